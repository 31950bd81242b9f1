# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Sweeps, surveys and the diagrams made of them: bits, cache, interrupts, flags and refusals."""

import concurrent.futures
import dataclasses
import importlib
import math
import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rotor_common import interrupt
from rotor_common.constants import GRAVITY_M_S2
from rotor_dynamics import (
    OperatingPoint,
    Plan,
    ResultCache,
    Survey,
    Sweep,
    continuation,
    lyapunov_diagram,
    lyapunov_exponent,
    orbit_diagram,
    parameter_map,
    poincare_section,
    survey,
    sweep,
    waterfall,
)
from rotor_dynamics.ensemble import Ensemble
from rotor_dynamics.errors import AnalysisError
from rotor_sim import RotorParameters
from rotor_sim.plant.parameters import VARIANTS

Array = NDArray[np.float64]

module = importlib.import_module('rotor_dynamics.surveys')
diagrams = importlib.import_module('rotor_dynamics.diagrams')

DERIVED = RotorParameters.hou2016()
SHORT = Plan(10, 20, exponent_revolutions=50, highest_order=4.0)
ARRAYS = [
    field.name
    for field in dataclasses.fields(Survey)
    if field.name not in {'points', 'plan', 'label', 'reason'}
]


def over_crack(count: int, variant: str = 'derived') -> tuple[OperatingPoint, ...]:
    values = np.linspace(0.0, 0.25, count)
    parameters = RotorParameters.hou2016(variant)
    return sweep(parameters, 'K', values, speed_rad_s=352.0, load_factor=3.0)


def assert_same(found: Survey, expected: Survey) -> None:
    """Bit for bit."""
    assert found.points == expected.points
    assert found.plan == expected.plan
    assert found.label.tolist() == expected.label.tolist()
    assert found.reason.tolist() == expected.reason.tolist()
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), name)


@pytest.fixture
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, 'CHUNK', 6)


class Immediate(concurrent.futures.Executor):
    """Does the work in submit, and counts."""

    def __init__(self, most: int = 1000) -> None:
        self.most = most
        self.points = 0

    def submit(self, function: Any, /, *args: Any, **kwargs: Any) -> Any:
        assert self.points < self.most, 'nothing was left to compute'
        self.points += len(args[0])
        future: concurrent.futures.Future[Any] = concurrent.futures.Future()
        future.set_result(function(*args, **kwargs))
        return future


# --- sweep ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ('over', 'name'),
    [
        ('K', 'crack_stiffness_ratio'),
        ('clearance', 'clearance_m'),
        ('eccentricity', 'eccentricity_m'),
        ('damping_ratio', 'damping_ratio'),
        ('crack_half_angle_rad', 'crack_half_angle_rad'),
    ],
)
def test_sweep_over_a_parameter(over: str, name: str) -> None:
    values = [2e-5, 1e-5, 3e-5] if name != 'crack_half_angle_rad' else [0.3, 0.2, 0.4]
    points = sweep(DERIVED, over, values, speed_rad_s=352, load_factor=3)
    assert [getattr(point.parameters, name) for point in points] == values
    for point in points:
        assert (point.speed_rad_s, point.load_factor) == (352.0, 3.0)
        same = point.parameters.model_dump() | {name: getattr(DERIVED, name)}
        assert same == DERIVED.model_dump()


def test_sweep_over_speed_and_load() -> None:
    for over in ('speed', 'speed_rad_s'):
        points = sweep(DERIVED, over, [300, 200], load_factor=2.0)
        assert points == tuple(OperatingPoint(DERIVED, w, 2.0) for w in (300.0, 200.0))
    for over in ('G', 'load_factor'):
        points = sweep(DERIVED, over, np.array([0.0, -3.0]), speed_rad_s=352.0)
        assert points == tuple(OperatingPoint(DERIVED, 352.0, g) for g in (0.0, -3.0))


@pytest.mark.parametrize(
    ('over', 'values', 'given', 'expected'),
    [
        ('k', [0.1], {}, r"'k' is nothing to sweep over; allowed: speed, G, K, clearance, ecc"),
        ('variant', [1.0], {}, "'variant' is nothing to sweep over"),
        ('ball_count', [8.0], {}, "'ball_count' is nothing to sweep over"),
        ('K', [], {}, 'range over crack_stiffness_ratio is empty; give at least one value'),
        ('K', [0.1], {'speed_rad_s': None}, 'speed_rad_s is missing; the sweep over crack_'),
        ('speed', [300.0], {'load_factor': None}, 'load_factor is missing; the sweep over speed'),
        ('speed', [300.0, math.nan], {}, 'speed_rad_s = nan rad/s is out of range'),
        ('G', [math.inf], {}, 'load_factor = inf is out of range'),
        ('K', [0.1, math.nan], {}, 'crack_stiffness_ratio'),
        ('K', [0.6], {}, 'crack_stiffness_ratio = 0.6'),
        ('load_scale', [1.5], {}, "load_scale = 1.5 is not that of variant 'derived'"),
    ],
)
def test_sweep_refuses(
    over: str, values: list[float], given: dict[str, Any], expected: str
) -> None:
    where = {'speed_rad_s': 352.0, 'load_factor': 3.0} | given
    with pytest.raises(ValueError, match=expected) as raised:
        sweep(DERIVED, over, values, **where)
    assert '\n' not in str(raised.value)


# --- surveys --------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.usefixtures('small_chunks')
def test_executors_and_orders_give_the_same_bits() -> None:
    points = over_crack(6) + over_crack(6, 'natural')
    with concurrent.futures.ThreadPoolExecutor(1) as one:
        expected = survey(points, SHORT, executor=one)
    with concurrent.futures.ThreadPoolExecutor(3) as three:
        assert_same(survey(points, SHORT, executor=three), expected)
    assert_same(survey(points, SHORT), expected)
    assert_same(survey(points, SHORT, executor=Immediate()), expected)
    # other chunks: in another order, with other neighbours
    order = np.array([*range(0, 12, 2), *range(11, 0, -2)])
    assert_same(survey([points[i] for i in order], SHORT), expected[order])


@pytest.mark.slow
def test_kinds_and_steps_are_sorted_out_and_back() -> None:
    """Two numbers of balls, another crack angle and two step sizes, mixed, in one survey."""
    kinds: list[dict[str, Any]] = [{}, {'ball_count': 7}, {'crack_half_angle_rad': 0.9}]
    points = [
        OperatingPoint(RotorParameters.hou2016(crack_stiffness_ratio=k, **kind), speed, 3.0)
        for k in (0.3, 0.1, 0.0, 0.2, 0.25)  # five: the code of sixteen lanes
        for speed in (120.0, 352.0)
        for kind in kinds
    ]
    plan = Plan(5, 16, check_steps=False)
    found = survey(points, plan)
    assert found.points == tuple(points)
    assert found.steps_per_revolution.tolist() == 5 * [512, 512, 512, 256, 256, 256]
    for first in range(6):
        assert_same(found[first::6], survey(points[first::6], plan))


def test_survey_refuses() -> None:
    with pytest.raises(AnalysisError, match='no points to survey; give at least one'):
        survey([], SHORT)
    for state in (np.zeros(11), np.full(12, np.nan), np.zeros((1, 12))):
        with pytest.raises(AnalysisError, match=r'initial_state has the shape .* 12 finite'):
            survey(over_crack(1), SHORT, initial_state=state)
    tight = sweep(DERIVED, 'clearance', [0.0, 1e-6], speed_rad_s=352.0, load_factor=3.0)
    with pytest.raises(AnalysisError, match='128 does not serve with clearance_m = 1e-06'):
        survey(tight, dataclasses.replace(SHORT, steps_per_revolution=128))


@pytest.mark.parametrize(
    ('changes', 'expected'),
    [
        ({'transient_revolutions': -1}, 'transient_revolutions = -1 is out of range; allowed: 0 '),
        ({'revolutions': 15}, 'revolutions = 15 is out of range; allowed: 16 to 4000'),
        ({'revolutions': 10**6}, 'revolutions = 1e.06 is out of range'),
        ({'exponent_revolutions': 49}, 'exponent_revolutions = 49 .* 0 .none., or at least 50'),
        ({'exponent_revolutions': -1}, 'exponent_revolutions = -1'),
        ({'highest_order': 32.5}, 'highest_order = 32.5 is out of range; allowed: 0 to 32'),
        ({'highest_order': math.nan}, 'highest_order = nan'),
    ],
)
def test_plan_refuses(changes: dict[str, Any], expected: str) -> None:
    with pytest.raises(AnalysisError, match=expected):
        Plan(**changes)


def test_start_is_the_one_given(section_4_start: Array) -> None:
    point = over_crack(1)[0]
    plan = Plan(0, 16, check_steps=False)
    start = section_4_start * point.parameters.length_scale_m
    default = survey([point], plan)
    assert_same(survey([point], plan, initial_state=start), default)
    assert default.y[0, 0] == start[0]
    other = survey([point], plan, initial_state=0.5 * start)
    assert (other.y[0, 0], other.z[0, 0]) == (0.5 * start[0], 0.5 * start[1])


def test_what_is_not_asked_for_is_absent() -> None:
    found = survey(over_crack(2), Plan(1, 16, check_steps=False))
    assert found.amplitude_y.shape == found.amplitude_z.shape == (2, 0)
    assert found.orders.shape == (0,)
    for name in ('exponent', 'standard_error', 'naive_exponent', 'difference'):
        assert np.isnan(getattr(found, name)).all()
    assert not found.converged.any()


# --- cache and interrupts -------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.usefixtures('small_chunks')
def test_second_run_computes_nothing_and_another_plan_does(tmp_path: Path) -> None:
    cache, points = ResultCache(tmp_path), over_crack(12)
    first = Immediate()
    expected = survey(points, SHORT, executor=first, cache=cache)
    assert first.points == 12
    seen: list[tuple[int, int]] = []
    found = survey(
        points,
        SHORT,
        executor=Immediate(most=0),
        cache=cache,
        on_progress=lambda *now: seen.append(now),
    )
    assert_same(found, expected)
    assert seen == [(6, 12), (12, 12)]
    changed = [
        (points, dataclasses.replace(SHORT, revolutions=21), None),
        (points, dataclasses.replace(SHORT, steps_per_revolution=512), None),
        (points, dataclasses.replace(SHORT, check_steps=False), None),
        (points, SHORT, np.zeros(12)),
        (over_crack(12, 'natural'), SHORT, None),
    ]
    for others, plan, start in changed:
        again = Immediate()
        survey(others, plan, initial_state=start, executor=again, cache=cache)
        assert again.points == 12


@pytest.mark.usefixtures('small_chunks')
@pytest.mark.parametrize('interrupt', [KeyboardInterrupt, SystemExit])
def test_interrupt_keeps_what_is_done(tmp_path: Path, interrupt: type[BaseException]) -> None:
    cache, points = ResultCache(tmp_path), over_crack(18)

    def stop(done: int, _: int) -> None:
        if done >= 12:
            raise interrupt

    with concurrent.futures.ThreadPoolExecutor(1) as one, pytest.raises(interrupt):
        survey(points, SHORT, executor=one, cache=cache, on_progress=stop)
    assert len(list(tmp_path.glob('*.npz'))) == 2
    rest = Immediate()
    found = survey(points, SHORT, executor=rest, cache=cache)
    assert rest.points == 6
    assert_same(found, survey(points, SHORT))


class InterruptedCache(ResultCache):
    """Ctrl-C hits when a chunk has just been stored."""

    def store(self, key: str, arrays: Any) -> None:
        super().store(key, arrays)
        os.kill(os.getpid(), signal.SIGINT)


@pytest.mark.usefixtures('small_chunks')
def test_what_is_stored_is_counted_whenever_ctrl_c_comes(tmp_path: Path) -> None:
    points, cache, done = over_crack(18), InterruptedCache(tmp_path), [0]
    with pytest.raises(interrupt.Interrupted), interrupt.interruptible(signal.SIGINT):
        survey(points, SHORT, cache=cache, on_progress=lambda now, _: done.append(now))
    assert len(list(tmp_path.glob('*.npz'))) == 1
    assert done == [0, 6]


class Interrupted(Immediate):
    """Ctrl-C hits while the last chunk is computed elsewhere; one still waits in line."""

    def __init__(self) -> None:
        super().__init__()
        self.waiting: list[concurrent.futures.Future[Any]] = []

    def submit(self, function: Any, /, *args: Any, **kwargs: Any) -> Any:
        if self.points < 6:
            return super().submit(function, *args, **kwargs)
        future: concurrent.futures.Future[Any] = concurrent.futures.Future()
        if not self.waiting:
            future.set_exception(KeyboardInterrupt())
        self.waiting.append(future)
        return future


@pytest.mark.usefixtures('small_chunks')
def test_interrupt_cancels_what_has_not_begun() -> None:
    executor = Interrupted()
    with pytest.raises(KeyboardInterrupt):
        survey(over_crack(18), SHORT, executor=executor)
    assert [future.cancelled() for future in executor.waiting] == [False, True]


@pytest.mark.usefixtures('small_chunks')
def test_progress_counts_points() -> None:
    seen: list[tuple[int, int]] = []
    survey(over_crack(14), SHORT, on_progress=lambda *now: seen.append(now))
    done = [now for now, _ in seen]
    assert len(seen) == 3
    assert sorted(np.diff([0, *done]).tolist()) == [2, 6, 6]
    assert done[-1] == 14
    assert {total for _, total in seen} == {14}


@pytest.mark.usefixtures('small_chunks')
def test_large_results_lie_on_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    points = over_crack(12)
    expected = survey(points, SHORT)
    assert not isinstance(expected.y, np.memmap)
    monkeypatch.setattr(module, 'LARGEST_IN_MEMORY', 12 * 8)
    found = survey(points, SHORT)
    assert isinstance(found.y, np.memmap)
    assert isinstance(found.amplitude_z, np.memmap)
    assert not isinstance(found.exponent, np.memmap)  # twelve numbers
    assert_same(found, expected)
    assert_same(found[3:5], expected[3:5])


# --- numbers --------------------------------------------------------------------------------


def free_response(parameters: RotorParameters, speed: float) -> Array:
    """State at tau = 0 of the forced motion without contact, crack and load: eq. (5) in complex.

    x = A exp(i tau) with x = y + i z; the bearings (twice m_b) and the disk hang on 2k and 2c.
    """
    p = parameters
    spring = 2.0 * (p.shaft_stiffness_n_m + 2j * p.damping_ratio * p.disk_mass_kg * speed**2)
    matrix = np.array(
        [
            [spring - p.disk_mass_kg * speed**2, -spring],
            [-spring, spring - 2.0 * p.bearing_mass_kg * speed**2],
        ]
    )
    disk, bearing = np.linalg.solve(matrix, [p.disk_mass_kg * p.eccentricity_m * speed**2, 0.0])
    places = np.array([disk, bearing, bearing])
    x = np.stack([places.real, places.imag], axis=1).ravel()
    return np.concatenate([x, speed * np.stack([-places.imag, places.real], axis=1).ravel()])


def test_amplitudes_of_a_known_motion() -> None:
    """A circle of known size: every amplitude is zero-to-peak, with and without window."""
    speed = 352.0
    p = RotorParameters.hou2016(contact_stiffness_n_m15=0.0, crack_stiffness_ratio=0.0)
    state = free_response(p, speed)
    size = math.hypot(state[0], state[1])
    found = survey(
        [OperatingPoint(p, speed, 0.0)],
        Plan(0, 32, 4096, highest_order=4.0, check_steps=False),
        initial_state=state,
    )
    # RK4 at N = 4096 keeps the circle to (14.7 2 pi/4096)^4/120 = 2e-9 and rounding
    tolerance = 1e-6 * size
    expected = np.where(found.orders == 1.0, size, 0.0)
    # the Hann window spreads a line over its neighbours, half as high
    beside = np.isclose(np.abs(found.orders - 1.0), 1.0 / 32.0)
    expected[beside] = 0.5 * size
    np.testing.assert_allclose(found.orders, np.arange(4 * 32 + 1) / 32.0, rtol=0, atol=0)
    for name in ('y', 'z'):
        amplitude = getattr(found, f'amplitude_{name}')
        assert amplitude.dtype == np.float32
        np.testing.assert_allclose(amplitude[0], expected, rtol=0, atol=tolerance)
        # 1, 2, 2.5, 3, 4 and the ball pass 3.0846, which is 67 bins away from order 1
        orders = getattr(found, f'order_amplitude_{name}')[0]
        np.testing.assert_allclose(orders, [size, *5 * [0.0]], rtol=0, atol=1e-5 * size)
        assert abs(getattr(found, f'mean_{name}')[0]) < tolerance
    np.testing.assert_allclose(found.velocity_y, state[6], rtol=1e-6)
    np.testing.assert_allclose(found.velocity_z, state[7], rtol=1e-6)


def test_order_amplitudes_are_those_of_the_spectrum() -> None:
    found = survey(over_crack(5), Plan(50, 64, highest_order=5.0, check_steps=False))
    for column, order in enumerate((1.0, 2.0, 2.5, 3.0, 4.0)):
        bin_ = int(np.flatnonzero(found.orders == order)[0])
        for name in ('y', 'z'):
            np.testing.assert_allclose(
                getattr(found, f'amplitude_{name}')[:, bin_],
                getattr(found, f'order_amplitude_{name}')[:, column],
                rtol=1e-5,  # float32
                atol=1e-12,
            )


def test_ball_pass_amplitude_follows_each_bearing() -> None:
    """Sweep over a radius: each point has a ball-pass order of its own, and motion there."""
    points = sweep(
        RotorParameters.hou2016(crack_stiffness_ratio=0.0),
        'inner_radius_m',
        [0.0401, 0.035, 0.0401, 0.045],
        speed_rad_s=352.0,
        load_factor=3.0,
    )
    found = survey(points, Plan(300, 130, highest_order=8.0, check_steps=False))
    for n, point in enumerate(points):
        # the uncracked rotor under load moves at the ball pass most, next to order 1
        away = np.abs(found.orders - 1.0) > 0.1
        peak = found.orders[away][found.amplitude_z[n, away].argmax()]
        assert peak == pytest.approx(point.parameters.ball_pass_order, abs=1.0 / 130)
        own, highest = found.order_amplitude_z[n, 5], found.amplitude_z[n, away].max()
        # between two bins the Hann window loses 15 % at most
        assert 0.999 * highest < own < 1.18 * highest
    assert found.order_amplitude_z[0, 5] == found.order_amplitude_z[2, 5]


@pytest.mark.slow
def test_converged_is_said_of_the_regular_and_not_of_the_chaotic() -> None:
    """figure, K = 0.25, beyond the threshold to chaos; derived forgets its start and its step."""
    points = [*over_crack(2), *over_crack(2, 'figure')]
    found = survey(points, Plan(300, 100, exponent_revolutions=100))
    assert found.converged[:3].all()
    assert (found.difference[:3] < 0.05).all()
    assert not found.converged[3]
    assert found.difference[3] > 0.05 or found.exponent_difference[3] > 1e-3
    assert found.exponent[3] > 3.0 * found.standard_error[3]
    assert found.label.tolist() == [*3 * ['quasi-periodic'], 'chaotic']
    # the numbers are those of N and 2N
    once, twice = (survey(points, Plan(300, 100, n, 100, check_steps=False)) for n in (256, 512))
    scale = np.maximum(
        np.maximum(once.order_amplitude_y, once.order_amplitude_z).max(axis=1),
        found.length_scale_m,
    )
    changes = [
        np.abs(getattr(once, name) - getattr(twice, name)).reshape(4, -1).max(axis=1)
        for name in ('mean_y', 'mean_z', 'order_amplitude_y', 'order_amplitude_z')
    ]
    np.testing.assert_allclose(found.difference, np.max(changes, axis=0) / scale, rtol=1e-12)
    expected = np.abs(once.exponent - twice.exponent)
    np.testing.assert_allclose(found.exponent_difference, expected, rtol=1e-12)
    assert not once.converged.any()


@pytest.mark.parametrize('variant', VARIANTS)
def test_naive_exponent_is_that_without_saltation(variant: str) -> None:
    point = over_crack(2, variant)[1]
    found = survey([point], Plan(20, 16, exponent_revolutions=50, check_steps=False))
    for saltation, expected in ((True, found.exponent), (False, found.naive_exponent)):
        alone = lyapunov_exponent(
            point.parameters,
            speed_rad_s=352.0,
            load_factor=3.0,
            transient_revolutions=36,
            revolutions=50,
            saltation=saltation,
        )
        if variant == 'derived' and not saltation:
            assert np.isnan(expected[0])
        else:
            assert alone.exponent == expected[0]


@pytest.mark.parametrize('analysis', ['lyapunov_exponent', 'poincare_section', 'survey'])
def test_a_rotor_that_runs_away_gives_no_number(analysis: str) -> None:
    """5000 static deflections are far outside of the model, however finite."""
    rotor = RotorParameters.hou2016()
    start = np.zeros(12)
    start[0] = 5000.0 * rotor.length_scale_m
    where = {'speed_rad_s': 352.0, 'load_factor': 3.0}
    if analysis == 'survey':
        points = sweep(rotor, 'K', [0.1], **where)
        found = survey(points, Plan(0, 20, check_steps=False), initial_state=start)
        assert found.label[0] == 'diverged'
        assert np.isnan(found.z).all()
    elif analysis == 'poincare_section':
        section = diagrams.poincare_section(
            OperatingPoint(rotor, **where), Plan(0, 20), initial_state=start
        )
        assert section.label == 'diverged'
        assert np.isnan(section.orbit_z).all()
    else:
        exponent = diagrams.lyapunov_exponent(
            rotor, **where, transient_revolutions=0, revolutions=50, initial_state=start
        )
        assert np.isnan([exponent.exponent, exponent.standard_error]).all()


@pytest.mark.parametrize('start', [0.0, [1.0], [float('nan')] * 12])
def test_a_start_is_twelve_finite_numbers(start: Any) -> None:
    rotor = RotorParameters.hou2016()
    point = OperatingPoint(rotor, 352.0, 3.0)
    with pytest.raises(AnalysisError, match='give 12 finite numbers'):
        diagrams.lyapunov_exponent(
            rotor, speed_rad_s=352.0, load_factor=3.0, initial_state=start, revolutions=100
        )
    with pytest.raises(AnalysisError, match='give 12 finite numbers'):
        diagrams.poincare_section(point, Plan(0, 100), initial_state=start)
    with pytest.raises(AnalysisError, match='give 12 finite numbers'):
        diagrams.orbit_diagram(point, Sweep('K', [0.1], 'up'), Plan(0), initial_state=start)


def test_divergence_is_a_row_of_nan_and_its_neighbours_do_not_feel_it() -> None:
    """physics.md: `figure` diverges from K = 0.2875 at 352 rad/s, G = 3."""
    figure = RotorParameters.hou2016('figure')
    crack = [0.1, 0.3, 0.0, 0.3, 0.05, 0.15]
    plan = Plan(300, 100, exponent_revolutions=50, highest_order=4.0)
    found = survey(sweep(figure, 'K', crack, speed_rad_s=352.0, load_factor=3.0), plan)
    lost = np.array([k == 0.3 for k in crack])
    assert np.array_equal(found.label == 'diverged', lost)
    per_point = set(ARRAYS) - {'orders', 'converged', 'steps_per_revolution', 'naive_exponent'}
    for name in per_point - {'diverged_at'}:
        values = getattr(found, name).reshape(6, -1)
        assert np.isnan(values[lost]).all(), name
        assert np.isfinite(values[~lost]).all(), name
    # a single trajectory, looked at 64 times a revolution: how many stay within 1000 deflections
    alone = Ensemble(found.points[1:2], 256)
    farthest = 1000.0 * figure.length_scale_m
    within = 0
    while np.abs(alone.advance(1, 64)[0, :, :2]).max() <= farthest:
        within += 1
    assert 0 < within < 100
    assert found.diverged_at[lost].tolist() == [within, within]
    assert np.isnan(found.diverged_at[~lost]).all()
    assert set(found.reason[lost]) == {f'left the model in revolution {within}'}
    assert np.isnan(found.naive_exponent[lost]).all()
    assert not found.converged[lost].any()


# --- diagrams -------------------------------------------------------------------------------

LOADS = [3.5, 2.5, 2.0, 3.0]
"""In no order. figure at 431 rad/s, G = 2.5 has two motions: order 2.5 at rest, or 7 wide in Z."""


def orbit(parameters: RotorParameters, speed: float, direction: Any = 'fixed') -> Any:
    # 130 revolutions bring the balls where they stood (401/130 passes each): every point of a
    # continuation meets the same cage
    point = OperatingPoint(parameters, speed, 1.0)
    return orbit_diagram(point, Sweep('G', LOADS, direction), Plan(230, 30))


def test_up_and_down_find_the_two_motions_of_a_bistable_rotor() -> None:
    figure = RotorParameters.hou2016('figure')
    found = {way: orbit(figure, 431.0, direction=way) for way in ('up', 'down', 'fixed')}
    width = {way: np.ptp(o.z.values, axis=1) / o.length_scale_m.values for way, o in found.items()}
    assert width['up'][1] < 1.0
    assert width['down'][1] > 5.0
    for way, diagram in found.items():
        assert diagram.direction == way
        assert diagram.load_factor.values.tolist() == LOADS
        assert (diagram.over, diagram.unit) == ('load_factor', '1')
        assert diagram.y.shape == diagram.z.shape == (4, 30)
        assert (diagram.steps_per_revolution == 256).all()
        assert diagram.converged.any() == (way == 'fixed')
    # each continuation is the one of its first value, and the next starts where it ended
    first = orbit(figure, 431.0, direction='down')
    assert np.array_equal(first.z, found['down'].z)


def test_up_down_and_fixed_are_one_where_the_motion_is_unique() -> None:
    """derived, exponents near -0.01: 230 revolutions leave e^-14 of the start."""
    up, down, fixed = (orbit(DERIVED, 352.0, direction=way) for way in ('up', 'down', 'fixed'))
    scale = DERIVED.length_scale_m
    for other in (up, down):
        np.testing.assert_allclose(other.y / scale, fixed.y / scale, rtol=0, atol=1e-4)
        np.testing.assert_allclose(other.z / scale, fixed.z / scale, rtol=0, atol=1e-4)


def test_continuation_starts_where_the_last_value_ended() -> None:
    points = sweep(DERIVED, 'G', [1.0, 2.0], speed_rad_s=352.0)
    plan = Plan(3, 16)
    down, up = continuation([(points, 'down'), (points, 'up')], [1.0, 2.0], plan)
    # the first of each is a survey of its own, with the same start
    fixed = survey(points, dataclasses.replace(plan, check_steps=False))
    np.testing.assert_array_equal(up.y[0], fixed.y[0])
    np.testing.assert_array_equal(down.y[1], fixed.y[1])
    # and no transient at all would be the very next revolution
    plan = Plan(0, 16)
    (joined,) = continuation([(points, 'up')], [1.0, 2.0], plan)
    whole = survey(points[:1], Plan(16, 16, check_steps=False))
    assert joined.y[1, 0] == whole.y[0, 0]
    assert joined.velocity_z[1, 0] == whole.velocity_z[0, 0]
    assert joined.points == points


def test_continuation_goes_on_after_a_divergence() -> None:
    point = OperatingPoint(RotorParameters.hou2016('figure'), 352.0, 3.0)
    found = orbit_diagram(point, Sweep('K', [0.1, 0.3, 0.15], 'down'), Plan(300, 16))
    assert (found.label == 'diverged').values.tolist() == [False, True, False]
    assert np.isnan(found.y[1]).all()
    assert np.isfinite(found.y[[0, 2]]).all()


@pytest.mark.parametrize('call', [orbit_diagram, waterfall])
def test_direction_that_is_not_known(call: Callable[..., Any]) -> None:
    with pytest.raises(AnalysisError, match="'left' is not known; it must be 'fixed', 'up' or"):
        call(OperatingPoint(DERIVED, 352.0, 1.0), Sweep('G', [1.0], 'left'))  # type: ignore[arg-type]


def test_poincare_section_is_the_orbit_at_whole_turns() -> None:
    point = OperatingPoint(DERIVED, 352.0, 3.0)
    found = poincare_section(point, Plan(100, 110, exponent_revolutions=500))
    for name in ('y', 'z', 'velocity_y', 'velocity_z'):
        section, whole = getattr(found, name), getattr(found, f'orbit_{name}')
        assert section.shape == (110,)
        assert whole.shape == (110, 64)
        np.testing.assert_array_equal(whole[:, 0], section)
    expected = survey([point], Plan(100, 110, check_steps=False))
    np.testing.assert_array_equal(found.y, expected.y[0])
    np.testing.assert_array_equal(found.velocity_z, expected.velocity_z[0])
    assert found.label == expected.label[0] == 'quasi-periodic'
    assert found.evidence_zero_one == expected.zero_one[0]
    assert found.length_scale_m == DERIVED.length_scale_m


def test_single_points_that_diverge_say_so() -> None:
    figure = RotorParameters.hou2016('figure', crack_stiffness_ratio=0.3)
    where = {'speed_rad_s': 352.0, 'load_factor': 3.0, 'transient_revolutions': 300}
    section = poincare_section(OperatingPoint(figure, 352.0, 3.0), Plan(300, 16))
    assert section.label == 'diverged'
    assert not np.isfinite(section.y).any()
    for method in ('tangent', 'two_trajectories'):
        found = lyapunov_exponent(figure, **where, revolutions=50, method=method)  # type: ignore[arg-type]
        assert math.isnan(found.exponent)
        assert math.isnan(found.standard_error)


def test_waterfall_has_a_frequency_for_each_order_and_speed() -> None:
    speeds = [300.0, 500.0, 400.0]
    plan = Plan(20, 20, highest_order=3.0)
    found = waterfall(OperatingPoint(DERIVED, 352.0, 3.0), Sweep('speed', speeds), plan)
    assert found.order.values.tolist() == [n / 20 for n in range(61)]
    np.testing.assert_allclose(found.frequency_rad_s, np.outer(speeds, found.order), rtol=1e-15)
    assert found.amplitude_y.shape == found.amplitude_z.shape == (3, 61)
    assert (found.over, found.unit) == ('speed_rad_s', 'rad/s')
    expected = survey(
        sweep(DERIVED, 'speed', speeds, load_factor=3.0), Plan(20, 20, highest_order=3.0)
    )
    np.testing.assert_array_equal(found.amplitude_z, expected.amplitude_z)
    np.testing.assert_array_equal(found.converged, expected.converged)


def test_lyapunov_diagram_is_a_survey_with_a_name() -> None:
    point = OperatingPoint(DERIVED, 352.0, 3.0)
    plan = Plan(20, 300, exponent_revolutions=60)
    found = lyapunov_diagram(point, Sweep('clearance', [0.0, 2e-6]), plan)
    points = sweep(DERIVED, 'clearance', [0.0, 2e-6], speed_rad_s=352.0, load_factor=3.0)
    expected = survey(points, plan)
    assert (found.over, found.unit) == ('clearance_m', 'm')
    assert found.clearance_m.values.tolist() == [0.0, 2e-6]
    for name in ('exponent', 'standard_error', 'exponent_difference', 'converged', 'label'):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))


def test_method_that_is_not_known() -> None:
    with pytest.raises(AnalysisError, match="'qr' is not known; it must be 'tangent' or 'two_tr"):
        lyapunov_exponent(DERIVED, speed_rad_s=352.0, load_factor=3.0, method='qr')  # type: ignore[arg-type]


def test_map_is_a_survey_of_the_grid_in_strips(monkeypatch: pytest.MonkeyPatch) -> None:
    speeds, cracks = [300.0, 352.0], [0.0, 0.2, 0.1]
    plan = Plan(5, 16, exponent_revolutions=50, check_steps=False)
    seen: list[tuple[int, int]] = []

    def make(over: tuple[str, str], values: tuple[Any, Any]) -> Any:
        sweeps = Sweep(over[0], values[0]), Sweep(over[1], values[1])
        point = OperatingPoint(DERIVED, 352.0, 3.0)
        return parameter_map(point, sweeps, plan, on_progress=lambda *now: seen.append(now))

    whole = make(('speed', 'K'), (speeds, cracks))
    points = [
        point
        for speed in speeds
        for point in sweep(DERIVED, 'K', cracks, speed_rad_s=speed, load_factor=3.0)
    ]
    expected = survey(points, plan)
    assert whole.exponent.dims == ('speed_rad_s', 'crack_stiffness_ratio')
    axes = [whole[name] for name in whole.exponent.dims]
    assert [axis.units for axis in axes] == ['rad/s', '1']
    assert [axis.values.tolist() for axis in axes] == [speeds, cracks]
    names = ('exponent', 'label', 'order_amplitude_y', 'order_amplitude_z', 'length_scale_m')
    for name in names:
        array = getattr(expected, name)
        found = getattr(whole, name)
        np.testing.assert_array_equal(found, array.reshape(2, 3, *array.shape[1:]))
    assert seen[-1] == (6, 6)
    # rows and columns change places
    turned = make(('K', 'speed'), (cracks, speeds))
    np.testing.assert_array_equal(turned.exponent, whole.exponent.T)
    # strips of five and one: the last point runs by the code of few, which differs by rounding
    seen.clear()
    monkeypatch.setattr(diagrams, 'STRIP', 5)
    strips = make(('speed', 'K'), (speeds, cracks))
    first = [found.exponent.values.ravel()[:5] for found in (strips, whole)]
    np.testing.assert_array_equal(*first)
    np.testing.assert_allclose(strips.exponent, whole.exponent, rtol=0, atol=1e-9)
    assert seen == [(5, 6), (6, 6)]


def test_map_refuses() -> None:
    point = OperatingPoint(DERIVED, 352.0, 3.0)
    for over in (('K', 'crack_stiffness_ratio'), ('speed', 'speed_rad_s')):
        with pytest.raises(AnalysisError, match='is a line; name two parameters'):
            parameter_map(point, (Sweep(over[0], [0.1]), Sweep(over[1], [0.2])), SHORT)


def test_load_is_gravity_times_the_factor() -> None:
    assert OperatingPoint(DERIVED, 352.0, 3.0).load_m_s2 == 3.0 * GRAVITY_M_S2
