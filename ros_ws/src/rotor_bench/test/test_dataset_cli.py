# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""rotor-rig dataset: what it says, refusals, Ctrl-C, a dask scheduler."""

import json
import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from dataset_worlds import TINY, tree, write_tiny
from rotor_bench.dataset import run as dataset_run
from rotor_bench.dataset.folder import read_manifest
from rotor_bringup.cli import app

CLI = [sys.executable, '-m', 'rotor_bringup']
Command = Callable[..., tuple[int, str]]


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    """Run a command in an empty folder with a suite `tiny.yaml`, in this process."""
    monkeypatch.chdir(tmp_path)
    write_tiny(tmp_path)

    def run(*arguments: object) -> tuple[int, str]:
        words = [str(argument) for argument in arguments]
        result = CliRunner().invoke(app, words, env={'COLUMNS': '300'})
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result.exit_code, result.output

    return run


def test_a_data_set_is_made_and_summed_up(command: Command, tmp_path: Path) -> None:
    options = ('tiny.yaml', '--out', 'set', '--jobs', '1', '--split', 'train', '--machines', '1')
    code, said = command('dataset', *options, '--json')
    assert code == 0, said
    found = json.loads(said)
    assert found['flights'] == found['written'] == 3
    assert found['flight_hours'] == pytest.approx(3 * 10.1 / 3600.0)
    assert found['times_real_time'] > 0.0
    size = sum(path.stat().st_size for path in (tmp_path / 'set').glob('flights/*'))
    assert found['size_bytes'] == size
    assert len(read_manifest(tmp_path / 'set')) == 3
    code, said = command('dataset', *options)
    assert code == 0, said
    assert '3 flights, 0.01 h' in said
    assert 'written' not in said


# arguments, and what the sentence must contain
REFUSED: dict[str, tuple[str, list[str]]] = {
    'no folder': ('dataset smoke', ['--out']),
    'unknown suite': ('dataset standrad --out set', ['standrad', 'standard']),
    'a folder as suite': ('dataset folder --out set', ['folder', 'smoke']),
    'bad suite': ('dataset bad.yaml --out set', ['flight_s', '10']),
    'not a suite': ('dataset tiny.txt --out set', ['mapping']),
    'negative seed': ('dataset smoke --out set --seed=-1', ['seed = -1', '0 to']),
    'half a seed': ('dataset smoke --out set --seed 0.5', ['--seed']),
    'unknown split': ('dataset smoke --out set --split valid', ['valid', 'train']),
    'no machines': ('dataset smoke --out set --machines 0', ['--machines 0', '1 to 16']),
    'too many machines': ('dataset smoke --out set --machines 17', ['--machines 17', '1 to 16']),
    'no jobs': ('dataset smoke --out set --jobs 0', ['--jobs 0', '1 or more']),
    'jobs of a scheduler': (
        'dataset smoke --out set --jobs 2 --scheduler tcp://127.0.0.1:1',
        ['--jobs', '--scheduler'],
    ),
    'a file as folder': ('dataset smoke --out tiny.txt', ['tiny.txt', 'looks like a file']),
    'a folder of other things': ('dataset smoke --out folder', ['folder', 'not empty']),
}


@pytest.mark.parametrize('case', REFUSED)
def test_bad_arguments_are_one_sentence_before_anything_is_computed(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, case: str
) -> None:
    arguments, wanted = REFUSED[case]
    (tmp_path / 'folder').mkdir()
    (tmp_path / 'folder' / 'letter').write_text('dear')
    (tmp_path / 'tiny.txt').write_text('3')
    (tmp_path / 'bad.yaml').write_text(TINY.replace('flight_s: 10.1', 'flight_s: 1.0'))
    before = tree(tmp_path)
    monkeypatch.setattr(dataset_run, 'write_flights', lambda *_: pytest.fail('it computed'))
    code, said = command(*shlex.split(arguments))
    assert code == 2, said
    errors = [line for line in said.splitlines() if line.startswith('error: ')]
    assert len(errors) == 1 or 'Usage:' in said, said
    for word in wanted:
        assert word in said, (word, said)
    assert tree(tmp_path) == before


def test_a_flight_that_cannot_be_flown_leaves_nothing_half_done(
    command: Command, tmp_path: Path
) -> None:
    """A recorded flight of 20 minutes does not cover one of half an hour."""
    suite = TINY.replace('flight_s: 10.1', 'flight_s: 1800.0\nfamilies: [level, recorded]')
    (tmp_path / 'long.yaml').write_text(
        suite.replace('family: pulls_5g', 'family: recorded').replace('machines: 2', 'machines: 1')
    )
    code, said = command('dataset', 'long.yaml', '--out', 'set', '--jobs', '1')
    assert code == 2, said
    assert 'start_s' in said
    assert not list((tmp_path / 'set').rglob('*.mcap*'))


@pytest.mark.slow
def test_ctrl_c_leaves_whole_files_and_a_second_run_goes_on(tmp_path: Path) -> None:
    (tmp_path / 'tiny.yaml').write_text(TINY.replace('machines: 2', 'machines: 4'))
    folder = tmp_path / 'set'
    arguments = [*CLI, 'dataset', str(tmp_path / 'tiny.yaml'), '--jobs', '2', '--out']
    process = subprocess.Popen(
        [*arguments, str(folder)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        stdin=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
    )
    deadline = time.monotonic() + 300.0
    journal = folder / 'finished.jsonl'
    while not (journal.exists() and journal.stat().st_size):
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline, 'no flight was done'
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does, to all of them
    _, err = process.communicate(timeout=300.0)
    assert process.returncode == 130, err
    assert 'flights are done; they are kept in' in err.replace('\n', ' ')
    assert 'Traceback' not in err
    done = [json.loads(line) for line in (folder / 'finished.jsonl').read_text().splitlines()]
    there = {str(path.relative_to(folder)) for path in folder.glob('flights/*')}
    assert {row['file'] for row in done} <= there
    assert len(done) < 15
    assert not (folder / 'manifest.parquet').exists()

    for place in (folder, tmp_path / 'fresh'):
        subprocess.run([*arguments, str(place)], check=True, capture_output=True, timeout=500.0)
    assert tree(folder) == tree(tmp_path / 'fresh')


@pytest.fixture
def scheduler() -> Iterator[str]:
    """A dask scheduler with two worker processes of one thread, and its address."""
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        host='127.0.0.1',
        dashboard_address='127.0.0.1:0',
        worker_dashboard_address='127.0.0.1:0',
        memory_limit=0,
    ) as cluster:
        yield cluster.scheduler_address


@pytest.mark.slow
def test_a_scheduler_writes_the_same_bytes(
    scheduler: str, command: Command, tmp_path: Path
) -> None:
    code, said = command('dataset', 'tiny.yaml', '--out', 'there', '--scheduler', scheduler)
    assert code == 0, said
    code, said = command('dataset', 'tiny.yaml', '--out', 'here', '--jobs', '1')
    assert code == 0, said
    assert tree(tmp_path / 'there') == tree(tmp_path / 'here')
