# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The processes in which detectors run; they never hold anything but anonymous blocks.

`python -m rotor_bringup.evaluation.child` is the server: started with a clean environment and an
empty folder, it loads what most detectors need and forks one process a machine and detector. That
one gives up its access to files, makes the detector, fits it, and forks once more for every
flight under test, so that each starts from the same fitted detector. Its parent is `isolation`.
"""

import contextlib
import ctypes
import gc
import importlib.util
import json
import math
import os
import shutil
import signal
import socket
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterator
from functools import partial
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from rotor_bringup.evaluation import landlock, wire
from rotor_interfaces.waveform import CHANNEL_COLUMNS, WAVEFORM_DTYPE, WaveformBlock
from vibration_monitor.detectors.protocol import (
    GROUP,
    Detector,
    Verdict,
    check_detector,
    load_detector,
)

LONGEST_ORDER = 65_536
OURS = 'vibration_monitor'
SIMULATOR = ('rotor_sim', 'maneuver_gen', 'rotor_bringup')
FIT, FLIGHT = b'fit', b'flight'
_PR_SET_PDEATHSIG = 1


def die_with_parent() -> None:
    """Ask Linux to kill this process when the one that started it is gone."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


def main() -> None:
    """Serve the orders on standard input, a socket, until it is closed."""
    die_with_parent()
    control = socket.socket(fileno=0)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the evaluation, which ends us
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody waits for the processes of machines
    folder = Path.cwd()
    _warm_up()
    gc.collect()
    gc.freeze()  # less to copy in the forks
    _send_line(control, {'ready': landlock.version()})
    while True:
        order, descriptor = _receive_order(control)
        if not order:
            return
        process = os.fork()
        if not process:
            _run(partial(_machine, json.loads(order), descriptor, folder), keep=descriptor)
        os.close(descriptor)
        watch = os.pidfd_open(process)
        socket.send_fds(control, [b'started'], [watch])
        os.close(watch)


def _warm_up() -> None:
    """Load and compile what our own detectors need, once: the forks cannot keep it in files."""
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
                continue  # what others wrote must not run where nothing is closed
            with contextlib.suppress(Exception):  # it will fail again where failures count
                detector = point.load()()
                detector.fit([[block]])
                detector.push(block)


def _run(work: Callable[[], None], *, keep: int) -> NoReturn:
    """Do `work` in a process just forked, with no descriptor open but `keep`, and end it."""
    code = 1
    try:
        die_with_parent()
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        nothing = os.open(os.devnull, os.O_RDWR)
        for standard in range(3):
            os.dup2(nothing, standard)
        os.closerange(3, keep)
        os.closerange(keep + 1, os.sysconf('SC_OPEN_MAX'))
        work()
        code = 0
    finally:
        os._exit(code)


def _machine(order: dict[str, Any], descriptor: int, server_folder: Path) -> None:
    """Hold the detector of one machine: make it, fit it, fork it for each flight."""
    control = socket.socket(fileno=descriptor)
    try:
        folder = _confine([Path(path) for path in order['read']], server_folder)
        sys.path[:0] = order['path']
        target = order['target']
        detector = check_detector(load_detector(target)(), target)
    except BaseException as error:  # noqa: BLE001 - whatever a detector raises is its failure
        _send_line(control, {'failure': last_line(error)})
        return
    _send_line(control, {'alarm_score': float(detector.alarm_score)})
    while True:
        kind, stream = _receive_order(control)
        if not kind:
            return
        if kind == FIT:
            _guarded(stream, partial(_fit, detector))
            continue
        flight_folder = Path(tempfile.mkdtemp(dir=folder))
        process = os.fork()
        if not process:
            _run(partial(_flight, detector, stream, flight_folder), keep=stream)
        os.close(stream)
        os.waitpid(process, 0)
        shutil.rmtree(flight_folder, ignore_errors=True)


def _confine(read: list[Path], parent: Path) -> Path:
    """Give up everything but reading `read` and a new folder of our own, made the current one."""
    folder = Path(tempfile.mkdtemp(dir=parent))
    _settle_in(folder)
    _save_no_machine_code()
    landlock.restrict(read, [folder, Path(os.devnull)], hide=_simulator())
    return folder


def _simulator() -> list[Path]:
    """Return where the packages lie with which a detector could fly its flight again."""
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
    """Let numba go on where it cannot store what it has compiled beside a package's source."""
    caching = sys.modules.get('numba.core.caching')
    if caching is None:
        return
    save = caching.Cache.save_overload

    def save_if_possible(*arguments: Any) -> None:
        with contextlib.suppress(OSError):
            save(*arguments)

    caching.Cache.save_overload = save_if_possible


def _flight(detector: Detector, descriptor: int, folder: Path) -> None:
    """Judge one flight; what is written can reach no other."""
    _settle_in(folder)
    # a second set of rules narrows the first: reading as before, writing only here
    landlock.restrict([Path('/')], [folder, Path(os.devnull)])
    _guarded(descriptor, partial(_judge, detector))


def _guarded(descriptor: int, work: Callable[[socket.socket], None]) -> None:
    """Do `work` on a stream; a failure is sent back, and what is still coming is thrown away."""
    with socket.socket(fileno=descriptor) as connection, contextlib.suppress(OSError):
        try:
            work(connection)
        except BaseException as error:  # noqa: BLE001 - whatever a detector raises is its failure
            wire.send_reply(connection, wire.FAILED, math.nan, last_line(error))
        else:
            wire.send_reply(connection, wire.DONE, math.nan, '')
        _drain(connection)


def _drain(connection: socket.socket) -> None:
    while wire.receive_block(connection) != wire.END_OF_STREAM:
        pass


def _fit(detector: Detector, connection: socket.socket) -> None:
    detector.fit(_flights(connection))


def _flights(connection: socket.socket) -> Iterator[Iterator[WaveformBlock]]:
    """Yield the reference flights; what is not read of one is passed over."""
    ended = False

    def blocks() -> Iterator[WaveformBlock]:
        nonlocal ended
        while isinstance(got := wire.receive_block(connection), WaveformBlock):
            yield got
        ended = got == wire.END_OF_STREAM

    while not ended:
        flight = blocks()
        first = next(flight, None)
        if first is None:
            return
        yield _with_first(first, flight)
        for _ in flight:
            pass


def _with_first(first: WaveformBlock, others: Iterator[WaveformBlock]) -> Iterator[WaveformBlock]:
    yield first
    yield from others


def _judge(detector: Detector, connection: socket.socket) -> None:
    """Answer every block; the evidence goes along where the score is the largest so far."""
    best = -math.inf
    while isinstance(block := wire.receive_block(connection), WaveformBlock):
        verdict = detector.push(block)
        score = checked_score(verdict)
        evidence = verdict.evidence if score > best else ''
        best = max(best, score) if not math.isnan(score) else best
        wire.send_reply(connection, wire.VERDICT, score, evidence)


def checked_score(verdict: Any) -> float:
    """Return the score of a verdict; raises TypeError or ValueError where it is none."""
    if not isinstance(verdict, Verdict) or not isinstance(verdict.evidence, str):
        raise TypeError(f'push returned {type(verdict).__name__}, not a Verdict with a text')
    score = float(verdict.score)
    if math.isinf(score):
        raise ValueError('push returned an infinite score; it must be a number, or NaN for none')
    return score


def last_line(error: BaseException) -> str:
    """Return the last line of a traceback and where in the code it was."""
    line = traceback.format_exception_only(error)[-1].strip()
    frames = traceback.extract_tb(error.__traceback__)
    return f'{line} ({Path(frames[-1].filename).name}:{frames[-1].lineno})' if frames else line


def _receive_order(control: socket.socket) -> tuple[bytes, int]:
    """Return the next order and its descriptor; no bytes where the other side is gone."""
    order, descriptors, _, _ = socket.recv_fds(control, LONGEST_ORDER, 1)
    return (order, descriptors[0]) if order and descriptors else (b'', -1)


def _send_line(control: socket.socket, content: dict[str, Any]) -> None:
    control.sendall(json.dumps(content).encode())


if __name__ == '__main__':
    main()
