# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""What killed processes leave is removed; what is in use, or somebody else's, never is."""

import fcntl
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from rotor_common import leftovers
from rotor_common.leftovers import OwnFolder, remove_leftovers

SEGMENT = 'fastrtps_0123456789abcdef'
PORT = 'fastrtps_port7411'


@pytest.fixture
def memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Stand in for /dev/shm, and let the temporary directory be empty."""
    folder = tmp_path / 'shm'
    folder.mkdir()
    (tmp_path / 'tmp').mkdir()
    monkeypatch.setattr(leftovers, 'SHARED_MEMORY', folder)
    monkeypatch.setattr(tempfile, 'tempdir', str(tmp_path / 'tmp'))
    return folder


@pytest.fixture
def old(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(leftovers, 'YOUNG_S', -1.0)


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def put(folder: Path, *files: str) -> None:
    for name in files:
        (folder / name).write_bytes(b'x')


@pytest.mark.usefixtures('old')
def test_segments_and_ports_without_a_holder_go(memory: Path) -> None:
    zombies = {SEGMENT, f'{SEGMENT}_el', PORT, f'{PORT}_el', f'{PORT}_sl', f'sem.{PORT}_mutex'}
    others = {'fastrtps_notes', 'fastrtps_port7411_el.bak', 'sem.x', f'{SEGMENT}0_el', 'x_el'}
    put(memory, *zombies, *others)
    assert {path.name for path in remove_leftovers()} == zombies
    assert names(memory) == others


@pytest.mark.usefixtures('old')
@pytest.mark.parametrize('kind', [fcntl.LOCK_EX, fcntl.LOCK_SH])
@pytest.mark.parametrize('lock', ['el', 'sl'])
def test_one_held_lock_keeps_all_of_a_port(memory: Path, lock: str, kind: int) -> None:
    put(memory, PORT, f'{PORT}_el', f'{PORT}_sl', f'sem.{PORT}_mutex')
    before = names(memory)
    with (memory / f'{PORT}_{lock}').open('rb') as holder:
        fcntl.flock(holder, kind)
        assert remove_leftovers() == []
        assert names(memory) == before


def test_what_has_just_been_made_stays(memory: Path) -> None:
    put(memory, SEGMENT, f'{SEGMENT}_el')
    assert remove_leftovers() == []
    assert names(memory) == {SEGMENT, f'{SEGMENT}_el'}


@pytest.mark.usefixtures('old')
def test_what_is_somebody_elses_stays(memory: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    abandoned = killed_owner()
    put(memory, SEGMENT, f'{SEGMENT}_el')
    uid = os.getuid()
    monkeypatch.setattr(os, 'getuid', lambda: uid + 1)
    assert remove_leftovers() == []
    assert abandoned.is_dir()
    assert names(memory) == {SEGMENT, f'{SEGMENT}_el'}


@pytest.mark.usefixtures('old')
def test_a_link_is_not_followed(memory: Path, tmp_path: Path) -> None:
    put(tmp_path, 'mine')
    (memory / f'{SEGMENT}_el').symlink_to(tmp_path / 'mine')
    (tmp_path / 'tmp' / 'rotor-rig-link').symlink_to(killed_owner(), target_is_directory=True)
    remove_leftovers()
    assert (tmp_path / 'mine').exists()
    assert (tmp_path / 'tmp' / 'rotor-rig-link').is_symlink()


def killed_owner() -> Path:
    """Return the folder of a process that was killed."""
    code = (
        'import sys, tempfile, time\n'
        'from rotor_common.leftovers import OwnFolder\n'
        'tempfile.tempdir = sys.argv[1]\n'
        'folder = OwnFolder()\n'
        'print(folder.path, flush=True)\n'
        'time.sleep(60)\n'
    )
    with subprocess.Popen(
        [sys.executable, '-c', code, tempfile.gettempdir()], stdout=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        folder = Path(child.stdout.readline().strip())
        assert folder not in remove_leftovers(), 'while it lives'
        assert folder.is_dir()
        child.send_signal(signal.SIGKILL)
    return folder


@pytest.mark.usefixtures('memory')
def test_the_folder_of_a_killed_process_goes_and_no_other(tmp_path: Path) -> None:
    mine = OwnFolder('view-')
    unmarked = Path(tempfile.mkdtemp(prefix='rotor-rig-'))
    foreign = Path(tempfile.mkdtemp(prefix='other-'))
    put(foreign, 'owner')
    abandoned = killed_owner()
    put(abandoned, 'log')
    assert remove_leftovers() == [abandoned]
    assert names(tmp_path / 'tmp') == {mine.path.name, unmarked.name, foreign.name}
    mine.cleanup()
    assert not mine.path.exists()


@pytest.mark.usefixtures('memory')
def test_folders_elsewhere_are_found_where_they_are_made(tmp_path: Path) -> None:
    with OwnFolder('view-', tmp_path) as folder:
        assert folder.parent == tmp_path
        assert remove_leftovers([tmp_path]) == []
    assert not folder.exists()


PARTICIPANTS = """
import os, signal, subprocess, sys, time
from pathlib import Path
from rotor_common import leftovers

assert not list(Path('/dev/shm').iterdir()), 'not a private one'
node = ('import rclpy, time; rclpy.init(); node = rclpy.create_node("a"); '
        'print("up", flush=True); time.sleep(60)')

def start():
    child = subprocess.Popen([sys.executable, '-c', node], stdout=subprocess.PIPE)
    child.stdout.readline()
    return child

def files():
    return {path.name for path in Path('/dev/shm').iterdir() if 'fastrtps' in path.name}

leftovers.YOUNG_S = -1.0
killed = start()
its = files()
alive = start()
both = files()
assert len(its) >= 4 and both > its, (its, both)
assert leftovers.remove_leftovers() == [], 'both live'
killed.send_signal(signal.SIGKILL)
killed.wait()
leftovers.remove_leftovers()
left = files()
assert both - its <= left, 'a file of the living one is gone'
assert not {name for name in its & left if 'port' not in name}, left
alive.send_signal(signal.SIGKILL)
alive.wait()
leftovers.remove_leftovers()
assert not files(), files()
print('done')
"""


def private(command: list[str]) -> list[str]:
    """Return a command that sees a /dev/shm and a network of its own."""
    return [
        'unshare', '--user', '--map-root-user', '--mount', '--net', 'sh', '-c',
        'mount -t tmpfs none /dev/shm && ip link set lo up && exec "$@"', 'sh', *command,
    ]  # fmt: skip


@pytest.fixture
def namespaces() -> None:
    done = subprocess.run(private(['true']), check=False, capture_output=True)
    if done.returncode:
        pytest.skip('no namespaces on this machine')


@pytest.mark.slow
@pytest.mark.usefixtures('namespaces')
def test_the_files_of_a_killed_participant_go_and_not_those_of_a_living_one() -> None:
    done = subprocess.run(
        private([sys.executable, '-c', PARTICIPANTS]),
        check=False, capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert done.stdout.endswith('done\n'), done.stderr
