# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""What happens to the others and to the recording when a process gets a signal."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from rig_support import CLI, private_environment
from rotor_interfaces.exit_code import ExitCode
from vibration_monitor.reading import Recording

NODES = {
    'rotor_sim': 'rotor_sim.node',
    'maneuver_gen': 'maneuver_gen.node',
    'vibration_monitor': 'vibration_monitor.node',
    'recorder': 'vibration_monitor.recorder_node',
}
pytestmark = [pytest.mark.slow, pytest.mark.real_time]


class Rig:
    """A live rig under way, started for one test."""

    def __init__(self, folder: Path, *options: str) -> None:
        self.folder = folder
        self.process = subprocess.Popen(
            [*CLI, 'run', '--duration', '60', '--record', str(folder), *options],
            env=private_environment(folder / 'log'),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def wait_until_recording(self, seconds: float = 2.0) -> None:
        """Return when the recording holds about `seconds` of the run."""
        deadline = time.monotonic() + 60.0
        while time.monotonic() < deadline:
            files = list(self.folder.glob('climb_dive-*/*.mcap.active'))
            if files and files[0].stat().st_size > seconds * 700_000:
                return
            assert self.process.poll() is None, self.process.communicate()
            time.sleep(0.05)
        raise AssertionError('the recording did not grow')

    def children(self) -> dict[str, int]:
        """Return the pids of the node processes by name."""
        found: dict[str, int] = {}
        for entry in Path('/proc').iterdir():
            if not entry.name.isdigit():
                continue
            try:
                status = (entry / 'status').read_text()
                command = (entry / 'cmdline').read_text().split('\0')
            except OSError:
                continue
            if f'PPid:\t{self.process.pid}\n' in status:
                found |= {
                    name: int(entry.name) for name, module in NODES.items() if module in command
                }
        return found

    def finish(self, timeout_s: float = 150.0) -> tuple[int, str]:
        """Wait for the end; return exit code and what was said."""
        out, err = self.process.communicate(timeout=timeout_s)
        return self.process.returncode, out + err

    def bag(self) -> Path:
        """Return the bag folder."""
        return next(self.folder.glob('climb_dive-*'))


Start = Callable[..., Rig]


@pytest.fixture
def started(tmp_path: Path) -> Iterator[Start]:
    rigs: list[Rig] = []

    def start(*options: str) -> Rig:
        rigs.append(Rig(tmp_path, *options))
        return rigs[-1]

    yield start
    for rig in rigs:
        if rig.process.poll() is None:
            rig.process.kill()
            rig.process.communicate()


def assert_gone(pids: dict[str, int]) -> None:
    """Every process has ended (or belongs to somebody else by now) within 5 s."""
    deadline = time.monotonic() + 5.0
    while True:
        alive = [
            name
            for name, pid in pids.items()
            if Path(f'/proc/{pid}/cmdline').exists()
            and NODES[name].encode() in Path(f'/proc/{pid}/cmdline').read_bytes()
        ]
        if not alive:
            return
        assert time.monotonic() < deadline, f'still running: {alive}'
        time.sleep(0.1)


def assert_complete(bag: Path) -> None:
    """The recording is finalised and readable without loss."""
    assert not list(bag.glob('*.active'))
    assert (bag / 'metadata.yaml').exists()
    recording = Recording(bag)
    counts = recording.message_counts
    assert counts['/rotor/waveform'] > 10
    assert not recording.damage


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize('options', [(), ('--composed',)])
def test_a_signal_to_the_rig_ends_everything_cleanly(
    started: Start, number: signal.Signals, options: tuple[str, ...]
) -> None:
    rig = started(*options)
    rig.wait_until_recording()
    pids = rig.children()
    rig.process.send_signal(number)
    code, said = rig.finish()
    assert code == 130, said
    assert 'Traceback' not in said
    assert_gone(pids)
    assert_complete(rig.bag())


@pytest.mark.parametrize('delay_s', [0.05, 0.4, 1.5])
def test_ctrl_c_before_the_run_has_begun(started: Start, delay_s: float) -> None:
    rig = started()
    while not rig.children():
        assert rig.process.poll() is None
        time.sleep(0.01)
    time.sleep(delay_s)
    pids = rig.children()
    rig.process.send_signal(signal.SIGINT)
    code, said = rig.finish()
    assert code == 130, said
    assert 'Traceback' not in said
    assert_gone(pids)


NODE = """
import sys

from interrupting import interrupt_myself
from rotor_interfaces import ros

sys.exit(ros.run(interrupt_myself, has_end=True))
"""
COMMAND = """
import typer
from rich.console import Console

from interrupting import interrupt_myself
from rotor_bringup.progress import interruptible


def main() -> None:
    with interruptible(Console(), 'work', None, quiet=True):
        interrupt_myself()


typer.run(main)
"""
# numba, pydantic and dataclasses build their classes and functions with exec()
IN_EXEC = """
def interrupt_myself():
    exec('import os, signal; os.kill(os.getpid(), signal.SIGINT)')
"""
# as the callback of llvmlite does with which numba stores what it compiled
SWALLOWED = """
import ctypes, os, signal, time


@ctypes.CFUNCTYPE(None)
def callback():
    os.kill(os.getpid(), signal.SIGINT)


def interrupt_myself():
    callback()
    time.sleep(50.0)
"""
# as numba does where that callback brought nothing
AS_ANOTHER_ERROR = """
import os, signal


def interrupt_myself():
    try:
        os.kill(os.getpid(), signal.SIGINT)
    except KeyboardInterrupt:
        raise RuntimeError('no compiled object yet')
"""


@pytest.mark.parametrize('program', [NODE, COMMAND], ids=['node', 'command'])
@pytest.mark.parametrize(
    'interrupting',
    [IN_EXEC, SWALLOWED, AS_ANOTHER_ERROR],
    ids=['in exec', 'swallowed', 'as another error'],
)
def test_ctrl_c_keeps_its_exit_code_whatever_it_hits(
    tmp_path: Path, program: str, interrupting: str
) -> None:
    (tmp_path / 'interrupting.py').write_text(interrupting)
    (tmp_path / 'interrupted.py').write_text(program)
    ended = subprocess.run(
        [sys.executable, '-m', 'interrupted'],
        cwd=tmp_path,
        env=private_environment(tmp_path / 'log'),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=40.0,
        check=False,
    )
    assert ended.returncode == ExitCode.INTERRUPTED, ended.stderr
    assert ended.stderr == ''


def hears(pid: int, number: signal.Signals) -> bool:
    """Say whether a process has a handler for a signal."""
    status = Path(f'/proc/{pid}/status').read_text()
    caught = int(status.split('SigCgt:')[1].split()[0], 16)
    return bool(caught >> (number - 1) & 1)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize('module', ['rotor_sim.node', 'rotor_bringup.composed'])
def test_a_signal_ends_a_node_that_still_compiles(
    tmp_path: Path, module: str, number: signal.Signals
) -> None:
    cache = tmp_path / 'cache'
    with subprocess.Popen(
        [sys.executable, '-m', module],
        env={**private_environment(tmp_path / 'log'), 'NUMBA_CACHE_DIR': str(cache)},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    ) as process:
        while not hears(process.pid, signal.SIGTERM):
            assert process.poll() is None
            time.sleep(0.01)
        time.sleep(1.0)
        assert not list(cache.rglob('_kernels.integrate-*.nbc')), 'compiled already'
        process.send_signal(number)
        started = time.monotonic()
        said, _ = process.communicate(timeout=60.0)
        elapsed_s = time.monotonic() - started
    assert (process.returncode, said) == (130, '')
    assert not list(cache.rglob('_kernels.integrate-*.nbc'))
    assert elapsed_s < 10.0  # the whole takes 20 to 50 s


@pytest.mark.parametrize('victim', NODES)
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_dead_process_ends_the_run_with_its_name(
    started: Start, victim: str, number: signal.Signals
) -> None:
    rig = started()
    rig.wait_until_recording()
    pids = rig.children()
    assert set(pids) == set(NODES)
    os.kill(pids[victim], number)
    code, said = rig.finish()
    assert code == 3, said
    assert victim in said
    assert 'Traceback' not in said
    assert_gone(pids)
    if victim != 'recorder' or number != signal.SIGKILL:
        assert_complete(rig.bag())
    else:
        recording = Recording(rig.bag())
        assert recording.message_counts['/rotor/waveform'] > 10
        assert recording.damage, 'a truncated recording must say so'


def test_a_killed_rig_leaves_no_process_behind(started: Start) -> None:
    rig = started()
    rig.wait_until_recording()
    pids = rig.children()
    assert len(pids) == len(NODES)
    rig.process.kill()
    rig.process.communicate()
    assert_gone(pids)
    assert_complete(rig.bag())
