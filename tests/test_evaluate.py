# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""`rotor-rig evaluate`: simulated, stored and over DDS, and what goes wrong in one sentence."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from rig_support import Rig
from rotor_bench.evaluation.sources import Simulated
from rotor_bench.evaluation.suites import load
from rotor_bringup.cli import app

NODE = Path(__file__).parent / 'score_node.py'


@pytest.fixture(scope='session')
def small_suite(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write a suite of two machines with one flight of each kind, 10 s long."""
    group = {'name': 'test', 'split': 'test', 'machines': 2, 'healthy': 1, 'cracked': 1,
             'growing': 0, 'held_out': True, 'noise': ['realistic']}  # fmt: skip
    references = [{'family': 'pulls_3g', 'speed_program': 'steady'}]
    suite = {'base': 'smoke', 'name': 'small', 'flight_s': 10.0, 'groups': [group],
             'references': references}  # fmt: skip
    path = tmp_path_factory.mktemp('suite') / 'small.yaml'
    path.write_text(yaml.safe_dump(suite))
    return path


def evaluation(folder: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((folder / 'evaluation.json').read_text('utf-8'))
    return content


@pytest.mark.slow
def test_a_stored_suite_gives_the_numbers_of_the_simulated_one(
    rig: Rig, small_suite: Path, tmp_path: Path
) -> None:
    stored = tmp_path / 'stored'
    assert rig('dataset', small_suite, '--out', stored, '--jobs', 1).code == 0
    for suite, out, jobs in ((small_suite, 'a', 1), (stored, 'b', 2)):
        done = rig('evaluate', 'ratios', 'zones', '--suite', suite, '--out', tmp_path / out,
                   '--jobs', jobs)  # fmt: skip
        assert done.code == 0, done.err
        assert 'AUC' in done.out
    simulated, read = evaluation(tmp_path / 'a'), evaluation(tmp_path / 'b')
    assert simulated['flights'] == read['flights']
    assert simulated['detectors'] == read['detectors']
    assert (simulated['stored'], read['stored']) == (False, True)
    assert len(simulated['flights']) == 4
    assert all(numbers['failed'] == 0 for numbers in simulated['detectors'].values())
    assert all((tmp_path / 'a' / name).is_file() for name in ('roc.png', 'growth.png'))


def processes() -> dict[int, tuple[int, str]]:
    """Return parent and start of every process that has not ended, by its number."""
    found = {}
    for path in Path('/proc').glob('[0-9]*/stat'):
        try:
            state, parent, *rest = path.read_text('utf-8').rpartition(')')[2].split()
        except OSError:
            continue  # it has ended meanwhile
        if state != 'Z':
            found[int(path.parent.name)] = (int(parent), rest[17])
    return found


def family(root: int) -> set[tuple[int, str]]:
    """Return number and start of a process and of all that descend from it."""
    there = processes()
    found = {root}
    while more := {pid for pid, (parent, _) in there.items() if parent in found} - found:
        found |= more
    return {(pid, there[pid][1]) for pid in found if pid in there}


def awaited(is_so: Callable[[], bool], limit_s: float = 120.0) -> bool:
    until = time.monotonic() + limit_s
    while not is_so() and time.monotonic() < until:
        time.sleep(0.05)
    return is_so()


def more_files_than(count: int, folder: Path) -> Callable[[int], bool]:
    return lambda _: len(list(folder.glob('*.json'))) > count


def interrupted(arguments: list[str], is_time: Callable[[int], bool]) -> str:
    """Press Ctrl-C when it is time, see that nobody is left, and return what was said last."""
    process = subprocess.Popen(
        [sys.executable, '-m', 'rotor_bringup', *arguments],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert awaited(lambda: is_time(process.pid))
    started = family(process.pid)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    _, said = process.communicate(timeout=300.0)
    assert process.returncode == 130, said
    assert awaited(lambda: not started & {(p, s) for p, (_, s) in processes().items()}, 20.0)
    assert 'Traceback' not in said
    return said.strip().splitlines()[-1]


@pytest.mark.slow
def test_ctrl_c_keeps_what_is_finished_and_the_same_command_goes_on(
    rig: Rig, small_suite: Path, tmp_path: Path
) -> None:
    suite = yaml.safe_load(small_suite.read_text('utf-8'))
    suite['groups'][0] |= {'machines': 1, 'healthy': 4, 'cracked': 2, 'growing': 1}
    growing = tmp_path / 'growing.yaml'
    growing.write_text(yaml.safe_dump({**suite, 'growth_s': 15.0}))
    out, parts = tmp_path / 'out', tmp_path / 'out' / 'parts'
    arguments = ['evaluate', 'ratios', 'zones', '--suite', str(growing), '--out', str(out)]
    # main, its tracker of resources, the process that flies, the server that is still loading
    at_the_start = interrupted([*arguments, '--jobs', '2'], lambda pid: len(family(pid)) >= 4)
    assert at_the_start == 'stopped: there are no finished flights to keep'
    kept: dict[Path, int] = {}
    for jobs in ('2', '1'):  # with one, Ctrl-C meets the flying itself
        said = interrupted([*arguments, '--jobs', jobs], more_files_than(len(kept), parts))
        assert said == (
            f'stopped: finished flights are kept in {parts}, and the same command goes on there'
        )
        kept = {path: path.stat().st_mtime_ns for path in parts.glob('*.json')}
    done = rig(*arguments, '--jobs', 1)
    assert done.code == 0, done.err
    assert f'going on: {len(kept)} flights are finished in {parts}' in done.err
    assert not parts.exists()
    assert rig(*arguments[:-1], tmp_path / 'whole', '--jobs', 1).code == 0
    resumed, whole = evaluation(out), evaluation(tmp_path / 'whole')
    assert (resumed['kept_flights'], whole['kept_flights']) == (len(kept), 0)
    timings = ('made', 'wall_s', 'kept_flights')
    assert {k: v for k, v in resumed.items() if k not in timings} == {
        k: v for k, v in whole.items() if k not in timings
    }
    assert len(whole['flights']) == 8


@pytest.mark.slow
@pytest.mark.real_time
def test_a_node_is_tested_by_its_topic(rig: Rig, small_suite: Path, tmp_path: Path) -> None:
    done = rig(
        'evaluate', 'topic:my/score', 'zones', '--node-command', f'{sys.executable} {NODE}',
        '--rate', 4, '--suite', small_suite, '--limit', 1, '--out', tmp_path, '--json',
    )  # fmt: skip
    assert done.code == 0, done.err
    content = evaluation(tmp_path)
    assert done.json['detectors'] == content['detectors']
    assert set(content['detectors']) == {'zones', 'topic:my/score'}
    assert 'topic: the node receives anonymous blocks only' in content['isolation']
    chosen = load(str(small_suite), seed=0, split='test', limit=1)
    tests = [flight for flight in chosen.machines[0].flights if flight.role == 'test']
    assert len(content['flights']) == len(tests) == 2
    for flight, result in zip(tests, content['flights'], strict=True):
        outcome = result['outcomes']['topic:my/score']
        blocks = [block.rows['disk_y'] for (block,) in Simulated().fly([flight])]
        # six digits are kept; the last 0.2 s may be spoken about or not when the flight ends
        assert outcome['score'] == pytest.approx(np.abs(blocks).max() / 1e-5, rel=1e-5)
        assert outcome['failure'] == ''
        # a word counts from when it was heard: at four times real time, 0.25 s late is 1 s
        assert outcome['judged_s'] > 9.0
        assert result['outcomes']['zones']['failure'] == ''


WORDLESS = {
    'nan': '',
    'empty': '',
    'type': '/my/score is std_msgs/msg/String; a detector says',
    'silent': 'no node published /my/score and listened to rotor/waveform within 15 s',
    'timer': '',
}


@pytest.mark.slow
@pytest.mark.parametrize('how', WORDLESS)
def test_a_node_without_a_number_fails_its_flights_and_ends_nothing(
    rig: Rig, small_suite: Path, tmp_path: Path, how: str
) -> None:
    program = f'{sys.executable} {NODE.with_name("wordless_node.py")} {how}'
    done = rig(
        'evaluate', 'topic:my/score', '--node-command', program, '--suite', small_suite,
        '--limit', 1, '--out', tmp_path, '--json',
    )  # fmt: skip
    assert done.code == 0, done.err
    flights = evaluation(tmp_path)['flights']
    assert len(flights) == 2
    for flight in flights:
        outcome = flight['outcomes']['topic:my/score']
        assert outcome['failure'].startswith(WORDLESS[how])
        assert bool(outcome['failure']) == bool(WORDLESS[how])
        assert (outcome['score'], outcome['alarms']) == (None, 0)


@pytest.mark.slow
def test_a_node_that_says_nothing_has_failed_in_a_sentence(
    rig: Rig, small_suite: Path, tmp_path: Path
) -> None:
    done = rig('evaluate', 'topic:not/there', '--suite', small_suite, '--limit', 1,
               '--out', tmp_path)  # fmt: skip
    assert done.code == 3
    assert done.err.strip().splitlines()[-1] == (
        'error: the replay failed: no node published /not/there and listened to rotor/waveform '
        'within 15 s'
    )


@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        (
            ('ratio', '--suite', 'smoke'),
            "'ratio' is not known; give one of baseline, ratios",
        ),
        (('no_such:Thing', '--suite', 'smoke'), "module 'no_such' of a detector is neither"),
        (('ratios', '--suite', 'smooke'), "'smooke'"),
        (('ratios', 'ratios', '--suite', 'smoke'), "'ratios' is given twice"),
        (('ratios', '--suite', 'smoke', '--jobs', 0), '--jobs 0 is out of range'),
        (('ratios', '--suite', 'smoke', '--limit', 0), '--limit 0 is out of range'),
        (('ratios', '--suite', 'smoke', '--seed', -1), 'seed = -1 is out of range'),
        (('topic:a', '--suite', 'smoke', '--rate', 0), '--rate 0 is out of range'),
        (
            ('topic:a', '--suite', 'smoke', '--node-command', 'no-such-program'),
            'there is no program',
        ),
    ],
)
def test_what_cannot_be_is_one_sentence(
    tmp_path: Path, arguments: tuple[object, ...], words: str
) -> None:
    options = ['evaluate', *map(str, arguments), '--out', str(tmp_path / 'out')]
    done = CliRunner().invoke(app, options, env={'COLUMNS': '300'})
    assert done.exit_code == 2
    assert words in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_a_folder_that_is_no_data_set_is_said(tmp_path: Path) -> None:
    options = ['evaluate', 'ratios', '--suite', str(tmp_path), '--out', str(tmp_path / 'out')]
    done = CliRunner().invoke(app, options)
    assert done.exit_code == 2
    assert 'holds no data set' in done.stderr
