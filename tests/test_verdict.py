# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The verdict on a flight: OK only where the monitor could see, one window for each sentence."""

import json
from pathlib import Path
from typing import Any

import pytest
import yaml
from typer.testing import CliRunner

from rig_support import OfflineFlights, Rig, recorded
from rotor_bringup.cli import app
from rotor_interfaces import topics
from rotor_interfaces.messages import level_of
from rotor_recording.reading import Recording
from rotor_rig.scenario_model import load_scenario

SOFTER_SHAFT_N_M = 1.5e7
"""Stiffness of a shaft whose crack the monitor did not see while it took the default's."""


def flown(rig: Rig, folder: Path, scenario: str, **changes: Any) -> Path:
    """Return the recording of a shipped scenario with other top-level values, flown offline."""
    plan = {**load_scenario(scenario).plain(), **changes}
    plan.pop('monitor')
    (folder / 'flight.yaml').write_text(yaml.safe_dump(plan))
    done = rig('simulate', folder / 'flight.yaml', '--out', folder / 'flight.mcap')
    assert done.code == 0, done.err
    return folder / 'flight.mcap'


def said(*words: object) -> Any:
    """Return what a command says that ends well, run in this process."""
    done = CliRunner().invoke(app, [str(word) for word in words], env={'COLUMNS': '200'})
    assert done.exit_code == 0, done.stderr
    return done


@pytest.mark.slow
@pytest.mark.parametrize(
    ('scenario', 'crack'), [('level_healthy', 0.3), ('level_healthy', 0.0), ('run_up', 0.1)]
)
def test_without_a_test_signal_no_shaft_is_called_sound(
    rig: Rig, tmp_path: Path, scenario: str, crack: float
) -> None:
    recording = flown(rig, tmp_path, scenario, rotor={'crack_stiffness_ratio': crack})
    reason = 'cannot judge: crack_ratio_low: the load has not changed by 0.079 g in the last minute'
    analyzed = json.loads(said('analyze', recording, '--json').stdout)
    assert analyzed['worst_alarm'] == 'STALE'
    assert analyzed['alarm_reasons'] == reason
    assert analyzed['judged_windows'] == 0
    assert analyzed['windows'] > 60
    assert analyzed['first_alarm_s'] is None
    printed = said('analyze', recording).stdout
    assert f'monitor: {reason}' in printed
    assert 'OK' not in printed
    statuses = [message.status[0] for _, message in recorded(Recording(recording), topics.ALARM)]
    assert {level_of(status) for status in statuses} == {3}
    assert statuses[-1].message == reason


@pytest.mark.slow
def test_a_sound_shaft_is_ok_once_the_load_has_changed(offline: OfflineFlights) -> None:
    analyzed = json.loads(said('analyze', offline('climb_dive_healthy'), '--json').stdout)
    assert analyzed['worst_alarm'] == 'OK'
    assert analyzed['alarm_reasons'] == ''
    judged, windows = analyzed['judged_windows'], analyzed['windows']
    assert 0 < judged < windows
    assert analyzed['conclusion'] == (
        f'no alarm in {judged} windows, {windows - judged} others could not be judged'
    )


@pytest.mark.slow
def test_a_sentence_joins_the_time_and_the_value_of_one_window(
    offline: OfflineFlights, tmp_path: Path
) -> None:
    recording, windows = offline('growing_crack'), tmp_path / 'windows.json'
    analyzed = json.loads(said('analyze', recording, '--json', '--out', windows).stdout)
    rows = json.loads((tmp_path / 'windows.json').read_text())
    epoch_ns = load_scenario('growing_crack').epoch_ns
    assert (analyzed['first_alarm'], analyzed['worst_alarm']) == ('WARN', 'ERROR')
    for level, time_key, reason_key in (
        ('WARN', 'first_alarm_s', 'first_alarm_reasons'),
        ('ERROR', 'worst_alarm_s', 'alarm_reasons'),
    ):
        first = next(row for row in rows if row['alarm'] == level)
        assert analyzed[time_key] == pytest.approx((first['stamp_ns'] - epoch_ns) * 1e-9, abs=1e-6)
        value = first['crack_ratio_low']
        assert f'crack_ratio_low = {value:.4g}: 3 of the last 5 windows' in analyzed[reason_key]
        assert f'the {level} limit' in analyzed[reason_key]
    assert analyzed['first_alarm_s'] < analyzed['worst_alarm_s'] - 10.0
    assert analyzed['conclusion'] == (
        f'ERROR at {analyzed["worst_alarm_s"]:.1f} s: {analyzed["alarm_reasons"]} '
        f'(first alarm: WARN at {analyzed["first_alarm_s"]:.1f} s)'
    )


@pytest.mark.slow
def test_the_monitor_takes_the_rotor_from_the_scenario(rig: Rig, tmp_path: Path) -> None:
    rotor = {'crack_stiffness_ratio': 0.1, 'shaft_stiffness_n_m': SOFTER_SHAFT_N_M}
    recording, windows = flown(rig, tmp_path, 'climb_dive', rotor=rotor), tmp_path / 'windows.json'
    analyzed = json.loads(said('analyze', recording, '--json', '--out', windows).stdout)
    assert analyzed['worst_alarm'] == 'ERROR'
    last = json.loads((tmp_path / 'windows.json').read_text())[-1]
    # the crack of K = 0.1; with the stiffness of the default it was 0.0105
    assert last['crack_ratio'] == pytest.approx(0.1, abs=0.01)


def test_a_monitor_that_contradicts_the_rotor_is_warned_of(tmp_path: Path) -> None:
    file = tmp_path / 'a.yaml'
    file.write_text(
        'maneuver: {profile: climb_dive}\n'
        f'rotor: {{shaft_stiffness_n_m: {SOFTER_SHAFT_N_M:.2e}}}\n'
        'monitor: {crack: {rigid_critical_speed_rad_s: 1248.0, damping_ratio: 0.01}}\n'
    )
    warning = (
        'warning: monitor.crack.rigid_critical_speed_rad_s = 1248 contradicts the rotor, which has '
        '966.736'
    )
    done = said('scenario', 'check', file)
    assert done.stderr.startswith(warning)
    assert done.stderr.count('warning') == 1
    done = said('simulate', file, '--duration', 0.2, '--out', tmp_path / 'a.mcap')
    assert done.stderr.startswith(warning)
