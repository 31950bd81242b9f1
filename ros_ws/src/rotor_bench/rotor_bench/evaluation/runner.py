# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Flies the machines of a suite past the detectors, block after block.

A batch of machines flies in lock-step; every block is copied anonymously and goes to the process
of each detector. Nothing longer than a block is held.
"""

import abc
import contextlib
import math
import multiprocessing
import queue
import signal
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import Any

from rotor_bench.dataset.suite import Flight, Machine, batches
from rotor_bench.evaluation.anonymous import Anonymiser
from rotor_bench.evaluation.checkpoint import Parts
from rotor_bench.evaluation.detector_process import die_with_parent
from rotor_bench.evaluation.exchange import Stream
from rotor_bench.evaluation.isolation import SILENCE_S, DetectorProcess, Sandbox
from rotor_bench.evaluation.outcome import Evaluated, FlightResult, Watch
from rotor_bench.evaluation.sources import Source
from rotor_bench.evaluation.walls import text as walls_text
from rotor_common.errors import ProcessError, RigError
from rotor_interfaces.waveform import WaveformBlock

OnFlights = Callable[[int, float], None]
"""Takes the number of flights that have just been flown, and their total length in s."""


@dataclass(frozen=True)
class Job:
    """What every worker needs to know."""

    detectors: tuple[str, ...]
    source: Source
    folder: Path
    secret: Path | None
    """Folder that no detector may read: that of a stored suite."""
    silence_s: float = SILENCE_S
    parts: Parts | None = None
    """Where finished flights are kept."""


def evaluate(
    machines: Sequence[Machine],
    detectors: Sequence[str],
    source: Source,
    *,
    jobs: int = 1,
    secret: Path | None = None,
    silence_s: float = SILENCE_S,
    parts: Parts | None = None,
    on_flights: OnFlights = lambda _flights, _seconds: None,
) -> Evaluated:
    """Return what the detectors say about every flight under test of `machines`.

    Args:
        machines: of a suite; those flown together are found by `dataset.suite.batches`.
        detectors: names or module:Class.
        source: of the blocks.
        jobs: processes that fly; each detector of each machine has one more process.
        secret: folder that the detectors must not be able to read.
        silence_s: longest time that a detector may take to answer.
        parts: where finished flights are kept, and taken from instead of being flown again.
        on_flights: is told of progress.

    Raises:
        RigError: a detector is not found, a flight cannot be flown, or a worker died.

    """
    with tempfile.TemporaryDirectory(prefix='rig-', ignore_cleanup_errors=True) as folder:
        job = Job(tuple(detectors), source, Path(folder), secret, silence_s, parts)
        tasks = list(batches(machines))
        if jobs == 1:
            done = [fly_batch(task, job, on_flights) for task in tasks]
        else:
            done = _spread(tasks, job, min(jobs, len(tasks)), on_flights)
    return joined(done)


def joined(parts: Sequence[Evaluated]) -> Evaluated:
    """Return parts as one, with all outcomes of a flight merged."""
    flights: dict[tuple[int, int], FlightResult] = {}
    scores: dict[str, float] = {}
    for part in parts:
        for flight in part.flights:
            known = flights.setdefault((flight.machine, flight.number), flight)
            known.outcomes.update(flight.outcomes)
        for name, score in part.alarm_scores.items():
            if math.isnan(scores.get(name, math.nan)):  # NaN: it failed before it could say
                scores[name] = score
    how = '; '.join(dict.fromkeys(part.isolation for part in parts))
    return Evaluated([flights[key] for key in sorted(flights)], how, scores)


def fly_batch(machines: Sequence[Machine], job: Job, on_flights: OnFlights) -> Evaluated:
    """Fly machines in lock-step, with a process for each detector of each machine.

    Tests whose parts are stored are left out; references are flown for the others.
    """
    kept, rows = [], []
    for row in zip(*(machine.flights for machine in machines), strict=True):
        part = job.parts.load(row) if job.parts and row[0].role == 'test' else None
        if part is None:
            rows.append(row)
        else:
            kept.append(part)
            on_flights(len(row), row[0].duration_s * len(row))
    if kept and all(row[0].role == 'reference' for row in rows):
        for row in rows:
            on_flights(len(row), row[0].duration_s * len(row))
        return joined(kept)
    return joined([*kept, *_flown(rows, job, on_flights)])


def _flown(
    rows: Sequence[Sequence[Flight]], job: Job, on_flights: OnFlights
) -> Iterator[Evaluated]:
    """Yield the results of each row of flights in lock-step, once they are stored."""
    with contextlib.ExitStack() as stack:
        sandbox = stack.enter_context(Sandbox(job.folder, job.silence_s))
        codes = {name: sandbox.code(name) for name in job.detectors}
        if job.secret is not None:
            sandbox.check_secret(job.secret, codes.values())
        processes = [{name: sandbox.start(code) for name, code in codes.items()} for _ in rows[0]]
        for process in (one for of_machine in processes for one in of_machine.values()):
            stack.callback(process.close)
        fits = [_opened(of_machine, DetectorProcess.fit) for of_machine in processes]
        how = walls_text(sandbox.walls or {})
        scores = {name: process.alarm_score for name, process in processes[0].items()}
        yield Evaluated([], how, scores)
        for flights in rows:
            if flights[0].role == 'reference':
                references = [
                    _Reference(flight, streams)
                    for flight, streams in zip(flights, fits, strict=True)
                ]
                _fly(job.source, flights, references)
            else:
                _finish_fits(processes, fits)
                tests = [
                    _Test(flight, of_machine)
                    for flight, of_machine in zip(flights, processes, strict=True)
                ]
                _fly(job.source, flights, tests)
                part = Evaluated([test.result() for test in tests], how, scores)
                if job.parts:
                    job.parts.store(flights, part)
                yield part
            on_flights(len(flights), flights[0].duration_s * len(flights))


def _fly(source: Source, flights: Sequence[Flight], listeners: Sequence['_Listener']) -> None:
    for blocks in source.fly(flights):
        for listener, block in zip(listeners, blocks, strict=True):
            listener.take(block)
    for listener in listeners:
        listener.end()


def crack_course(flight: Flight) -> tuple[tuple[float, float], ...]:
    """Return (time in s, K) at the start, the end, and around every bend between."""
    config = flight.scenario.rotor_sim()
    schedule = config.schedules()['crack_stiffness_ratio']
    end = round(flight.duration_s * config.rate_hz)
    bends = {0, end}
    for growth in config.crack_growth:
        for time_s in (growth.at_s, growth.at_s + growth.over_s):
            bends |= {round(time_s * config.rate_hz) - 1, round(time_s * config.rate_hz)}
    inside = sorted(bend for bend in bends if 0 <= bend <= end)
    return tuple((bend / config.rate_hz, schedule.value(bend)) for bend in inside)


def _opened(
    processes: dict[str, DetectorProcess], stream_of: Callable[[DetectorProcess], Stream]
) -> dict[str, Stream]:
    return {name: stream_of(process) for name, process in processes.items()}


def _finish_fits(
    processes: Sequence[dict[str, DetectorProcess]], fits: Sequence[dict[str, Stream]]
) -> None:
    """Wait until every detector is fitted; one whose fit fails has failed for all flights."""
    for of_machine, streams in zip(processes, fits, strict=True):
        for name, stream in streams.items():
            stream.finish()
            if stream.failure and not of_machine[name].failure:
                of_machine[name].failure = f'in fit: {stream.failure}'
        streams.clear()


class _Listener(abc.ABC):
    """Takes the blocks of one flight."""

    def __init__(self, flight: Flight) -> None:
        self.flight = flight
        self._rate_hz = flight.scenario.rate_hz
        self._anonymiser = Anonymiser(self._rate_hz)

    @abc.abstractmethod
    def take(self, block: WaveformBlock) -> None:
        """Hand on an anonymous copy of a block."""

    @abc.abstractmethod
    def end(self) -> None:
        """Hand on that the flight has ended."""


class _Reference(_Listener):
    """Hands a reference flight to the detectors of a machine."""

    def __init__(self, flight: Flight, streams: dict[str, Stream]) -> None:
        super().__init__(flight)
        self._streams = list(streams.values())

    def take(self, block: WaveformBlock) -> None:
        copy = self._anonymiser.copy(block)
        for stream in self._streams:
            stream.send(copy)

    def end(self) -> None:
        for stream in self._streams:
            stream.end_flight()


class _Test(_Listener):
    """Hands a flight under test to the detectors of a machine and follows what they say."""

    def __init__(self, flight: Flight, processes: dict[str, DetectorProcess]) -> None:
        super().__init__(flight)
        self._streams = _opened(processes, DetectorProcess.flight)
        self._watches = {name: Watch(process.alarm_score) for name, process in processes.items()}
        self._ends_s = [0.0]

    def take(self, block: WaveformBlock) -> None:
        copy = self._anonymiser.copy(block)
        end = int(copy.rows['sample'][-1]) + 1
        self._ends_s.append(end / self._rate_hz)
        for name, stream in self._streams.items():
            stream.send(copy)
            self._follow(name)

    def end(self) -> None:
        for name, stream in self._streams.items():
            stream.finish()
            self._follow(name)

    def _follow(self, name: str) -> None:
        verdicts = self._streams[name].verdicts
        while verdicts:
            block, score, evidence = verdicts.popleft()
            start_s, end_s = self._ends_s[block : block + 2]
            self._watches[name].take(end_s, end_s - start_s, score, evidence)

    def result(self) -> FlightResult:
        """Return the result of the flight."""
        return FlightResult(
            self.flight.machine,
            self.flight.number,
            self.flight.duration_s,
            self.flight.labels,
            crack_course(self.flight),
            {
                name: watch.outcome(self._streams[name].failure)
                for name, watch in self._watches.items()
            },
        )


def _spread(
    tasks: Sequence[tuple[Machine, ...]], job: Job, workers: int, on_flights: OnFlights
) -> list[Evaluated]:
    """Share the batches among worker processes, which know the labels, unlike the detectors'."""
    context = multiprocessing.get_context('spawn')
    waiting: Any = context.Queue()
    news: Any = context.Queue()
    for number, task in enumerate(tasks):
        waiting.put((number, task))
    for _ in range(workers):
        waiting.put(None)
    processes = [
        context.Process(target=_work, args=(waiting, news, job), daemon=True)
        for _ in range(workers)
    ]
    # this process handles Ctrl-C and ends the others, which inherit a blocked SIGINT
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        for process in processes:
            process.start()
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        return _gather(news, processes, len(tasks), on_flights)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        for process in processes:
            if process.pid is not None:
                process.terminate()  # the servers of detectors die with it
                process.join()


def _gather(
    news: Any, processes: Sequence[SpawnProcess], count: int, on_flights: OnFlights
) -> list[Evaluated]:
    parts: dict[int, Evaluated] = {}
    while len(parts) < count:
        try:
            kind, number, content = news.get(timeout=1.0)
        except queue.Empty:
            if any(process.exitcode for process in processes):
                raise ProcessError('a process that flew machines has died') from None
            continue
        if kind == 'error':
            raise content
        if kind == 'flights':
            on_flights(number, content)
        else:
            parts[number] = content
    return [parts[number] for number in range(count)]


def _work(waiting: Any, news: Any, job: Job) -> None:
    """Fly batches until there are no more."""
    die_with_parent()

    def on_flights(flights: int, seconds: float) -> None:
        news.put(('flights', flights, seconds))

    try:
        while (task := waiting.get()) is not None:
            number, machines = task
            news.put(('part', number, fly_batch(machines, job, on_flights)))
    except RigError as error:
        news.put(('error', 0, error))
