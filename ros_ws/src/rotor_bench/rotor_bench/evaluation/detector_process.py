# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The processes in which detectors run; they only ever receive anonymised blocks.

`python -m rotor_bench.evaluation.detector_process` is the server: started with a clean
environment and an empty folder, it loads what most detectors need, and never runs a line of the
code under test. It forks a keeper for each fit and each flight under test, in namespaces of its
own, and the keeper forks the process of the detector. That process restricts itself (`walls`)
before it loads the detector. The fitted detector goes to every flight as the same bytes, and
nothing else passes from one process to another. The keeper ends all processes below it when the
detector or the evaluation is gone. The parent of the server is `isolation`.
"""

import contextlib
import ctypes
import gc
import importlib.util
import json
import math
import os
import pickle
import select
import shutil
import signal
import socket
import sys
import tempfile
import traceback
from collections.abc import Callable, Collection, Iterator
from functools import partial
from importlib.metadata import entry_points
from itertools import pairwise
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from rotor_bench.evaluation import pipe_protocol, walls
from rotor_interfaces.channels import CHANNEL_COLUMNS
from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock
from vibration_monitor.detectors.protocol import (
    GROUP,
    Detector,
    Verdict,
    check_detector,
    load_detector,
)
from vibration_monitor.errors import MonitorError

LONGEST_ORDER = 65_536
OURS = 'vibration_monitor'
SIMULATOR = (
    'maneuver_gen', 'rotor_bench', 'rotor_bringup', 'rotor_dynamics', 'rotor_rig', 'rotor_sim'
)  # fmt: skip
PROBE, FIT, FLIGHT = 'probe', 'fit', 'flight'
"""Purpose of a process; a probe only reports which restrictions (walls) are in force."""
_PR_SET_PDEATHSIG = 1


def die_with_parent() -> None:
    """Ask Linux to kill this process when its parent has ended."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


def main() -> None:
    """Serve the orders on standard input, a socket, until it is closed."""
    die_with_parent()
    control = socket.socket(fileno=0)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the evaluation handles Ctrl-C
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # keepers are not waited for: no zombies
    walls.adopt()
    folder = Path.cwd()
    shared = walls.enter_shared()
    _warm_up()
    gc.collect()
    gc.freeze()  # less to copy in the forks
    control.sendall(b'ready')
    while True:
        text, descriptors, _, _ = socket.recv_fds(control, LONGEST_ORDER, 2)
        if not text or len(descriptors) != 2:
            return
        if not os.fork():
            stream, leash = descriptors
            start = partial(_start, json.loads(text), stream, leash, folder, shared)
            _run(start, keep=descriptors)
        for descriptor in descriptors:
            os.close(descriptor)


def _warm_up() -> None:
    """Load and compile once what our own detectors need: the forks cannot cache it in files."""
    rate_hz = 4096
    rows = np.zeros(3 * rate_hz, WAVEFORM_DTYPE)
    samples = np.arange(len(rows))
    angle = 2 * math.pi * 50 * samples / rate_hz
    for name in (*CHANNEL_COLUMNS, 'load_y'):
        rows[name] = np.cos(angle)
    rows['sample'] = samples
    rows['time'] = samples / rate_hz
    rows['keyphasor'] = 5.0 * (np.cos(angle) > 0.9)
    for encoder in (angle, math.nan):
        rows['angle'] = encoder
        block = WaveformBlock(0, rows.copy())
        for point in entry_points(group=GROUP):
            if not point.module.startswith(f'{OURS}.'):
                continue  # code of others must not run without restrictions
            with contextlib.suppress(Exception):  # it will fail again where failures count
                detector = point.load()()
                detector.fit([[block]])
                detector.push(block)


def _run(work: Callable[[], None], *, keep: Collection[int]) -> NoReturn:
    """Do `work` in a newly forked process with only the descriptors `keep` open, and end it."""
    code = 1
    try:
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        nothing = os.open(os.devnull, os.O_RDWR)
        for standard in range(3):
            os.dup2(nothing, standard)
        ends = [*sorted(keep), os.sysconf('SC_OPEN_MAX')]
        for begin, end in pairwise([2, *ends]):
            os.closerange(begin + 1, end)
        work()
        code = 0
    finally:
        os._exit(code)


def _start(
    order: dict[str, Any], stream: int, leash: int, parent: Path, shared: walls.Walls
) -> None:
    """Start a keeper in new namespaces; this process ends, since it cannot enter them itself."""
    folder = Path(tempfile.mkdtemp(dir=parent))
    known = shared | walls.enter_own(folder)
    if not os.fork():
        _run(partial(_keep, order, stream, leash, folder, known), keep=(stream, leash))


def _keep(order: dict[str, Any], stream: int, leash: int, folder: Path, known: walls.Walls) -> None:
    """Start the detector; end all processes below once it or the leash's other end is gone."""
    walls.adopt()
    process = os.fork()
    if not process:
        _run(partial(_detect, order, stream, folder, known), keep=(stream,))
    os.close(stream)
    watch = os.pidfd_open(process)
    select.select([leash, watch], [], [])
    walls.end_all_below()
    shutil.rmtree(folder, ignore_errors=True)


def _detect(order: dict[str, Any], stream: int, folder: Path, known: walls.Walls) -> None:
    """Restrict this process, make the detector, and fit it or judge a flight with it."""
    die_with_parent()
    with socket.socket(fileno=stream) as connection, contextlib.suppress(OSError):
        _settle_in(folder)
        _save_no_machine_code()
        read = [Path(path) for path in order['read']]
        standing = walls.close_around(read, folder, _simulator(), known)
        pipe_protocol.send_data(
            connection, pipe_protocol.WALLS, math.nan, json.dumps(standing).encode()
        )
        if order['kind'] == PROBE:
            return
        try:
            sys.path[:0] = order['path']
            if order['kind'] == FIT:
                _fit(order['target'], connection)
            else:
                detector = pickle.loads(pipe_protocol.receive_learnt(connection))  # noqa: S301
                pipe_protocol.send_reply(
                    connection, pipe_protocol.MADE, float(detector.alarm_score), ''
                )
                _judge(detector, connection)
        except BaseException as error:  # noqa: BLE001 - whatever a detector raises is its failure
            pipe_protocol.send_reply(connection, pipe_protocol.FAILED, math.nan, last_line(error))
        else:
            pipe_protocol.send_reply(connection, pipe_protocol.DONE, math.nan, '')
        _drain(connection)


def _simulator() -> list[Path]:
    """Return the folders of the packages with which a detector could simulate its flight."""
    specs = map(importlib.util.find_spec, SIMULATOR)
    return [Path(spec.origin).parent for spec in specs if spec and spec.origin]


def _settle_in(folder: Path) -> None:
    os.chdir(folder)
    tempfile.tempdir = str(folder)
    for name in ('HOME', 'TMPDIR', 'NUMBA_CACHE_DIR'):
        os.environ[name] = str(folder)
    if 'numba' in sys.modules:
        sys.modules['numba'].config.CACHE_DIR = str(folder)


def _save_no_machine_code() -> None:
    """Make numba ignore that it cannot cache compiled code beside a package's source."""
    caching = sys.modules.get('numba.core.caching')
    if caching is None:
        return
    save = caching.Cache.save_overload

    def save_if_possible(*arguments: Any) -> None:
        with contextlib.suppress(OSError):
            save(*arguments)

    caching.Cache.save_overload = save_if_possible


def _drain(connection: socket.socket) -> None:
    while pipe_protocol.receive_block(connection) != pipe_protocol.END_OF_STREAM:
        pass


def _fit(target: str, connection: socket.socket) -> None:
    """Make a detector, fit it, and send back the fitted detector."""
    detector = check_detector(load_detector(target)(), target)
    pipe_protocol.send_reply(connection, pipe_protocol.MADE, float(detector.alarm_score), '')
    flights = _Flights(connection)
    detector.fit(iter(flights))
    flights.pass_over()
    try:
        learnt = pickle.dumps(detector)
    except Exception as error:  # noqa: BLE001 - pickling a detector may raise anything
        raise MonitorError(
            f'{last_line(error)}: what it has learnt cannot be copied to its flights; keep what '
            'pickle can store in the detector'
        ) from None
    if len(learnt) > pipe_protocol.LARGEST_LEARNT:
        raise MonitorError(
            f'it has learnt {len(learnt)} bytes; allowed: at most {pipe_protocol.LARGEST_LEARNT}'
        )
    pipe_protocol.send_data(connection, pipe_protocol.LEARNT, math.nan, learnt)


class _Flights:
    """The reference flights of a stream; blocks that are not read are skipped."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        self._ended = False

    def __iter__(self) -> Iterator[Iterator[WaveformBlock]]:
        while not self._ended:
            flight = self._blocks()
            first = next(flight, None)
            if first is None:
                return
            yield _with_first(first, flight)
            for _ in flight:
                pass

    def _blocks(self) -> Iterator[WaveformBlock]:
        while isinstance(got := pipe_protocol.receive_block(self._connection), WaveformBlock):
            yield got
        self._ended = got == pipe_protocol.END_OF_STREAM

    def pass_over(self) -> None:
        """Skip all blocks that are still to come."""
        if not self._ended:
            _drain(self._connection)


def _with_first(first: WaveformBlock, others: Iterator[WaveformBlock]) -> Iterator[WaveformBlock]:
    yield first
    yield from others


def _judge(detector: Detector, connection: socket.socket) -> None:
    """Answer every block; the evidence is sent if the score is the largest so far."""
    best = -math.inf
    while isinstance(block := pipe_protocol.receive_block(connection), WaveformBlock):
        verdict = detector.push(block)
        score = checked_score(verdict)
        evidence = verdict.evidence if score > best else ''
        best = max(best, score) if not math.isnan(score) else best
        pipe_protocol.send_reply(connection, pipe_protocol.VERDICT, score, evidence)


def checked_score(verdict: Any) -> float:
    """Return the score of a verdict; raises TypeError or ValueError if it is invalid."""
    if not isinstance(verdict, Verdict) or not isinstance(verdict.evidence, str):
        raise TypeError(f'push returned {type(verdict).__name__}, not a Verdict with a text')
    score = float(verdict.score)
    if math.isinf(score):
        raise ValueError('push returned an infinite score; it must be a number, or NaN for none')
    return score


def last_line(error: BaseException) -> str:
    """Return the last line of a traceback and its place in the code."""
    line = traceback.format_exception_only(error)[-1].strip()
    frames = traceback.extract_tb(error.__traceback__)
    return f'{line} ({Path(frames[-1].filename).name}:{frames[-1].lineno})' if frames else line


if __name__ == '__main__':
    main()
