# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""docs/maneuvers.md says what the code does: its tables, its examples, its figure."""

import re
import subprocess
import sys
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pydantic
import pytest
import yaml

from maneuver_gen import load_grid, parse_maneuver, resolve_paths
from maneuver_gen.maneuvers.climb_dive import ClimbDive
from maneuver_gen.maneuvers.recorded import shipped_flights
from maneuver_gen.registry import shipped_maneuvers
from rotor_common.configuration import ConfigModel, bounds_of, range_text, unit_of

DOCS = Path(__file__).resolve().parents[4] / 'docs'
TEXT = (DOCS / 'maneuvers.md').read_text('utf-8')
MODELS = tuple(shipped_maneuvers().values())
EXAMPLES = re.findall(r'```yaml\n(.*?)```', TEXT, re.DOTALL)


def row(name: str, field: pydantic.fields.FieldInfo) -> str:
    default = 'required' if field.is_required() else field.default
    if isinstance(default, bool):
        default = str(default).lower()
    elif isinstance(default, float):
        default = f'{default:g}'
    unit = unit_of(field)
    allowed = range_text(field) if unit else ''
    shown = unit if unit != '1' else ''
    cells = [f'`{name}`', str(default), shown, allowed, field.description or '']
    return re.sub(' +', ' ', f'| {" | ".join(cells)} |')


@pytest.mark.parametrize('model', MODELS, ids=lambda model: model.__name__)
def test_every_key_stands_in_its_table(model: type[ConfigModel]) -> None:
    profile = model.model_fields['profile'].default
    section = TEXT.split(f'### {profile}\n')[1].split('\n##')[0]
    rows = [line for line in section.splitlines() if line.startswith('| `')]
    fields = {name: field for name, field in model.model_fields.items() if name != 'profile'}
    assert rows == [row(name, field) for name, field in fields.items()]
    assert all(field.description for field in fields.values())


def test_every_number_has_a_range_and_only_start_s_has_none() -> None:
    unbounded = [
        f'{model.__name__}.{name}'
        for model in MODELS
        for name, field in model.model_fields.items()
        if field.annotation is float and not bounds_of(field)
    ]
    assert unbounded == ['Recorded.start_s']


@pytest.mark.parametrize('text', EXAMPLES)
def test_yaml_examples_run(tmp_path: Path, text: str) -> None:
    table = re.search(r'```csv\n(.*?)```', TEXT, re.DOTALL)
    assert table is not None
    (tmp_path / 'flight.csv').write_text(table.group(1), 'utf-8')
    data: dict[str, Any] = yaml.safe_load(text)
    grid = load_grid(parse_maneuver(resolve_paths(data['maneuver'], tmp_path)), 1.0)
    assert grid.shape == (102, 2)
    assert np.isfinite(grid).all()


def test_there_is_an_example_of_every_profile() -> None:
    shown = {yaml.safe_load(text)['maneuver']['profile'] for text in EXAMPLES}
    assert shown == set(shipped_maneuvers())
    assert set(re.findall('^### (.*)$', TEXT, re.MULTILINE)) == shown


def test_python_example_prints_what_it_says(capsys: pytest.CaptureFixture[str]) -> None:
    example = re.search(r'```python\n(.*?)```', TEXT, re.DOTALL)
    assert example is not None
    exec(compile(example.group(1), 'maneuvers.md', 'exec'), {})  # noqa: S102
    expected = re.search(r'print\(.*?\)  # (.*)\n', example.group(1))
    assert expected is not None
    assert capsys.readouterr().out.strip() == expected.group(1)


def test_the_numbers_of_the_default_flight() -> None:
    """19.9 s in all; 3 g for 1.6 s, twice; 0.04 to 0.1 g for 9.5 s."""
    config = parse_maneuver({'profile': 'climb_dive'})
    assert isinstance(config, ClimbDive)
    pull_up, push_over, pull_out = config.pulses()
    assert pull_out.end_s + config.level_s == pytest.approx(19.9, abs=0.05)
    assert pull_up.hold_s == pytest.approx(1.6, abs=0.05)
    assert pull_out.hold_s == pull_up.hold_s
    assert push_over.hold_s == pytest.approx(9.5, abs=0.05)
    load = load_grid(config, 20.0)[:, 0] / 9.81
    times = np.arange(len(load)) / 100.0
    start = push_over.start_s + push_over.transition_s
    held = load[(times >= start) & (times <= start + push_over.hold_s)]
    assert held.min() == pytest.approx(0.04, abs=0.005)
    assert held.max() == pytest.approx(0.1, abs=0.005)


@pytest.mark.slow
def test_the_shipped_record_is_made_by_its_script(tmp_path: Path) -> None:
    path = tmp_path / 'record.csv'
    script = DOCS / 'make_synthetic_record.py'
    subprocess.run([sys.executable, '-W', 'error', str(script), str(path)], check=True)
    (shipped,) = shipped_flights()
    assert path.read_bytes() == (files('maneuver_gen') / f'flights/{shipped}.csv').read_bytes()


def test_the_shipped_record_can_be_flown_from_any_folder(tmp_path: Path) -> None:
    data = {'profile': 'recorded', 'path': 'shipped:synthetic_record', 'start_s': 60.0}
    assert resolve_paths(data, tmp_path) == data
    factors = load_grid(parse_maneuver(data), 1100.0)[:, 0] / 9.81
    assert factors.min() < 0.3
    assert 5.5 < factors.max() < 7.0


@pytest.mark.slow
def test_the_figure_is_made_by_its_script(tmp_path: Path) -> None:
    path = tmp_path / 'figure.png'
    script = DOCS / 'make_maneuver_figure.py'
    subprocess.run([sys.executable, '-W', 'error', str(script), str(path)], check=True)
    matplotlib_image = pytest.importorskip('matplotlib.image')
    made = matplotlib_image.imread(path)
    shown = matplotlib_image.imread(DOCS / 'images' / 'maneuvers.png')
    # the same matplotlib gives the same pixels; a climb angle of 0.35 for 0.36 rad gives 0.005
    assert made.shape == shown.shape
    assert np.abs(made - shown).mean() < 0.002
