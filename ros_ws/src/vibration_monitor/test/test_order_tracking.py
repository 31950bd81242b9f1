# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Resampling to equal angles: places, ranges and refusals; its accuracy: test_truth_monitor."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rotor_common.constants import MIN_SAMPLES_PER_CYCLE
from vibration_monitor.errors import MonitorError
from vibration_monitor.order_tracking import highest_order, points_per_revolution, resample


@pytest.mark.parametrize(
    ('samples', 'points'),
    [(10.0, 64), (64.0, 64), (65.0, 128), (182.8, 256), (256.0, 256), (6434.0, 8192), (1e5, 8192)],
)
def test_points_are_the_next_power_of_two_within_bounds(samples: float, points: int) -> None:
    assert points_per_revolution(np.arange(2000) / samples) == points


@settings(deadline=None)
@given(st.floats(70.0, 4000.0), st.floats(1.0, 10.0))
def test_points_follow_the_slowest_and_orders_the_fastest_part(slow: float, ratio: float) -> None:
    steps = np.concatenate((np.full(100, 1 / slow), np.full(100, ratio / slow)))
    revolutions = np.concatenate(([0.0], np.cumsum(steps)))
    points = points_per_revolution(revolutions)
    # 1e-5: the sum of steps does not give the steps back exactly
    assert slow * (1 - 1e-5) <= points < 2 * slow * (1 + 1e-5)
    assert highest_order(revolutions) == pytest.approx(
        slow / ratio / MIN_SAMPLES_PER_CYCLE, rel=1e-5
    )


def test_a_quintic_polynomial_is_reproduced() -> None:
    revolutions = np.arange(1000) / 143.0 + 100.0
    start = 101
    x = revolutions - start
    polynomial = np.array([1.0, -2.0, 0.5, 0.25, -0.125, 0.0625])
    signals = np.stack([np.polynomial.polynomial.polyval(x, polynomial), np.ones_like(x)])
    result = resample(revolutions, signals, start=start, count=4, points=64)
    assert result.shape == (2, 4 * 64)
    expected = np.polynomial.polynomial.polyval(np.arange(256) / 64, polynomial)
    # The spline space holds the polynomial: only rounding of values up to 200 is left, as the
    # mirror image at the ends fades by 0.43 a sample and is 140 samples away.
    np.testing.assert_allclose(result[0], expected, rtol=0, atol=200 * 1e-13)
    np.testing.assert_allclose(result[1], 1.0, rtol=0, atol=1e-13)


def test_the_ends_disturb_a_few_samples_only() -> None:
    revolutions = np.arange(401) / 100.0
    signal = np.sin(2 * np.pi * revolutions)
    result = resample(revolutions, signal[np.newaxis], start=0, count=4, points=128)[0]
    error = np.abs(result - np.sin(2 * np.pi * np.arange(512) / 128))
    # A kink of 0.06 a sample at the end; quintic: poles 0.43 and 0.04, so 0.43^12 = 4e-5 of it
    # is left after 12 samples (16 points) and 2e-9 after 24 (31 points).
    assert error.max() < 0.01
    assert error[16:-16].max() < 4e-5 * 0.06
    assert error[31:-31].max() < 2e-9 * 0.06 + 1e-10


@pytest.mark.parametrize('ramp_rad_s2', [0.0, 100.0, -100.0])
def test_the_time_of_an_angle_is_as_right_as_promised(ramp_rad_s2: float) -> None:
    rate_hz = 10240
    time = np.arange(3 * rate_hz) / rate_hz
    revolutions = (400.0 * time + ramp_rad_s2 * time**2 / 2) / (2 * np.pi)
    # the angle itself, in rad, as the signal
    signals = 2 * np.pi * revolutions[np.newaxis]
    points = resample(revolutions, signals, start=1, count=60, points=256)[0]
    error = np.abs(points - 2 * np.pi * (1 + np.arange(60 * 256) / 256))
    assert error.max() < abs(ramp_rad_s2) / (8 * rate_hz**2) * 1.01 + 1e-11


def test_a_signal_does_not_depend_on_its_neighbours() -> None:
    rng = np.random.default_rng(2)
    revolutions = np.cumsum(rng.uniform(0.005, 0.015, 3000))
    signals = rng.normal(size=(7, 3000)) * 10.0 ** rng.integers(-9, 9, (7, 1))
    everything = resample(revolutions, signals, start=1, count=20, points=128)
    for chosen in ([0], [6, 2], [3, 4, 5], [5, 4, 3, 2, 1]):
        part = resample(revolutions, signals[chosen], start=1, count=20, points=128)
        assert part.tobytes() == everything[chosen].tobytes()


def test_nothing_is_extrapolated() -> None:
    revolutions = np.linspace(0.5, 9.5, 1000)
    signals = np.zeros((1, 1000))
    for start, count in ((0, 4), (6, 4)):
        with pytest.raises(MonitorError, match='nothing is extrapolated'):
            resample(revolutions, signals, start=start, count=count, points=64)


@pytest.mark.parametrize(
    'revolutions',
    [np.zeros(100), np.array([0.0, 1.0]), np.array([*range(10), 8.5, 11.0]), np.full(9, np.nan)],
)
def test_an_angle_that_does_not_rise_is_refused(revolutions: np.ndarray) -> None:
    signals = np.zeros((1, len(revolutions)))
    with pytest.raises(MonitorError, match='must rise from sample to sample'):
        resample(revolutions, signals, start=0, count=1, points=64)
