# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Noise, key-phasor and IMU decimator: statistics, shape, and independence of blocks."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import stats

from rotor_sim.sensors import KEYPHASOR_VOLT, ImuDecimator, keyphasor, white_noise

Array = NDArray[np.float64]
RATE_HZ, IMU_HZ = 10_240, 200


def test_noise_is_standard_normal_and_white() -> None:
    x = white_noise(3, 5, 0, 200_000)
    # standard errors of mean, variance and autocorrelation of n values; 5 of each
    n = len(x)
    assert abs(x.mean()) < 5 / math.sqrt(n)
    assert abs(x.var() - 1.0) < 5 * math.sqrt(2 / n)
    for lag in (1, 2, 3, 4, 17):
        assert abs((x[lag:] * x[:-lag]).mean()) < 5 / math.sqrt(n)
    assert stats.kstest(x, 'norm').pvalue > 1e-4


@pytest.mark.parametrize('other', [(3, 6, 0), (4, 5, 0), (3, 5, 200_000)])
def test_noise_of_another_seed_channel_or_time_is_independent(other: tuple[int, int, int]) -> None:
    n = 100_000
    x, y = white_noise(3, 5, 0, n), white_noise(*other, n)
    assert abs((x * y).mean()) < 5 / math.sqrt(n)


@given(first=st.integers(0, 2**50), count=st.integers(1, 60), cut=st.integers(0, 60))
def test_noise_depends_on_the_sample_alone(first: int, count: int, cut: int) -> None:
    cut = min(cut, count)
    whole = white_noise(1, 2, first, count)
    parts = [white_noise(1, 2, first, cut), white_noise(1, 2, first + cut, count - cut)]
    assert whole.tobytes() == np.concatenate(parts).tobytes()


def test_keyphasor_is_one_smooth_pulse_a_revolution() -> None:
    angle = np.linspace(0.0, 2.0 * math.pi, 36_001)
    volt = keyphasor(angle)
    assert volt[0] == KEYPHASOR_VOLT
    assert np.max(volt) == KEYPHASOR_VOLT
    assert np.min(volt) == 0.0
    # on for 12 degrees around angle 0, and symmetric about it
    np.testing.assert_allclose((volt > 0.0).mean() * 360.0, 12.0, atol=0.03)
    np.testing.assert_allclose(volt, volt[::-1], atol=1e-9)
    # half of the voltage at u^2 = 1 - sqrt(1/2): 3.247 degrees by hand
    half = math.radians(6.0 * math.sqrt(1.0 - math.sqrt(0.5)))
    assert keyphasor(np.array([half]))[0] == pytest.approx(0.5 * KEYPHASOR_VOLT, rel=1e-12)
    # smooth: no jump between neighbours 0.01 degrees apart beyond the steepest slope
    assert np.abs(np.diff(volt)).max() < KEYPHASOR_VOLT * 1.6 * 0.01 / 6.0


def resample(signal: Array, rate: int = RATE_HZ, imu: int = IMU_HZ) -> tuple[Array, Array]:
    done = ImuDecimator(rate, imu).push([signal])
    return np.array([index for index, _ in done]), np.array([values[0] for _, values in done])


def tone(frequency_hz: float, phase: float = 0.3, rate: int = RATE_HZ) -> Array:
    return np.asarray(np.cos(2 * np.pi * frequency_hz * np.arange(rate) / rate + phase))


@pytest.mark.parametrize(('rate', 'imu'), [(10_240, 200), (10_240, 333), (1000, 250), (44_100, 7)])
def test_constant_passes_unchanged(rate: int, imu: int) -> None:
    _, values = resample(np.full(3 * rate, 7.5), rate, imu)
    np.testing.assert_allclose(values, 7.5, rtol=1e-13)


@pytest.mark.parametrize('frequency_hz', [3.0, 30.0, 69.0])
def test_passband_keeps_amplitude_and_time(frequency_hz: float) -> None:
    index, values = resample(tone(frequency_hz))
    expected = np.cos(2 * np.pi * frequency_hz * index / IMU_HZ + 0.3)
    # ripple of an 80 dB Kaiser design is 1e-4; the stamps carry no delay
    np.testing.assert_allclose(values, expected, rtol=0, atol=2e-4)


@pytest.mark.parametrize('frequency_hz', [101.0, 130.0, 199.0, 201.0, 1000.5, 5000.0])
def test_what_would_alias_is_removed(frequency_hz: float) -> None:
    _, values = resample(tone(frequency_hz))
    assert np.abs(values).max() < 1e-4  # 80 dB


def test_outputs_start_and_end_with_complete_filters() -> None:
    done = ImuDecimator(RATE_HZ, IMU_HZ).push([np.ones(RATE_HZ)])
    indices = [index for index, _ in done]
    assert indices == list(range(indices[0], indices[-1] + 1))
    # the filter is 0.17 s long, so 0.086 s at each end stay empty
    assert 0.08 < indices[0] / IMU_HZ < 0.1
    assert 0.9 < indices[-1] / IMU_HZ < 0.92


@given(cuts=st.lists(st.integers(1, 4000), max_size=6), seed=st.integers(0, 99))
def test_decimator_does_not_depend_on_blocks(cuts: list[int], seed: int) -> None:
    x = np.random.default_rng(seed).normal(size=(2, 6000))
    whole = ImuDecimator(RATE_HZ, IMU_HZ).push(list(x))
    decimator = ImuDecimator(RATE_HZ, IMU_HZ)
    parts = []
    edges = [0, *sorted({min(c, 5999) for c in cuts}), 6000]
    for a, b in itertools.pairwise(edges):
        parts += decimator.push([x[0, a:b], x[1, a:b]])
    assert parts == whole
