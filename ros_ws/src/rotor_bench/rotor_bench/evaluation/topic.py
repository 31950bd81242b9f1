# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Evaluates any ROS 2 node: replays flights over DDS and records its alarm topic.

The node sees the topic rotor/waveform with anonymous blocks, and /clock; nothing else is
published. It is a process of the user's, whose access to files is not restricted.
"""

import contextlib
import json
import math
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from rotor_bench.dataset.suite import Flight, Machine
from rotor_bench.evaluation.anonymous import Anonymiser
from rotor_bench.evaluation.outcome import Evaluated, FlightResult, Outcome, Watch
from rotor_bench.evaluation.runner import OnFlights, crack_course
from rotor_bench.evaluation.sources import Source
from rotor_common.errors import ConfigError, ProcessError
from rotor_interfaces import access, messages, topics
from rotor_interfaces.messages import OFFLINE, sample_stamp_ns
from rotor_interfaces.waveform import encode
from rotor_recording.recording import RecordingWriter

ALARM_SCORE = 1.0
"""Level WARN of a DiagnosticArray; a Float64 must have the same scale."""

ISOLATION = (
    'topic: the node receives anonymous blocks only, but its process is not isolated; its messages '
    'are dated by the newest block that was published when they were heard'
)
SLACK_S = 0.2
"""A stamp may be this much after the end of the flight: one block."""
STOP_S = 10.0
MOST_PER_S = 1000.0


@dataclass(frozen=True)
class TestedNode:
    """A node under test: the topic of its alarm, how to start it, how fast to replay.

    Without a `command` it must be running; with one it is started anew for every flight.
    """

    topic: str
    command: str = ''
    rate: float = 20.0

    def __post_init__(self) -> None:
        if not 0 < self.rate <= MOST_PER_S:
            raise ConfigError(f'--rate {self.rate:g} is out of range; allowed: above 0 to 1000')
        try:
            program = shlex.split(self.command)[:1]
        except ValueError as error:
            raise ConfigError(f'--node-command {self.command!r} cannot be read: {error}') from None
        if program and shutil.which(program[0]) is None:
            raise ConfigError(f'--node-command {self.command!r}: there is no program {program[0]}')


def follow(
    machines: Sequence[Machine],
    node: TestedNode,
    source: Source,
    on_flights: OnFlights = lambda _flights, _seconds: None,
) -> Evaluated:
    """Return what a node says about every flight under test; reference flights are left out.

    Raises:
        ConfigError: security is required but not available.

    """
    access.keep_on_this_machine()  # also the node under test
    access.check_security()
    name = f'topic:{node.topic}'
    results = []
    for flight in (flight for machine in machines for flight in machine.flights):
        if flight.role == 'test':
            outcomes = {name: _outcome(flight, node, source)}
            results.append(
                FlightResult(
                    flight.machine,
                    flight.number,
                    flight.duration_s,
                    flight.labels,
                    crack_course(flight),
                    outcomes,
                )
            )
        on_flights(1, flight.duration_s)
    return Evaluated(results, ISOLATION, {name: ALARM_SCORE})


def _outcome(flight: Flight, node: TestedNode, source: Source) -> Outcome:
    with tempfile.TemporaryDirectory(prefix='rig-') as place:
        folder = Path(place)
        file = folder / 'flight.mcap'
        _write(flight, source, file)
        with _running(node.command, folder) as complaint:
            heard = _replayed(file, node, folder)
            died = complaint()
        return watched(heard['said'], flight.duration_s, died or heard['failure'])


def _write(flight: Flight, source: Source, file: Path) -> None:
    """Write the anonymous waveform of a flight and nothing else."""
    rate_hz = flight.scenario.rate_hz
    anonymiser = Anonymiser(rate_hz)
    with RecordingWriter.single_file(file) as writer:
        for (block,) in source.fly([flight]):
            copy = anonymiser.copy(block)
            data = messages.to_cdr(encode(copy, OFFLINE))
            end_ns = sample_stamp_ns(0, int(copy.rows['sample'][-1]) + 1, rate_hz)
            writer.write(topics.WAVEFORM, data, end_ns, end_ns)  # published when complete


@contextlib.contextmanager
def _running(command: str, folder: Path) -> 'Iterator[_Complaint]':
    """Run the node's command, where there is one, in an empty folder."""
    if not command:
        yield _Complaint(None)
        return
    workplace = folder / 'node'
    workplace.mkdir()
    process = subprocess.Popen(
        shlex.split(command),
        cwd=workplace,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        yield _Complaint(process)
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


@dataclass(frozen=True)
class _Complaint:
    """Says why a node is no longer there, '' while it is."""

    process: subprocess.Popen[bytes] | None

    def __call__(self) -> str:
        code = None if self.process is None else self.process.poll()
        return '' if code is None else f'its node ended with exit code {code} during the flight'


def _replayed(file: Path, node: TestedNode, folder: Path) -> dict[str, Any]:
    """Return what `listener_node` wrote; raises ProcessError if a running node is missing."""
    out = folder / 'said.json'
    done = subprocess.run(
        [
            sys.executable,
            '-m',
            'rotor_bench.evaluation.listener_node',
            str(file),
            node.topic,
            str(node.rate),
            str(out),
        ],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    if not out.exists():
        words = done.stderr.strip().splitlines() or [f'it ended with code {done.returncode}']
        raise ProcessError(f'the replay failed: {words[-1].removeprefix("error: ")}')
    heard: dict[str, Any] = json.loads(out.read_text('utf-8'))
    if heard['is_absent'] and not node.command:
        raise ProcessError(f'the replay failed: {heard["failure"]}')
    return heard


def watched(said: Sequence[tuple[float, float, str]], duration_s: float, failure: str) -> Outcome:
    """Return the outcome of a flight from its messages (time in s, score, reason).

    Each score holds until the next, the last until the flight ends. A stamp outside the flight is
    a failure: its meaning is unknown.
    """
    watch = Watch(ALARM_SCORE)
    if outside := [time_s for time_s, _, _ in said if not 0 <= time_s <= duration_s + SLACK_S]:
        return watch.outcome(
            f'it stamped a message {outside[0]:.9g} s, outside its flight of {duration_s:g} s; '
            'stamps must follow those of the waveform'
        )
    if any(math.isinf(score) for _, score, _ in said):
        return watch.outcome('it published an infinite score; it must be a number, or NaN for none')
    ordered = sorted(said, key=lambda one: one[0])
    times_s = [*(min(time_s, duration_s) for time_s, _, _ in ordered), duration_s]
    for (_, score, text), (said_s, next_s) in zip(ordered, pairwise(times_s), strict=True):
        watch.take(said_s, next_s - said_s, score, text)
    return watch.outcome(failure or ('' if said else 'it said nothing'))
