# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Start the rerun viewer: on this machine only, without usage reports or hangs."""

import contextlib
import importlib.util
import json
import os
import signal
import socket
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from rotor_common.errors import RigError
from rotor_common.leftovers import OwnFolder

LOOPBACK = '127.0.0.1'
START_S = 30.0
STOP_S = 5.0
HEADLESS_MEMORY = '2GiB'
"""A picture needs about a quarter of it; beyond it rerun drops its oldest data."""

LAVAPIPE = Path('/usr/share/vulkan/icd.d')
INSTALL = 'scripts/install_viewer_packages'

_CRASH_WORDS = ('panicked at', 'caught a signal')
"""How the viewer begins its report of a crash, which ends with a stack and an address."""

_ENDING_S = 5.0
"""A crash is noticed by the cut connection, up to this long before the process ends."""

_SILENCE = {
    'RERUN_APP_ONLY': 'true',
    'ALL_PROXY': 'http://127.0.0.1:9',  # its query for a newer version ends here, unanswered
}


class ViewError(RigError):
    """A view that cannot be shown or drawn; one sentence says why and what to do."""


class ViewerEndedError(ViewError):
    """A viewer that ended by itself, such as by a crash; another attempt may succeed."""


class Viewer:
    """A rerun viewer process that listens on 127.0.0.1 alone.

    The binary itself is started, not its Python wrapper: ending the wrapper leaves the viewer
    running. Its own configuration folder turns usage reports off without touching the user's.
    As a context it ends with the block; `leave_open` lets it outlive this process.

    Raises:
        ViewError: it did not start within START_S; the sentence has its last output.

    """

    def __init__(self, arguments: Sequence[str], environment: dict[str, str]) -> None:
        self._folder = OwnFolder('view-')
        folder = self._folder.path
        _usage_reports_off(folder)
        self._words = folder / 'viewer.log'
        port = _free_port()
        self.url = f'rerun+http://{LOOPBACK}:{port}/proxy'
        with self._words.open('wb') as words:
            self._process = subprocess.Popen(
                [_executable(), '--bind', LOOPBACK, '--port', str(port), *arguments],
                env={
                    **os.environ,
                    **_SILENCE,
                    'XDG_CONFIG_HOME': str(folder),
                    'TMPDIR': str(folder),  # it leaves a folder there when it is ended
                    **environment,
                },
                stdin=subprocess.DEVNULL,
                stdout=words,
                stderr=words,
                start_new_session=True,  # this process handles Ctrl-C and ends it
            )
        try:
            self._wait_for_port(port)
        except BaseException:
            self.close()
            raise

    def _wait_for_port(self, port: int) -> None:
        """Wait until the viewer listens: connecting rerun earlier would block for seconds."""
        deadline = time.monotonic() + START_S
        while time.monotonic() < deadline and self.is_running():
            try:
                socket.create_connection((LOOPBACK, port), timeout=1.0).close()
            except OSError:
                time.sleep(0.05)
            else:
                return
        raise self.failure('did not start')

    def failure(self, what: str) -> ViewError:
        """Return the error for a viewer that failed: what, how it ended, its most telling line.

        It is a `ViewerEndedError`, with all the viewer wrote as a note, if the viewer is gone.
        """
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_ENDING_S)
        words = self._words.read_text(errors='replace')
        lines = [line.strip() for line in words.split('\n') if line.strip()]
        crash = [line for line in lines if any(word in line for word in _CRASH_WORDS)]
        telling = (crash or lines[-1:] or ['it said nothing'])[0][:200]
        remedy = '' if crash else f'; {INSTALL} installs what it needs'
        code = self._process.poll()
        if code is None:
            return ViewError(f'the rerun viewer {what} ({telling}){remedy}')
        error = ViewerEndedError(f'the rerun viewer {what}: {_ended(code)} ({telling}){remedy}')
        error.add_note(words)
        return error

    def is_running(self) -> bool:
        """Say whether the viewer is still there (a user may close its window)."""
        return self._process.poll() is None

    def wait(self) -> None:
        """Wait until the user closes the window; raises ViewError if it failed instead."""
        if self._process.wait() != 0:
            raise self.failure('failed')

    def leave_open(self) -> None:
        """Leave the window to the user: neither `close` nor the end of this process ends it."""
        self._folder.cleanup()

    def close(self) -> None:
        """End the viewer."""
        if self.is_running():
            self._process.terminate()
            try:
                self._process.wait(STOP_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._folder.cleanup()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def _ended(code: int) -> str:
    """Return how a process with this return code ended, in words."""
    if code >= 0:
        return f'it ended with code {code}'
    with contextlib.suppress(ValueError):  # not every signal has a name
        return f'it ended by {signal.Signals(-code).name}'
    return f'it ended by signal {-code}'


def require_screen() -> None:
    """Raise ViewError where no window can be opened."""
    if not (os.environ.get('DISPLAY') or os.environ.get('WAYLAND_DISPLAY')):
        raise ViewError(
            'there is no screen to open the view on (neither DISPLAY nor WAYLAND_DISPLAY is '
            'set); write a picture with --screenshot FILE.png or a file with --save FILE.rrd'
        )


def window(arguments: Sequence[str] = ()) -> Viewer:
    """Open the viewer's window; raises ViewError where there is no screen or it fails."""
    require_screen()
    return Viewer(arguments, {})


def headless(arguments: Sequence[str], size: tuple[int, int]) -> Viewer:
    """Start the viewer without a screen, drawing in software, on a page of `size` pixels.

    Raises:
        ViewError: the software renderer is not installed, or the viewer did not start.

    """
    drivers = sorted(LAVAPIPE.glob('lvp_icd*.json'))
    if not drivers:
        raise ViewError(
            'a picture without a screen needs the software renderer of Mesa, which is not '
            f'installed here; run {INSTALL}'
        )
    width, height = size
    return Viewer(
        [
            '--headless',
            '--memory-limit',
            HEADLESS_MEMORY,
            '--window-size',
            f'{width}x{height}',
            *arguments,
        ],
        {
            'WGPU_BACKEND': 'vulkan',
            'VK_DRIVER_FILES': str(drivers[0]),
            'RUST_LOG': 'error',  # else a notice covers a corner of the picture
        },
    )


def _executable() -> str:
    """Return the path of the viewer's binary, a part of the rerun-sdk package."""
    package = importlib.util.find_spec('rerun_cli')
    if package is None or package.origin is None:
        raise ViewError('the rerun viewer is not installed; install the package rerun-sdk')
    return str(Path(package.origin).parent / 'rerun')


def _usage_reports_off(folder: Path) -> None:
    """Write the configuration that `rerun analytics disable` would write, for this viewer only."""
    settings = folder / 'rerun' / 'analytics.json'
    settings.parent.mkdir()
    settings.write_text(
        json.dumps(
            {
                'analytics_enabled': False,
                'analytics_id': '0' * 32,
                'metadata': {},
                'config_file_path': str(settings),
                'data_dir_path': str(folder / 'analytics'),
            }
        )
    )


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        return int(probe.getsockname()[1])
