# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Two rigs on one machine, and strangers on the rig's topics: nobody enters another's flight."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from live_flight import CLI, hidden_topic

from rig_support import Rig, recorded, shared_folder
from rotor_interfaces import messages, topics
from rotor_interfaces.messages import ROS
from rotor_interfaces.topics import Topic
from rotor_recording.reading import Recording, waveform_blocks
from rotor_rig.scenario_model import load_scenario

pytestmark = pytest.mark.slow

REFUSAL = 'another source publishes rotor/waveform in this ROS domain'
LENGTH_S = {'climb_dive': 6, 'level_healthy': 3}


@dataclass
class Flight:
    """A `rotor-rig run` under way."""

    name: str
    folder: Path
    process: subprocess.Popen[str]
    out: str = ''
    err: str = ''

    @property
    def code(self) -> int:
        """Exit code; waits for the end."""
        out, err = self.process.communicate(timeout=120.0)
        self.out, self.err = out or self.out, err or self.err
        return self.process.returncode

    @property
    def recording(self) -> Recording:
        """The recording of a flight that ended well."""
        (folder,) = self.folder.iterdir()
        return Recording(folder)


Start = Callable[..., Flight]


@pytest.fixture
def start(domain: dict[str, str], tmp_path: Path) -> Iterator[Start]:
    """Start flights in the same ROS domain; what still runs at the end is killed, by its id."""
    flights: list[Flight] = []

    def run(name: str, *options: str) -> Flight:
        folder = tmp_path / f'{len(flights)}'
        command = [*CLI, 'run', name, '--duration', str(LENGTH_S[name]), '--json', *options]
        process = subprocess.Popen(
            [*command, '--record', str(folder)],
            env=domain,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        flights.append(Flight(name, folder, process))
        return flights[-1]

    yield run
    for flight in flights:
        if flight.process.poll() is None:
            flight.process.kill()
            flight.process.communicate()


@pytest.fixture(scope='module')
def alone(rig: Rig, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The waveform that each flight has when nothing else is there."""
    with shared_folder(tmp_path_factory, 'alone') as (folder, is_new):
        if is_new:
            folder.mkdir()
            for name, length_s in LENGTH_S.items():
                file = folder / f'{name}.mcap'
                done = rig('simulate', name, '--duration', length_s, '--out', file)
                assert done.code == 0, done.err
    return {name: waveform(Recording(folder / f'{name}.mcap')) for name in LENGTH_S}


def waveform(recording: Recording) -> bytes:
    return b''.join(block.rows.tobytes() for block in waveform_blocks(recording))


def assert_undisturbed(flight: Flight, alone: dict[str, bytes]) -> None:
    """Check that a flight's result and file are those of this flight alone."""
    assert flight.code == 0, flight.err
    summary = json.loads(flight.out)
    assert summary['simulated_s'] == LENGTH_S[flight.name]
    assert summary['lost_samples'] == 0
    assert summary['first_alarm_s'] is None  # all are too short for an alarm
    recording = flight.recording
    assert waveform(recording) == alone[flight.name]
    (config,) = [json.loads(message.data) for _, message in recorded(recording, topics.CONFIG)]
    expected = load_scenario(flight.name, duration_s=LENGTH_S[flight.name])
    assert config['scenario'] == expected.plain() | {'changes': []}
    epochs = {
        stamp_ns - messages.sample_stamp_ns(0, number * 256, 10_240)
        for number, (stamp_ns, _) in enumerate(recorded(recording, topics.TRUTH))
    }
    assert len(epochs) == 1
    assert recording.start_ns in epochs
    assert recording.end_ns is not None
    load_ends_ns = recording.start_ns + LENGTH_S[flight.name] * 10**9 + 10**7  # one point beyond
    assert recording.end_ns <= load_ends_ns


@pytest.mark.parametrize('offset_s', [0.0, 1.0, 5.0, 9.0])
def test_the_second_rig_is_refused_or_flies_after_the_first(
    start: Start, alone: dict[str, bytes], offset_s: float
) -> None:
    first = start('climb_dive')
    time.sleep(offset_s)
    second = start('level_healthy')
    if offset_s == 0.0 and first.code:  # which of the two came first is the machine's choice
        first, second = second, first
    code = second.code
    assert_undisturbed(first, alone)
    if code == 0:  # the first had ended by then
        assert offset_s >= 5.0
        assert_undisturbed(second, alone)
        return
    assert code == 3
    assert REFUSAL in second.err
    assert '--namespace' in second.err
    assert second.err.count('\n') == 1
    assert not list(second.folder.iterdir())


def test_two_namespaces_fly_side_by_side(start: Start, alone: dict[str, bytes]) -> None:
    flights = [
        start('climb_dive', '--namespace', 'rig_1'),
        start('level_healthy', '--namespace', '/fleet/rig_2', '--composed'),
        start('level_healthy'),
    ]
    for flight, namespace in zip(flights, ('/rig_1', '/fleet/rig_2', ''), strict=True):
        assert_undisturbed(flight, alone)
        assert json.loads(flight.out)['warnings'] == []
        names = flight.recording.topics()
        assert f'{namespace}/clock' in names
        assert f'{namespace}/diagnostics' in names
        assert all(name.startswith(f'{namespace}/') for name in names)
        assert all('_run_' not in name for name in names)


class Stranger:
    """A node that publishes on topics of the rig whatever it likes."""

    def __init__(self, domain: dict[str, str]) -> None:
        import rclpy
        from rclpy.context import Context
        from rclpy.node import Node

        self._context = Context()
        rclpy.init(context=self._context, domain_id=int(domain['ROS_DOMAIN_ID']))
        self._node = Node('stranger', context=self._context)
        self._outputs: dict[Topic, Any] = {}

    def say(self, topic: Topic, *said: Any) -> None:
        from rotor_interfaces import ros

        if topic not in self._outputs:
            self._outputs[topic] = ros.publisher(self._node, topic)
        for message in said:
            self._outputs[topic].publish(message)

    def close(self) -> None:
        import rclpy

        self._node.destroy_node()
        rclpy.shutdown(context=self._context)

    def hidden(self, topic: Topic) -> Topic | None:
        return hidden_topic(self._node, topic)

    def found_hidden(self, topic: Topic) -> Topic:
        """Wait until this node too has discovered what another process has heard already."""
        deadline = time.monotonic() + 60.0
        while (found := self.hidden(topic)) is None:
            assert time.monotonic() < deadline, f'no hidden {topic.name} was discovered'
            time.sleep(0.02)
        return found


@pytest.fixture
def stranger(domain: dict[str, str]) -> Iterator[Stranger]:
    node = Stranger(domain)
    yield node
    node.close()


LISTEN = """
import rclpy
from rotor_interfaces import ros, topics

rclpy.init()
node = rclpy.create_node('listener')
blocks = []
ros.subscription(node, topics.WAVEFORM, blocks.append)
while not blocks:
    rclpy.spin_once(node, timeout_sec=0.1)
"""
"""Ends with the first block."""
STAMPS_S = (0, 12, 1_000_000_000, 2_147_480_000)
WORDS = ('n/a', '', '-1', '1e9', '999999999')


def test_what_strangers_publish_changes_nothing(
    start: Start, alone: dict[str, bytes], stranger: Stranger
) -> None:
    flight = start('climb_dive')
    began = time.monotonic()
    count = 0
    while flight.process.poll() is None and time.monotonic() - began < 300.0:
        count += 1
        stamp_ns = STAMPS_S[count % len(STAMPS_S)] * 10**9
        word = WORDS[count % len(WORDS)]
        for name in ('battery', 'recorder: stream', 'rotor_sim: co-simulation'):
            values = {'lost samples [1]': word, 'late blocks [1]': word}
            values['topics with another source'] = word
            said = messages.diagnostics(ROS, stamp_ns, name, level=2, text=word, values=values)
            stranger.say(topics.DIAGNOSTICS, said)
        stranger.say(topics.CLOCK, messages.clock(ROS, stamp_ns))
        for name in ('rotor_sim', 'recorder', 'vibration_monitor', word):
            stranger.say(topics.PROGRESS, messages.header(ROS, stamp_ns, name))
        stranger.say(topics.CONFIG, messages.string(ROS, word))
        alarm = messages.diagnostics(ROS, stamp_ns, 'x', level=2, text=word, values={})
        stranger.say(topics.ALARM, alarm)
        time.sleep(0.05)
    assert count > 50
    assert_undisturbed(flight, alone)
    summary = json.loads(flight.out)
    assert summary['late_blocks'] < 1000
    (warning,) = summary['warnings']
    for topic in (topics.CLOCK, topics.CONFIG, topics.ALARM):
        assert topic.name in warning
    # what others say of their health is recorded as they said it, at the time of this run
    statuses = list(recorded(flight.recording, topics.DIAGNOSTICS))
    theirs = [m for _, m in statuses if m.status[0].name == 'battery']
    assert {m.header.stamp.sec for m in theirs} == set(STAMPS_S)
    assert {m.status[0].message for m in theirs} == set(WORDS)


def test_a_stranger_that_joins_a_flight_is_reported_and_not_heard(
    start: Start, alone: dict[str, bytes], stranger: Stranger, domain: dict[str, str]
) -> None:
    from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock, encode

    flight = start('climb_dive')
    heard = subprocess.Popen([sys.executable, '-c', LISTEN], env=domain)
    assert heard.wait(300.0) == 0
    for number in range(60):
        rows = np.zeros(256, WAVEFORM_DTYPE)
        rows['sample'] = 256 * number + np.arange(256)
        block = WaveformBlock(time.time_ns(), rows)
        stranger.say(topics.WAVEFORM, encode(block, ROS))
        stranger.say(topics.MANEUVER_LOAD, messages.load(ROS, time.time_ns(), 99.0, 0.0))
        time.sleep(0.025)
    assert_undisturbed(flight, alone)
    (warning,) = json.loads(flight.out)['warnings']
    assert 'another source published maneuver/load, rotor/waveform' in warning
    told = [
        (message.status[0].level, message.status[0].message)
        for _, message in recorded(flight.recording, topics.DIAGNOSTICS)
        if message.status[0].name == 'rotor_sim: co-simulation'
    ]
    assert (1, f'{REFUSAL.replace("rotor/waveform", "maneuver/load, rotor/waveform")}') in told


@pytest.mark.parametrize('is_hidden', [False, True])
def test_forged_progress_neither_stops_nor_frees_a_fast_run(
    start: Start, alone: dict[str, bytes], stranger: Stranger, *, is_hidden: bool
) -> None:
    """Not even on the hidden topic, whose name anybody can find."""
    flight = start('climb_dive', '--rate', '0')
    names = ('rotor_sim', 'recorder', 'vibration_monitor')
    began = time.monotonic()
    count = 0
    while flight.process.poll() is None and time.monotonic() - began < 300.0:
        topic = stranger.hidden(topics.PROGRESS) if is_hidden else topics.PROGRESS
        for seconds in (-5, *STAMPS_S) if topic else ():
            for name in names:
                said = messages.header(ROS, seconds * 10**9, name)
                stranger.say(topic, said)  # type: ignore[arg-type]
                count += 1
        time.sleep(0.02)
    assert count > 100
    assert_undisturbed(flight, alone)
    warnings = json.loads(flight.out)['warnings']
    if is_hidden:
        assert any('reports of progress that cannot be of this run' in said for said in warnings)
    else:
        assert warnings == []


def test_blocks_on_the_hidden_topic_are_not_of_the_flight(
    start: Start, alone: dict[str, bytes], stranger: Stranger, domain: dict[str, str]
) -> None:
    from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock, encode

    flight = start('climb_dive')
    heard = subprocess.Popen([sys.executable, '-c', LISTEN], env=domain)
    assert heard.wait(300.0) == 0
    topic = stranger.found_hidden(topics.WAVEFORM)
    count = 0
    while flight.process.poll() is None and count < 400:
        rows = np.zeros(256, WAVEFORM_DTYPE)
        rows['sample'] = 256 * (count % 100) + np.arange(256)
        rows['time'] = np.arange(256) / 10_240
        stranger.say(topic, encode(WaveformBlock(time.time_ns() + 10**12, rows), ROS))
        count += 1
        time.sleep(0.02)
    assert count > 50
    assert_undisturbed(flight, alone)
    (warning,) = json.loads(flight.out)['warnings']
    assert 'another source published rotor/waveform' in warning


def test_loads_on_the_hidden_topic_end_the_flight_and_are_not_flown(
    start: Start, alone: dict[str, bytes], stranger: Stranger, domain: dict[str, str]
) -> None:
    flight = start('climb_dive')
    heard = subprocess.Popen([sys.executable, '-c', LISTEN], env=domain)
    assert heard.wait(300.0) == 0
    topic = stranger.found_hidden(topics.MANEUVER_LOAD)
    began = time.monotonic()
    while flight.process.poll() is None and time.monotonic() - began < 300.0:
        for ahead in range(400):
            stamp_ns = time.time_ns() + ahead * 10**7
            stranger.say(topic, messages.load(ROS, stamp_ns, 12.0, 0.0))
        time.sleep(1.0)  # each burst is for the next 4 s
    assert flight.code == 3
    assert 'another source publishes maneuver/load' in flight.err
    flown = waveform(flight.recording)
    assert len(flown) < len(alone['climb_dive'])
    assert alone['climb_dive'].startswith(flown)


def test_a_rig_that_was_killed_is_waited_for(
    start: Start, alone: dict[str, bytes], domain: dict[str, str]
) -> None:
    first = start('climb_dive')
    heard = subprocess.Popen([sys.executable, '-c', LISTEN], env=domain)
    assert heard.wait(300.0) == 0
    children = Path(f'/proc/{first.process.pid}/task/{first.process.pid}/children').read_text()
    for process_id in (*map(int, children.split()), first.process.pid):
        os.kill(process_id, signal.SIGKILL)
    first.process.communicate()
    second = start('level_healthy')
    assert_undisturbed(second, alone)


@pytest.mark.parametrize('name', ['rig 1', '1rig', '/', 'a//b', 'rig/', 'rig-1', '~/x', 'a' * 300])
def test_a_namespace_that_is_none_is_one_sentence(rig: Rig, tmp_path: Path, name: str) -> None:
    done = rig('run', '--duration', '1', '--namespace', name, '--record', tmp_path / 'new')
    assert done.code == 2
    assert f'--namespace {name!r} is not allowed' in done.err
    assert done.err.count('\n') == 1
