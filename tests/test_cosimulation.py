# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The simulator as a process among foreign nodes: grid, holes, frames, credits, deadlines."""

import random
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import pytest

from rotor_interfaces import messages, topics
from rotor_interfaces.messages import ROS, stamp_ns
from rotor_interfaces.waveform import decode

pytestmark = pytest.mark.slow
EPOCH_NS = 1_800_000_000_123_456_789
STEP_NS = 10_000_000
BLOCK_NS = 25_000_000
SIMULATOR = ('-m', 'rotor_sim.node')
FORGETFUL = """
import sys

from rotor_interfaces import messages, ros
from rotor_sim.node import RotorSimNode


class Forgetful(RotorSimNode):
    lost = set(range({first}, {last} + 1))

    def _on_load(self, message):
        point = (messages.stamp_ns(message) - {epoch_ns}) // {step_ns}
        if point in self.lost:
            self.lost.remove(point)
        else:
            super()._on_load(message)


sys.exit(ros.run(lambda: [Forgetful()], has_end=True))
"""


class Bench:
    """Plays generator and consumer to one rotor_sim process."""

    def __init__(
        self, domain: dict[str, str], *, program: Sequence[str] = SIMULATOR, **parameters: Any
    ) -> None:
        import rclpy
        from rclpy.context import Context
        from rclpy.experimental.events_executor import EventsExecutor
        from rclpy.node import Node

        from rotor_interfaces import ros

        options = [
            option for name, value in parameters.items() for option in ('-p', f'{name}:={value}')
        ]
        self.process = subprocess.Popen(
            [sys.executable, *program, '--ros-args', *options],
            env=domain,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._context = Context()
        rclpy.init(context=self._context, domain_id=int(domain['ROS_DOMAIN_ID']))
        self.node = Node('bench', context=self._context)
        self._load = ros.publisher(self.node, topics.MANEUVER_LOAD)
        self.progress = ros.publisher(self.node, topics.PROGRESS)
        self.blocks: list[Any] = []
        self.ready = False
        ros.subscription(self.node, topics.WAVEFORM, self.blocks.append)
        self.counts: dict[str, str] = {}
        ros.subscription(self.node, topics.DIAGNOSTICS, self._on_diagnostics)
        for topic in (topics.SHAFT, topics.TRUTH, topics.CONFIG, topics.CLOCK):
            ros.subscription(self.node, topic, lambda _: None)
        for topic in (topics.BEARING_1_IMU, topics.BEARING_2_IMU):
            ros.subscription(self.node, topic, lambda _: None)
        ros.subscription(self.node, topics.PROGRESS, self._on_progress)
        self._executor = EventsExecutor(context=self._context)
        self._executor.add_node(self.node)

    def _on_progress(self, message: Any) -> None:
        self.ready |= message.frame_id == 'rotor_sim'

    def _on_diagnostics(self, message: Any) -> None:
        self.counts = {value.key: value.value for value in message.status[0].values}

    def spin(self, seconds: float) -> None:
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self._executor.spin_once(0.02)

    def wait_for(self, condition: Callable[[], bool], timeout_s: float = 300.0) -> None:
        deadline = time.monotonic() + timeout_s
        while not condition():
            assert time.monotonic() < deadline, 'it never happened'
            assert self.process.poll() is None, self.process.communicate()[0]
            self._executor.spin_once(0.02)

    def send_load(self, points: Iterable[int], *, frame_id: str = 'rotor') -> None:
        for k in points:
            message = messages.load(ROS, EPOCH_NS + k * STEP_NS, 9.81, 0.0)
            message.header.frame_id = frame_id
            self._load.publish(message)

    def report(self, consumed_ns: int) -> None:
        self.progress.publish(messages.header(ROS, consumed_ns, 'slow'))

    def end(self, timeout_s: float = 300.0) -> tuple[int, str]:
        deadline = time.monotonic() + timeout_s
        while self.process.poll() is None and time.monotonic() < deadline:
            self._executor.spin_once(0.05)
        return self.process.wait(1), self.process.communicate()[0]

    def close(self) -> None:
        import rclpy

        if not self._context.ok():
            return
        if self.process.poll() is None:
            self.process.kill()
            self.process.communicate()
        self._executor.shutdown()  # it keeps the publishers, which others would hear
        self.node.destroy_node()
        rclpy.shutdown(context=self._context)


Start = Callable[..., Bench]


@pytest.fixture
def bench(domain: dict[str, str]) -> Iterator[Start]:
    benches: list[Bench] = []

    def start(**parameters: Any) -> Bench:
        benches.append(Bench(domain, **parameters))
        return benches[-1]

    yield start
    for one in benches:
        one.close()


def test_a_second_generator_is_refused(bench: Start) -> None:
    from rotor_interfaces import ros

    rig = bench(duration_s=1.0, timeout_s=1.0)
    ros.publisher(rig.node, topics.MANEUVER_LOAD)
    code, said = rig.end()
    assert code == 3
    assert 'another source publishes maneuver/load' in said


def test_an_ended_bench_is_heard_no_more(domain: dict[str, str]) -> None:
    import rclpy
    from rclpy.context import Context
    from rclpy.node import Node

    first = Bench(domain, duration_s=1.0)
    first.wait_for(lambda: first.ready)
    context = Context()
    rclpy.init(context=context, domain_id=int(domain['ROS_DOMAIN_ID']))
    node = Node('listener', context=context)
    first.close()
    deadline = time.monotonic() + 300.0
    while node.count_publishers(topics.MANEUVER_LOAD.name):
        assert time.monotonic() < deadline, 'a closed bench still publishes'
        time.sleep(0.1)
    node.destroy_node()
    rclpy.shutdown(context=context)


def test_a_hole_in_the_grid_stalls_the_run_and_ends_it_with_a_reason(bench: Start) -> None:
    rig = bench(duration_s=10.0, rate=0.0, timeout_s=2.0)
    rig.wait_for(lambda: rig.ready)
    rig.send_load(range(150))
    rig.send_load(range(151, 400))
    code, said = rig.end()
    assert code == 3
    assert 'maneuver/load ends before point 150' in said
    assert 'there is a hole' in said
    assert 'Traceback' not in said
    # every block up to the hole came, and not one beyond it
    assert len(rig.blocks) == 149 * STEP_NS // BLOCK_NS
    assert stamp_ns(rig.blocks[0]) == EPOCH_NS


def test_points_out_of_order_are_put_in_order(bench: Start) -> None:
    rig = bench(duration_s=3.0, rate=0.0, timeout_s=5.0)
    rig.wait_for(lambda: rig.ready)
    later = list(range(1, 302))
    random.Random(1).shuffle(later)
    rig.send_load([0, *later])
    code, said = rig.end()
    assert code == 0, said
    assert [decode(block).first_sample for block in rig.blocks] == [k * 256 for k in range(120)]
    assert int(rig.counts['early load points [1]']) > 100


@pytest.mark.parametrize('last', [150, 301])
def test_lost_points_are_asked_for_again(bench: Start, last: int) -> None:
    script = FORGETFUL.format(first=150, last=last, epoch_ns=EPOCH_NS, step_ns=STEP_NS)
    rig = bench(program=('-c', script), duration_s=3.0, rate=0.0, timeout_s=10.0)
    rig.wait_for(lambda: rig.ready)
    rig.send_load(range(302))
    code, said = rig.end()
    assert code == 0, said
    assert [decode(block).first_sample for block in rig.blocks] == [k * 256 for k in range(120)]
    assert rig.counts['load asked for again [1]'] == '1'


def test_the_run_goes_on_when_the_grid_does(bench: Start) -> None:
    rig = bench(duration_s=2.0, rate=0.0)
    rig.wait_for(lambda: rig.ready)
    rig.send_load(range(100))
    rig.spin(2.0)
    assert 0 < len(rig.blocks) < 40
    rig.send_load(range(100, 202))
    code, said = rig.end()
    assert code == 0, said
    assert [decode(block).first_sample for block in rig.blocks] == [k * 256 for k in range(80)]


def test_a_load_in_another_frame_is_refused(bench: Start) -> None:
    rig = bench(duration_s=2.0, timeout_s=1.0)
    rig.wait_for(lambda: rig.ready)
    rig.send_load(range(202), frame_id='base_link')
    code, said = rig.end()
    assert code == 3
    assert "frame_id 'base_link'" in said
    assert not rig.blocks


def test_a_slow_consumer_is_never_left_more_than_the_window_behind(bench: Start) -> None:
    window = 16
    rig = bench(duration_s=3.0, rate=0.0, consumers='[slow]', window_blocks=window)
    rig.spin(1.0)
    rig.report(0)
    rig.wait_for(lambda: rig.ready)
    rig.send_load(range(302))
    consumed = -1
    while consumed < 119:
        wanted = consumed + 1
        rig.wait_for(lambda wanted=wanted: len(rig.blocks) > wanted)  # type: ignore[misc]
        rig.spin(0.05)
        assert len(rig.blocks) <= consumed + 1 + window + 1
        consumed = min(consumed + 5, len(rig.blocks) - 1)
        rig.report(stamp_ns(rig.blocks[consumed]))
    code, said = rig.end()
    assert code == 0, said
    assert len(rig.blocks) == 120


def test_a_consumer_that_never_reports_ends_the_start_with_its_name(bench: Start) -> None:
    rig = bench(duration_s=3.0, consumers='[absent]', timeout_s=0.5)
    code, said = rig.end()
    assert code == 3
    assert 'no report from absent' in said


def test_nonsense_among_the_ros_arguments_is_one_sentence(bench: Start) -> None:
    rig = bench(rate=-1.0)
    code, said = rig.end()
    assert code == 2
    assert 'rate = -1 is out of range' in said
    assert 'Traceback' not in said


def true_blocks(bench: Start) -> list[bytes]:
    """Return the blocks of a flight of 3 s that nobody disturbs."""
    rig = bench(duration_s=3.0, rate=0.0)
    rig.wait_for(lambda: rig.ready)
    rig.send_load(range(302))
    assert rig.end()[0] == 0
    blocks = [bytes(block.data) for block in rig.blocks]
    rig.close()
    return blocks


def test_plausible_loads_of_a_second_source_are_refused_and_the_flight_is_the_same(
    bench: Start,
) -> None:
    from rotor_interfaces import ros

    expected = true_blocks(bench)
    rig = bench(duration_s=3.0, rate=0.0, timeout_s=20.0)
    rig.wait_for(lambda: rig.ready)
    rig.send_load(range(100))
    rig.wait_for(lambda: len(rig.blocks) >= 39)
    forger = ros.publisher(rig.node, topics.MANEUVER_LOAD)
    rig.wait_for(lambda: forger.get_subscription_count() > 0)
    for k in range(100, 302):
        forger.publish(messages.load(ROS, EPOCH_NS + k * STEP_NS, 9.9, 0.1))
    rig.send_load(range(100, 302))
    rig.spin(1.0)
    assert len(rig.blocks) == 39
    rig.node.destroy_publisher(forger)
    code, said = rig.end()
    assert code == 0, said
    assert 'maneuver/load refused: another source publishes it too' in said
    assert [bytes(block.data) for block in rig.blocks] == expected
    assert int(rig.counts['refused loads [1]']) > 100


def test_a_second_source_that_stays_ends_the_run_with_its_name(bench: Start) -> None:
    from rotor_interfaces import ros

    rig = bench(duration_s=3.0, rate=0.0, timeout_s=2.0)
    rig.wait_for(lambda: rig.ready)
    rig.send_load(range(100))
    rig.wait_for(lambda: len(rig.blocks) >= 39)
    forger = ros.publisher(rig.node, topics.MANEUVER_LOAD)
    rig.wait_for(lambda: forger.get_subscription_count() > 0)
    rig.send_load(range(100, 302))
    code, said = rig.end()
    assert code == 3
    assert 'the run stalled at 0.975 s for 2 s: another source publishes maneuver/load' in said


def test_a_point_with_two_values_ends_the_run(bench: Start) -> None:
    rig = bench(duration_s=3.0, rate=1.0)
    rig.wait_for(lambda: rig.ready)
    rig.send_load(range(150))
    rig._load.publish(messages.load(ROS, EPOCH_NS + 140 * STEP_NS, 9.9, 0.1))
    code, said = rig.end()
    assert code == 3
    assert 'load point 140 came as (9.81, 0.0) and as (9.9, 0.1) m/s^2' in said
    assert 'Traceback' not in said


def test_reports_that_cannot_be_true_neither_stop_nor_free_a_run(bench: Start) -> None:
    window = 16
    rig = bench(duration_s=3.0, rate=0.0, consumers='[slow]', window_blocks=window, timeout_s=5.0)
    rig.report(0)
    rig.wait_for(lambda: rig.ready)
    rig.send_load(range(302))
    forged = (0, -5 * 10**9, 12 * 10**9, EPOCH_NS - 1, EPOCH_NS + 10**10, 2**31 * 10**9 - 1)
    consumed = 0
    while consumed < 119:
        wanted = consumed
        rig.wait_for(lambda wanted=wanted: len(rig.blocks) > wanted)  # type: ignore[misc]
        for stamp in forged:
            rig.report(stamp)
        rig.spin(0.1)
        assert len(rig.blocks) <= consumed + 1 + window + 1
        consumed = min(consumed + 10, len(rig.blocks) - 1)
        rig.report(stamp_ns(rig.blocks[consumed]))
        for stamp in forged:
            rig.report(stamp)
    code, said = rig.end()
    assert code == 0, said
    assert len(rig.blocks) == 120
    assert int(rig.counts['refused progress [1]']) > 20


class Credit:
    """Plays simulator and stranger to one maneuver_gen process."""

    def __init__(self, domain: dict[str, str]) -> None:
        import rclpy
        from rclpy.context import Context
        from rclpy.experimental.events_executor import EventsExecutor
        from rclpy.node import Node

        from rotor_interfaces import ros

        self.process = subprocess.Popen(
            [sys.executable, '-m', 'maneuver_gen.node', '--ros-args', '-p', 'duration_s:=60.0'],
            env=domain,
            stdin=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        self._context = Context()
        rclpy.init(context=self._context, domain_id=int(domain['ROS_DOMAIN_ID']))
        self._executor = EventsExecutor(context=self._context)
        self.nodes = [Node(name, context=self._context) for name in ('rotor_sim', 'stranger')]
        self.said = [ros.publisher(node, topics.PROGRESS) for node in self.nodes]
        self.stamps: list[int] = []
        for node in self.nodes:
            self._executor.add_node(node)
        ros.subscription(
            self.nodes[1], topics.MANEUVER_LOAD, lambda load: self.stamps.append(stamp_ns(load))
        )

    def report(self, who: int, stamp: int) -> None:
        self.said[who].publish(messages.header(ROS, stamp, 'rotor_sim'))

    def spin(self, seconds: float) -> None:
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self._executor.spin_once(0.02)

    def wait_for(self, condition: Callable[[], bool]) -> None:
        deadline = time.monotonic() + 120.0
        while not condition():
            assert time.monotonic() < deadline, 'it never happened'
            self._executor.spin_once(0.02)

    def close(self) -> None:
        import rclpy

        if self.process.poll() is None:
            self.process.kill()
            self.process.communicate()
        self._executor.shutdown()
        for node in self.nodes:
            node.destroy_node()
        rclpy.shutdown(context=self._context)


@pytest.fixture
def credit(domain: dict[str, str]) -> Iterator[Credit]:
    made = Credit(domain)
    yield made
    made.close()


def test_forged_credit_neither_ends_nor_frees_the_generator(credit: Credit) -> None:
    credit.report(0, 0)
    credit.wait_for(lambda: len(credit.stamps) == 201)
    epoch_ns = credit.stamps[0]
    for stamp in (0, -1, 5 * 10**9, epoch_ns - 1, epoch_ns + 3 * 10**9, 2**31 * 10**9 - 1, 0):
        credit.report(1, stamp)
    credit.spin(1.0)
    assert credit.process.poll() is None
    assert len(credit.stamps) == 201
    credit.report(0, epoch_ns + 10**9)
    credit.wait_for(lambda: len(credit.stamps) == 301)
    credit.report(1, epoch_ns + 10**8)
    credit.spin(0.5)
    assert len(credit.stamps) == 301
    assert credit.process.poll() is None


def test_a_simulator_that_starts_anew_ends_the_generator(credit: Credit) -> None:
    from rotor_interfaces import ros

    credit.report(0, 0)
    credit.wait_for(lambda: len(credit.stamps) == 201)
    for _ in range(10):  # as a simulator does, until the generator has found it by its name
        credit.report(0, credit.stamps[0])
        credit.spin(0.3)
    credit.nodes[0].destroy_publisher(credit.said[0])
    credit.said[0] = ros.publisher(credit.nodes[0], topics.PROGRESS)
    credit.wait_for(lambda: credit.said[0].get_subscription_count() > 0)

    def has_ended() -> bool:
        credit.report(0, 0)  # once more: the generator may not have found the new publisher yet
        return credit.process.poll() is not None

    credit.wait_for(has_ended)
    assert 'rotor_sim restarted in the middle of a flight' in credit.process.communicate()[1]
    assert credit.process.returncode == 2
