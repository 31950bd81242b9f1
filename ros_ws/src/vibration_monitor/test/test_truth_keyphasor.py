# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The monitor on a key-phasor alone, against signals whose answer is known by construction."""

import cmath
import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from monitor_signals import (
    RATE_HZ,
    Component,
    blocks,
    ramp_angle,
    run,
    same,
    signal,
    steady_angle,
    table,
)
from vibration_monitor import IndicatorRecord, MonitorConfig, VibrationMonitor

CONFIG = MonitorConfig(orders=(0.5, 1.0, 2.0, 3.0), extras=())
COMPONENTS: list[Component] = [
    (0.5, 2e-7, 0.3),
    (1.0, 2e-6, -1.2),
    (2.0, 1e-6, 3.1),
    (3.0, 5e-7, 0.0),
]
# The centre of a pulse of 12 degrees is right to 0.02 samples where it has 4 samples or more (up to
# 600 rad/s), 6e-4 rad; with 2 samples (1000 rad/s) to 0.1 samples, 0.01 rad. A window averages 30
# pulses, but their errors are not independent: a third is allowed.
TOLERANCE, FEW_SAMPLES = 2e-4, 3e-3

WIDTH_RAD = math.radians(12.0)
PULSE_V = 5.0


def pulses(angle: NDArray[np.float64], centres: Sequence[float] | None = None) -> np.ndarray:
    """Return pulses of 5 V and 12 degrees, at the whole turns or at `centres` (revolutions)."""
    turns = angle / (2 * math.pi)
    if centres is None:
        offset = turns - np.round(turns)
    else:
        places = np.sort(np.asarray(centres))
        after = np.clip(np.searchsorted(places, turns), 1, len(places) - 1)
        offset = np.minimum(np.abs(turns - places[after - 1]), np.abs(places[after] - turns))
    inside = np.clip(1.0 - (offset * 2 * math.pi / (WIDTH_RAD / 2)) ** 2, 0.0, None)
    return PULSE_V * inside**2


def rows_of(angle: NDArray[np.float64], volts: np.ndarray) -> NDArray[np.void]:
    rows = table(angle, {'disk_z': signal(angle, COMPONENTS), 'keyphasor': volts})
    rows['angle'] = math.nan
    return rows


def error(record: IndicatorRecord) -> float:
    """Return the largest error of a vector in parts of the largest one, 2 um at 1x."""
    worst = 0.0
    for order, amplitude, phase in COMPONENTS:
        found = record.vector('disk_z', f'order_{order:g}')
        expected = amplitude * cmath.exp(1j * phase)
        difference = abs(found - expected)
        if not order.is_integer():
            # the key-phasor counts from another revolution: an odd number turns 0.5x by pi
            difference = min(difference, abs(found + expected))
        worst = max(worst, difference / 2e-6)
    return worst


def check(records: list[IndicatorRecord], count: int, tolerance: float) -> None:
    assert len(records) >= count
    assert [record.window for record in records] == list(range(len(records)))
    for record in records:
        assert record.valid
        assert error(record) < tolerance


@pytest.mark.parametrize('speed_rad_s', [40.0, 150.0, 263.0, 352.0, 542.0, 1000.0])
def test_constant_speed(speed_rad_s: float) -> None:
    angle = 1.0 + steady_angle(2 * math.pi * 105 / speed_rad_s, speed_rad_s)
    monitor = VibrationMonitor(CONFIG)
    records = run(monitor, blocks(rows_of(angle, pulses(angle)), 256))
    check(records, 2, FEW_SAMPLES if speed_rad_s > 600 else TOLERANCE)
    # 0.1 samples at both ends of a window of 4100 samples or more
    assert records[0].value('speed_rad_s') == pytest.approx(speed_rad_s, rel=5e-5)
    status = monitor.status()
    assert status['angle from'] == 'key-phasor'
    assert status['key-phasor pulses missed [1]'] == 0
    assert status['key-phasor pulses too many [1]'] == 0


@pytest.mark.parametrize(('start', 'ramp'), [(352.0, 20.0), (100.0, 50.0), (900.0, -100.0)])
def test_while_the_speed_sweeps(start: float, ramp: float) -> None:
    angle = ramp_angle(4.0, start, ramp)
    records = run(VibrationMonitor(CONFIG), blocks(rows_of(angle, pulses(angle)), 256))
    check(records, 3, FEW_SAMPLES if start > 600 else TOLERANCE)


def governor_angle() -> NDArray[np.float64]:
    """A governor that hunts: 352 rad/s and 2 percent at 0.5 Hz."""
    time = np.arange(6 * RATE_HZ) / RATE_HZ
    rate = 2 * math.pi * 0.5
    angle: NDArray[np.float64] = 352.0 * (time + 0.02 * (1 - np.cos(rate * time)) / rate)
    return angle


def test_while_the_governor_hunts() -> None:
    angle = governor_angle()
    records = run(VibrationMonitor(CONFIG), blocks(rows_of(angle, pulses(angle)), 256))
    check(records, 10, TOLERANCE)


def test_missed_and_double_pulses_are_bridged_and_counted() -> None:
    angle = ramp_angle(5.0, 300.0, 20.0)
    whole = np.arange(math.floor(angle[-1] / (2 * math.pi)) + 1, dtype=float)
    missed = [40, 41, 77, 120, 121, 122, 200]
    doubled = {30: 0.4, 60: 0.1, 90: 0.95, 91: 0.5, 150: 0.8}
    centres = [turn for turn in whole if turn not in missed]
    centres += [turn + later for turn, later in doubled.items()]
    monitor = VibrationMonitor(CONFIG)
    records = run(monitor, blocks(rows_of(angle, pulses(angle, centres)), 256))
    check(records, 10, TOLERANCE)
    status = monitor.status()
    assert status['key-phasor pulses missed [1]'] == len(missed)
    assert status['key-phasor pulses too many [1]'] == len(doubled)
    assert status['key-phasor lost [1]'] == 0


@pytest.mark.parametrize('seed', [1, 2, 3])
def test_noise_on_the_pulses(seed: int) -> None:
    angle = steady_angle(4.0, 352.0)
    rng = np.random.default_rng(seed)
    volts = pulses(angle) + 0.1 * rng.standard_normal(len(angle)) - 10.0
    monitor = VibrationMonitor(CONFIG)
    records = run(monitor, blocks(rows_of(angle, volts), 256))
    # 0.1 V on 9 samples move the centre of a pulse whose samples sum to 16 V by 0.05 samples or
    # 1.6e-3 rad. 1x feels that as it is, and a window averages about 30 pulses: 3e-4; three of
    # them, and as much again for the orders beside it
    check(records, 5, 2e-3)
    assert monitor.status()['key-phasor lost [1]'] == 0


@settings(max_examples=10, deadline=None)
@given(st.lists(st.integers(1, 3000), max_size=30))
def test_no_split_changes_a_bit(sizes: list[int]) -> None:
    angle = ramp_angle(2.5, 300.0, 40.0)
    rng = np.random.default_rng(1)
    rows = rows_of(angle, pulses(angle) + 0.05 * rng.standard_normal(len(angle)))
    assert same(
        run(VibrationMonitor(CONFIG), blocks(rows, sizes)),
        run(VibrationMonitor(CONFIG), blocks(rows, 256)),
    )
