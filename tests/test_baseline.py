# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""`rotor-rig baseline` and the crack estimate, on flights that the simulator made."""

import json
import math
from pathlib import Path
from typing import Any

import pytest
import yaml
from typer.testing import CliRunner

from rotor_bringup.cli import app
from rotor_rig.pipeline import record, simulate
from rotor_rig.scenario_model import Scenario, load_scenario

DESIGN_RAD_S = math.sqrt(2 * 2.5e7 / 32.1)
FLIGHT: dict[str, Any] = {
    'name': 'flight',
    'duration_s': 20.0,
    'speed': {'initial_rad_s': 410.0},
    'maneuver': {'profile': 'sinusoid', 'mean': 2.5, 'amplitude': 1.5, 'frequency_hz': 0.2},
    'rotor': {'crack_stiffness_ratio': 0.0, 'clearance_m': 2e-6, 'eccentricity_m': 2e-5},
    'forcing': {'amplitude_n': 40.0, 'phase_rad': 1.0},
    'sensors': {'preset': 'realistic', 'imu_rate_hz': 0},
    'settle_revolutions': 60,
}


def flight(**rotor: float) -> Scenario:
    return Scenario.from_mapping({**FLIGHT, 'rotor': {**FLIGHT['rotor'], **rotor}})


def final(scenario: Scenario) -> dict[str, float]:
    """Return the indicators of the last window."""
    windows = [window for step in simulate(scenario) for window in step.records]
    return windows[-1].indicators()


@pytest.mark.slow
@pytest.mark.parametrize('speed_rad_s', [250.0, 410.0, 536.0])
def test_the_estimate_is_the_crack_of_the_simulated_rotor(speed_rad_s: float) -> None:
    # 536 rad/s is half the critical speed, where the size of 2x says nothing
    scenario = flight(crack_stiffness_ratio=0.04, crack_angle_rad=-2.0)
    speed = scenario.speed.model_copy(update={'initial_rad_s': speed_rad_s})
    found = final(scenario.model_copy(update={'speed': speed}))
    # errors of the preset's probes: 2.6 % of scale, 2 um of runout on a bend of 30 um
    assert found['crack_ratio'] == pytest.approx(0.04, rel=0.2)
    assert 0.005 < found['crack_ratio_low'] < 0.04
    assert math.remainder(found['crack_angle'] + 2.0, 2 * math.pi) == pytest.approx(0.0, abs=0.3)


@pytest.mark.slow
def test_a_sound_rotor_with_unbalance_misalignment_and_clearance_shows_none() -> None:
    assert final(flight())['crack_ratio_low'] < 0.0


@pytest.mark.slow
def test_level_flight_with_perfect_sensors_is_no_evidence() -> None:
    # nothing but nanometres change: they must not pass for a load that changes
    level = {'speed': {'initial_rad_s': 352.0}, 'maneuver': {'profile': 'constant'}}
    found = final(Scenario.from_mapping({'name': 'level', 'duration_s': 20.0, **level}))
    assert found['crack_ratio_low'] <= 0.0


@pytest.mark.slow
def test_a_baseline_is_part_of_a_scenario(tmp_path: Path) -> None:
    for number, stiffness in enumerate((2.5e7, 2.4e7)):
        file = tmp_path / f'healthy_{number}.mcap'
        for _ in record(flight(shaft_stiffness_n_m=stiffness), file):
            pass
        result = CliRunner().invoke(app, ['baseline', str(file), '--json'])
        assert result.exit_code == 0, result.output
        part = json.loads(result.stdout)
        measured = part['monitor']['crack']['baseline']['rigid_critical_speeds_rad_s']
        # the ball-pass line says how stiff this shaft is, whatever the drawing says
        wanted = DESIGN_RAD_S * math.sqrt(stiffness / 2.5e7)
        assert measured == pytest.approx([wanted, wanted], rel=0.02)
    text = CliRunner().invoke(app, ['baseline', str(file)]).stdout
    scenario = tmp_path / 'with_baseline.yaml'
    scenario.write_text(yaml.safe_dump({**FLIGHT, **yaml.safe_load(text)}))
    assert load_scenario(str(scenario)).monitor.crack.baseline is not None


def test_a_baseline_needs_the_probes(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ['baseline', str(tmp_path / 'nothing.mcap')])
    assert result.exit_code == 2
    assert 'nothing.mcap' in result.output
