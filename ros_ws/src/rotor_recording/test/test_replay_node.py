# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The real replay over DDS, heard by an independent subscriber."""

import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import zstandard
from mcap.writer import Writer
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile

from recording_support import (
    EPOCH_NS,
    Peer,
    bag,
    block_bytes,
    made_up_run,
    private_ros,
    process,
    stamp_of,
)
from rotor_common.exit_code import ExitCode
from rotor_interfaces import messages, ros, topics
from rotor_interfaces.messages import OFFLINE, from_cdr, ros_class, to_cdr
from rotor_interfaces.topics import Topic
from rotor_recording.recording import RecordingWriter
from rotor_recording.recording_stream import raw_stamp_ns

pytestmark = pytest.mark.slow

BLOCKS = 80
HEARD = tuple(
    topic for topic in dict.fromkeys(w.topic for w in made_up_run(1)) if topic is not topics.CLOCK
)


class Heard(NamedTuple):
    topic: Topic
    data: bytes
    at_s: float


class Listener:
    """Everything that arrives, in its order."""

    def __init__(self, peer: Peer) -> None:
        self.peer = peer
        self.heard: list[Heard] = []
        self.clock_ns: list[int] = []
        for topic in HEARD:
            ros.subscription(peer.node, topic, self._noting(topic), raw=True)
        # reliable, unlike what the contract asks for, so that the test can be exact
        peer.node.create_subscription(
            ros_class(topics.CLOCK.type), '/clock', self._on_clock, QoSProfile(depth=1000)
        )

    def _noting(self, topic: Topic) -> Any:
        return lambda data: self.heard.append(Heard(topic, data, time.monotonic()))

    def _on_clock(self, message: Any) -> None:
        self.clock_ns.append(messages.stamp_ns(message))

    def of(self, topic: Topic) -> list[Heard]:
        return [heard for heard in self.heard if heard.topic is topic]

    def stamps(self, topic: Topic) -> list[int]:
        return [raw_stamp_ns(topic, heard.data) for heard in self.of(topic)]


@pytest.fixture
def ros_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    environment = private_ros(tmp_path / 'log')
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    return environment


@pytest.fixture
def listener(ros_environment: dict[str, str]) -> Iterator[Listener]:
    with Peer(int(ros_environment['ROS_DOMAIN_ID'])) as peer:
        yield Listener(peer)


def replaying(
    path: Path, environment: dict[str, str], **options: Any
) -> AbstractContextManager[subprocess.Popen[str]]:
    given = ''.join(f', {name}={value!r}' for name, value in options.items())
    code = f'import sys; from rotor_recording.replay_node import replay; sys.exit(replay({str(path)!r}{given}))'  # noqa: E501
    return process(['-c', code], environment)


def wait_for_end(listener: Listener, child: subprocess.Popen[str]) -> None:
    assert listener.peer.spin_until(lambda: child.poll() is not None, 60.0)
    listener.peer.spin_for(0.3)


@pytest.mark.real_time
@pytest.mark.parametrize('rate', [1.0, 4.0])
def test_every_byte_comes_in_order_and_in_time(
    tmp_path: Path, ros_environment: dict[str, str], listener: Listener, rate: float
) -> None:
    count = BLOCKS * int(rate)  # 2 s of replay
    path = bag(tmp_path / 'bag', count)
    with replaying(path, ros_environment, rate=rate, wait_for_subscribers_s=30.0) as child:
        wait_for_end(listener, child)
        assert child.returncode == 0
        out, err = child.communicate()
    sent = [wire for wire in made_up_run(count) if wire.topic is not topics.CLOCK]
    assert f'{len(sent)} messages published' in out
    assert err == ''
    for topic in HEARD:
        wires = [wire for wire in sent if wire.topic is topic]
        # DDS fills a message up to a multiple of 4 bytes
        expected = [wire.data + bytes(-len(wire.data) % 4) for wire in wires]
        assert [heard.data for heard in listener.of(topic)] == expected, topic.name
    blocks = listener.of(topics.WAVEFORM)
    # A busy machine makes single blocks late, even by 0.3 s. That the least late of both halves are
    # equally late takes the right rate: twice too slow or all at once they differ by 1 s.
    late_s = [block.at_s - (stamp_of(k) - EPOCH_NS) * 1e-9 / rate for k, block in enumerate(blocks)]
    assert min(late_s[count // 2 :]) == pytest.approx(min(late_s[: count // 2]), abs=0.4)
    assert listener.clock_ns == sorted(listener.clock_ns)
    assert set(listener.clock_ns) <= {stamp_of(k) for k in range(count)}
    assert listener.clock_ns[-1] == stamp_of(count - 1)


@pytest.mark.real_time
def test_a_replay_from_the_middle_first_tells_what_is_latched(
    tmp_path: Path, ros_environment: dict[str, str], listener: Listener
) -> None:
    path = bag(tmp_path / 'bag', BLOCKS)
    with replaying(path, ros_environment, start_s=1.0, rate=4.0, wait_for_subscribers_s=30.0) as p:
        wait_for_end(listener, p)
        assert p.returncode == 0
    assert listener.stamps(topics.WAVEFORM) == [stamp_of(k) for k in range(40, BLOCKS)]
    assert listener.stamps(topics.TRUTH) == [stamp_of(k) for k in range(39, BLOCKS)]
    (config,) = listener.of(topics.CONFIG)
    assert from_cdr(config.data, topics.CONFIG.type).data.startswith('{"scenario"')
    # latched ones arrive before the waveform starts
    assert config.at_s < listener.of(topics.WAVEFORM)[0].at_s
    assert min(listener.clock_ns) >= stamp_of(40)


def test_a_late_subscriber_still_gets_the_configuration(
    tmp_path: Path, ros_environment: dict[str, str]
) -> None:
    path = bag(tmp_path / 'bag', BLOCKS)
    heard: list[str] = []
    with (
        Peer(int(ros_environment['ROS_DOMAIN_ID'])) as peer,
        replaying(path, ros_environment, rate=0.1, wait_for_subscribers_s=0.0) as child,
    ):
        assert peer.spin_until(lambda: peer.node.count_publishers('/rotor/config') > 0)
        peer.spin_for(0.7)
        profile = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        kind = ros_class(topics.CONFIG.type)
        peer.node.create_subscription(
            kind, '/rotor/config', lambda message: heard.append(message.data), profile
        )
        assert peer.spin_until(lambda: bool(heard) or child.poll() is not None)
    assert len(heard) == 1


@pytest.mark.real_time
def test_a_loop_is_a_new_run_until_a_signal(
    tmp_path: Path, ros_environment: dict[str, str], listener: Listener
) -> None:
    path = bag(tmp_path / 'bag', 20)
    with replaying(
        path, ros_environment, loop=True, rate=2.0, start_s=0.1, wait_for_subscribers_s=30.0
    ) as child:
        assert listener.peer.spin_until(lambda: len(listener.of(topics.WAVEFORM)) >= 40)
        child.send_signal(signal.SIGINT)
        wait_for_end(listener, child)
        assert child.returncode == 130
        assert 'Traceback' not in child.communicate()[1]
    one_pass = [stamp_of(k) for k in range(4, 20)]
    stamps = listener.stamps(topics.WAVEFORM)
    assert stamps[:32] == one_pass * 2
    assert stamps[32:40] == one_pass[:8]
    # what is latched comes before each pass
    config_at = [heard.at_s for heard in listener.of(topics.CONFIG)]
    first_at = [heard.at_s for heard in listener.of(topics.WAVEFORM)[::16]]
    assert len(config_at) >= 3
    # the signal may end a pass between its configuration and its first block
    assert len(config_at) - len(first_at) in {0, 1}
    assert all(config < first for config, first in zip(config_at, first_at, strict=False))
    falls = [b for a, b in zip(listener.clock_ns, listener.clock_ns[1:], strict=False) if b < a]
    assert len(falls) == len(config_at) - 1
    assert set(falls) <= {EPOCH_NS + 100_000_000, *one_pass}


def test_chosen_topics_leave_room_for_a_live_monitor(
    tmp_path: Path, ros_environment: dict[str, str], listener: Listener
) -> None:
    path = bag(tmp_path / 'bag', 10)
    with replaying(
        path, ros_environment, topics=['rotor/waveform'], wait_for_subscribers_s=30.0
    ) as child:
        wait_for_end(listener, child)
        assert child.returncode == 0
    assert {heard.topic for heard in listener.heard} == {topics.WAVEFORM}
    assert len(listener.heard) == 10


def test_a_damaged_recording_is_replayed_with_a_warning(
    tmp_path: Path, ros_environment: dict[str, str], listener: Listener
) -> None:
    writer = RecordingWriter(tmp_path / 'bag')
    for number in range(10):
        writer.write(topics.WAVEFORM, block_bytes(number), stamp_of(number), 0)
    writer.flush()
    with replaying(tmp_path / 'bag', ros_environment, wait_for_subscribers_s=30.0) as child:
        wait_for_end(listener, child)
        assert child.returncode == 0
        assert child.communicate()[1].startswith('warning: bag_0.mcap.active: it was not finalised')
    writer.close()
    assert listener.stamps(topics.WAVEFORM) == [stamp_of(k) for k in range(10)]


HOUR_NS = 3600 * 10**9


def test_a_foreign_bag_is_replayed_without_what_is_not_known_here(
    tmp_path: Path, ros_environment: dict[str, str], listener: Listener
) -> None:
    """As `ros2 bag record -a` leaves it, with messages compressed one by one and a pause."""
    path = tmp_path / 'bag.mcap'
    pack = zstandard.ZstdCompressor().compress
    with path.open('wb') as file:
        writer = Writer(file)
        writer.start('ros2')
        schemas = {
            name: writer.register_schema(name, 'ros2msg', b'')
            for name in (
                topics.WAVEFORM.type,
                topics.CONFIG.type,
                topics.ALARM.type,
                'a_msgs/msg/B',
            )
        }

        def channel(name: str, kind: str, encoding: str = 'cdr') -> int:
            offer = {'offered_qos_profiles': '- durability: transient_local'}
            return writer.register_channel(name, encoding, schemas[kind], offer)

        channel('/events/write_split', 'a_msgs/msg/B')
        channel('/no good name', topics.CONFIG.type)
        writer.add_message(channel('/seen', topics.CONFIG.type, 'json'), EPOCH_NS, b'{}', 0)
        alarm = channel('/monitor/alarm', topics.ALARM.type)
        writer.add_message(alarm, EPOCH_NS, b'(packed by nobody knows what', 0)
        config = to_cdr(messages.string(OFFLINE, '{}'))
        writer.add_message(channel('/rotor/config', topics.CONFIG.type), 12 * 10**9, config, 0)
        waveform = channel('/rotor/waveform', topics.WAVEFORM.type)
        other = channel('/rotor/waveform', topics.CONFIG.type)
        for number in range(4):
            time_ns = EPOCH_NS + number // 2 * HOUR_NS + number
            writer.add_message(waveform, time_ns, pack(block_bytes(number)), 0)
        writer.add_message(other, EPOCH_NS, config, 0)
        writer.add_message(channel('/diagnostics', topics.ALARM.type), 2**62, bytes(12), 0)
        writer.finish()  # type: ignore[no-untyped-call]
    with replaying(path, ros_environment, wait_for_subscribers_s=30.0) as child:
        wait_for_end(listener, child)
        assert child.returncode == 0
        out, err = child.communicate()
    blocks = [block_bytes(k) for k in range(4)]
    expected = [data + bytes(-len(data) % 4) for data in blocks]
    assert [heard.data for heard in listener.of(topics.WAVEFORM)] == expected
    assert len(listener.of(topics.CONFIG)) == 1
    assert listener.of(topics.ALARM) == []
    assert '5 messages published' in out
    assert (
        'warning: not published, since type or name cannot be used here: /events/write_split '
        '(a_msgs/msg/B), /no good name (std_msgs/msg/String)'
    ) in err
    assert "/seen is not published: its encoding is 'json'" in err
    assert 'without a message to publish: 2, the longest 1799999988 s' in err
    assert 'messages of /monitor/alarm left out: 1 (' in err
    assert 'messages of /rotor/waveform left out: 1 (' in err
    assert listener.clock_ns == sorted(listener.clock_ns)
    assert listener.clock_ns[-1] == EPOCH_NS + HOUR_NS + 2


@pytest.mark.real_time
def test_the_clock_goes_on_where_messages_are_rare(
    tmp_path: Path, ros_environment: dict[str, str], listener: Listener
) -> None:
    with RecordingWriter.single_file(path := tmp_path / 'rare.mcap') as writer:
        for second in range(4):
            (wire,) = (wire for wire in made_up_run(1) if wire.topic is topics.ALARM)
            writer.write(topics.ALARM, wire.data, EPOCH_NS + second * 10**9, 0)
    node = listener.peer.node
    node.set_parameters([Parameter('use_sim_time', Parameter.Type.BOOL, value=True)])
    fired: list[int] = []
    node.create_timer(0.1, lambda: fired.append(node.get_clock().now().nanoseconds))
    with replaying(path, ros_environment, wait_for_subscribers_s=30.0) as child:
        wait_for_end(listener, child)
        assert child.returncode == 0
    assert listener.clock_ns == sorted(set(listener.clock_ns))
    assert (listener.clock_ns[0], listener.clock_ns[-1]) == (EPOCH_NS, EPOCH_NS + 3 * 10**9)
    # 40 Hz over 3 s; a busy machine may skip some
    assert 60 <= len(listener.clock_ns) <= 125
    assert 20 <= len(fired) <= 32


def test_the_start_is_that_of_what_is_published(
    tmp_path: Path, ros_environment: dict[str, str], listener: Listener
) -> None:
    """Diagnostics stamped decades before hold nothing up; a start counts without the holes."""
    with RecordingWriter.single_file(path := tmp_path / 'run.mcap') as writer:
        writer.write(topics.DIAGNOSTICS, bytes(12), 12, 0)
        writer.write(topics.CONFIG, to_cdr(messages.string(OFFLINE, '{}')), 10**9, 0)
        for number in range(40):
            writer.write(topics.WAVEFORM, block_bytes(number), stamp_of(number), 0)
    with replaying(path, ros_environment, start_s=0.5, wait_for_subscribers_s=30.0) as child:
        wait_for_end(listener, child)
        assert child.returncode == 0
    assert listener.stamps(topics.WAVEFORM) == [stamp_of(k) for k in range(20, 40)]
    assert len(listener.of(topics.CONFIG)) == 1
    assert listener.clock_ns[0] == stamp_of(20)


def test_a_type_that_is_not_installed_ends_in_one_sentence(
    tmp_path: Path, ros_environment: dict[str, str]
) -> None:
    path = tmp_path / 'run.mcap'
    with path.open('wb') as file:
        writer = Writer(file)
        writer.start('ros2')
        schema = writer.register_schema('foreign_msgs/msg/Thing', 'ros2msg', b'float64 x')
        writer.add_message(writer.register_channel('/thing', 'cdr', schema), 1, bytes(12), 1)
        writer.finish()  # type: ignore[no-untyped-call]
    with replaying(path, ros_environment) as child:
        assert child.wait(300.0) == ExitCode.BAD_INPUT
        said = child.communicate()[1].strip()
    assert said == (
        "error: /thing has type 'foreign_msgs/msg/Thing', which is not installed here; name the "
        'topics to replay'
    )
