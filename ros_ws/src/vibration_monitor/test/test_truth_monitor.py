# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The whole monitor against signals whose answer is known by construction.

Waveform columns are float32, so every sample carries a rounding error of 3e-8 of the largest
value; it averages out over the 11 700 samples of a window.
"""

import math
from itertools import pairwise

import numpy as np
import pytest

from monitor_signals import (
    BALL_PASS,
    EPOCH_NS,
    RATE_HZ,
    blocks,
    ramp_angle,
    run,
    signal,
    steady_angle,
    table,
    wrapped,
)
from vibration_monitor import IndicatorRecord, MonitorConfig, VibrationMonitor

ORDERS = MonitorConfig().orders
MICRON = 1e-6

COMPONENTS = [
    (0.5, 0.2 * MICRON, 0.3),
    (1.0, 2.0 * MICRON, -1.2),
    (1.5, 0.1 * MICRON, 2.9),
    (2.0, 1.0 * MICRON, 3.1),
    (2.5, 0.4 * MICRON, -2.0),
    (3.0, 0.5 * MICRON, 0.0),
    (4.0, 0.25 * MICRON, -0.4),
    (5.0, 0.05 * MICRON, 1.6),
    (BALL_PASS, 0.3 * MICRON, 0.7),
]


def check(record: IndicatorRecord, relative: float, radians: float) -> None:
    for order, amplitude, phase in COMPONENTS:
        name = 'ball_pass' if order == BALL_PASS else f'order_{order:g}'
        found = record.value(f'disk_z/amplitude_{name}')
        assert found == pytest.approx(amplitude, rel=relative), name
        error = wrapped(record.value(f'disk_z/phase_{name}') - phase)
        assert abs(error) < radians, name


@pytest.mark.parametrize('speed_rad_s', [100.0, 263.0, 352.0, 542.0, 1000.0])
def test_orders_at_constant_speed(speed_rad_s: float) -> None:
    angle = steady_angle(2 * math.pi * 100 / speed_rad_s, speed_rad_s)
    rows = table(angle, {'disk_z': 4e-5 + signal(angle, COMPONENTS)}, load_factor=3.0)
    records = run(VibrationMonitor(), blocks(rows, 256))
    assert [record.window for record in records] == [0, 1, 2]
    for record in records:
        # Side lobes (2.5e-5) of the largest component, 2 um, reach the smallest, 0.05 um, only
        # through the ball-pass order and its neighbour 3x; all others are zero there. 4e-5 is
        # 20 times 1x, and its float32 spacing of 3.6e-12 m averages to 2e-14 m.
        check(record, relative=1.3e-5, radians=1.3e-5)
        assert record.value('speed_rad_s') == pytest.approx(speed_rad_s, rel=1e-9)
        assert record.value('load_factor') == pytest.approx(3.0, rel=1e-6)
        assert record.value('load_factor_range') == 0.0


@pytest.mark.parametrize(('start', 'ramp'), [(352.0, 20.0), (100.0, 50.0), (900.0, -100.0)])
def test_orders_while_the_speed_sweeps(start: float, ramp: float) -> None:
    angle = ramp_angle(4.0, start, ramp)
    rows = table(angle, {'disk_z': signal(angle, COMPONENTS)})
    records = run(VibrationMonitor(), blocks(rows, 256))
    assert len(records) >= 3
    for record in records:
        check(record, relative=1.3e-5, radians=1.3e-5)
        # a steady acceleration: the mean speed is that half-way between the ends, in time
        first, last = (
            math.sqrt(start**2 + 2 * ramp * 2 * math.pi * revolutions)
            for revolutions in (16 * record.window, 16 * record.window + 64)
        )
        assert record.value('speed_rad_s') == pytest.approx((first + last) / 2, rel=1e-7)


def test_phases_stand_on_angle_0_and_not_on_the_start_of_the_window() -> None:
    # windows that start after an odd number of revolutions: half orders would turn by pi there
    config = MonitorConfig(hop_revolutions=17)
    angle = steady_angle(3.0, 352.0)
    rows = table(angle, {'disk_z': signal(angle, COMPONENTS)})
    records = run(VibrationMonitor(config), blocks(rows, 256))
    assert len(records) >= 4
    for record in records:
        check(record, relative=1.3e-5, radians=1.3e-5)


@pytest.mark.parametrize('speed_rad_s', [352.0, 353.7])
@pytest.mark.parametrize('phase', [0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
def test_order_3_beside_a_ball_pass_order_ten_times_its_size(
    phase: float, speed_rad_s: float
) -> None:
    angle = steady_angle(2.0, speed_rad_s)
    components = [(1.0, 1e-6, 0.1), (3.0, 1e-7, -0.8), (BALL_PASS, 1e-6, phase)]
    rows = table(angle, {'disk_z': signal(angle, components)})
    for record in run(VibrationMonitor(), blocks(rows, 256)):
        # The demand is 0.5 % and 0.5 degrees. 3.0846 is 5.4 bins away, beyond the main lobe; the
        # highest side lobe is -92 dB, so ten times the size leaks at most 2.5e-4.
        assert record.value('disk_z/amplitude_order_3') == pytest.approx(1e-7, rel=3e-4)
        assert abs(wrapped(record.value('disk_z/phase_order_3') + 0.8)) < 3e-4
        assert record.value('disk_z/ratio_3_1') == pytest.approx(0.1, rel=3e-4)
        assert record.value('disk_z/amplitude_ball_pass') == pytest.approx(1e-6, rel=1e-4)
        assert abs(wrapped(record.value('disk_z/phase_ball_pass') - phase)) < 1e-4


def test_white_noise_spreads_over_the_bins_as_it_must() -> None:
    rng = np.random.default_rng(5)
    sigma = 1e-7
    angle = steady_angle(12.0, 352.0)
    channels = {name: sigma * rng.standard_normal(len(angle)) for name in ('disk_y', 'disk_z')}
    records = run(VibrationMonitor(), blocks(table(angle, channels), 1000))
    samples = 64 * 2 * math.pi / 352.0 * RATE_HZ
    # One bin holds the noise power of a bandwidth of B = 2.0044 bins of 1 / samples each:
    # E(A^2) = 4 sigma^2 B / samples, with nothing folded on top.
    expected = 4 * sigma**2 * 2.0044 / samples
    power = [
        record.value(f'{name}/amplitude_order_{order:g}') ** 2
        for record in records[::4]
        for name in channels
        for order in ORDERS
    ]
    # A^2 is exponential: relative scatter of the mean 1/sqrt(160) = 8 %, three of them allowed
    assert len(power) >= 160
    assert np.mean(power) == pytest.approx(expected, rel=0.25)
    assert records[0].value('disk_z/rms') == pytest.approx(sigma, rel=0.03)
    assert records[0].value('disk_z/kurtosis') == pytest.approx(3.0, abs=0.2)


def test_statistics_of_a_sine() -> None:
    angle = steady_angle(2.0, 352.0)
    rows = table(angle, {'disk_z': 5.0 + 2.0 * np.cos(angle), 'brg1_ay': 3.0 * np.cos(angle)})
    for record in run(VibrationMonitor(), blocks(rows, 256)):
        # the samples cover 64 revolutions but for one sample in 11 700
        assert record.value('disk_z/rms') == pytest.approx(math.sqrt(2.0), rel=1e-4)
        assert record.value('disk_z/crest_factor') == pytest.approx(math.sqrt(2.0), rel=5e-4)
        assert record.value('disk_z/kurtosis') == pytest.approx(1.5, rel=2e-4)
        assert record.value('brg1_ay/rms') == pytest.approx(3.0 / math.sqrt(2.0), rel=1e-4)


def test_spectrum_shows_what_is_there() -> None:
    angle = steady_angle(2.0, 352.0)
    components = [(1.0, 2e-6, 0.4), (2.5, 1e-6, 0.2), (7.25, 5e-7, -1.0)]
    rows = table(angle, {'disk_z': signal(angle, components)})
    record = run(VibrationMonitor(), blocks(rows, 256))[0]
    spectrum = record.spectrum
    assert spectrum is not None
    np.testing.assert_array_equal(spectrum.orders, np.arange(641) / 64)
    np.testing.assert_allclose(
        spectrum.frequency_hz, spectrum.orders * 352.0 / (2 * math.pi), rtol=1e-9
    )
    amplitudes = spectrum.amplitudes['disk_z']
    for order, amplitude, _ in components:
        assert amplitudes[round(64 * order)] == pytest.approx(amplitude, rel=1e-4)
    far = np.ones(641, bool)
    for order, _, _ in components:
        far[round(64 * order) - 3 : round(64 * order) + 4] = False
    # the window has no side lobes on bins; what is left is the spline error, below 1e-5
    assert np.max(amplitudes[far]) < 1e-5 * 2e-6


def test_the_highest_order_that_is_given_is_still_right() -> None:
    angle = steady_angle(1.0, 1072.0)
    rows = table(angle, {'disk_z': signal(angle, [(1.0, 1e-6, 0.0), (10.0, 1e-6, 0.0)])})
    record = run(VibrationMonitor(), blocks(rows, 256))[0]
    assert record.spectrum is not None
    # 6.002 samples a cycle: the gain of a quintic spline is 0.99993 (Unser's formula)
    gain = record.spectrum.amplitudes['disk_z'][640] / 1e-6
    assert gain == pytest.approx(1 - 7.33e-5, abs=1e-5)


def test_a_load_ramp_does_not_leak_into_the_orders() -> None:
    angle = steady_angle(2.0, 352.0)
    ramp = 20e-6 * np.arange(len(angle)) / len(angle)
    components = [(1.0, 1e-6, 0.0), (3.0, 1e-8, 0.5)]
    rows = table(angle, {'disk_y': ramp + signal(angle, components)})
    for record in run(VibrationMonitor(), blocks(rows, 256)):
        # The ramp of 11.4 um in a window jumps back at its ends, where the window is 6e-5. A jump
        # J has the component J / (pi k) at bin k; the window's mean of 0.36 is divided out:
        # 11.4 um * 6e-5 / (0.36 pi 32) = 1.9e-11 m at 0.5x (bin 32).
        assert record.value('disk_y/amplitude_order_0.5') < 1.9e-11
        assert record.value('disk_y/amplitude_order_3') == pytest.approx(1e-8, rel=1e-3)


def test_stamps_and_samples_of_a_window() -> None:
    angle = steady_angle(3.0, 352.0)
    rows = table(angle, {'disk_z': np.cos(angle)})
    records = run(VibrationMonitor(), blocks(rows, 205))
    assert len(records) == int((angle[-1] / (2 * math.pi) - 64) // 16) + 1
    for record in records:
        start, end = (2 * math.pi * (16 * record.window + more) for more in (0, 64))
        assert angle[record.first_sample] >= start
        assert record.first_sample == 0 or angle[record.first_sample - 1] < start
        assert angle[record.last_sample] < end <= angle[record.last_sample + 1]
        # half a nanosecond of rounding
        assert abs((record.stamp_ns - EPOCH_NS) - record.last_sample / RATE_HZ * 1e9) <= 0.51
    assert all(second.window == first.window + 1 for first, second in pairwise(records))
