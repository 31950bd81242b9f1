# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""`rotor-rig paper` from end to end at small sizes, and the page made from its report."""

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
from live_flight import CLI
from typer.testing import CliRunner

from rotor_bringup.cli import app
from rotor_common.exit_code import ExitCode
from rotor_paper import validation

SMALL = ['--values', '5', '--transient', '60', '--revolutions', '100', '--no-check']

Run = Callable[..., tuple[int, str]]


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> tuple[int, str]:
        result = CliRunner().invoke(app, ['paper', *arguments], env={'COLUMNS': '300'})
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result.exit_code, result.output

    return run


BAD: dict[str, tuple[list[str], list[str]]] = {
    'figure 4': (['4', '--out', 'o'], ['figure 4', '5 to 19']),
    'figure as text': (['five', '--out', 'o'], ['figures', 'integer']),
    'variant': (['--variant', 'exact', '--out', 'o'], ["'exact'", 'natural', 'figure_chaos']),
    'no values': (['--values', '0', '--out', 'o'], ['--values 0', '2 to 2000']),
    'negative transient': (['--transient=-1', '--out', 'o'], ['--transient -1', '0 to']),
    'too few revolutions': (['--revolutions', '5', '--out', 'o'], ['--revolutions 5', '100 to']),
    'jobs': (['--jobs', '0', '--out', 'o'], ['--jobs 0', '1 or more']),
    'out is a file': (['--out', 'file'], ['--out file']),
    'out below a file': (['--out', 'file/deeper'], ['--out file/deeper']),
    'cache is a file': (['--out', 'o', '--cache', 'file'], ['file']),
    'no out': ([], ['--out']),
    'scheduler': (['--out', 'o', '--scheduler', 'nowhere'], ['nowhere']),
}


@pytest.mark.parametrize('case', BAD)
def test_bad_arguments_end_in_one_sentence(command: Run, tmp_path: Path, case: str) -> None:
    (tmp_path / 'file').write_text('')
    arguments, wanted = BAD[case]
    code, said = command(*arguments)
    assert code == ExitCode.BAD_INPUT, said
    assert 'Traceback' not in said
    errors = [line for line in said.splitlines() if line.startswith('error: ')]
    assert len(errors) == 1 or 'Usage:' in said, said
    for word in wanted:
        assert word in said
    assert not list(tmp_path.rglob('*.png'))


@pytest.fixture(scope='module')
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """Figures 15 and 16 of two variants, made once."""
    out = tmp_path_factory.mktemp('paper')
    arguments = ['15', '16', '--variant', 'figure', '--variant', 'natural', '--out', str(out)]
    result = CliRunner().invoke(app, ['paper', *arguments, *SMALL, '--json'])
    assert result.exit_code == 0, result.output
    return out, json.loads(result.stdout)


@pytest.mark.slow
def test_pictures_data_and_report_are_made(made: tuple[Path, dict[str, Any]]) -> None:
    out, content = made
    assert content == json.loads((out / 'report.json').read_text('utf-8'))
    assert list(content['variants']) == ['natural', 'figure']  # the default variant first
    page = (out / 'report.html').read_text('utf-8')
    for picture in content['pictures']:
        assert (out / picture['picture']).exists()
        assert (out / picture['picture']).with_suffix('.svg').exists()
        assert f'src="{picture["picture"]}"' in page
        assert picture['unconverged'] is None  # not checked, and not taken for converged
    names = {row['name'] for row in content['claims']}
    assert names == {
        'fig15_quasi_periodic',
        'fig15_chaotic',
        'fig16_exponent_range',
        'fig16_deeper_crack',
    }
    assert 'fig16_load_less_stable' in content['not_computed']  # it needs Fig. 14 too
    assert 'fig14_chaos' in content['not_computed']
    with np.load(out / 'data' / 'fig16_natural.npz', allow_pickle=False) as data:
        assert data['K_unloaded/z'].shape == (5, 100)
        np.testing.assert_allclose(
            data['K_unloaded/crack_stiffness_ratio'], np.linspace(0.0, 0.3, 5)
        )


@pytest.mark.slow
def test_a_repeated_run_takes_its_results_from_the_cache(
    made: tuple[Path, dict[str, Any]], tmp_path: Path
) -> None:
    """Same verdicts and same data, and no new file in the cache."""
    out, content = made
    before = {path: path.stat().st_mtime_ns for path in (out / 'cache').iterdir()}
    arguments = ['16', '--variant', 'natural', '--out', str(tmp_path), *SMALL]
    result = CliRunner().invoke(app, ['paper', *arguments, '--cache', str(out / 'cache')])
    assert result.exit_code == 0, result.output
    assert {path: path.stat().st_mtime_ns for path in (out / 'cache').iterdir()} == before
    again = json.loads((tmp_path / 'report.json').read_text('utf-8'))
    assert again['results_in_cache_before']
    assert {claim['figure'] for claim in again['claims']} == {16}
    for claim in again['claims']:
        first = next(row for row in content['claims'] if row['name'] == claim['name'])
        assert claim['verdicts']['natural'] == first['verdicts']['natural']
    name = 'data/fig16_natural.npz'
    with np.load(out / name) as one, np.load(tmp_path / name) as other:
        for key in one:
            np.testing.assert_array_equal(one[key], other[key])


@pytest.mark.slow
def test_ctrl_c_keeps_what_is_done_and_the_next_run_goes_on(tmp_path: Path) -> None:
    arguments = ['paper', '16', '19', '--variant', 'derived', '--out', str(tmp_path / 'out')]
    arguments += ['--values', '130', '--transient', '100', '--revolutions', '100', '--no-check']
    process = subprocess.Popen(
        [*CLI, *arguments, '--jobs', '1'], stderr=subprocess.PIPE, text=True, env={**os.environ}
    )
    cache = tmp_path / 'out' / 'cache'
    until = time.monotonic() + 120.0
    while not list(cache.glob('*.npz')) and time.monotonic() < until:
        time.sleep(0.02)
    assert list(cache.glob('*.npz')), 'nothing was kept in time'
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=300.0)
    assert process.returncode == ExitCode.INTERRUPTED, said
    assert 'Traceback' not in said
    assert 'goes on from there' in said
    kept = {path: path.stat().st_mtime_ns for path in cache.glob('*.npz')}
    assert kept
    assert CliRunner().invoke(app, arguments).exit_code == 0
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    assert len(list(cache.glob('*.npz'))) > len(kept)


@pytest.mark.slow
def test_the_page_of_the_documentation_is_made_from_the_report(
    made: tuple[Path, dict[str, Any]], tmp_path: Path
) -> None:
    out, content = made
    script = [sys.executable, '-m', 'rotor_paper.validation', str(out / 'report.json')]
    subprocess.run([*script, '--docs', str(tmp_path)], check=True, timeout=120.0)
    page = (tmp_path / 'validation.md').read_text('utf-8')
    assert page == validation.page(content)
    for number in (15, 16):
        picture = tmp_path / 'images' / 'paper' / f'fig{number}.png'
        assert f'(images/paper/{picture.name})' in page
        assert picture.stat().st_size < 500_000
    for row in content['claims']:
        assert row['paper'] in page
    assert 'are a selection' in page
    for what in content['not_judged']:
        assert f'- {what}' in page
    assert "empirical reconstruction, not the authors' code" in page


def test_natural_stands_beside_the_variant_that_agrees_most() -> None:
    verdict = {'why': '', 'value': {}}
    pictures = [
        {'figure': 14, 'variant': name, 'picture': f'{name}.png'}
        for name in ('natural', 'derived', 'figure', 'figure_chaos')
    ]
    verdicts = {
        'natural': {**verdict, 'verdict': 'partly'},
        'derived': {**verdict, 'verdict': 'does not'},
        'figure': {**verdict, 'verdict': 'partly'},
        'figure_chaos': {**verdict, 'verdict': 'agrees'},
    }
    content = {'pictures': pictures, 'claims': [{'figure': 14, 'verdicts': verdicts}]}
    chosen = [row['variant'] for row in validation.side_by_side(content, 14)]
    assert chosen == ['natural', 'figure_chaos']
