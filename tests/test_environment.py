# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Faults of the machine around the rig: it works all the same, or ends in one sentence."""

import fcntl
import mmap
import os
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from live_flight import CLI, private_environment
from typer.testing import CliRunner

from rig_support import RigRun
from rotor_bringup.cli import app
from rotor_common import machine_code
from rotor_interfaces import access, dds

pytestmark = pytest.mark.slow

Command = Callable[..., RigRun]
REPLAY = '$RIG replay recording.mcap --rate 20'
REPLAYED = 'messages published'
TABLES = ['analyze recording.mcap', 'scenario list']
HELP_PAGES = ['', 'run', 'view', 'import', 'dataset', 'evaluate', 'paper', 'orbit-diagram']


@pytest.fixture(scope='session')
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a short recording."""
    path = tmp_path_factory.mktemp('machine')
    arguments = ['simulate', '--duration', '3', '--out', 'recording.mcap']
    subprocess.run([*CLI, *arguments], cwd=path, check=True, capture_output=True, timeout=200)
    return path


@pytest.fixture
def command(folder: Path, tmp_path: Path) -> Command:
    """Run a line of bash, in which $RIG is `rotor-rig`, with variables set, or unset by None."""

    def run(line: str, *, mounts: bool = False, **variables: str | None) -> RigRun:
        private = private_environment(tmp_path / 'log')
        changed = {**private, 'RIG': shlex.join(CLI), 'PYTHON': sys.executable, **variables}
        in_private = ['unshare', '--map-root-user', '--mount'] if mounts else []
        done = subprocess.run(
            [*in_private, 'bash', '-c', line.replace('$RIG', shlex.join(CLI))],
            env={name: value for name, value in changed.items() if value is not None},
            cwd=folder,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
        return RigRun(done.returncode, done.stdout, done.stderr)

    return run


def can_mount() -> bool:
    line = 'mount -t tmpfs tmpfs /dev/shm'
    done = subprocess.run(
        ['unshare', '--map-root-user', '--mount', 'bash', '-c', line],
        check=False,
        capture_output=True,
    )
    return done.returncode == 0


needs_mounts = pytest.mark.skipif(not can_mount(), reason='needs a mount of its own')


def assert_sentence(done: RigRun, *wanted: str, code: int = 2) -> None:
    """The command has ended with this code and one sentence that contains the words."""
    assert done.code == code, (done.out, done.err)
    assert [line for line in done.err.splitlines() if line.startswith('error: ')], done.err
    assert 'Traceback' not in done.err
    for word in wanted:
        assert word in done.err


@pytest.mark.parametrize('home', ['/proc/none', None])
def test_a_home_that_cannot_be_written(command: Command, home: str | None) -> None:
    done = command(REPLAY, HOME=home, ROS_LOG_DIR=None)
    assert (done.code, done.err) == (0, '')
    assert REPLAYED in done.out


def test_a_log_folder_is_removed_at_the_end(command: Command, tmp_path: Path) -> None:
    done = command(REPLAY, ROS_LOG_DIR='', TMPDIR=str(tmp_path))
    assert done.code == 0
    assert list(tmp_path.iterdir()) == []


VARIABLES = {
    'ROS_LOG_DIR': ('/proc/none', ['another folder', 'unset']),
    'FASTRTPS_DEFAULT_PROFILES_FILE': ('/none.xml', ['unset']),
    'ROS_AUTOMATIC_DISCOVERY_RANGE': ('OFF', ['LOCALHOST, SUBNET, SYSTEM_DEFAULT', 'find']),
    'RMW_IMPLEMENTATION': ('rmw_cyclonedds_cpp', ['not installed', 'rmw_fastrtps_cpp']),
    'ROS_DOMAIN_ID': ('\u0663', ['0 to 232']),
}


@pytest.mark.parametrize('name', VARIABLES)
@pytest.mark.parametrize('what', ['replay', 'run', 'node'])
def test_a_variable_that_cannot_work(
    command: Command, tmp_path: Path, name: str, what: str
) -> None:
    value, wanted = VARIABLES[name]
    lines = {
        'replay': REPLAY,
        'run': f'$RIG run --duration 1 --record {tmp_path}',
        'node': '"$PYTHON" -m vibration_monitor.node',
    }
    done = command(lines[what], **{name: value})
    assert_sentence(done, f'{name} = {value!r}', *wanted)
    assert len(done.err.splitlines()) == 1


def test_an_unknown_range(command: Command) -> None:
    assert_sentence(
        command(REPLAY, ROS_AUTOMATIC_DISCOVERY_RANGE='localhost'), "RANGE = 'localhost'"
    )


def test_empty_variables_are_as_none(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    names = ['ROS_DOMAIN_ID', 'ROS_AUTOMATIC_DISCOVERY_RANGE', 'RMW_IMPLEMENTATION', 'ROS_LOG_DIR']
    assert command(REPLAY, **dict.fromkeys(names, '')).code == 0
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', '')
    monkeypatch.delenv('FASTRTPS_DEFAULT_PROFILES_FILE', raising=False)
    access.keep_on_this_machine()
    profile = os.environ['FASTRTPS_DEFAULT_PROFILES_FILE']
    assert profile == str(access.LOOPBACK_PROFILE), 'not the whole subnet'


FULL = 'mount -t tmpfs -o size=64k tmpfs /dev/shm && head -c 65536 /dev/zero >/dev/shm/f && exec '


@needs_mounts
@pytest.mark.parametrize(
    'line',
    [
        REPLAY,
        '$RIG run --duration 1 --record /tmp',
        '"$PYTHON" -m rotor_sim.node',
        '"$PYTHON" -m maneuver_gen.node',
        '"$PYTHON" -m rotor_recording.recorder_node',
        '"$PYTHON" -m rotor_bringup.composed',
    ],
)
def test_shared_memory_that_is_full(command: Command, line: str) -> None:
    done = command(FULL + line, mounts=True)
    assert_sentence(done, f'{dds.SHARED_MEMORY} has 0 KiB free', '1024 KiB', 'fastdds shm clean')


@needs_mounts
def test_shared_memory_too_small_for_all_processes(command: Command, tmp_path: Path) -> None:
    line = 'mount -t tmpfs -o size=3m tmpfs /dev/shm && exec '
    done = command(f'{line} $RIG run --duration 1 --record {tmp_path}', mounts=True)
    assert_sentence(done, 'KiB free', '5120 KiB')


def test_a_process_that_shared_memory_ended_is_told_in_words(tmp_path: Path) -> None:
    from rotor_bringup.processes import ProcessGroup, ProcessPlan
    from rotor_common.errors import ProcessError

    (tmp_path / 'dying.py').write_text('import os, signal; os.kill(os.getpid(), signal.SIGBUS)')
    group = ProcessGroup([ProcessPlan('monitor', 'dying')], {}, tmp_path)
    before = os.environ.get('PYTHONPATH', '')
    os.environ['PYTHONPATH'] = str(tmp_path)
    try:
        group.start()
    finally:
        os.environ['PYTHONPATH'] = before
    os.waitid(os.P_PID, group.pids()['monitor'], os.WEXITED | os.WNOWAIT)
    with pytest.raises(ProcessError, match='monitor was ended by SIGBUS: /dev/shm has run full'):
        group.has_ended('monitor')


@needs_mounts
@pytest.mark.parametrize('size', ['4k', '64k', '1m'])
def test_a_view_on_a_full_disk(command: Command, tmp_path: Path, size: str) -> None:
    line = f'mount -t tmpfs -o size={size} tmpfs {tmp_path} && timeout -s KILL 60 '
    done = command(f'{line} $RIG view recording.mcap --save {tmp_path}/x.rrd', mounts=True)
    assert_sentence(done, 'No space left on device', str(tmp_path))


@needs_mounts
@pytest.mark.parametrize(
    'verb',
    ['simulate --duration 5 --out FOLDER/a.mcap', 'analyze recording.mcap --out FOLDER/a.csv'],
)
def test_a_file_on_a_full_disk(command: Command, tmp_path: Path, verb: str) -> None:
    line = f'mount -t tmpfs -o size=4k tmpfs {tmp_path} && '
    done = command(f'{line} $RIG {verb.replace("FOLDER", str(tmp_path))}', mounts=True)
    assert_sentence(done, 'No space left on device')


@pytest.mark.parametrize(
    'verb',
    ['--help', 'scenario list', 'scenario show turn', 'analyze recording.mcap --json'],
)
def test_output_that_takes_nothing(command: Command, verb: str) -> None:
    done = command(f'$RIG {verb} >/dev/full')
    assert_sentence(done, 'cannot be written: No space left on device')


def test_a_replay_whose_summary_cannot_be_written(command: Command) -> None:
    assert_sentence(command(f'{REPLAY} >/dev/full'), 'cannot be written')


@pytest.mark.parametrize('verb', ['--help', *TABLES, 'scenario show turn'])
def test_a_reader_that_has_had_enough(command: Command, verb: str) -> None:
    done = command(f'$RIG {verb} | head -c 1; exit "${{PIPESTATUS[0]}}"')
    assert (done.code, done.err) == (0, '')


@pytest.mark.parametrize('closed', ['<&-', '>&-', '2>&-', '<&- >&- 2>&-'])
def test_closed_streams(command: Command, closed: str) -> None:
    done = command(f'$RIG analyze recording.mcap --out closed.json {closed}')
    assert (done.code, done.err) == (0, '')
    assert command(f'$RIG analyze none.mcap {closed}').code == 2


def test_remarks_that_nobody_takes(command: Command) -> None:
    assert command('$RIG scenario show none 2>/dev/full').code == 2


@pytest.mark.parametrize('verb', ['--help', 'scenario list', 'analyze recording.mcap'])
def test_a_folder_that_was_removed(command: Command, verb: str) -> None:
    done = command(f'mkdir gone && cd gone && rmdir ../gone && $RIG {verb}')
    assert_sentence(done, 'has been removed', 'change to another')


@pytest.mark.parametrize('line', TABLES)
def test_tables_on_a_narrow_terminal_lose_nothing(
    folder: Path, monkeypatch: pytest.MonkeyPatch, line: str
) -> None:
    monkeypatch.chdir(folder)

    def shown(columns: str) -> str:
        return CliRunner().invoke(app, shlex.split(line), env={'COLUMNS': columns}).stdout

    def letters(text: str) -> list[str]:
        return sorted(letter for letter in text if letter.isalnum())

    wide = letters(shown('200'))
    assert len(wide) > 100
    for columns in ('30', '40', '60'):
        narrow = shown(columns)
        assert '\u2026' not in narrow
        assert letters(narrow) == wide


@pytest.mark.parametrize('verb', HELP_PAGES)
def test_help_on_a_narrow_terminal_loses_nothing(command: Command, verb: str) -> None:
    done = command(f'$RIG {verb} --help', COLUMNS='40')
    assert done.code == 0
    assert '\u2026' not in done.out


@pytest.mark.parametrize('columns', ['0', 'abc', ''])
def test_a_width_that_is_none(command: Command, columns: str) -> None:
    assert 'climb_dive_healthy' in command('$RIG scenario list', COLUMNS=columns).out


def test_the_live_table_on_a_narrow_terminal_loses_nothing() -> None:
    from rich.console import Console

    from rotor_bringup.display import Display, RunState

    state = RunState(20.0, level='WARN', reasons='disk_z/amplitude_order_3 above its limit')
    console = Console(width=40, record=True)
    console.print(Display(state, console)._table())
    shown = ''.join(console.export_text().split())
    assert '\u2026' not in shown
    assert 'amplitude_o' in shown


def test_a_terminal_without_unicode(command: Command) -> None:
    done = command('$RIG scenario list', PYTHONIOENCODING='ascii', LC_ALL='C', TERM='dumb')
    assert (done.code, done.err) == (0, '')
    done = command('$RIG analyze \u00e9\u672c.mcap', PYTHONIOENCODING='ascii')
    assert_sentence(done, r'\xe9\u672c.mcap')


def test_machine_code_is_kept_only_where_it_can_be(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    nowhere = '/proc/none/source.py'
    monkeypatch.setenv('NUMBA_CACHE_DIR', '')
    monkeypatch.setenv('XDG_CACHE_HOME', '/proc/none')
    assert not machine_code.can_be_kept(nowhere)
    assert machine_code.can_be_kept(str(tmp_path / 'source.py'))
    monkeypatch.setenv('NUMBA_CACHE_DIR', str(tmp_path / 'cache'))
    assert machine_code.can_be_kept(nowhere)


@pytest.fixture
def seen_by_another(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Stand-in for /dev/shm, mapped into this process, which runs as another user."""
    me = os.geteuid()
    segment = tmp_path / 'fastrtps_0123456789abcdef'
    segment.write_bytes(bytes(4096))
    monkeypatch.setattr(dds, 'SHARED_MEMORY', tmp_path)
    monkeypatch.setattr(os, 'geteuid', lambda: me + 1)
    monkeypatch.setenv('ROS_DOMAIN_ID', '7')
    with segment.open('r+b') as file, mmap.mmap(file.fileno(), 4096):
        yield tmp_path


def test_another_user_in_the_domain_is_noticed(seen_by_another: Path) -> None:
    owner = seen_by_another.stat().st_uid
    lock = seen_by_another / f'fastrtps_port{7400 + 250 * 7 + 11}_el'
    with lock.open('wb') as file:
        assert dds.other_users() == [], 'what a killed process has left'
        fcntl.flock(file, fcntl.LOCK_EX)
        assert dds.other_users() == [owner]
        os.environ['ROS_DOMAIN_ID'] = '8'
        assert dds.other_users() == []
    assert f'uid {owner}' in dds.warning_about([owner])


STRANGER = """
import rclpy, time
rclpy.init()
node = rclpy.create_node('stranger')
print('there', flush=True)
while rclpy.ok():
    time.sleep(0.1)
"""


@pytest.mark.skipif(os.geteuid() != 0, reason='only root can be another user')
def test_another_user_is_warned_about(command: Command, tmp_path: Path) -> None:
    logs = tmp_path / 'stranger'
    logs.mkdir()
    logs.chmod(0o777)
    (tmp_path / 'stranger.py').write_text(STRANGER)
    capability = '+dac_read_search'  # it may read this installation, wherever that is
    line = (
        f'coproc env ROS_LOG_DIR={logs} setpriv --reuid 65534 --regid 65534 --clear-groups '
        f'--inh-caps {capability} --ambient-caps {capability} "$PYTHON" {tmp_path}/stranger.py; '
        f'read -r -u "${{COPROC[0]}}"; {REPLAY}; code=$?; kill "$COPROC_PID"; exit $code'
    )
    done = command(line)
    assert done.code == 0, done.err
    assert 'another user (uid 65534)' in done.err
    assert 'exchange no data' in done.err
