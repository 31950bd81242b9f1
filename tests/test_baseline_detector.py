# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The detector `baseline` on simulated flights: what it scores, when it is silent, and live."""

import copy
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from maneuver_gen.load_grid import load_grid
from rotor_interfaces.waveform import WaveformBlock
from rotor_rig.scenario_model import Scenario
from rotor_sim.stream.load_grid import LoadGrid
from rotor_sim.stream.simulator import RotorSimulator
from vibration_monitor.crack_model import CrackConfig
from vibration_monitor.detectors.baseline import BaselineDetector, baseline_of
from vibration_monitor.monitor import VibrationMonitor
from vibration_monitor.monitor_config import MonitorConfig

Rows = NDArray[np.void]
PULLS = {'profile': 'sinusoid', 'mean': 2.5, 'amplitude': 1.5, 'frequency_hz': 0.2}
LEVEL = {'profile': 'constant', 'load_factor': 1.0}
DURATION_S = 24.0
pytestmark = pytest.mark.slow


def fly(maneuver: dict[str, Any], crack: float, seed: int, **sensors: Any) -> Rows:
    """Return what the sensors of one machine say on a flight."""
    scenario = Scenario.from_mapping(
        {
            'name': 'flight',
            'duration_s': DURATION_S,
            'seed': seed,
            'speed': {'initial_rad_s': 497.0, 'highest_rad_s': 500.0},
            'steps_per_revolution': 256,
            'maneuver': maneuver,
            'rotor': {'crack_stiffness_ratio': crack, 'clearance_m': 5e-6},
            'forcing': {'amplitude_n': 20.0},
            'sensors': {'preset': 'realistic', 'imu_rate_hz': 0, **sensors},
            'settle_revolutions': 60,
        }
    )
    grid = LoadGrid.from_points(load_grid(scenario.maneuver, DURATION_S))
    simulator = RotorSimulator(scenario.rotor_sim())
    simulator.prepare(grid)
    return simulator.advance(int(DURATION_S * scenario.rate_hz), grid).rows


def blocks(rows: Rows, size: int = 2048) -> Iterator[WaveformBlock]:
    for start in range(0, len(rows), size):
        yield WaveformBlock(0, rows[start : start + size])


# the scales of the disk's probes 5 % up, of the bearings' 4 % down: a machine that looked cracked
# before probe errors were learnt
ERRORS: dict[str, Any] = {
    'proximity': {
        **{f'disk_{axis}': {'scale_error': 0.05} for axis in 'yz'},
        **{f'brg{i}_{axis}': {'scale_error': -0.04} for i in (1, 2) for axis in 'yz'},
    }
}


@pytest.fixture(scope='module')
def healthy() -> Rows:
    return fly(PULLS, 0.0, 1, **ERRORS)


@pytest.fixture(scope='module')
def cracked() -> Rows:
    return fly(PULLS, 0.03, 2, **ERRORS)


@pytest.fixture(scope='module')
def fitted(healthy: Rows) -> BaselineDetector:
    detector = BaselineDetector()
    detector.fit([blocks(healthy)])
    return detector


def scores(fitted: BaselineDetector, rows: Rows, size: int = 2048) -> list[float]:
    detector = copy.deepcopy(fitted)
    return [detector.push(block).score for block in blocks(rows, size)]


def test_probe_errors_near_half_the_critical_speed_raise_no_alarm(
    fitted: BaselineDetector, healthy: Rows
) -> None:
    untaught = BaselineDetector()
    told = [untaught.push(block).score for block in blocks(healthy)]
    other = scores(fitted, fly(PULLS, 0.0, 3, **ERRORS))
    assert np.nanmax(told) < 0.1 * fitted.alarm_score
    assert np.nanmax(other) < 0.1 * fitted.alarm_score


@pytest.mark.parametrize('gain', [0.85, 1.15])
def test_a_probe_whose_gain_changed_after_the_reference_raises_no_alarm(
    fitted: BaselineDetector, healthy: Rows, cracked: Rows, gain: float
) -> None:
    def changed(rows: Rows) -> Rows:
        other = rows.copy()
        other['disk_y'] *= gain
        return other

    assert np.nanmax(scores(fitted, changed(healthy))) < 0.5 * fitted.alarm_score
    assert scores(fitted, changed(cracked))[-1] > fitted.alarm_score


def test_a_crack_is_found_with_its_depth_whatever_the_block_size(
    fitted: BaselineDetector, cracked: Rows
) -> None:
    found = scores(fitted, cracked)
    assert fitted.alarm_score < found[-1] < 0.03
    assert scores(fitted, cracked, 777)[-1] == found[-1]
    # 10 s to settle, then 4 more windows of 32 revolutions
    first = next(i for i, score in enumerate(found) if not math.isnan(score))
    assert 11.4 < first * 2048 / 10240 < 12.8


def test_it_is_silent_once_a_probe_or_the_angle_is_lost(
    fitted: BaselineDetector, cracked: Rows
) -> None:
    lost = cracked.copy()
    end = int(18.0 * 10240)
    lost['brg1_y'][end:] = math.nan
    # the next window is the first that the loss touches
    assert not math.isnan(scores(fitted, lost)[17 * 5])
    assert all(math.isnan(score) for score in scores(fitted, lost)[20 * 5 :])
    still = cracked.copy()
    end = int(13.5 * 10240)
    still['angle'][end:] = math.nan
    still['keyphasor'][end:] = 0.0
    told = scores(fitted, still)
    assert not math.isnan(told[16 * 5])
    assert math.isnan(told[-1])


def test_the_reference_alone_stays_below_the_alarm(fitted: BaselineDetector) -> None:
    found = scores(fitted, fly(LEVEL, 0.04, 4, **ERRORS))
    assert 0.0 < np.nanmax(found) < fitted.alarm_score


def test_the_live_alarm_is_that_of_the_detector(
    fitted: BaselineDetector, healthy: Rows, cracked: Rows
) -> None:
    crack = CrackConfig(baseline=baseline_of([blocks(healthy)]))
    monitor = VibrationMonitor(MonitorConfig(crack=crack))
    warned = math.inf
    for block in blocks(cracked):
        for record in monitor.push(block):
            if record.alarm.level in (1, 2):
                warned = min(warned, record.last_sample / 10240)
    found = scores(fitted, cracked)
    alarmed = next(i for i, score in enumerate(found) if score >= fitted.alarm_score) * 2048 / 10240
    # the live monitor asks 3 of its last 5 windows, 16 revolutions apart, besides
    assert warned == pytest.approx(alarmed, abs=1.5)
