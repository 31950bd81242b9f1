# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The label of motions whose nature is known, and the 0-1 test against its definition.

Logistic map: period doubling to 3.56995, the period-3 window from 1 + sqrt(8) = 3.8284, chaos at
r = 4 (exponent ln 2) and in bands below 3.6786 (May, Nature 261 (1976) 459; Strogatz, ch. 10).
Circle map: invertible below k = 1, so quasi-periodic or locked and never chaotic (Arnold).
Henon: chaotic, 0.4192. Sums of incommensurate sines and linearly filtered ones: quasi-periodic.
Exponents are the analytic slopes along the orbit, errors by `estimate`.
"""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rotor_dynamics.lyapunov import estimate
from rotor_dynamics.motion import (
    DIFFUSION,
    FREQUENCIES,
    LINE_SHARE,
    RETURN,
    classify,
    quasi_periodicity,
    zero_one_test,
)

Array = NDArray[np.float64]

POINTS = 300
SETTLING = 20_000
TURN = 2.0 * np.pi * np.arange(POINTS)
UNKNOWN = np.array([np.nan])


def logistic(r: list[float], points: int = POINTS) -> tuple[Array, Array, Array]:
    """Series (len(r), points), exponents and standard errors over 2000 iterates."""
    rate, x, series = np.array(r), np.full(len(r), 0.3), []
    for _ in range(SETTLING + max(points, 2000)):
        x = rate * x * (1.0 - x)
        series.append(x)
    orbit = np.array(series[SETTLING:])
    found = estimate(np.log(np.abs(rate * (1.0 - 2.0 * orbit))), 1.0)
    return orbit[:points].T, found.exponent, found.standard_error


def circle(drive: float, coupling: float) -> tuple[Array, Array]:
    """Cos and sin of the circle map theta + drive - coupling/(2 pi) sin(2 pi theta), (1, m)."""
    theta, series = 0.1, []
    for _ in range(2000 + POINTS):
        theta += drive - coupling / (2.0 * np.pi) * np.sin(2.0 * np.pi * theta)
        series.append(2.0 * np.pi * theta)
    turns = np.array([series[2000:]])
    return np.cos(turns), np.sin(turns)


def section_alone(y: Array, z: Array) -> str:
    return str(classify(y, z, UNKNOWN, UNKNOWN).label[0])


def test_period_doubling_has_its_periods() -> None:
    x, exponent, error = logistic([2.9, 3.2, 3.5, 3.55, 3.566, 3.83])
    motion = classify(x, x, exponent, error)
    assert motion.evidence['period'].tolist() == [1, 2, 4, 8, 16, 3]
    assert set(motion.label) == {'periodic'}
    assert np.all(motion.evidence['recurrence'] < 1e-6)
    # the median over c passes over those that resonate with the period
    assert np.all(np.abs(zero_one_test(x)) < 0.2)


def test_logistic_chaos() -> None:
    x, exponent, error = logistic([3.7, 3.8, 3.9, 4.0])
    assert set(classify(x, x, exponent, error).label) == {'chaotic'}
    # here the section alone says it too
    assert set(classify(x, x, exponent * np.nan, error).label) == {'chaotic'}
    assert np.all(zero_one_test(x) > 0.95)


def test_banded_chaos_is_chaos_only_by_its_exponent() -> None:
    """r = 3.6: two bands in turn, 98 % of the power in one line, K far from 1."""
    x, exponent, error = logistic([3.6])
    motion = classify(x, x, exponent, error)
    assert motion.evidence['zero_one'][0] < DIFFUSION
    assert motion.label[0] == 'chaotic'
    assert section_alone(x, x) == 'undecided'


def test_zero_one_test_of_long_series_comes_close_to_0_and_1() -> None:
    """At the 2000 points of Gottwald and Melbourne's examples."""
    x, _, _ = logistic([3.55, 3.83, 3.97, 4.0], points=2000)
    k = zero_one_test(x)
    assert np.all(np.abs(k[:2]) < 0.05)
    assert np.all(k[2:] > 0.99)


def test_henon_is_chaotic() -> None:
    x, y, points = 0.1, 0.1, []
    for _ in range(1000 + POINTS):
        x, y = 1.0 - 1.4 * x * x + y, 0.3 * x
        points.append((x, y))
    section = np.array(points[1000:]).T[:, np.newaxis]
    assert section_alone(section[0], section[1]) == 'chaotic'
    assert (
        classify(section[0], section[1], np.array([0.42]), np.array([0.02])).label[0] == 'chaotic'
    )
    assert quasi_periodicity(section[0], section[1]).return_distance[0] > 0.5


@pytest.mark.parametrize(
    ('drive', 'coupling', 'label'),
    [
        (0.606661, 0.9, 'quasi-periodic'),  # near the golden mean's rotation number
        (0.3, 0.5, 'quasi-periodic'),
        (0.02, 0.9, 'periodic'),  # |drive| < coupling/(2 pi): a fixed point
        (0.5, 0.9, 'periodic'),  # in the tongue of 1/2
        (0.4, 2.5, 'chaotic'),  # folds
    ],
)
def test_circle_map(drive: float, coupling: float, label: str) -> None:
    assert section_alone(*circle(drive, coupling)) == label


def test_invertible_circle_map_is_never_chaotic() -> None:
    for drive in np.linspace(0.05, 0.95, 19):
        assert section_alone(*circle(float(drive), 0.8)) in {'quasi-periodic', 'periodic'}


@pytest.mark.parametrize('frequencies', [1, 2, 3])
def test_incommensurate_sines_with_noise(frequencies: int) -> None:
    noise = 1e-9 * np.random.default_rng(1).standard_normal((2, 1, POINTS))
    y, z = noise
    for n, root in enumerate([2.0, 3.0, 5.0][:frequencies]):
        y = y + np.sin(TURN * np.sqrt(root) / (8.0 + n)) / (1 + n)
        z = z + np.cos(TURN * np.sqrt(root) / (8.0 + n)) / (2 + n)
    torus = quasi_periodicity(y, z)
    assert torus.line_share[0] > LINE_SHARE
    for exponent in (np.nan, 0.0, -0.01):
        label = classify(y, z, np.array([exponent]), np.array([1e-3])).label[0]
        assert label == 'quasi-periodic'


@settings(deadline=None, max_examples=60)
@given(
    frequency=st.floats(0.015, 0.485),
    phase=st.floats(0.0, 6.28),
    mean=st.floats(-5.0, 5.0),
    size=st.floats(0.1, 10.0),
)
def test_one_line_of_any_frequency_returns_and_is_regular(
    frequency: float, phase: float, mean: float, size: float
) -> None:
    """Dirichlet: within 150 lags a frequency comes back to 1/151 turn, sqrt(2) sin of it."""
    y = mean + size * np.sin(TURN * frequency + phase)[np.newaxis]
    z = np.zeros_like(y)
    torus = quasi_periodicity(y, z)
    assert torus.line_share[0] > LINE_SHARE
    # the variance of a finite piece differs from that of the sine by 1/(2 pi 300 * 0.015) = 4 %
    assert torus.return_distance[0] < 1.1 * np.sqrt(2.0) * np.sin(np.pi / 151)
    assert section_alone(y, z) in {'quasi-periodic', 'periodic'}
    assert abs(zero_one_test(y)[0]) < 0.2


def test_forced_torus_has_a_negative_exponent_and_returns() -> None:
    """x' = 0.9 x + tanh(4 sin phase) at 401/130 cycles a turn: exponent ln 0.9, period 130.

    Many harmonics, so fewer than 99.9 % of the power lie in six lines; the return finds it.
    """
    order = Fraction(401, 130)
    x, series = 0.0, []
    for n in range(1000 + POINTS):
        x = 0.9 * x + np.tanh(4.0 * np.sin(2.0 * np.pi * float(order * n % 1)))
        series.append(x)
    y = np.array([series[1000:]])
    z = np.sign(y - 0.3)
    motion = classify(y, z, np.array([np.log(0.9)]), np.array([0.0]))
    assert motion.label[0] == 'quasi-periodic'
    assert motion.evidence['line_share'][0] < LINE_SHARE
    assert motion.evidence['return_lag'][0] == order.denominator
    assert motion.evidence['return_distance'][0] < 1e-9


def test_irrational_torus_that_jumps_returns() -> None:
    """Smooth in the phase but for one jump: the golden mean comes back after 144."""
    phase = TURN / (2.0 * np.pi) * (np.sqrt(5.0) - 1.0) / 2.0 % 1.0
    y = (np.cos(2.0 * np.pi * phase) + 0.1 * (phase < 0.5))[np.newaxis]
    torus = quasi_periodicity(y, -y)
    assert torus.return_lag[0] == 144
    assert torus.return_distance[0] < RETURN
    assert section_alone(y, -y) == 'quasi-periodic'


def test_zero_one_test_is_its_definition() -> None:
    """Displacements of the walk itself, one c and one start at a time (their eqs. 2 to 8)."""
    x, _, _ = logistic([3.6, 3.9])
    centred = x - x.mean(axis=1, keepdims=True)
    lags, last = np.arange(1, POINTS // 10 + 1), POINTS - POINTS // 10
    expected = []
    for series in centred:
        ks = []
        for step in range(FREQUENCIES):
            c = np.pi / 5 + 3 * np.pi / 5 * (step + 0.5) / FREQUENCIES
            walk = np.cumsum(series * np.exp(1j * c * np.arange(1, POINTS + 1)))
            walk = np.concatenate([[0.0], walk])
            square = [
                np.mean(np.abs(walk[lag : lag + last + 1] - walk[: last + 1]) ** 2) for lag in lags
            ]
            ks.append(np.corrcoef(lags, square)[0, 1])
        expected.append(np.median(ks))
    # the same sums in another order
    np.testing.assert_allclose(zero_one_test(x), expected, rtol=0, atol=1e-9)


def test_zero_one_test_does_not_see_mean_and_size() -> None:
    x, _, _ = logistic([3.6, 3.83, 4.0])
    # adding 1e3 costs 3 of 16 digits
    np.testing.assert_allclose(zero_one_test(1e3 - 1e3 * x), zero_one_test(x), rtol=0, atol=1e-9)
