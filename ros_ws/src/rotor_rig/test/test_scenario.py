# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A scenario as it is shown is the scenario; a recording that lies about its own is said so."""

import json
from pathlib import Path
from typing import Any

import pytest
import yaml
from typer.testing import CliRunner

from rotor_bench.dataset.suite_config import load_suite, shipped_suites
from rotor_bringup.analysis import analyze_recording
from rotor_bringup.cli import app
from rotor_common.configuration import unit_of
from rotor_common.errors import RigError
from rotor_common.plain_data import dump_yaml, parse_yaml
from rotor_interfaces import messages, topics
from rotor_interfaces.messages import OFFLINE
from rotor_recording.reading import Recording
from rotor_recording.recording import RecordingWriter
from rotor_rig.errors import ScenarioError
from rotor_rig.pipeline import record
from rotor_rig.scenario import Scenario, load_scenario, shipped_scenarios
from rotor_sim.plant.parameters import VARIANTS, RotorParameters

PHYSICAL = [n for n in RotorParameters.model_fields if n not in {'variant', *VARIANTS['derived']}]


def shown(source: str) -> str:
    done = CliRunner().invoke(app, ['scenario', 'show', source])
    assert done.exit_code == 0, done.output
    return done.stdout


def assert_shown_is_loaded(source: str, tmp_path: Path) -> None:
    file = tmp_path / 'again.yaml'
    file.write_text(shown(source), 'utf-8')
    assert load_scenario(str(file)) == load_scenario(source)
    assert shown(str(file)) == shown(source)
    assert Scenario.from_mapping(yaml.safe_load(shown(source))) == load_scenario(source)
    as_json = CliRunner().invoke(app, ['scenario', 'show', source, '--json']).stdout
    assert Scenario.from_mapping(json.loads(as_json)) == load_scenario(source)


@pytest.mark.parametrize('name', shipped_scenarios())
def test_a_shipped_scenario_as_shown_is_the_same(name: str, tmp_path: Path) -> None:
    assert_shown_is_loaded(name, tmp_path)


def test_every_parameter_of_the_rotor_is_shown_with_its_unit(tmp_path: Path) -> None:
    file = tmp_path / 'a.yaml'
    file.write_text(
        'variant: figure\nrotor: {eccentricity_m: 2e-05}\nmaneuver: {profile: constant}\n'
    )
    lines = [line for line in shown(str(file)).split('speed:')[0].splitlines() if ':' in line]
    found = {line.split(':')[0].strip(): line for line in lines}
    for name in PHYSICAL:
        unit = unit_of(RotorParameters.model_fields[name])
        assert found[name].endswith(f'  # {unit}') == (unit != '1'), found[name]
    rotor = parse_yaml(shown(str(file)))['rotor']
    wanted = RotorParameters.hou2016('figure', eccentricity_m=2e-5).model_dump()
    assert rotor == {name: wanted[name] for name in PHYSICAL}


@pytest.mark.parametrize(
    'name', ['010', '1e5', 'yes', '0o17', '08', '1_000', 'null', '2024-01-01', '-', '0x1F']
)
def test_a_name_that_looks_like_more(name: str, tmp_path: Path) -> None:
    """Also with a recorded flight, whose path is made absolute."""
    (tmp_path / 'flight.csv').write_text('time_s,load_factor\n0,1\n100,1\n')
    file = tmp_path / 'a.yaml'
    flight = {'profile': 'recorded', 'path': 'flight.csv'}
    file.write_text(dump_yaml({'name': name, 'description': f'{name}:\n  a', 'maneuver': flight}))
    assert load_scenario(str(file)).name == name
    assert_shown_is_loaded(str(file), tmp_path)


def test_a_recording_as_shown_is_the_same_and_gives_the_same_bytes(tmp_path: Path) -> None:
    given = load_scenario('hidden_crack', duration_s=0.2)
    first, second = tmp_path / 'first.mcap', tmp_path / 'second.mcap'
    steps = [step.block.rows for step in record(given, first)]
    assert load_scenario(str(first)) == given
    assert_shown_is_loaded(str(first), tmp_path)
    again = [step.block.rows for step in record(load_scenario(str(first)), second)]
    assert [rows.tobytes() for rows in again] == [rows.tobytes() for rows in steps]


def test_a_stated_default_changes_nothing() -> None:
    plain = load_scenario('climb_dive').plain()
    bare = {**plain, 'rotor': {'crack_stiffness_ratio': plain['rotor']['crack_stiffness_ratio']}}
    assert Scenario.from_mapping(bare) == load_scenario('climb_dive')


def with_config(path: Path, text: str) -> Path:
    """Write a recording whose run configuration is `text`, in both places."""
    with RecordingWriter.single_file(path) as writer:
        writer.add_config(text)
        writer.write(topics.CONFIG, messages.to_cdr(messages.string(OFFLINE, text)), 0, 0)
        for step in record(load_scenario('climb_dive', duration_s=0.2), path.with_suffix('.tmp')):
            for topic, stamp_ns, message in step.messages:
                if topic == topics.WAVEFORM:
                    writer.write(topic, messages.to_cdr(message), stamp_ns, stamp_ns)
    return path


CONFIGS = [
    'null', '[]', '3', '{', '{"scenario": null}', '{"scenario": []}', '{"scenario": "x"}',
    '{"scenario": {"monitor": null}}', '{"scenario": {"monitor": []}}',
    '{"scenario": {"rotor": 1}}',
    '{"scenario": {"monitor": {"window_revolutions": NaN}}}',
    '{"scenario": {"seed": ' + '9' * 5000 + '}}', '{"scenario": ' + '[' * 100_000,
    '{"scenario": {"maneuver": ' + '{"maneuver": ' * 60 + '1' + '}' * 62,
    '{"scenario": {"seed": 1e999}}', '{"scenario": {}, "scenario": {}}',
    '{"scenario": {"name": "\\ud800", "maneuver": {"profile": "constant"}}}',
    '{"scenario": {"name": null, "maneuver": null}}',
]  # fmt: skip


@pytest.mark.parametrize('text', CONFIGS)
def test_a_recorded_configuration_of_any_kind(text: str, tmp_path: Path) -> None:
    path = with_config(tmp_path / 'a.mcap', text)
    with pytest.raises(RigError) as caught:
        load_scenario(str(path))
    assert len(str(caught.value)) < 1000
    config: dict[str, Any] = Recording(path).config() or {}
    scenario = config.get('scenario', {})
    # null is as good as no section
    if isinstance(scenario, dict) and not isinstance(scenario.get('monitor'), dict | None):
        with pytest.raises(RigError, match='monitor'):
            analyze_recording(path)
        return
    analysis = analyze_recording(path)
    if scenario is None or isinstance(scenario, list | str):
        assert any('scenario' in sentence for sentence in analysis.damage)
    if not config and text != '{}':
        assert any('JSON mapping' in sentence for sentence in analysis.damage)


def test_every_shipped_suite_is_plain() -> None:
    for name in shipped_suites():
        suite = load_suite(name)
        assert parse_yaml(dump_yaml(suite.plain())) == suite.plain()


def test_a_scenario_from_a_name_that_is_no_file(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match='neither a file'):
        load_scenario('/dev/zero')
    with pytest.raises(ScenarioError, match='neither a file'):
        load_scenario(str(tmp_path / 'none.yaml'))
