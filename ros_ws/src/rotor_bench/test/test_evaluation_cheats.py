# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Detectors that cheat fail, each in its flight, and where nothing is closed they get through."""

import contextlib
import ctypes
import importlib
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import cheating_detector
import spy_rig
from rotor_bench.dataset.suite import Flight, Machine
from rotor_bench.evaluation import walls
from rotor_bench.evaluation.outcome import Evaluated, Outcome
from rotor_bench.evaluation.runner import evaluate
from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock

CHEATS = tuple(
    name
    for name, found in vars(cheating_detector).items()
    if isinstance(found, type) and issubclass(found, cheating_detector.Sound)
)
SAMPLES, BLOCKS, RISES_AT = 512, 8, 5
RATE_HZ = 10_240
RISE_S = (RISES_AT + 1) * SAMPLES / RATE_HZ
"""The end of the first block that is high."""
PLAIN = {
    'signal_to_evaluator', 'suite_folder', 'tcp', 'udp', 'memory_shared_in_system_v',
    'messages_in_system_v', 'memory_shared_in_posix', 'file_in_temp', 'file_in_folder',
    'file_beside_folder', 'file_in_home',
}  # fmt: skip
"""What any process can do where nothing is closed."""
CLOSED_BY = {
    'files': {'memory_file', 'suite_folder', 'memory_shared_in_posix', 'file_in_temp',
              'file_beside_folder', 'file_in_home'},
    'capabilities dropped': {'ptrace', 'perf_event_open', 'bpf'},
    'processes': {'signal_to_evaluator'},
    'network': {'tcp', 'udp'},
    'IPC': {'memory_shared_in_system_v', 'messages_in_system_v'},
    'users': {'keyring'},
}  # fmt: skip
"""What is open where neither this wall stands nor seccomp."""


class Rising:
    """Flights under test whose signal is high from block RISES_AT on."""

    def fly(self, flights: Sequence[Flight]) -> Iterator[list[WaveformBlock]]:
        for number in range(BLOCKS):
            yield [block(number, rises=flight.role == 'test') for flight in flights]


def block(number: int, *, rises: bool = True) -> WaveformBlock:
    rows = np.zeros(SAMPLES, WAVEFORM_DTYPE)
    rows['sample'] = SAMPLES * number + np.arange(SAMPLES)
    rows['disk_y'] = 5.0 if rises and number >= RISES_AT else 1.0
    return WaveformBlock(number * SAMPLES * 10**9 // RATE_HZ, rows)


def plan(flights: int) -> tuple[Machine, ...]:
    (machine, *_) = spy_rig.plan()
    return (Machine(0, 'test', machine.flights[: flights + 1]),)


@dataclass(frozen=True)
class Cheating:
    """A copy of the cheats that knows where to look, and how it is called."""

    name: str
    module: ModuleType

    def evaluated(self, cheats: Sequence[str], flights: int, silence_s: float) -> Evaluated:
        names = [f'{self.name}:{cheat}' for cheat in cheats]
        return evaluate(plan(flights), names, Rising(), silence_s=silence_s)


@pytest.fixture(scope='module')
def cheating(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cheating]:
    """Put a suite where a cheat can find it, and remove what cheats have left."""
    folder = tmp_path_factory.mktemp('cheating')
    suite = folder / 'suite'
    suite.mkdir()
    (suite / 'manifest.csv').write_text('cracked')
    listener = socket.create_server(('127.0.0.1', 0))
    note = f'cheat-{os.getpid()}'
    text = Path(cheating_detector.__file__).read_text('utf-8')
    for name, value in {
        'EVALUATOR = 0': os.getpid(),
        "SUITE = ''": str(suite),
        'PORT = 0': listener.getsockname()[1],
        "NOTE = 'cheat'": note,
    }.items():
        assert text.count(f'{name}\n') == 1
        text = text.replace(f'{name}\n', f'{name.split()[0]} = {value!r}\n')
    (folder / f'cheats_{os.getpid()}.py').write_text(text)
    before = Path.cwd()
    os.chdir(folder)
    sys.path.insert(0, str(folder))
    module = importlib.import_module(f'cheats_{os.getpid()}')
    yield Cheating(module.__name__, module)
    sys.path.remove(str(folder))
    os.chdir(before)
    listener.close()
    forget(module)


def forget(module: ModuleType) -> None:
    """Remove the notes that were left where nothing was closed."""
    libc = ctypes.CDLL(None)
    libc.shmctl(libc.shmget(module.key(), 0, 0), 0, None)
    libc.msgctl(libc.msgget(module.key(), 0), 0, None)
    shared = Path('/dev/shm') / module.NOTE  # noqa: S108
    for left in (shared, Path(f'/tmp/{module.NOTE}-temp'), Path.home() / f'{module.NOTE}-home'):  # noqa: S108
        left.unlink(missing_ok=True)
    for process in named(module.NOTE):
        os.kill(process, signal.SIGKILL)


def named(name: str) -> list[int]:
    """Return the processes of that name."""
    found = []
    for path in Path('/proc').glob('[0-9]*/comm'):
        with contextlib.suppress(OSError):
            if path.read_text('utf-8').strip() == name[:15]:
                found.append(int(path.parent.name))
    return found


@pytest.fixture(scope='module')
def done(cheating: Cheating) -> Evaluated:
    """Let everybody cheat in two flights, but for the one that takes its time."""
    return cheating.evaluated([name for name in CHEATS if name != 'Drips'], 2, 30.0)


def outcomes(done: Evaluated, cheat: str) -> list[Outcome]:
    found = [
        outcome
        for flight in done.flights
        for name, outcome in flight.outcomes.items()
        if name.endswith(f':{cheat}')
    ]
    assert len(found) == 2
    return found


def open_here(done: Evaluated) -> set[str]:
    """Return what this machine cannot close, according to the report."""
    if 'seccomp (' not in done.isolation:
        return CLOSED_BY['files'] if walls.FILES not in done.isolation else set()
    return {
        name
        for wall, names in CLOSED_BY.items()
        for name in names
        if f'{wall} (' in done.isolation or wall == 'files' not in done.isolation
    }


@pytest.mark.slow
def test_nothing_is_found_and_no_note_is_passed(done: Evaluated) -> None:
    for outcome in outcomes(done, 'Looks'):
        assert outcome.failure == ''
        assert set(json.loads(outcome.evidence)) - open_here(done) == set()
    if missing := open_here(done):
        pytest.skip(f'not closed on this machine, as its report says: {sorted(missing)}')


@pytest.mark.slow
@pytest.mark.parametrize('cheat', ['Sound', 'Backdates'])
def test_an_alarm_is_dated_by_the_block_that_was_there(done: Evaluated, cheat: str) -> None:
    for outcome in outcomes(done, cheat):
        assert (outcome.failure, outcome.alarms) == ('', 1)
        assert outcome.first_alarm_s == outcome.score_s == pytest.approx(RISE_S)


@pytest.mark.slow
@pytest.mark.parametrize(
    ('cheat', 'words'),
    [
        ('AnswersInAdvance', 'it gave more verdicts than the 1 blocks sent so far'),
        ('EndsEarly', 'it broke the rules of the exchange'),
        ('RepliesAtLength', 'it broke the rules of the exchange'),
        ('RepliesNonsense', 'it broke the rules of the exchange'),
        ('RepliesInFit', 'in fit: it broke the rules of the exchange'),
        ('RepliesInfinity', 'it sent an infinite score'),
        ('RaisesToTheTerminal', 'ValueError: a'),
    ],
)
def test_what_breaks_the_rules_has_failed_in_a_sentence(
    done: Evaluated, cheat: str, words: str
) -> None:
    for outcome in outcomes(done, cheat):
        assert words in outcome.failure
        assert outcome.failure.isprintable()
        assert len(outcome.failure) <= 500


@pytest.mark.slow
def test_no_text_reaches_the_terminal_as_it_is(done: Evaluated) -> None:
    for outcome in outcomes(done, 'WritesToTheTerminal'):
        assert outcome.evidence.startswith('a\ufffd]0;owned\ufffd\ufffd[2J\ufffd\ufffd b\ufffdccc')
        assert outcome.evidence.isprintable()
        assert len(outcome.evidence) <= 500


@pytest.mark.slow
def test_no_program_is_executed(done: Evaluated) -> None:
    assert [o.failure for o in outcomes(done, 'ExecutesMemory')] == ['', '']


@pytest.mark.slow
def test_nobody_outlives_the_evaluation(done: Evaluated, cheating: Cheating) -> None:
    assert [o.failure for o in outcomes(done, 'Outlives')] == ['', '']
    assert named(cheating.module.NOTE) == []


@pytest.mark.slow
def test_the_same_holds_where_a_container_grants_no_namespaces() -> None:
    if 'NO_NAMESPACES' in os.environ or shutil.which('unshare') is None:
        pytest.skip('this is the run without namespaces, or there is no `unshare` to make it')
    limits = '; '.join(
        f'echo 0 > /proc/sys/user/max_{name}_namespaces'
        for name in ('user', 'net', 'uts', 'ipc', 'mnt', 'pid')
    )
    chosen = 'found or dated or executed or outlives or common or said_in_the_report'
    again = [sys.executable, '-m', 'pytest', '-q', '-rs', __file__, '-k', chosen]
    command = ['unshare', '--user', '--map-root-user', 'sh', '-ec', f'{limits}; exec "$@"', 'sh']
    if subprocess.run([*command, 'true'], capture_output=True, check=False).returncode:
        pytest.skip('this machine grants no user namespace to take the others away in')
    done = subprocess.run(
        [*command, *again],
        env={**os.environ, 'NO_NAMESPACES': '1'},
        capture_output=True,
        text=True,
        timeout=500,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-3000:]
    assert 'passed' in done.stdout


@pytest.mark.slow
def test_a_wall_that_does_not_stand_is_said_in_the_report(done: Evaluated) -> None:
    if 'NO_NAMESPACES' not in os.environ:
        assert walls.is_weak(done.isolation) == ('weak without' in done.isolation)
        return
    for name in (*walls.SHARED, *walls.OWN):
        assert f'{name} (their number is limited here)' in done.isolation
    assert walls.is_weak(done.isolation)


@pytest.mark.slow
def test_memory_and_files_have_an_end(done: Evaluated) -> None:
    if 'limits (' in done.isolation:
        pytest.skip(done.isolation)
    for outcome in outcomes(done, 'TakesMemory'):
        assert outcome.failure == ''
        assert int(outcome.evidence.split()[0]) <= (walls.MEMORY + walls.ADDRESSES) >> 30
    for outcome in outcomes(done, 'TakesTheDisk'):
        assert outcome.failure == ''
        assert outcome.evidence.startswith('[]')
        if 'mounts (' not in done.isolation:
            assert int(outcome.evidence.split()[1]) <= walls.FILE >> 20


@pytest.mark.slow
def test_no_memory_is_common_to_two_flights(done: Evaluated) -> None:
    assert [o.evidence for o in outcomes(done, 'Shares')] == ['fresh', 'fresh']


@pytest.mark.slow
def test_dripping_bytes_buy_no_time(cheating: Cheating) -> None:
    began = time.monotonic()
    (flight,) = cheating.evaluated(['Drips'], 1, 2.0).flights
    (outcome,) = flight.outcomes.values()
    assert outcome.failure == 'it did not answer within 2 s'
    assert time.monotonic() - began < 60.0


def forked(work: Callable[[], object]) -> tuple[int, str]:
    """Return exit code and words of a plain fork, as a naive evaluation would use it."""
    reading, writing = os.pipe()
    process = os.fork()
    if not process:
        with contextlib.suppress(BaseException):
            os.write(writing, json.dumps(work()).encode())
        os._exit(1)
    os.close(writing)
    with open(reading, 'rb') as pipe:  # noqa: PTH123
        said = pipe.read().decode()
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]), said


@pytest.mark.slow
def test_the_same_cheats_get_through_where_nothing_is_closed(cheating: Cheating) -> None:
    module = cheating.module
    forked(module.looked)
    found = set(json.loads(forked(module.looked)[1]))
    assert found >= PLAIN
    if os.geteuid() == 0 and 'perf_event_open' in found:
        assert 'memory_file' in found
    code, _ = forked(lambda: module.ExecutesMemory().push(block(0)))
    assert code == 0
    assert forked(lambda: module.TakesTheDisk().push(block(0)).evidence)[1].startswith('"[\'1 TB')
    process = os.fork()
    if not process:
        module.Outlives().push(block(0))
        os._exit(0)
    os.waitpid(process, 0)
    time.sleep(0.5)
    assert named(module.NOTE)
