# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Detectors in processes of their own, which know nothing; `child` is their side.

The processes are forked from a server that was started afresh with a clean environment, before it
could hear of anything, so they inherit no memory, argument, variable, descriptor or folder of the
evaluation. Where Linux has Landlock they can read Python, its packages and the system's libraries
and nothing else, /proc included, and write into an empty folder of their own.
"""

import collections
import contextlib
import importlib.machinery
import importlib.util
import json
import math
import os
import select
import shutil
import signal
import site
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Self

from rotor_bringup.errors import ProcessError
from rotor_bringup.evaluation import wire
from rotor_bringup.evaluation.child import FIT, FLIGHT, LONGEST_ORDER
from rotor_interfaces.errors import ConfigError
from rotor_interfaces.waveform import WaveformBlock
from vibration_monitor.detectors.protocol import detector_target

SILENCE_S = 60.0
"""A detector that takes longer over a block, or over what its fit does at the end, has failed."""

START_S = 120.0
"""Longest time to start Python, or to load and make a detector."""

_SYSTEM = ('/lib', '/lib64', '/usr/lib', '/usr/lib64', '/usr/local/lib', '/usr/share/zoneinfo',
           '/etc/ld.so.cache', '/etc/localtime', '/dev/urandom')  # fmt: skip
_OWN = ('rotor_interfaces', 'vibration_monitor')
_ENVIRONMENT = {
    'LANG': 'C.UTF-8',
    'PATH': os.defpath,
    'PYTHONDONTWRITEBYTECODE': '1',
    'PYTHONHASHSEED': '0',
    # one core a detector, and a fork that no thread pool survives in halves
    **dict.fromkeys(
        ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS', 'NUMBA_NUM_THREADS'), '1'
    ),
    '_ROS_WHEELS_BOOTSTRAP_COMPLETE': '1',  # no second start for the sake of ROS libraries
}


def isolation_text(version: int) -> str:
    """Return in words how detectors are shut off, given the version of Landlock, 0 for none."""
    if version:
        return f'process and Landlock {version}'
    return 'process only: this kernel cannot close files and /proc to a detector'


class Code:
    """Where the code of a detector lies: `target` to load, `read` and `path` to read it from.

    A module that lies among the packages of Python is read there. Any other is copied, so that
    nothing that lies beside it is seen; the current folder is looked into as well.
    """

    def __init__(self, name: str, copies: Path) -> None:
        """Find the code of a detector; `copies` is a folder for what must be copied.

        Raises:
            MonitorError: the name is unknown.
            ConfigError: its module cannot be found.

        """
        self.target = detector_target(name)
        self.read: list[Path] = []
        self.path: list[str] = []
        self.origin = _place_of(_module_of(self.target))
        if any(self.origin.is_relative_to(folder.resolve()) for folder in readable()):
            return
        copies.mkdir(parents=True, exist_ok=True)
        if self.origin.is_dir():
            without = shutil.ignore_patterns('__pycache__')
            shutil.copytree(
                self.origin, copies / self.origin.name, ignore=without, dirs_exist_ok=True
            )
        else:
            shutil.copyfile(self.origin, copies / self.origin.name)
        self.read = [copies]
        self.path = [str(copies)]


def place_of_detector(name: str) -> Path:
    """Return the file or folder of a detector's code, without importing it; raises as `Code`."""
    return _place_of(_module_of(detector_target(name)))


def _module_of(target: str) -> str:
    """Return the top-level module of module:attribute."""
    return target.partition(':')[0].partition('.')[0]


def _place_of(module: str) -> Path:
    """Return the file or folder of a top-level module, without importing it."""
    spec = importlib.machinery.PathFinder.find_spec(module, [*sys.path, str(Path.cwd())])
    spec = spec or importlib.util.find_spec(module)
    places = [] if spec is None else [*(spec.submodule_search_locations or ()), spec.origin]
    if not places or places[0] is None or not Path(places[0]).exists():
        raise ConfigError(
            f'module {module!r} of a detector is neither installed nor in this folder'
        )
    return Path(places[0]).resolve()


def readable() -> list[Path]:
    """Return what every detector may read: Python, its packages, the system's libraries."""
    python = [sys.prefix, sys.base_prefix, *site.getsitepackages()]
    if site.ENABLE_USER_SITE:
        python.append(site.getusersitepackages())
    own = [
        Path(spec.origin).parent
        for name in _OWN
        if (spec := importlib.util.find_spec(name)) and spec.origin
    ]
    return [*map(Path, (*_SYSTEM, *python)), *own]


class Sandbox:
    """The server that forks the processes of detectors; end it by `close` or as a context."""

    def __init__(self, parent: Path, silence_s: float = SILENCE_S) -> None:
        """Start the server with a folder in `parent`; raises ProcessError where it fails."""
        self._silence_s = silence_s
        self._folder = Path(tempfile.mkdtemp(dir=parent))
        workplace = self._folder / 'w'
        workplace.mkdir()
        self._control, theirs = _pair(socket.SOCK_SEQPACKET)
        environment = {**_ENVIRONMENT, 'HOME': str(workplace), 'TMPDIR': str(workplace)}
        if os.environ.get('PYTHONPATH'):
            environment['PYTHONPATH'] = os.environ['PYTHONPATH']
        with (self._folder / 'server.log').open('wb') as log, theirs:
            self._server = subprocess.Popen(
                [sys.executable, '-P', '-s', '-m', 'rotor_bringup.evaluation.child'],
                stdin=theirs.fileno(),
                stdout=subprocess.DEVNULL,
                stderr=log,
                cwd=workplace,
                env=environment,
                start_new_session=True,
            )
        try:
            ready = _receive_line(self._control)
            if 'ready' not in ready:
                words = (self._folder / 'server.log').read_text('utf-8', 'replace').strip()
                raise ProcessError(f'the server of detectors did not start: {words[-300:]}')
        except BaseException:  # Ctrl-C too
            self.close()
            raise
        self.landlock_version = int(ready['ready'])

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the server; what it forked dies with it."""
        self._control.close()
        self._server.kill()
        self._server.wait()
        shutil.rmtree(self._folder, ignore_errors=True)

    def code(self, name: str) -> Code:
        """Return where the code of a detector lies; raises as `Code`."""
        return Code(name, self._folder / 'code' / name.replace(':', '_'))

    def check_secret(self, place: Path, codes: Iterable[Code]) -> None:
        """Raise ConfigError where a folder that the detectors may read holds `place`."""
        secret = place.resolve()
        for folder in [*readable(), *(code.origin for code in codes)]:
            if secret.is_relative_to(folder.resolve()):
                raise ConfigError(
                    f'{place} lies in {folder}, which the detectors can read; move it elsewhere'
                )

    def start(self, code: Code) -> 'DetectorProcess':
        """Start a process with a detector of its own, for one machine."""
        ours, theirs = _pair(socket.SOCK_SEQPACKET)
        paths = [str(path) for path in (*readable(), *code.read)]
        order = json.dumps({'target': code.target, 'read': paths, 'path': code.path}).encode()
        if len(order) > LONGEST_ORDER:
            raise ProcessError('the folders that detectors may read have too long names')
        with theirs:
            socket.send_fds(self._control, [order], [theirs.fileno()])
        _, (watch,), _, _ = socket.recv_fds(self._control, 64, 1)
        return DetectorProcess(ours, watch, self._silence_s)


class DetectorProcess:
    """The detector of one machine, in its process.

    `alarm_score` is the detector's own. `failure` says in a sentence why it can do nothing more,
    '' while it can.
    """

    def __init__(self, control: socket.socket, watch: int, silence_s: float) -> None:
        self._control = control
        self._watch = watch
        self._silence_s = silence_s
        self._stream: Stream | None = None
        made = _receive_line(control)
        self.failure: str = made.get('failure', '' if made else 'its process died at the start')
        self.alarm_score = float(made.get('alarm_score', math.nan))

    def fit(self) -> 'Stream':
        """Return the stream for the reference flights."""
        return self._open(FIT)

    def flight(self) -> 'Stream':
        """Return the stream for a flight under test, judged by a copy of the fitted detector."""
        return self._open(FLIGHT)

    def _open(self, kind: bytes) -> 'Stream':
        ours, theirs = _pair(socket.SOCK_STREAM)
        with theirs:
            if not self.failure:
                try:
                    socket.send_fds(self._control, [kind], [theirs.fileno()])
                except OSError:
                    self.failure = 'its process died'
        self._stream = Stream(ours, self._silence_s, self.failure)
        return self._stream

    def close(self) -> None:
        """End the process, whatever it is doing, and what is open to it."""
        if self._stream is not None:
            self._stream.close()
        self._control.close()
        with contextlib.suppress(ProcessLookupError):
            signal.pidfd_send_signal(self._watch, signal.SIGKILL)
        os.close(self._watch)


class Stream:
    """Blocks to a detector, verdicts back; a failure ends it and is never raised.

    `verdicts` holds what has come back and has not been taken: (number of the block, score,
    evidence, '' where the score is not the largest so far).
    """

    def __init__(self, connection: socket.socket, silence_s: float, failure: str = '') -> None:
        self._connection = connection
        self._connection.settimeout(silence_s)
        self._silence_s = silence_s
        self._replies = bytearray()
        self._blocks = 0
        self._judged = 0
        self._done = False
        self.failure = failure
        self.verdicts: collections.deque[tuple[int, float, str]] = collections.deque()

    def send(self, block: WaveformBlock) -> None:
        """Send an anonymous block, and take what has come back by now."""
        self._blocks += 1
        if not self._is_open():
            return
        with self._failing():
            wire.send_block(self._connection, block)
            while self._is_open() and self._has_news(0.0):
                self._take()

    def end_flight(self) -> None:
        """Send the end of a reference flight."""
        if self._is_open():
            with self._failing():
                wire.send_end(self._connection, wire.END_OF_FLIGHT)

    def finish(self) -> None:
        """Send the end, wait for what is still to come, and close."""
        if self._is_open():
            with self._failing():
                wire.send_end(self._connection, wire.END_OF_STREAM)
        while self._is_open():
            with self._failing():
                self._take()
        self.close()

    def close(self) -> None:
        """Close the connection; nothing comes back any more."""
        self._connection.close()

    def _is_open(self) -> bool:
        return not (self._done or self.failure)

    @contextlib.contextmanager
    def _failing(self) -> Iterator[None]:
        """Turn what can go wrong with the socket into the failure of the detector."""
        try:
            yield
        except TimeoutError:
            self.failure = f'it did not answer within {self._silence_s:g} s'
        except OSError:
            # it is gone; what it said before counts
            with contextlib.suppress(OSError):
                while self._is_open() and self._has_news(0.1):
                    self._take()
            if self._is_open():
                self.failure = 'its process died'

    def _has_news(self, wait_s: float) -> bool:
        return bool(select.select([self._connection], [], [], wait_s)[0])

    def _take(self) -> None:
        data = self._connection.recv(65_536)
        if not data:
            raise ConnectionResetError
        self._replies += data
        for reply in wire.take_replies(self._replies):
            if reply.kind == wire.VERDICT:
                self.verdicts.append((self._judged, reply.score, reply.text))
                self._judged += 1
            elif reply.kind == wire.DONE:
                self._done = True
            else:
                self.failure = reply.text


def _pair(kind: int) -> tuple[socket.socket, socket.socket]:
    return socket.socketpair(socket.AF_UNIX, kind)


def _receive_line(control: socket.socket) -> dict[str, Any]:
    """Return what the other side says once, nothing where it dies or says nothing in time."""
    control.settimeout(START_S)
    try:
        line = control.recv(LONGEST_ORDER)
    except OSError:
        return {}
    control.settimeout(None)
    content: dict[str, Any] = json.loads(line) if line else {}
    return content
