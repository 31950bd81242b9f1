# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The exponent core on systems whose exponents are known.

Exact: linear systems (real parts of the eigenvalues), Stuart-Landau (0, -2), the fixed point of
Lorenz rho = 20 (its eigenvalues), the sums of Lorenz (divergence -(sigma + 1 + beta)) and Henon
(ln 0.3), the logistic map at r = 4 (ln 2), the skew tent map (entropy of its two branches).
Literature: Lorenz rho = 28 (0.9056, 0, -14.5723) and Henon (0.4192): Sprott, Chaos and Time-Series
Analysis (2003), appendix A.
A statistical tolerance is 4 reported standard errors (Student, 19 degrees of freedom: missed once
in 1300) of fixed starts, so a test that passes keeps passing.
"""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from rotor_dynamics.errors import AnalysisError
from rotor_dynamics.lyapunov import (
    BATCHES,
    Advance,
    Growth,
    estimate,
    growth,
    two_trajectory_growth,
)

Array = NDArray[np.float64]
Field = Callable[[Array], Array]

SIGMA, BETA = 10.0, 8.0 / 3.0


def identity(n: int, d: int, k: int | None = None) -> Array:
    return np.tile(np.eye(d)[: k or d], (n, 1, 1))


# systems: every one takes states (n, d) and tangents (n, k, d)


def linear_map(matrix: Array) -> Advance:
    return lambda x, v: (x @ matrix.T, v @ matrix.T)


def flow(field: Field, jacobian: Field, step: float, steps: int) -> Advance:
    """RK4 of the states together with its exact tangent map; jacobian (n, d, d)."""

    def derivative(both: Array) -> Array:
        x, v = both[:, 0], both[:, 1:]
        return np.concatenate([field(x)[:, None], v @ jacobian(x).swapaxes(1, 2)], axis=1)

    def advance(x: Array, v: Array) -> tuple[Array, Array]:
        both = np.concatenate([x[:, None], v], axis=1)
        for _ in range(steps):
            k1 = derivative(both)
            k2 = derivative(both + 0.5 * step * k1)
            k3 = derivative(both + 0.5 * step * k2)
            k4 = derivative(both + step * k3)
            both = both + step / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
        return both[:, 0], both[:, 1:]

    return advance


def lorenz_jacobian(rho: float, s: Array) -> Array:
    j = np.tile([[-SIGMA, SIGMA, 0.0], [rho, -1.0, 0.0], [0.0, 0.0, -BETA]], (len(s), 1, 1))
    j[:, 1, 0] -= s[:, 2]
    j[:, 1, 2] = -s[:, 0]
    j[:, 2, 0] = s[:, 1]
    j[:, 2, 1] = s[:, 0]
    return j


def lorenz(rho: float, step: float, steps: int) -> Advance:
    def field(s: Array) -> Array:
        x, y, z = s.T
        return np.stack([SIGMA * (y - x), x * (rho - z) - y, x * y - BETA * z], axis=-1)

    return flow(field, lambda s: lorenz_jacobian(rho, s), step, steps)


def henon(x: Array, v: Array) -> tuple[Array, Array]:
    a, b = v[..., 0], v[..., 1]
    moved = np.stack([1.0 - 1.4 * x[:, 0] ** 2 + x[:, 1], 0.3 * x[:, 0]], axis=-1)
    return moved, np.stack([-2.8 * x[:, :1] * a + b, 0.3 * a], axis=-1)


def states_only(advance: Advance) -> Callable[[Array], Array]:
    return lambda x: advance(x, np.zeros((len(x), 1, x.shape[1])))[0]


def on_henon(n: int) -> Array:
    """Points of the Henon attractor: 1000 iterates from different starts."""
    x = np.stack([np.linspace(-0.1, 0.1, n), np.full(n, 0.1)], axis=-1)
    for _ in range(1000):
        x = states_only(henon)(x)
    return x


@pytest.fixture(scope='module')
def lorenz_28() -> Growth:
    """64 trajectories over 50 units of time each, after 10 to settle; intervals of 0.5."""
    advance = lorenz(28.0, 0.01, 50)
    x = np.linspace(-12.0, 12.0, 64)
    start = np.stack([x, x + 1.0, np.full(64, 20.0)], axis=-1)
    settled = growth(advance, start, identity(64, 3), 20)
    return growth(advance, settled.states, settled.tangents, 100)


# linear systems


@pytest.mark.parametrize('k', [1, 2, 3])
def test_symmetric_matrix_is_exact(k: int) -> None:
    """Aligned eigenvectors: every interval is the exponent to rounding."""
    rotation, _ = np.linalg.qr(np.array([[1.0, 2.0, 0.5], [0.3, 1.0, -1.0], [2.0, 0.0, 1.0]]))
    matrix = rotation @ np.diag([1.7, -0.9, 0.2]) @ rotation.T
    found = growth(linear_map(matrix), np.ones((2, 3)), identity(2, 3, k) + 0.1, 300)
    result = estimate(found.logs, 1.0, discard=100)
    exact = np.log([1.7, 0.9, 0.2])[:k]
    # (0.9/1.7)^(2*100) has aligned the tangents below rounding after the discarded intervals
    np.testing.assert_allclose(result.exponent, np.tile(exact, (2, 1)), rtol=0, atol=1e-13)
    assert np.all(result.standard_error < 1e-13)


def test_non_normal_matrix_grows_first_and_decays_in_the_end() -> None:
    """Norms grow 1000-fold before they decay; the exponents are the eigenvalues all the same."""
    matrix = np.array([[0.9, 1e3, 0.0], [0.0, 0.5, 1e3], [0.0, 0.0, 0.25]])
    tangents = identity(1, 3)[:, ::-1]
    found = growth(linear_map(matrix), np.zeros((1, 3)), tangents, 300)
    assert found.logs[0, 0, 0] > np.log(900.0)
    result = estimate(found.logs, 2.0, discard=150)
    # (0.5/0.9)^150 = 5e-39 leaves rounding, magnified by the condition 1e6 of the eigenvectors
    np.testing.assert_allclose(
        result.exponent[0], np.log([0.9, 0.5, 0.25]) / 2.0, rtol=0, atol=1e-9
    )


def test_complex_pair_has_two_equal_exponents() -> None:
    """A rotation in skew coordinates: norms oscillate, the mean is the modulus."""
    turn, skew = 0.7, np.array([[1.0, 3.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]])
    core = np.zeros((3, 3))
    core[:2, :2] = 0.95 * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    core[2, 2] = 0.4
    matrix = skew @ core @ np.linalg.inv(skew)
    found = growth(linear_map(matrix), np.zeros((1, 3)), identity(1, 3), 2100)
    result = estimate(found.logs, 1.0, discard=100)
    # the sum over the intervals is bounded by the log of the condition of `skew`
    bound = np.log(np.linalg.cond(skew)) / 2000.0
    np.testing.assert_allclose(result.exponent[0], np.log([0.95, 0.95, 0.4]), rtol=0, atol=bound)
    # the sum of all is the determinant, in every single interval
    np.testing.assert_allclose(
        found.logs[:, 0].sum(axis=-1), np.log(np.linalg.det(matrix)), rtol=1e-12
    )


def test_decaying_flow_has_its_rate_per_unit_of_time() -> None:
    """x' = -0.9 x: not an interval's log but a rate; RK4 with step 0.01 is off by 5e-11."""
    advance = flow(lambda x: -0.9 * x, lambda x: np.full((len(x), 1, 1), -0.9), 0.01, 50)
    result = estimate(growth(advance, np.ones((1, 1)), np.ones((1, 1, 1)), 60).logs, 0.5)
    np.testing.assert_allclose(result.exponent, -0.9, rtol=0, atol=1e-9)


# flows


@pytest.mark.slow
def test_lorenz_28_spectrum(lorenz_28: Growth) -> None:
    result = estimate(lorenz_28.logs, 0.5)
    literature = [0.9056, 0.0, -14.5723]
    # the mean over 64 runs scatters by 1/8 of one run
    error = np.sqrt(np.mean(result.standard_error**2, axis=0)) / 8
    assert np.all(np.abs(result.exponent.mean(axis=0) - literature) < 4 * error)
    assert np.all(np.abs(result.exponent - literature) < 4 * result.standard_error + 0.02)
    assert error[0] < 0.02  # so that the comparison says something


def test_lorenz_28_volume_shrinks_at_the_divergence_in_every_interval(lorenz_28: Growth) -> None:
    # RK4 drops (J h)^5/120 a step, J up to 25 (sqrt of 10 * 28 and of the products of the state)
    sums = lorenz_28.logs.sum(axis=-1) / 0.5
    truncation = (25.0 * 0.01) ** 5 / 120.0 / 0.01
    np.testing.assert_allclose(sums, -(SIGMA + 1.0 + BETA), rtol=0, atol=truncation)


def test_lorenz_20_settles_on_a_fixed_point() -> None:
    """rho = 20 is not 0 but the real part of the eigenvalues at the fixed point, -0.155."""
    rest = np.array([np.sqrt(BETA * 19.0), np.sqrt(BETA * 19.0), 19.0])
    values, vectors = np.linalg.eig(lorenz_jacobian(20.0, rest[None])[0])
    exact = np.sort(values.real)[::-1]
    assert exact[0] == pytest.approx(-0.155, abs=1e-3)
    start = rest + np.array([[0.3, 0.0, 0.0], [0.0, -0.3, 0.2]])
    found = growth(lorenz(20.0, 0.02, 25), start, identity(2, 3), 240)
    result = estimate(found.logs, 0.5, discard=40)
    # the turning pair oscillates within the log of the eigenvectors' condition; 100 units of time
    bound = np.log(np.linalg.cond(vectors)) / 100.0
    np.testing.assert_allclose(result.exponent, np.tile(exact, (2, 1)), rtol=0, atol=bound)


def test_limit_cycle_of_stuart_landau() -> None:
    """z' = (1 + 3i) z - |z|^2 z: unit circle, exponents 0 along and -2 across it."""

    def field(s: Array) -> Array:
        shrink = 1.0 - (s**2).sum(axis=-1, keepdims=True)
        return shrink * s + 3.0 * s[:, ::-1] * [-1.0, 1.0]

    def jacobian(s: Array) -> Array:
        shrink = 1.0 - (s**2).sum(axis=-1)[:, None, None]
        turn = np.array([[0.0, -3.0], [3.0, 0.0]])
        return np.asarray(shrink * np.eye(2) + turn - 2.0 * s[:, :, None] * s[:, None, :])

    advance = flow(field, jacobian, 0.01, 20)
    found = growth(advance, np.array([[0.3, 0.1], [2.0, 0.0]]), identity(2, 2), 200)
    result = estimate(found.logs, 0.2, discard=100)
    # 20 units of time at rate -2 leave e-40 of the start; RK4's own error is (3 * 0.01)^4
    np.testing.assert_allclose(result.exponent, [[0.0, -2.0]] * 2, rtol=0, atol=1e-6)


# maps


def test_henon_spectrum() -> None:
    n = 8
    result = estimate(growth(henon, on_henon(n), identity(n, 2), 3000).logs, 1.0, discard=50)
    assert np.all(np.abs(result.exponent[:, 0] - 0.4192) < 4 * result.standard_error[:, 0])
    # every step's determinant is -0.3
    np.testing.assert_allclose(result.exponent.sum(axis=1), np.log(0.3), rtol=0, atol=1e-12)


def test_logistic_map_at_4_is_ln_2() -> None:
    x = np.linspace(0.1, 0.4, 4)[:, None]
    found = growth(
        lambda s, v: (4.0 * s * (1.0 - s), (4.0 - 8.0 * s)[..., None] * v),
        x,
        np.ones((4, 1, 1)),
        5000,
    )
    result = estimate(found.logs, 1.0)
    # conjugate to the tent map: the sum differs from T ln 2 by log sin at the two ends, about
    # ln(5000) at worst; 5 ln(5000)/5000
    np.testing.assert_allclose(result.exponent[:, 0], np.log(2.0), rtol=0, atol=0.0085)


@pytest.mark.slow
def test_two_trajectories_agree_with_the_tangent_map() -> None:
    """Same states and directions: the neighbour differs by curvature and rounding only."""
    n, steps = 4, 2000
    start = on_henon(n)
    tangent = estimate(growth(henon, start, identity(n, 2, 1), steps).logs, 1.0, discard=50)
    pair = two_trajectory_growth(
        states_only(henon), start, identity(n, 2)[:, 0], steps, separation=1e-8
    )
    neighbour = estimate(pair.logs, 1.0, discard=50)
    assert np.all(np.abs(tangent.exponent - neighbour.exponent) < 2 * tangent.standard_error)
    # each step: 1e-8 of curvature and 1e-16/1e-8 of rounding, relative to a length that folds
    # shorten up to 100-fold
    np.testing.assert_allclose(neighbour.exponent, tangent.exponent, rtol=0, atol=1e-6)

    advance = lorenz(28.0, 0.01, 25)
    start = np.array([[1.0, 2.0, 20.0], [-5.0, -6.0, 25.0]])
    tangent = estimate(growth(advance, start, identity(2, 3, 1), 90).logs, 0.25, discard=10)
    distances = np.array([1e-7, 1e-8])
    pair = two_trajectory_growth(
        states_only(advance), start, identity(2, 3)[:, 0], 90, separation=distances
    )
    neighbour = estimate(pair.logs, 0.25, discard=10)
    assert np.all(np.abs(tangent.exponent - neighbour.exponent) < 2 * tangent.standard_error)
    np.testing.assert_allclose(neighbour.exponent, tangent.exponent, rtol=0, atol=1e-5)


# the standard error


def skew_tent(a: float) -> Advance:
    """x/a below a, (1 - x)/(1 - a) above: branches are visited independently, a and 1 - a."""

    def advance(x: Array, v: Array) -> tuple[Array, Array]:
        low = x < a
        slope = np.where(low, 1.0 / a, -1.0 / (1.0 - a))
        return np.where(low, x / a, (1.0 - x) / (1.0 - a)), slope[..., None] * v

    return advance


def test_standard_error_is_honest_for_chaotic_maps() -> None:
    """Estimates of 40 independent runs scatter like the error each reports.

    Ratio: the scatter of 40 is known to +-11 %; factor 1.5 is 4 of that and leaves the bias.
    """
    runs, a = 40, 0.3
    start = np.random.default_rng(1).uniform(size=(runs, 1))
    tent = estimate(growth(skew_tent(a), start, np.ones((runs, 1, 1)), 2000).logs[..., 0], 1.0)
    exact = -a * np.log(a) - (1.0 - a) * np.log(1.0 - a)
    scatter = np.std(tent.exponent, ddof=1)
    assert 1 / 1.5 < scatter / tent.standard_error.mean() < 1.5
    # independent branches: the scatter itself is known
    known = abs(np.log(1.0 / a - 1.0)) * np.sqrt(a * (1.0 - a) / 2000.0)
    assert 1 / 1.5 < tent.standard_error.mean() / known < 1.5
    assert abs(tent.exponent.mean() - exact) < 4.0 * scatter / np.sqrt(runs)

    cloud = on_henon(runs)
    found = growth(henon, cloud, identity(runs, 2, 1), 2000).logs[..., 0]
    result = estimate(found, 1.0, discard=50)
    # anticorrelated logs: batches of 97 leave a part of that, so the error may be a little large
    assert 0.5 < np.std(result.exponent, ddof=1) / result.standard_error.mean() < 1.5


def test_standard_error_allows_for_correlation() -> None:
    """Logs 0.1 + AR(1), coefficient 0.8: the mean scatters 3 times as much as if independent."""
    runs, length, keep = 40, 2000, 0.8
    noise = np.random.default_rng(2).standard_normal((length, runs))
    logs = np.zeros((length, runs))
    logs[0] = noise[0] / np.sqrt(1.0 - keep**2)
    for now in range(1, length):
        logs[now] = keep * logs[now - 1] + noise[now]
    result = estimate(logs + 0.1, 1.0)
    known = 1.0 / (1.0 - keep) / np.sqrt(length)
    # 40 x 19 degrees of freedom know it to 3 %; batches of 100 miss 2 * 0.8/0.36/5/100 = 5 %
    assert 0.85 < np.sqrt(np.mean(result.standard_error**2)) / known < 1.1
    naive = np.std(logs, axis=0, ddof=1).mean() / np.sqrt(length)
    assert result.standard_error.mean() > 2.5 * naive
    # covers as Student's t with 19 degrees of freedom says: 95 % of 40, at least 33 (p < 0.003)
    assert np.sum(np.abs(result.exponent - 0.1) < 2.093 * result.standard_error) >= 33


def test_running_estimate_ends_in_the_exponent() -> None:
    logs = np.random.default_rng(3).standard_normal((100, 3, 2))
    result = estimate(logs, 4.0, discard=20)
    assert result.running.shape == (80, 3, 2)
    np.testing.assert_array_equal(result.running[-1], result.exponent)
    # the mean of the kept logs, by another order of summation
    np.testing.assert_allclose(result.running[9], logs[20:30].mean(axis=0) / 4.0, rtol=1e-12)
    np.testing.assert_allclose(result.exponent, logs[20:].mean(axis=0) / 4.0, rtol=1e-12)


def test_too_few_intervals_have_no_standard_error() -> None:
    logs = np.random.default_rng(4).standard_normal(2 * BATCHES)
    assert np.isfinite(estimate(logs, 1.0).standard_error)
    short = estimate(logs, 1.0, discard=1)
    assert np.isfinite(short.exponent)
    assert np.isnan(short.standard_error)


# failure is NaN, and of one trajectory only


def assert_only_second_failed(found: Growth, alone: Growth) -> None:
    result = estimate(found.logs, 1.0)
    assert np.isnan(result.exponent[1]).all()
    assert np.isnan(result.standard_error[1]).all()
    assert np.isnan(found.tangents[1]).all()
    np.testing.assert_array_equal(found.logs[:, [0, 2]], alone.logs)


@pytest.mark.parametrize('k', [1, 2])
@pytest.mark.parametrize('bad', [np.nan, np.inf, 1e200], ids=['nan', 'inf', 'overflows'])
def test_state_that_is_or_becomes_infinite(bad: float, k: int) -> None:
    start = np.insert(on_henon(2), 1, [bad, 0.0], axis=0)
    found = growth(henon, start, identity(3, 2, k), 100)
    assert_only_second_failed(found, growth(henon, start[[0, 2]], identity(2, 2, k), 100))
    pair = two_trajectory_growth(states_only(henon), start, np.ones((3, 2)), 100, separation=1e-8)
    alone = two_trajectory_growth(
        states_only(henon), start[[0, 2]], np.ones((2, 2)), 100, separation=1e-8
    )
    assert_only_second_failed(pair, alone)


def test_escape_in_the_middle_keeps_what_was_before() -> None:
    """A state outside the basin of Henon overflows after some steps; no finite log follows."""
    start = np.insert(on_henon(2), 1, [1.5, 0.5], axis=0)
    logs = growth(henon, start, identity(3, 2), 60).logs
    lost = np.isnan(logs[:, 1, 0])
    assert not lost[0]
    assert np.all(np.diff(lost.astype(int)) >= 0)
    assert lost[-1]
    assert np.isnan(estimate(logs, 1.0).exponent[1]).all()
    # even where the failure lies among the discarded intervals
    assert np.isnan(estimate(logs, 1.0, discard=59).exponent[1]).all()


@pytest.mark.parametrize('k', [1, 2])
def test_zero_and_parallel_tangents(k: int) -> None:
    start, tangents = on_henon(3), identity(3, 2, k)
    tangents[1, k - 1] = 0.0
    alone = growth(henon, start[[0, 2]], tangents[[0, 2]], 50)
    assert_only_second_failed(growth(henon, start, tangents, 50), alone)
    if k == 2:
        # parallel up to rounding: QR would give the logarithm of noise
        tangents[1] = [[1.0, 2.0], [1.0 / 3.0, 2.0 / 3.0]]
        assert_only_second_failed(growth(henon, start, tangents, 50), alone)


@pytest.mark.parametrize('small', [0.0, 1e-14], ids=['singular', 'below rounding'])
def test_exponent_below_rounding_is_not_a_number(small: float) -> None:
    """Not the -36 that the rounding of a singular matrix looks like."""
    turn = np.linalg.qr(np.array([[1.0, 2.0], [-0.7, 1.0]]))[0]
    matrix = turn @ np.diag([1.0, small]) @ turn.T
    found = growth(linear_map(matrix), np.zeros((1, 2)), identity(1, 2), 50)
    assert np.isnan(estimate(found.logs, 1.0).exponent).all()
    # but what rounding has left digits of is a number: 1e-16/1e-10 relative
    matrix = turn @ np.diag([1.0, 1e-10]) @ turn.T
    found = growth(linear_map(matrix), np.zeros((1, 2)), identity(1, 2), 50)
    exponent = estimate(found.logs, 1.0, discard=2).exponent[0]
    np.testing.assert_allclose(exponent, [0.0, np.log(1e-10)], rtol=0, atol=1e-5)


def scaling(factor: float) -> Advance:
    return lambda x, v: (x, factor * v)


@pytest.mark.parametrize('factor', [0.0, 1e-310, np.inf, np.nan])
def test_tangent_that_vanishes_or_overflows_within_an_interval(factor: float) -> None:
    found = growth(scaling(factor), np.zeros((1, 1)), np.ones((1, 1, 1)), 40)
    assert np.isnan(estimate(found.logs, 1.0).exponent).all()


def test_length_whose_square_overflows_is_a_length() -> None:
    found = growth(scaling(1e250), np.zeros((1, 2)), np.ones((1, 1, 2)), 40)
    np.testing.assert_allclose(estimate(found.logs, 1.0).exponent, 250.0 * np.log(10.0), rtol=1e-12)


@pytest.mark.parametrize(('factor', 'start'), [(1e-7, 1.0), (1e7, 0.0)], ids=['drowned', 'thrown'])
def test_neighbour_outside_its_band(factor: float, start: float) -> None:
    """Drowned in rounding, or thrown away by a jump: no number."""

    def advance(x: Array) -> Array:
        return np.concatenate([x[:1], x[:1] + factor * (x[1:] - x[:1])])

    found = two_trajectory_growth(
        advance, np.full((1, 1), start), np.ones((1, 1)), 40, separation=1e-8
    )
    assert np.isnan(estimate(found.logs, 1.0).exponent).all()


def test_separation_that_vanishes_in_rounding() -> None:
    found = two_trajectory_growth(
        lambda x: x, np.ones((1, 2)), np.ones((1, 2)), 40, separation=1e-17
    )
    assert np.isnan(found.logs).all()


@pytest.mark.parametrize('wrong', [np.nan, np.inf, -np.inf])
def test_log_that_is_not_finite(wrong: float) -> None:
    logs = np.ones((100, 2))
    logs[3, 1] = wrong
    for discard in (0, 10):
        result = estimate(logs, 1.0, discard=discard)
        assert result.exponent[0] == 1.0
        assert result.standard_error[0] == 0.0
        assert np.isnan(result.exponent[1])
        assert np.isnan(result.standard_error[1])
        assert np.isnan(result.running[-1, 1])


def test_a_clock_inside_the_system_ticks_once_an_interval() -> None:
    """Forced systems keep their phase themselves: one call an interval, in both methods."""
    calls: list[int] = []

    def advance(x: Array) -> Array:
        calls.append(len(x))
        return 0.5 * x

    two_trajectory_growth(advance, np.ones((3, 2)), np.ones((3, 2)), 7, separation=1e-3)
    assert calls == [6] * 7


def test_impossible_requests_are_refused() -> None:
    start, same = np.zeros((2, 3)), linear_map(np.eye(3))
    with pytest.raises(AnalysisError, match=r'give \(n, d\)'):
        growth(same, np.zeros(3), np.ones((1, 1, 3)), 5)
    with pytest.raises(AnalysisError, match='with k from 1 to 3'):
        growth(same, start, np.ones((2, 4, 3)), 5)
    with pytest.raises(AnalysisError, match='at least 1'):
        growth(same, start, np.ones((2, 1, 3)), 0)
    with pytest.raises(AnalysisError, match='one positive number'):
        two_trajectory_growth(lambda x: x, start, start + 1.0, 5, separation=0.0)
    with pytest.raises(AnalysisError, match='give one a state'):
        two_trajectory_growth(lambda x: x, start, np.ones((2, 2)), 5, separation=1.0)
    with pytest.raises(AnalysisError, match='keep at least one'):
        estimate(np.ones(5), 1.0, discard=5)
    with pytest.raises(AnalysisError, match='positive length'):
        estimate(np.ones(5), 0.0)
