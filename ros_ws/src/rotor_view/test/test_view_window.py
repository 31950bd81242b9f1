# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The viewer's window, on a screen of its own (Xvfb)."""

import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil  # type: ignore[import-untyped]
import pytest
from rerun.experimental import ViewerClient

import view_flight
from recording_support import private_ros, process
from rotor_interfaces import messages
from rotor_recording.recording import RecordingWriter
from view_pictures import EXPECTED

XVFB = shutil.which('Xvfb')
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        XVFB is None, reason='no Xvfb here; scripts/install_viewer_packages installs it'
    ),
]


@pytest.fixture
def environment(tmp_path: Path) -> Iterator[dict[str, str]]:
    assert XVFB is not None
    with subprocess.Popen(
        [XVFB, '-displayfd', '1', '-screen', '0', '800x500x24', '-nolisten', 'tcp'],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as screen:
        assert screen.stdout is not None
        yield {**private_ros(tmp_path / 'log'), 'DISPLAY': f':{screen.stdout.readline().strip()}'}
        screen.terminate()


def until(condition: Callable[[], bool], timeout_s: float = 300.0) -> bool:
    deadline = time.monotonic() + timeout_s
    while time.monotonic() < deadline:
        if condition():
            return True
        time.sleep(0.2)
    return False


def viewer_of(child: subprocess.Popen[str]) -> psutil.Process:
    def children() -> list[psutil.Process]:
        started = psutil.Process(child.pid).children()
        return [one for one in started if '--port' in one.cmdline()]  # it is the viewer by now

    assert until(lambda: child.poll() is not None or bool(children()))
    (found,) = children()
    return found


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_recording_opens_on_the_views_and_a_signal_closes_it(
    tmp_path: Path, environment: dict[str, str], number: signal.Signals
) -> None:
    environment['TMPDIR'] = str(tmp_path / 'temp')
    (tmp_path / 'temp').mkdir()
    recording = tmp_path / 'flight.mcap'
    with RecordingWriter.single_file(recording) as writer:
        for topic, stamp_ns, message in view_flight.flight(1.0):
            time_ns = stamp_ns or view_flight.EPOCH_NS
            writer.write(topic, messages.to_cdr(message), time_ns, time_ns)
    code = (
        'import pathlib, sys; from rotor_view import view_recording; '
        'view_recording(pathlib.Path(sys.argv[1]))'
    )
    with process(['-c', code, str(recording)], environment) as child:
        viewer = viewer_of(child)
        command = viewer.cmdline()
        port = command[command.index('--port') + 1]
        client = ViewerClient.connect(f'rerun+http://127.0.0.1:{port}/proxy')

        def views_at_the_end() -> set[str]:
            try:
                state = client.get_state()
            except (RuntimeError, OSError):
                return set()
            at_the_end = any(r.current_time == 1_000_000_000 for r in state.recordings)
            return {view.name for view in state.views} if at_the_end else set()

        assert until(lambda: views_at_the_end() == set(EXPECTED))
        child.send_signal(number)
        assert child.wait(300.0) != 0
        assert not psutil.pid_exists(viewer.pid)
    assert list((tmp_path / 'temp').iterdir()) == []


def test_the_node_ends_when_the_user_closes_the_window(environment: dict[str, str]) -> None:
    with process(['-m', 'rotor_view.viewer_node'], environment) as child:
        viewer = viewer_of(child)
        time.sleep(2.0)
        viewer.terminate()
        assert child.wait(300.0) == 0


def test_the_window_outlives_the_run(environment: dict[str, str]) -> None:
    with process(['-m', 'rotor_view.viewer_node'], environment) as child:
        viewer = viewer_of(child)
        time.sleep(3.0)
        child.send_signal(signal.SIGTERM)
        assert child.wait(300.0) == 0
        assert viewer.is_running()
        assert viewer.status() != psutil.STATUS_ZOMBIE
        viewer.terminate()
        assert until(lambda: not viewer.is_running())
