# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Runs each detector in an isolated process; `detector_process` is the code in that process.

The processes are forked from a server that was started afresh with a clean environment, before it
could hear of anything, so they inherit no memory, argument, variable, descriptor or folder of the
evaluation. Each fit and each flight under test has a fresh one, with the restrictions (`walls`)
that this machine allows.
"""

import importlib.machinery
import importlib.util
import json
import os
import shutil
import site
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Self

from rotor_bench.evaluation.detector_process import FIT, FLIGHT, LONGEST_ORDER, PROBE
from rotor_bench.evaluation.exchange import START_S, Stream
from rotor_bench.evaluation.walls import Walls
from rotor_common.errors import ConfigError, ProcessError
from vibration_monitor.detectors.protocol import detector_target

SILENCE_S = 60.0
"""Longest time that a detector may take for a block, or for the end of its fit."""

_SYSTEM = ('/lib', '/lib64', '/usr/lib', '/usr/lib64', '/usr/local/lib', '/usr/share/zoneinfo',
           '/etc/ld.so.cache', '/etc/localtime', '/dev/urandom')  # fmt: skip
_OWN = ('rotor_common', 'rotor_interfaces', 'rotor_recording', 'vibration_monitor')
_ENVIRONMENT = {
    'LANG': 'C.UTF-8',
    'PATH': os.defpath,
    'PYTHONDONTWRITEBYTECODE': '1',
    'PYTHONHASHSEED': '0',
    # one core per detector, and no thread pool that a fork would break
    **dict.fromkeys(
        ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS', 'NUMBA_NUM_THREADS'), '1'
    ),
    '_ROS_WHEELS_BOOTSTRAP_COMPLETE': '1',  # no second start for the sake of ROS libraries
}


class Code:
    """Location of a detector's code: `target` to load, `read` and `path` to read it from.

    A module among the packages of Python is read there. Any other is copied, so that the files
    beside it are not visible; the current folder is searched as well.
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
    """The server that forks the processes of detectors; end it by `close` or as a context.

    `walls` are the restrictions of each of these processes.
    """

    def __init__(self, parent: Path, silence_s: float = SILENCE_S) -> None:
        """Start the server with a folder in `parent`; raises ProcessError where it fails."""
        self.walls: Walls | None = None
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
                [sys.executable, '-P', '-s', '-m', 'rotor_bench.evaluation.detector_process'],
                stdin=theirs.fileno(),
                stdout=subprocess.DEVNULL,
                stderr=log,
                cwd=workplace,
                env=environment,
                start_new_session=True,
            )
        try:
            self._control.settimeout(START_S)
            if self._received() != b'ready':
                words = (self._folder / 'server.log').read_text('utf-8', 'replace').strip()
                raise ProcessError(f'the server of detectors did not start: {words[-300:]}')
            probe = self.open(PROBE)
            probe.begin()
            probe.close()
            if not probe.walls:
                raise ProcessError(f'the server of detectors does not work: {probe.failure}')
            self.walls = probe.walls
        except BaseException:  # Ctrl-C too
            self.close()
            raise

    def _received(self) -> bytes:
        """Return the server's answer, b'' if it dies or does not answer in time."""
        try:
            return self._control.recv(LONGEST_ORDER)
        except OSError:
            return b''

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
        """Return the location of a detector's code; raises as `Code`."""
        return Code(name, self._folder / 'code' / name.replace(':', '_'))

    def check_secret(self, place: Path, codes: Iterable[Code]) -> None:
        """Raise ConfigError if a folder that the detectors may read holds `place`."""
        secret = place.resolve()
        for folder in [*readable(), *(code.origin for code in codes)]:
            if secret.is_relative_to(folder.resolve()):
                raise ConfigError(
                    f'{place} lies in {folder}, which the detectors can read; move it elsewhere'
                )

    def start(self, code: Code) -> 'DetectorProcess':
        """Make the detector of one machine, in a process that can be fitted."""
        return DetectorProcess(self, code)

    def open(self, kind: str, code: Code | None = None) -> Stream:
        """Start a process of `kind` and return the stream to it.

        Raises:
            ProcessError: the server is gone, or the folders have too long names.

        """
        paths = [str(path) for path in (*readable(), *(code.read if code else ()))]
        order = json.dumps(
            {
                'kind': kind,
                'read': paths,
                'target': code.target if code else '',
                'path': code.path if code else [],
            }
        ).encode()
        if len(order) > LONGEST_ORDER:
            raise ProcessError('the folders that detectors may read have too long names')
        ours, theirs = _pair(socket.SOCK_STREAM)
        leash, its_leash = _pair(socket.SOCK_STREAM)
        with theirs, its_leash:
            try:
                socket.send_fds(self._control, [order], [theirs.fileno(), its_leash.fileno()])
            except OSError as error:
                ours.close()
                leash.close()
                raise ProcessError(f'the server of detectors is gone: {error.strerror}') from None
        return Stream(ours, leash, self._silence_s, is_fit=kind == FIT, expected=self.walls)


class DetectorProcess:
    """The detector of one machine: a process that is fitted, then a fresh one for each flight.

    `alarm_score` is the detector's own. `failure` says in a sentence why it cannot go on, '' while
    it can.
    """

    def __init__(self, sandbox: Sandbox, code: Code) -> None:
        self._sandbox = sandbox
        self._code = code
        self._fit = self._stream = sandbox.open(FIT, code)
        self._fit.begin()
        # once it is made, the stream reports a failure of its fit
        self.failure: str = '' if self._fit.is_made else self._fit.failure
        self.alarm_score = self._fit.alarm_score

    def fit(self) -> Stream:
        """Return the stream for the reference flights."""
        return self._fit

    def flight(self) -> Stream:
        """Return the stream for a flight under test, judged by a copy of the fitted detector."""
        self._stream.close()
        if not self._fit.learnt:
            self._fit.failure = self._fit.failure or 'it was not fitted'
        if self.failure or self._fit.failure:
            self._fit.failure = self.failure or self._fit.failure
            return self._fit
        self._stream = self._sandbox.open(FLIGHT, self._code)
        self._stream.teach(self._fit.learnt)
        return self._stream

    def close(self) -> None:
        """End the process, whatever it is doing, and what it has started."""
        self._stream.close()


def _pair(kind: int) -> tuple[socket.socket, socket.socket]:
    return socket.socketpair(socket.AF_UNIX, kind)
