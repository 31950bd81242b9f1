# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""docs/datasets.md says what the suites are; its examples run."""

import re
from pathlib import Path

import pytest

from dataset_worlds import TINY
from rotor_bench.dataset.folder import COLUMNS
from rotor_bench.dataset.run import make_dataset
from rotor_bench.dataset.suite import plan_suite
from rotor_bench.dataset.suite_config import load_suite, shipped_suites

PAGE = (Path(__file__).resolve().parents[4] / 'docs' / 'datasets.md').read_text('utf-8')


def examples(language: str) -> list[str]:
    return re.findall(rf'```{language}\n(.*?)```', PAGE, re.DOTALL)


@pytest.mark.parametrize('name', shipped_suites())
def test_the_table_of_suites_counts_what_is_planned(name: str) -> None:
    flights = [flight for machine in plan_suite(name) for flight in machine.flights]
    machines = {flight.machine for flight in flights}
    hours = sum(flight.duration_s for flight in flights) / 3600.0
    assert f'| `{name}` | {len(machines)} | {len(flights)} | {hours:.2f} |' in PAGE
    assert f'{len(flights)} flights' in load_suite(name).description or name == 'full'


def test_the_levels_of_the_grid_are_those_of_the_table() -> None:
    suite = load_suite('standard')
    ladder = ', '.join(f'{depth:g}' for depth in suite.crack_stiffness_ratios)
    assert f'| crack, K = dk/k | healthy; {ladder}; growing |' in PAGE
    assert f'| maneuver | {", ".join(suite.families)} |' in PAGE
    assert f'| confounder | {", ".join(suite.confounders)} |' in PAGE
    assert all(f'`{family}`' in PAGE for family in suite.held_out_families)
    for group in suite.groups:
        assert f'| `{group.name}` | {group.split} | {group.machines} |' in PAGE


def test_every_column_of_the_manifest_is_explained() -> None:
    for name, meaning in COLUMNS.items():
        assert f'| `{name}` | {meaning} |' in PAGE


def test_the_example_of_an_own_suite_can_be_planned(tmp_path: Path) -> None:
    (example,) = examples('yaml')
    path = tmp_path / 'mine.yaml'
    path.write_text(example)
    (*_, last) = plan_suite(str(path))
    assert {flight.grid.family for flight in last.flights[3:]} <= {'pulls_5g', 'gusts'}


def test_the_documented_commands_are_commands() -> None:
    for line in examples('bash')[0].splitlines():
        program, name, suite, *_ = line.split()
        assert (program, name) == ('rotor-rig', 'dataset')
        assert suite in shipped_suites()


@pytest.mark.slow
def test_the_documented_python_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    tiny = tmp_path / 'tiny.yaml'
    tiny.write_text(TINY + 'crack_stiffness_ratios: [0.2]\n')
    make_dataset(str(tiny), tmp_path / 'data' / 'smoke', split='train', jobs=1)
    reading, streaming = examples('python')
    exec(compile(reading, 'datasets.md', 'exec'), {})  # noqa: S102 - our own documentation
    wanted = re.search(r'print\(.*\)  # (.*)\n', reading)
    assert wanted is not None
    assert capsys.readouterr().out.strip() == wanted.group(1)
    exec(compile(streaming, 'datasets.md', 'exec'), {})  # noqa: S102
    assert capsys.readouterr().out.split()[0] in {'healthy', 'constant'}
