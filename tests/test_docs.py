# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The examples and tables of the documentation are true."""

import importlib.util
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from PIL import Image

from rotor_bringup.analysis import analyze_recording
from rotor_interfaces import messages
from rotor_interfaces.channels import COLUMN_UNITS
from rotor_interfaces.topics import TOPICS
from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock, encode
from rotor_rig.scenario_model import Scenario, load_scenario, shipped_scenarios
from rotor_view import view_recording

ROOT = Path(__file__).parents[1]
DOCS = ROOT / 'docs'


def text(name: str) -> str:
    return (DOCS / name).read_text('utf-8')


def blocks(name: str, language: str) -> list[str]:
    return re.findall(rf'```{language}\n(.*?)```', text(name), re.DOTALL)


def test_the_scenario_example_is_a_scenario() -> None:
    (example,) = blocks('scenarios.md', 'yaml')
    scenario = Scenario.from_mapping(yaml.safe_load(example))
    assert scenario.duration_s == 20.0


def printed_values(page: str) -> list[tuple[str, str]]:
    """Return key and number, as printed but for the unit, of the tables of a page."""
    rows = re.findall(r'^\| `([a-z0-9_.]+)` \| ([^|]*) \|', text(page), re.MULTILINE)
    number = re.compile(r'([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)(?: [^,;]+)?')
    return [(key, found[1]) for key, cell in rows if (found := number.fullmatch(cell.strip()))]


def nested(key: str, value: str) -> str:
    """Return `{a: {b: value}}` for the key a.b."""
    for name in reversed(key.split('.')):
        value = f'{{{name}: {value}}}'
    return value


def at(data: Any, key: str) -> Any:
    for name in key.split('.'):
        data = data[name]
    return data


@pytest.mark.parametrize(
    ('page', 'section', 'least'),
    [('physics.md', 'rotor', 13), ('monitor.md', 'monitor', 8), ('sensors.md', 'sensors', 40)],
)
def test_what_is_printed_can_be_pasted(page: str, section: str, least: int, tmp_path: Path) -> None:
    """Defaults as the tables print them, 1e-05 and all; those of sensors.md are of presets."""
    printed = [(key, v) for key, v in printed_values(page) if '.' in key or section != 'sensors']
    assert len(printed) >= least
    file = tmp_path / 'pasted.yaml'
    head = 'maneuver: {profile: constant}\n'
    file.write_text(head)
    bare = load_scenario(str(file)).plain()
    for key, value in printed:
        preset = 'preset: realistic, ' if section == 'sensors' else ''  # bits need a range
        file.write_text(f'{head}{section}: {{{preset}{nested(key, value)[1:]}\n')
        pasted = at(load_scenario(str(file)).plain()[section], key)
        assert pasted == float(value), key
        if section != 'sensors':
            assert pasted == pytest.approx(at(bare[section], key), rel=1e-5), key


def test_every_shipped_scenario_is_listed_and_describes_itself() -> None:
    for name in shipped_scenarios():
        assert f'| `{name}` |' in text('scenarios.md')
        scenario = load_scenario(name)
        assert scenario.name == name
        assert scenario.description.endswith('.')


def test_every_topic_and_column_is_listed_with_its_type() -> None:
    page = text('topics.md')
    for topic in TOPICS:
        row = next(
            line
            for line in page.splitlines()
            if f'| `{topic.name}`' in line or f', `{topic.name}`' in line
        )
        assert topic.type.split('/')[-1] in row
    for column in WAVEFORM_DTYPE.names or ():
        row = next(line for line in page.splitlines() if f'`{column}`' in line and '|' in line)
        kind = 'float64' if WAVEFORM_DTYPE[column] == np.float64 else 'float32'
        assert f'| {kind} | {COLUMN_UNITS[column]} |' in row


def test_the_decoding_example_runs() -> None:
    (example,) = blocks('topics.md', 'python')
    rows = np.zeros(4, WAVEFORM_DTYPE)
    rows['disk_z'] = [1, 2, 3, 4]
    scope = {'message': encode(WaveformBlock(0, rows), messages.OFFLINE)}
    exec(example, scope)  # noqa: S102 - our own documentation
    assert scope['block'].rows['disk_z'].tolist() == [1, 2, 3, 4]


@pytest.mark.parametrize(
    ('name', 'script'),
    [('indicators.md', 'make_indicator_tables.py'), ('plants.md', 'make_element_tables.py')],
)
def test_generated_tables_are_those_of_the_registry(name: str, script: str) -> None:
    spec = importlib.util.spec_from_file_location('tables', DOCS / script)
    assert spec is not None
    assert spec.loader is not None
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    page = text(name)
    assert page[page.index(made.MARK) :] == made.tables(), f'run docs/{script}'


def test_the_plant_of_the_page_is_as_it_says(capsys: pytest.CaptureFixture[str]) -> None:
    (example,) = blocks('plants.md', 'python')
    exec(compile(example, 'plants.md', 'exec'), {})  # noqa: S102 - our own documentation
    assert capsys.readouterr().out.splitlines() == re.findall(r'print\(.*# (.*)', example)


@pytest.mark.slow
def test_the_picture_of_the_view_shows_what_the_present_program_shows(tmp_path: Path) -> None:
    spec = importlib.util.spec_from_file_location('pictures', DOCS / 'make_view_pictures.py')
    assert spec is not None
    assert spec.loader is not None
    pictures = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(pictures)
    flight, view = tmp_path / 'flight.mcap', tmp_path / 'flight.rrd'
    pictures.fly(flight)
    view_recording(flight, save=view)
    with Image.open(DOCS / 'images' / f'{pictures.FLIGHT}.png') as image:
        drawn = str(image.info['Description']).splitlines()
    assert pictures.words(view).splitlines() == drawn, 'run docs/make_view_pictures.py'
    (rule,) = load_scenario(pictures.FLIGHT).monitor.alarm.rules
    assert f'{rule.indicator}: WARN {rule.warn:g}, ERROR {rule.error:g}' in drawn
    state = analyze_recording(flight).state
    assert f'{state.level}: {state.reasons}' in drawn


@pytest.mark.parametrize('page', [ROOT / 'README.md', *sorted(DOCS.rglob('*.md'))])
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r'\]\((?!https?:)([^)#]+)', page.read_text('utf-8')):
        assert (page.parent / target).exists(), f'{page.name} links to {target}'
