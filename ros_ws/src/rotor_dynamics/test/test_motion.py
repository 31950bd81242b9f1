# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Labels of motions: the rule, batches, steady and broken sections, the rotor itself, the time."""

import time
from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import NDArray

from rotor_dynamics.errors import AnalysisError
from rotor_dynamics.motion import (
    CONTINUOUS_SHARE,
    DIFFUSION,
    LONGEST_PERIOD,
    NO_DIFFUSION,
    RETURN,
    SHORTEST,
    Motion,
    classify,
    quasi_periodicity,
    zero_one_test,
)
from rotor_sim import RotorParameters

Array = NDArray[np.float64]

POINTS = 300
NOW = np.arange(POINTS)
RANDOM = np.random.default_rng(5).uniform(size=POINTS)
"""Stands for fully developed chaos: nothing returns, no lines."""
LINES = np.sin(0.0846 * 2.0 * np.pi * NOW)
BLURRED = LINES + 0.2 * (RANDOM - 0.5)
"""Crossings seen up to a step late: neither few lines nor a return, but no diffusion."""
LOUD = LINES + (RANDOM - 0.5)
"""So much of it that the walk diffuses in part."""
THREE = np.array([1.0, 2.0, 4.0])[NOW % 3]


def label(series: Array, exponent: float = np.nan, error: float = 1e-3) -> str:
    one = series[np.newaxis]
    return str(classify(one, one, np.array([exponent]), np.array([error])).label[0])


@pytest.mark.parametrize(
    ('series', 'exponent', 'expected'),
    [
        (RANDOM, 0.1, 'chaotic'),
        (RANDOM, np.nan, 'chaotic'),
        (RANDOM, 0.0029, 'undecided'),  # within 3 standard errors
        (RANDOM, 0.0031, 'chaotic'),
        (RANDOM, -0.1, 'undecided'),  # contradiction
        (LINES, 0.1, 'undecided'),  # contradiction
        (LINES, 0.0029, 'quasi-periodic'),
        (LINES, -0.1, 'quasi-periodic'),
        (LINES, np.nan, 'quasi-periodic'),
        (BLURRED, -0.1, 'quasi-periodic'),
        (BLURRED, -0.0031, 'quasi-periodic'),
        (BLURRED, -0.0029, 'undecided'),  # within 3 standard errors
        (BLURRED, np.nan, 'undecided'),
        (LOUD, -0.1, 'undecided'),
        (THREE, -0.1, 'periodic'),
        (THREE, 0.0, 'periodic'),
        (THREE, np.nan, 'periodic'),
        (THREE, 0.1, 'undecided'),  # contradiction
    ],
)
def test_rule(series: Array, exponent: float, expected: str) -> None:
    assert label(series, exponent) == expected


def test_blurred_sections_are_what_they_stand_for() -> None:
    """Else the rule on a negative exponent without lines and return would not be tested."""
    for series, low, high in ((BLURRED, -1.0, NO_DIFFUSION), (LOUD, NO_DIFFUSION, DIFFUSION)):
        torus = quasi_periodicity(series, series)
        assert torus.line_share < CONTINUOUS_SHARE
        assert torus.return_distance > RETURN
        assert low < zero_one_test(series) < high


def test_exponent_without_error_is_unknown() -> None:
    assert label(RANDOM, -0.1, np.nan) == 'chaotic'
    assert label(LINES, 0.1, np.nan) == 'quasi-periodic'


@pytest.mark.parametrize('value', [0.0, -3.0, 1e-300])
def test_steady_section_is_periodic(value: float) -> None:
    steady = np.full((1, POINTS), value)
    motion = classify(steady, steady, np.array([-0.1]), np.array([0.0]))
    assert motion.label[0] == 'periodic'
    assert motion.evidence['period'][0] == 1
    assert motion.evidence['zero_one'][0] == 0.0
    assert motion.evidence['return_distance'][0] == 0.0
    assert motion.evidence['line_share'][0] == 1.0


def test_noise_of_1e_9_makes_no_chaos_of_a_periodic_section() -> None:
    noise = 1e-9 * (RANDOM - 0.5)
    for series in (4.0 + noise, THREE + noise):
        assert label(series) == 'periodic'
        assert zero_one_test(series) < 0.2
    assert label(LINES + noise) == 'quasi-periodic'


def test_slow_drift_is_not_a_period() -> None:
    """Neighbours within 1e-4 of the size, and 1 % over all: it has not repeated."""
    assert label(1.0 + 0.01 * np.exp(-NOW / 100.0)) != 'periodic'
    assert label(1.0 + 1e-6 * np.exp(-NOW / 100.0)) == 'periodic'
    # a torus next to period 3
    assert label(4.0 + 0.1 * np.sin(2.0 * np.pi * (1.0 / 3.0 + 1e-4) * NOW)) != 'periodic'


def test_periods_longer_than_the_limit_are_no_periods() -> None:
    rng = np.random.default_rng(6)
    for period in (LONGEST_PERIOD, LONGEST_PERIOD + 1):
        series = rng.uniform(size=period)[NOW % period][np.newaxis]
        motion = classify(series, series, np.array([-0.1]), np.array([1e-3]))
        assert (motion.label[0] == 'periodic') == (period == LONGEST_PERIOD)
        # it comes back all the same, and the evidence has the lag
        assert motion.evidence['return_lag'][0] == period
        assert motion.evidence['return_distance'][0] == 0.0


@pytest.mark.parametrize(
    ('series', 'exponent', 'expected'),
    [(THREE, -0.1, 'periodic'), (LINES, -0.1, 'quasi-periodic'), (RANDOM, 0.1, 'chaotic')],
)
def test_one_component_is_enough(series: Array, exponent: float, expected: str) -> None:
    """Motion along y alone: z steady must not hide it."""
    one, still = series[np.newaxis], np.zeros((1, POINTS))
    for y, z in ((one, still), (still, one)):
        assert classify(y, z, np.array([exponent]), np.array([1e-3])).label[0] == expected


@pytest.mark.parametrize('bad', [np.nan, np.inf, -np.inf])
def test_section_that_is_not_finite_diverged_and_nothing_else(bad: float) -> None:
    y = np.stack([RANDOM, LINES, THREE, RANDOM])
    z = y[:, ::-1].copy()
    exponent, error = np.array([0.1, -0.1, -0.1, np.nan]), np.full(4, 1e-3)
    whole = classify(y, z, exponent, error)
    for component in (y, z):
        component[1, 7] = bad
    broken = classify(y, z, exponent, error)
    assert broken.label.tolist() == ['chaotic', 'diverged', 'periodic', 'chaotic']
    for name in ('zero_one', 'line_share', 'return_distance', 'recurrence'):
        assert np.isnan(broken.evidence[name][1])
        keep = [0, 2, 3]
        np.testing.assert_array_equal(broken.evidence[name][keep], whole.evidence[name][keep])
    assert broken.evidence['period'][1] == broken.evidence['return_lag'][1] == 0


def test_batch_gives_what_each_gives_alone() -> None:
    rng = np.random.default_rng(7)
    y, z = rng.standard_normal((2, 9, POINTS))
    exponent, error = rng.standard_normal(9), np.full(9, 0.1)
    whole = classify(y, z, exponent, error)
    for n in range(9):
        one: Motion = classify(*(a[n : n + 1] for a in (y, z, exponent, error)))
        assert one.label[0] == whole.label[n]
        for name, value in one.evidence.items():
            # sums may run in another order
            np.testing.assert_allclose(whole.evidence[name][n], value[0], rtol=0, atol=1e-12)


def test_evidence_is_one_number_a_point_under_names() -> None:
    y = np.stack([RANDOM, LINES])
    motion = classify(y, y, np.array([0.1, np.nan]), np.array([0.01, np.nan]))
    assert {name: value.shape for name, value in motion.evidence.items()} == dict.fromkeys(
        (
            'period',
            'recurrence',
            'zero_one',
            'line_share',
            'return_distance',
            'return_lag',
            'exponent',
            'standard_error',
        ),
        (2,),
    )
    np.testing.assert_array_equal(motion.evidence['zero_one'], zero_one_test(y))
    np.testing.assert_array_equal(motion.evidence['exponent'], [0.1, np.nan])


@pytest.mark.parametrize('points', [1, 2, 10, SHORTEST - 1])
def test_short_section_is_undecided_unless_it_repeats(points: int) -> None:
    for series in (RANDOM, LINES):
        short = series[np.newaxis, :points]
        motion = classify(short, short, np.array([np.nan]), np.array([np.nan]))
        assert motion.label[0] == 'undecided'
        assert np.isnan(motion.evidence['zero_one'][0])
        assert np.isnan(quasi_periodicity(short, short).line_share[0])
    assert (label(THREE[:points]) == 'periodic') == (points >= 9)


def test_no_points_make_no_labels() -> None:
    none = np.zeros((0, POINTS))
    assert classify(none, none, np.zeros(0), np.zeros(0)).label.shape == (0,)


def test_shapes_of_leading_axes() -> None:
    assert zero_one_test(RANDOM).shape == ()
    assert zero_one_test(np.ones((2, 3, POINTS))).shape == (2, 3)
    assert quasi_periodicity(np.ones((2, 3, POINTS)), np.ones((2, 3, POINTS))).line_share.shape == (
        2,
        3,
    )


def test_shapes_that_do_not_fit_are_refused() -> None:
    with pytest.raises(AnalysisError, match='two equal ones'):
        quasi_periodicity(np.ones((2, POINTS)), np.ones((3, POINTS)))
    with pytest.raises(AnalysisError, match=r'give \(n, m\), \(n,\) and \(n,\)'):
        classify(RANDOM, RANDOM, np.array(0.1), np.array(0.1))
    with pytest.raises(AnalysisError, match=r'give \(n, m\)'):
        classify(RANDOM[None], RANDOM[None], np.zeros(2), np.zeros(2))


def test_64_sections_take_less_than_50_ms() -> None:
    """The 0-1 test of one chunk; 6 ms measured, so that a loaded machine passes too."""
    series = np.random.default_rng(8).standard_normal((64, POINTS))
    took = []
    for _ in range(5):
        start = time.perf_counter()
        zero_one_test(series)
        took.append(time.perf_counter() - start)
    assert min(took) < 0.05


def test_rotor_follows_the_ball_pass_order_and_returns(
    run_revolutions: Callable[..., tuple[Array, Array]],
) -> None:
    """Derived model at 352 rad/s, G = 3: forced, quasi-periodic in the paper (Fig. 8).

    8 balls at 40.1/104 of the speed pass 401/130 times a revolution: after 130 revolutions every
    ball stands where another stood, and a response with exponent -0.0115 a radian (physics.md,
    section 4) has forgotten its start after 1000, so it comes back as a whole.
    """
    passes = Fraction(8 * 401, 1040)
    rows, _ = run_revolutions(
        RotorParameters.hou2016(), 352.0, 3.0, steps=256, revolutions=1000 + POINTS
    )
    y, z = rows[1000:, :2].T[:, np.newaxis]
    motion = classify(y, z, np.array([-0.0115]), np.array([0.001]))
    assert motion.label[0] == 'quasi-periodic'
    assert motion.evidence['return_lag'][0] == passes.denominator
    # rounding, 1e-16 * 256 steps * 130 revolutions, not yet forgotten
    assert motion.evidence['return_distance'][0] < 1e-9
    assert motion.evidence['zero_one'][0] < 0.2
