# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Parts of the reliability run that say what nobody should: rogue messages, fuzz, cheats."""

import json
import operator
import os
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import rclpy
from fuzz_blocks import ROWS, hostile_bytes, sane_block
from live_flight import LiveFlight, hidden_topic, private_environment
from numpy.random import Generator, default_rng
from rclpy._rclpy_pybind11 import RCLError
from rclpy.experimental.events_executor import EventsExecutor
from reliability_flights import hold, simulated

from rotor_common.exit_code import ExitCode
from rotor_interfaces import messages, ros, topics
from rotor_interfaces.messages import OFFLINE, to_cdr
from rotor_interfaces.topics import Topic
from rotor_interfaces.waveform import encode
from rotor_recording.reading import Recording, waveform_blocks

ROOT = Path(__file__).resolve().parent.parent
SEED = 20_261_130
ROUND = 20
"""Hostile blocks between two looks whether the nodes still answer."""


class Rogue:
    """A node that publishes bytes on any topic of a ROS domain."""

    def __init__(self, environment: dict[str, str]) -> None:
        os.environ.update(environment)
        ros.initialise()
        self._node = ros.Node('rogue')
        self._executor = EventsExecutor()
        self._executor.add_node(self._node)
        self._outputs: dict[Topic, Any] = {}
        self._stop = threading.Event()
        self.heard: Counter[str] = Counter()
        self.refused: dict[str, int] = {}

    def output(self, topic: Topic) -> Any:
        """Return the publisher of a topic."""
        if topic not in self._outputs:
            self._outputs[topic] = ros.publisher(self._node, topic)
        return self._outputs[topic]

    def hidden(self, topic: Topic) -> Topic | None:
        """Return the topic of the run itself, None before there is one."""
        return hidden_topic(self._node, topic)

    def listen(self) -> None:
        """Count indicators, and keep what the monitor says that it refused."""
        ros.subscription(self._node, topics.INDICATORS, self._on_indicators)
        ros.subscription(self._node, topics.DIAGNOSTICS, self._on_diagnostics)

    def _on_indicators(self, _: Any) -> None:
        self.heard['indicators'] += 1

    def _on_diagnostics(self, message: Any) -> None:
        for status in message.status:
            self.heard[status.name] += 1
            for value in status.values:
                if value.key == 'refused blocks [1]':
                    self.refused[status.name] = int(value.value)

    def spin(self, seconds: float) -> None:
        """Hear what comes."""
        deadline = time.monotonic() + seconds
        while (left_s := deadline - time.monotonic()) > 0.0:
            self._executor.spin_once(max(left_s, 1e-3))  # of less, DDS makes no end at all

    def close(self) -> None:
        """Leave the domain."""
        self._node.destroy_node()
        rclpy.try_shutdown()


def rogue_blocks(folder: Path, *, quick: bool) -> dict[str, Any]:
    """Let a hostile source feed a monitor and a recorder that run alone."""
    count = 400 if quick else 20_000
    environment = private_environment(folder / 'log')
    recorder = ['rotor_recording.recorder_node', '--ros-args', '-p', f'path:={folder / "bag"}']
    commands = {'vibration_monitor': ['vibration_monitor.node'], 'recorder': recorder}
    nodes = {
        name: subprocess.Popen([sys.executable, '-m', *words], env=environment,
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for name, words in commands.items()
    }  # fmt: skip
    rogue = Rogue(environment)
    try:
        rogue.listen()
        output = rogue.output(topics.WAVEFORM)
        deadline = time.monotonic() + 60.0
        while output.get_subscription_count() < len(nodes) and time.monotonic() < deadline:
            rogue.spin(0.1)
        for number in range(count):
            rng = default_rng([SEED, number])
            output.publish(hostile_bytes(rng, 2 * ROWS * number))
            output.publish(to_cdr(encode(sane_block(2 * ROWS * number + ROWS), OFFLINE)))
            rogue.spin(0.004)
            if number % ROUND == ROUND - 1:
                gone = {
                    name: node.poll() for name, node in nodes.items() if node.poll() is not None
                }
                hold(not gone, f'after block {number}: {gone}')
        before = rogue.heard['indicators']
        for number in range(200):  # ten seconds of blocks that are as they should be
            index = 2 * ROWS * count + ROWS * number
            output.publish(to_cdr(encode(sane_block(index), OFFLINE)))
            rogue.spin(0.02)
        rogue.spin(1.0)
        windows = rogue.heard['indicators'] - before
        hold(windows > 10, f'only {windows} windows came of 10 s of sane blocks')
        for node in nodes.values():
            node.send_signal(signal.SIGINT)
        codes = {name: node.wait(60.0) for name, node in nodes.items()}
    finally:
        rogue.close()
        for node in nodes.values():
            if node.poll() is None:
                node.kill()
                node.wait()
    hold(set(codes.values()) == {0}, f'exit codes {codes}')
    recording = Recording(folder / 'bag')
    kept = sum(1 for _ in recording.messages([recording.find(topics.WAVEFORM) or '']))
    hold(not recording.damage, f'{recording.damage}')
    return {
        'hostile blocks sent, each followed by a sane one': count,
        'refused by the monitor': rogue.refused.get('vibration_monitor: stream', 0),
        'recorded as they came': kept,
        'windows of the ten seconds that followed': windows,
    }


def rogue_stranger(folder: Path, *, quick: bool) -> dict[str, Any]:
    """Let a stranger publish mutated bytes on every topic of a rig in flight."""
    length_s = '6' if quick else '60'
    alone = Recording(simulated(folder, 'climb_dive', length_s))
    examples = _examples(alone)
    flight = LiveFlight(folder / 'flight', 'climb_dive', '--duration', length_s, '--json')
    rogue = Rogue(flight.environment)
    rng = default_rng(SEED)
    sent = unsent = 0
    try:
        flight.wait_until_recording(0.5)
        places = [(topic, topic) for topic in topics.TOPICS]
        for topic in topics.TOPICS:
            inside = None if topic is topics.MANEUVER_LOAD else rogue.hidden(topic)
            if inside:  # a second source of loads there ends the run, see docs/topics.md
                places.append((topic, inside))
        hold(len(places) > len(topics.TOPICS), 'the topics of the run were not found')
        while flight.process.poll() is None:
            topic, place = places[rng.integers(len(places))]
            try:
                rogue.output(place).publish(_mutated(rng, topic, examples[topic.name]))
            except RCLError:
                unsent += 1  # DDS takes no message that is longer than its type allows
            else:
                sent += 1
            time.sleep(0.002)
        code, said = flight.finish()
    finally:
        rogue.close()
        flight.close()
    # on the topics of the run itself, what is refused is missing for all that the recorder knows
    hold(code in {ExitCode.DONE, ExitCode.CHECK_FAILED}, f'exit code {code}: {said[-500:]}')
    hold('Traceback' not in said, said[-2000:])
    blocks = [block.rows.tobytes() for block in waveform_blocks(Recording(flight.bag()))]
    flown = [block.rows.tobytes() for block in waveform_blocks(alone)]
    remaining = iter(blocks)
    whole = all(block in remaining for block in flown)
    hold(whole, 'the recording lacks blocks of the flight')
    summary = json.loads(said[said.index('{') : said.rindex('}') + 1])
    hold(summary['lost_samples'] == 0, f'{summary["lost_samples"]} samples were lost')
    return {
        'messages sent': sent,
        'messages that DDS did not send': unsent,
        'topics, those of the run among them': len(places),
        'refused by the nodes of the run': summary['refused_blocks'],
        'blocks of the flight that are recorded byte for byte': len(flown),
        'blocks of the stranger recorded beside them': len(blocks) - len(flown),
    }


def _mutated(rng: Generator, topic: Topic, example: bytes) -> bytes:
    """Return a message of a topic's type with bytes that nobody sends."""
    if topic.type == topics.WAVEFORM.type and rng.integers(2):
        return hostile_bytes(rng, int(rng.integers(100_000)))
    data = bytearray(example)
    kind = rng.integers(4)
    if kind == 0:
        del data[rng.integers(len(data) + 1) :]
    elif kind == 1:
        data += rng.bytes(int(rng.integers(1, 200)))
    for _ in range(rng.integers(1, 12)):
        if data:
            data[rng.integers(len(data))] = rng.integers(256)
    return bytes(data)


def _examples(recording: Recording) -> dict[str, bytes]:
    """Return a message of each type, by topic."""
    found = {topics.PROGRESS.name: to_cdr(messages.header(OFFLINE, time.time_ns(), 'recorder'))}
    for topic in topics.TOPICS:
        if (name := recording.find(topic)) is not None:
            found[topic.name] = next(iter(recording.messages([name]))).data
    clock = to_cdr(messages.clock(OFFLINE, time.time_ns()))
    return {topic.name: found.get(topic.name, clock) for topic in topics.TOPICS}


SLICE = 2000
"""Inputs that one process takes: rerun keeps some memory of each view that a process has made."""


def fuzz(kind: str, folder: Path, *, quick: bool, inputs: int = 100_000) -> dict[str, Any]:
    """Feed hostile inputs of a kind to what takes them; where quick, 300."""
    count = 300 if quick else inputs
    found: dict[str, Any] = {}
    for first in range(0, count, SLICE):
        size = min(count - first, SLICE)
        file = folder / f'{first}.json'
        done = subprocess.run(
            [sys.executable, '-W', 'ignore', str(ROOT / 'benchmarks/fuzz.py'), kind,
             '--first', str(first), '--inputs', str(size), '--json', str(file)],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        hold(done.returncode == 0, done.stdout[-3000:] + done.stderr[-1000:])
        for what, value in json.loads(file.read_text('utf-8'))[kind].items():
            add = max if isinstance(value, float) or 'most' in what else operator.add
            found[what] = add(found.get(what, 0), value)
    return found


def cheats(folder: Path, *, quick: bool) -> dict[str, Any]:
    """Evaluate the detectors that cheat; each must fail in its own way."""
    report = folder / 'cheats.xml'
    chosen = ['-k', 'dated or nothing_is_found'] if quick else []
    test = ROOT / 'ros_ws/src/rotor_bench/test/test_evaluation_cheats.py'
    done = subprocess.run(
        [sys.executable, '-m', 'pytest', '-q', f'--junitxml={report}', str(test), *chosen],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    hold(done.returncode == 0, done.stdout[-2000:])
    suite = ET.parse(report).getroot()[0]  # noqa: S314 - pytest's own
    skipped = [case[0].get('message') for case in suite if len(case) and case[0].tag == 'skipped']
    return {
        'checks that held': int(suite.attrib['tests']) - len(skipped),
        'could not be checked on this machine': skipped,
    }
