# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Average, envelope, passage and load trend against signals whose answer is known."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from monitor_signals import (
    BALL_PASS,
    RATE_HZ,
    blocks,
    ramp_angle,
    run,
    same,
    signal,
    steady_angle,
    table,
)
from vibration_monitor import MonitorConfig, VibrationMonitor
from vibration_monitor.indicators.average import average_and_residual_rms, synchronous_average
from vibration_monitor.indicators.passage import PassageTracker
from vibration_monitor.indicators.trend import LoadTrend, load_slope
from vibration_monitor.monitor_config import Extra
from vibration_monitor.spectrum import overlap_inflation


def config(*extras: Extra, **changes: object) -> MonitorConfig:
    return MonitorConfig.from_mapping({'extras': list(extras), **changes})


def test_average_and_residual_of_known_parts() -> None:
    rng = np.random.default_rng(3)
    angle = steady_angle(3.0, 352.0)
    sigma = 2e-7
    whole = signal(angle, [(1.0, 3e-6, 0.2), (4.0, 1e-6, 1.0)])
    rest = signal(angle, [(2.5, 8e-7, 0.4)]) + sigma * rng.standard_normal(len(angle))
    rows = table(angle, {'disk_z': 2e-5 + whole + rest, 'disk_y': whole})
    for record in run(VibrationMonitor(config('average', 'statistics')), blocks(rows, 256)):
        # 2.5x over 64 revolutions averages to nothing; noise to a 64th of its power
        synchronous = math.sqrt((3e-6**2 + 1e-6**2) / 2 + sigma**2 / 64)
        residual = math.sqrt(8e-7**2 / 2 + sigma**2 * 63 / 64)
        # noise of 2.5e-8 in 183 independent samples beside 2.2e-6: 1e-3 of scatter, three of it
        assert record.value('disk_z/synchronous_rms') == pytest.approx(synchronous, rel=3e-3)
        # the spline passes less of the noise near half the sample rate, 7 percent of its power;
        # noise is a ninth of this power
        assert record.value('disk_z/residual_rms') == pytest.approx(residual, rel=0.01)
        whole_rms = math.hypot(
            record.value('disk_z/synchronous_rms'), record.value('disk_z/residual_rms')
        )
        # that part of the noise again, beside all of the signal
        assert whole_rms == pytest.approx(record.value('disk_z/rms'), rel=2e-3)
        assert record.value('disk_y/residual_rms') < 1e-4 * record.value('disk_y/synchronous_rms')
        assert math.isnan(record.value('brg1_y/residual_rms'))


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 20), st.integers(4, 64))
def test_powers_of_average_and_residual_add_up(seed: int, count: int, points: int) -> None:
    tracked = np.random.default_rng(seed).standard_normal((2, count * points)) + 5.0
    average, residual = average_and_residual_rms(tracked, count)
    np.testing.assert_allclose(average**2 + residual**2, tracked.var(axis=1), rtol=1e-10)
    repeated = np.tile(tracked[:, :points], count)
    np.testing.assert_allclose(synchronous_average(repeated, count), tracked[:, :points])
    assert average_and_residual_rms(repeated, count)[1] == pytest.approx([0, 0], abs=1e-13)


def test_a_struck_resonance_shows_in_the_envelope_and_not_in_the_signal() -> None:
    speed = 352.0
    angle = steady_angle(3.0, speed)
    time = np.arange(len(angle)) / RATE_HZ
    outer = np.cos(2 * np.pi * 2500 * time) * (1 + 0.5 * np.cos(BALL_PASS * angle + 0.3))
    inner = np.cos(2 * np.pi * 2200 * time) * (1 + 0.2 * np.cos((8 - BALL_PASS) * angle))
    noise = 0.01 * np.random.default_rng(1).standard_normal((2, len(angle)))
    rows = table(
        angle,
        {
            'brg1_ay': 2.0 * outer + 5.0 * np.cos(angle) + noise[0],
            'brg2_az': 0.5 * inner + noise[1],
            'disk_y': 1e-6 * np.cos(angle),
        },
    )
    records = run(VibrationMonitor(config('envelope')), blocks(rows, 256))
    assert records
    for record in records:
        # band 1 to 4 kHz: the line is 2 * 0.5; zero padding may miss its top by 0.6 percent
        assert record.value('brg1_ay/envelope_line_ball_pass_outer') == pytest.approx(1.0, rel=0.01)
        assert record.value('brg1_ay/envelope_prominence_ball_pass_outer') > 100
        assert record.value('brg2_az/envelope_line_ball_pass_inner') == pytest.approx(0.1, rel=0.02)
        assert record.value('brg2_az/envelope_prominence_ball_pass_outer') < 6
        assert record.value('brg1_ay/amplitude_ball_pass') < 1e-3
        assert math.isnan(record.value('brg1_az/envelope_line_cage'))
        assert 'disk_y/envelope_line_cage' not in record.names
    low = run(
        VibrationMonitor(config('envelope', envelope_band_hz=[1000.0, 6000.0])), blocks(rows, 256)
    )
    # the band reaches beyond half the sample rate
    assert math.isnan(low[0].value('brg1_ay/envelope_line_ball_pass_outer'))


def resonance(speed: NDArray[np.float64], at: float, damping: float) -> NDArray[np.float64]:
    ratio = speed / at
    return np.asarray(1 / np.hypot(1 - ratio**2, 2 * damping * ratio))


@pytest.mark.slow
@pytest.mark.parametrize('downward', [False, True])
def test_passages_of_a_run_up_and_a_run_down(downward: bool) -> None:
    critical = 600.0
    duration = 46.0
    start, ramp = (366.0, -4.5) if downward else (159.0, 4.5)
    angle = ramp_angle(duration, start, ramp)
    speed = start + ramp * np.arange(len(angle)) / RATE_HZ
    displacement = np.cos(angle) * 1e-6
    for order in (2, 3):
        # resonant super-harmonics as the oscillator shows them, 10 percent damped
        amplitude = 1e-7 * resonance(speed, critical / order, 0.1)
        displacement += amplitude * np.cos(order * angle)
    rows = table(angle, {'disk_z': displacement, 'disk_y': displacement})
    settings = config('passage', critical_speed_rad_s=critical)
    records = run(VibrationMonitor(settings), blocks(rows, 2048))
    assert same(run(VibrationMonitor(settings), blocks(rows, 333)), records)
    for order in (2, 3):
        name = f'disk_z/passage_amplitude_order_{order}'
        found = [record for record in records if math.isfinite(record.value(name))]
        assert len(found) == 1
        # told by the first window beyond the band of 15 percent
        beyond = found[0].value('speed_rad_s') / (critical / order)
        assert 0.80 < beyond < 0.85 if downward else 1.15 < beyond < 1.2
        # largest at 1 / (2 d sqrt(1 - d^2)) = 5.025; a window of 2 s and 9 rad/s rounds the peak
        # of a half width of 30 rad/s off by 1 percent
        assert found[0].value(name) == pytest.approx(5.025e-7, rel=0.015)
        peak = found[0].value(f'disk_z/passage_speed_order_{order}')
        # sqrt(1 - 2 d^2) = 0.99; windows are 2.3 rad/s apart, the top is flat
        assert peak == pytest.approx(0.99 * critical / order, abs=5.0)
    assert all(math.isnan(record.value('disk_z/passage_amplitude_order_4')) for record in records)


def test_a_passage_needs_both_ends() -> None:
    def passed(speeds: list[float]) -> list[float]:
        tracker = PassageTracker(100.0, 1)
        return [float(tracker.update(s, np.array([s / 10]))[0][0]) for s in speeds]

    def count(speeds: list[float]) -> int:
        return int(np.count_nonzero(np.isfinite(passed(speeds))))

    assert passed([80.0, 90, 100, 110, 120])[-1] == 11.0
    assert count([80.0, 90, 100, 110, 120, 130]) == 1
    assert count([120.0, 110, 90, 80, 90, 120]) == 2
    # turned back; started within; leapt across; still within
    assert count([80.0, 90, 100, 90, 80]) == 0
    assert count([90.0, 100, 110, 120]) == 0
    assert count([80.0, 120, 80]) == 0
    assert count([80.0, 90, 100]) == 0
    tracker = PassageTracker(100.0, 2)
    for speed, first in ((80.0, 1.0), (95.0, math.nan), (105.0, 2.0)):
        tracker.update(speed, np.array([first, math.nan]))
    peak, place = tracker.update(120.0, np.array([9.0, math.nan]))
    assert (peak[0], place[0]) == (2.0, 105.0)
    assert math.isnan(peak[1])


def test_the_slope_over_the_load_is_found_beside_what_does_not_depend_on_it() -> None:
    duration = 30.0
    angle = steady_angle(duration, 352.0)
    time = np.arange(len(angle)) / RATE_HZ
    load_factor = 2.0 + 1.5 * np.sin(2 * np.pi * time / 15)
    crack, fixed = 5e-8, 4e-7
    rng = np.random.default_rng(4)
    displacement = (
        1e-6 * np.cos(angle)
        + fixed * np.cos(2 * angle + 0.3)
        + crack * load_factor * np.cos(2 * angle - 1.0)
        + 1e-7 * rng.standard_normal(len(angle))
    )
    rows = table(angle, {'disk_y': displacement, 'disk_z': 1e-6 * np.cos(angle)})
    rows['load_y'] = 9.81 * load_factor
    records = run(VibrationMonitor(config('trend')), blocks(rows, 2048))
    late = records[45:]
    assert late
    for record in late:
        slope = record.value('disk_y/load_slope_order_2')
        error = record.value('disk_y/load_slope_error_order_2')
        # noise of 1e-7 is 2.6e-9 in a vector, and the load spreads by 1 over some 40 windows
        assert 1e-10 < error < 2e-9
        assert abs(slope - crack) < 4 * error
        for order in (1, 3):
            still = record.value(f'disk_y/load_slope_order_{order}')
            assert still < 4 * record.value(f'disk_y/load_slope_error_order_{order}')
    assert all(math.isnan(r.value('disk_y/load_slope_order_2')) for r in records[:5])
    assert same(run(VibrationMonitor(config('trend')), blocks(rows, 333)), records)


def test_a_load_that_hardly_varies_gives_no_slope() -> None:
    angle = steady_angle(8.0, 352.0)
    rows = table(angle, {'disk_z': 1e-6 * np.cos(angle)})
    rows['load_y'] = 9.81 * (1 + 0.1 * np.sin(np.arange(len(angle)) * 1e-4))
    records = run(VibrationMonitor(config('trend')), blocks(rows, 2048))
    assert len(records) > 10
    assert all(math.isnan(record.value('disk_z/load_slope_order_2')) for record in records)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(8, 60), st.floats(0.3, 5.0))
def test_slope_of_exact_lines(seed: int, windows: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    load = 1.0 + spread * np.linspace(-1, 1, windows)
    a, b = rng.standard_normal((2, 3)) + 1j * rng.standard_normal((2, 3))
    slope, error = load_slope(load, a + np.outer(load, b))
    np.testing.assert_allclose(slope, np.abs(b), rtol=1e-10)
    assert (error < 1e-12).all()


def test_the_error_of_the_slope_is_the_scatter_of_the_slope() -> None:
    rng = np.random.default_rng(5)
    load = rng.uniform(0.5, 3.0, 30)
    noise = rng.standard_normal((30, 8000)).view(np.complex128)
    vectors = (2.0 + 1.0j) * load[:, np.newaxis] + noise
    slope, error = load_slope(load, vectors)
    # the error is that of the complex slope; its magnitude scatters by 1/sqrt(2) of it
    assert np.mean(error**2) == pytest.approx(2 * np.var(slope), rel=0.05)


def test_windows_that_overlap_count_for_less() -> None:
    # Harris, table 1, 4-term: overlap correlation 46.0 percent at 75 percent, 3.8 at 50 percent
    expected = 1 + 2 * (0.460 + 0.038)
    assert overlap_inflation(64, 16) == pytest.approx(expected, abs=0.005)
    assert overlap_inflation(64, 64) == 1.0


def test_other_speeds_do_not_take_part_in_a_trend() -> None:
    trend = LoadTrend(100, 1.0)
    slopes = np.empty((1, 1))
    for k in range(60):
        speed, factor = ((300.0, 1.0), (330.0, 7.0))[k % 2]
        load = 1.0 + k % 5
        slopes, _ = trend.update(speed, load, np.array([[factor * load + 0j]]))
        if k > 20:
            assert slopes[0, 0] == pytest.approx(factor, rel=1e-10)
    nothing, _ = trend.update(330.0, math.nan, np.array([[1 + 0j]]))
    assert math.isnan(nothing[0, 0])
