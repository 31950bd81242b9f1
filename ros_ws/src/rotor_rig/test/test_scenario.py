# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A scenario as it is shown is the scenario; a recording that lies about its own is said so."""

import json
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
import yaml
from typer.testing import CliRunner

import rotor_rig
from maneuver_gen.maneuvers.constant import Constant
from rotor_bench.dataset.suite_config import load_suite, shipped_suites
from rotor_bringup.analysis import analyze_recording
from rotor_bringup.cli import app
from rotor_common.configuration import unit_of
from rotor_common.errors import ConfigError, RigError
from rotor_common.plain_data import dump_yaml, parse_yaml
from rotor_interfaces import messages, topics
from rotor_interfaces.messages import OFFLINE
from rotor_recording.reading import Recording
from rotor_recording.recording import RecordingWriter
from rotor_rig.errors import ScenarioError
from rotor_rig.pipeline import record
from rotor_rig.scenario_model import Scenario, load_scenario, shipped_scenarios
from rotor_sim.plant.parameters import OF_THE_VARIANT, RotorParameters
from rotor_sim.rotor_config import RotorSimConfig
from vibration_monitor.monitor_config import MonitorConfig

PHYSICAL = [n for n in RotorParameters.model_fields if n not in OF_THE_VARIANT]


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


def test_values_are_shown_with_their_units_and_readings_of_the_variant_as_comments() -> None:
    lines = load_scenario('hidden_crack').yaml().splitlines()
    for line in (
        '  # phase_convention: atan2_z_y, of the variant',
        '  initial_rad_s: 440.0  # rad/s',
        'duration_s: 60.0  # s',
        '    range: 490.3325  # m/s^2',
    ):
        assert line in lines
    assert not [line for line in lines if '# u' in line]


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


def test_each_part_is_validated_once_and_handed_on(monkeypatch: pytest.MonkeyPatch) -> None:
    plain, counts = load_scenario('climb_dive').plain(), Counter[str]()
    for part, method in (
        (RotorParameters, 'check_crack'),
        (MonitorConfig, '_check_separation'),
        (RotorSimConfig, '_check_speed'),
    ):
        monkeypatch.setattr(part, method, lambda self, *_: counts.update([type(self).__name__]))
    scenario = Scenario.from_mapping(plain)
    orders = len(scenario.monitor.orders)
    assert counts == {'RotorParameters': 1, 'MonitorConfig': orders, 'RotorSimConfig': 1}
    assert scenario.rotor_sim().rotor is scenario.rotor
    assert scenario.rotor_sim().speed is scenario.speed
    assert counts.total() == 2 + orders
    assert not isinstance(scenario, RotorSimConfig)


@pytest.mark.parametrize(
    ('changes', 'sentence'),
    [
        ({'rotor': {'clearance_m': 5.0}}, r'^rotor.clearance_m = 5.0 is out of range; .* 0.0001 m'),
        ({'rotor': {'clearence_m': 0}}, "^rotor.clearence_m is not .* did you mean 'clearance_m'"),
        ({'rotor': {'load_scale': 2.0}}, '^rotor: load_scale belongs to the variant'),
        ({'rotor': {'ball_count': 2}, 'monitor': 3}, '^rotor.ball_count = 2 is out of range'),
        ({'monitor': {'crack': {'memory_s': -1}}}, '^monitor.crack.memory_s = -1 is out of range'),
        ({'monitor': {'orders': 1}}, '^monitor.orders = 1 is not allowed'),
        ({'monitor': []}, '^monitor'),
    ],
)
def test_an_error_names_the_key_of_the_part(changes: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ConfigError, match=sentence):
        load_scenario('climb_dive', **changes)


def test_a_scenario_of_parts_made_in_python() -> None:
    rotor = RotorParameters.hou2016('natural', ball_count=9)
    flight = Constant(load_factor=2.0)
    scenario = rotor_rig.Scenario(name='a', variant='natural', rotor=rotor, maneuver=flight)
    assert scenario.rotor is rotor
    assert scenario.maneuver is flight
    assert scenario.monitor.ball_count == 9
    assert Scenario.from_mapping(scenario.plain()) == scenario
    assert Scenario.from_mapping(parse_yaml(scenario.yaml())) == scenario


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
