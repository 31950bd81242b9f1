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
from live_flight import NODES, LiveFlight, private_environment, running

from rotor_common.exit_code import ExitCode
from rotor_recording.reading import Recording
from rotor_recording.recovery import recover
from rotor_recording.verification import is_good, verify

pytestmark = pytest.mark.slow


Start = Callable[..., LiveFlight]


@pytest.fixture
def started(tmp_path: Path) -> Iterator[Start]:
    rigs: list[LiveFlight] = []

    def start(*options: str) -> LiveFlight:
        rigs.append(LiveFlight(tmp_path, 'climb_dive', '--duration', '60', *options))
        return rigs[-1]

    yield start
    for rig in rigs:
        rig.close()


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
    rig.wait_until_recording(1.0)
    pids = rig.nodes()
    rig.process.send_signal(number)
    code, said = rig.finish()
    assert code == 130, said
    assert 'Traceback' not in said
    assert not running(pids)
    assert_complete(rig.bag())


@pytest.mark.parametrize('delay_s', [0.05, 0.4, 1.5])
def test_ctrl_c_before_the_run_has_begun(started: Start, delay_s: float) -> None:
    rig = started()
    while not rig.nodes():
        assert rig.process.poll() is None
        time.sleep(0.01)
    time.sleep(delay_s)
    pids = rig.nodes()
    rig.process.send_signal(signal.SIGINT)
    code, said = rig.finish()
    assert code == 130, said
    assert 'Traceback' not in said
    assert not running(pids)


NODE = """
import sys

from interrupting import interrupt_myself
from rotor_interfaces import ros

sys.exit(ros.run(interrupt_myself, has_end=True))
"""
COMMAND = """
import typer

from interrupting import interrupt_myself
from rotor_common.progress import interruptible


def main() -> None:
    with interruptible('work', None, quiet=True):
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
        timeout=300.0,
        check=False,
    )
    assert ended.returncode == ExitCode.INTERRUPTED, ended.stderr
    assert ended.stderr == ('stopped: nothing is done yet\n' if program is COMMAND else '')


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
        assert not list(cache.rglob('engine_*.stream-*.nbc')), 'compiled already'
        process.send_signal(number)
        started = time.monotonic()
        said, _ = process.communicate(timeout=300.0)
        elapsed_s = time.monotonic() - started
    assert (process.returncode, said) == (130, '')
    assert not list(cache.rglob('engine_*.stream-*.nbc'))
    assert elapsed_s < 10.0  # the whole takes 20 to 50 s


@pytest.mark.parametrize(
    ('number', 'victim'),
    [
        *((number, victim) for number in (signal.SIGTERM, signal.SIGKILL) for victim in NODES),
        # to a node the same as SIGTERM, see ros.SIGNALS
        *((signal.SIGINT, victim) for victim in ('rotor_sim', 'recorder')),
    ],
)
def test_a_dead_process_ends_the_run_with_its_name(
    started: Start, victim: str, number: signal.Signals, tmp_path: Path
) -> None:
    rig = started()
    rig.wait_until_recording(1.0)
    pids = rig.nodes()
    assert set(pids) == set(NODES)
    os.kill(pids[victim], number)
    code, said = rig.finish()
    assert code == 3, said
    assert victim in said
    assert 'Traceback' not in said
    assert not running(pids)
    if victim != 'recorder' or number != signal.SIGKILL:
        assert_complete(rig.bag())
    else:
        recording = Recording(rig.bag())
        assert recording.message_counts['/rotor/waveform'] > 10
        assert recording.damage, 'a truncated recording must say so'
        recover(rig.bag(), tmp_path / 'recovered')
        assert is_good(verify(tmp_path / 'recovered'))


def test_a_killed_rig_leaves_no_process_behind(started: Start) -> None:
    rig = started()
    rig.wait_until_recording(1.0)
    pids = rig.nodes()
    assert len(pids) == len(NODES)
    rig.process.kill()
    rig.process.wait()
    assert not running(pids)
    assert_complete(rig.bag())
