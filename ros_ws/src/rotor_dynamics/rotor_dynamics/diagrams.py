# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Orbit diagrams, spectrum waterfalls, exponents and Poincare sections of the cracked rotor.

Every function takes a rotor and keyword arguments in SI; `speed_rad_s` and `load_factor` may be
left out where the sweep runs over them. Sweeps take `over`, a parameter's name (see `sweep`), and
its `values`. Results are in frame `rotor` and SI; `length_scale_m` makes them dimensionless.
"""

import concurrent.futures
import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor_dynamics.cache import ResultCache
from rotor_dynamics.continuations import follow
from rotor_dynamics.ensemble import (
    Array,
    Ensemble,
    OperatingPoint,
    check_breathing,
    checked_start,
    steps_needed,
)
from rotor_dynamics.errors import AnalysisError
from rotor_dynamics.labels import judge, label_motions
from rotor_dynamics.lyapunov import estimate, two_trajectory_growth
from rotor_dynamics.surveys import (
    ALIASES,
    ALIGNMENT,
    SAMPLES,
    Plan,
    Progress,
    Survey,
    diverged,
    run_chunk,
    settle,
    survey,
    sweep,
    tangent_growth,
)
from rotor_sim.plant.parameters import RotorParameters

Direction = Literal['fixed', 'up', 'down']
Method = Literal['tangent', 'two_trajectories']

SEPARATION = 1e-8
"""Distance of the two trajectories over the static deflection."""
STRIP = 4096
"""Points of a map that are worked on at once."""
MOST_POINTS = 250_000
"""Points of a map; the points alone take 0.5 GB."""
BAND = 8.0
"""Orders of a waterfall unless asked otherwise."""


@dataclass(frozen=True)
class OrbitDiagram:
    """Stroboscopic displacements of the disk over a parameter.

    `values` (n,) of `over` in `unit`; `y`, `z` (n, revolutions) in m at tau = 2 pi j;
    `length_scale_m` (n,); `label` (n,) of the motion and `reason` (n,) why it is undecided or
    diverged; `converged` (n,): the same with half the step (never for a continuation, which is
    not repeated); `direction`: 'fixed', the same start at every value, or continuation 'up' or
    'down' the values, each from where the last ended.
    """

    over: str
    unit: str
    values: Array
    y: Array
    z: Array
    length_scale_m: Array
    label: NDArray[np.str_]
    reason: NDArray[np.str_]
    converged: NDArray[np.bool_]
    steps_per_revolution: NDArray[np.int64]
    direction: Direction


@dataclass(frozen=True)
class Waterfall:
    """Amplitude spectra over a parameter: `amplitude_y`, `amplitude_z` (n, b) in m.

    `orders` (b,) and `frequency_rad_s` (n, b), the order times the speed; one-sided, zero-to-peak
    amplitudes after a Hann window, mean removed.
    """

    over: str
    unit: str
    values: Array
    orders: Array
    frequency_rad_s: Array
    amplitude_y: NDArray[np.float32]
    amplitude_z: NDArray[np.float32]
    length_scale_m: Array
    converged: NDArray[np.bool_]
    direction: Direction = 'fixed'
    window: str = 'hann'
    scaling: str = 'zero-to-peak'


@dataclass(frozen=True)
class LyapunovDiagram:
    """Largest exponents (n,) per unit tau over a parameter, standard errors, motion's labels.

    `reason` (n,) says why a motion is undecided or diverged.
    """

    over: str
    unit: str
    values: Array
    exponent: Array
    standard_error: Array
    exponent_difference: Array
    converged: NDArray[np.bool_]
    label: NDArray[np.str_]
    reason: NDArray[np.str_]


@dataclass(frozen=True)
class ParameterMap:
    """Results over two parameters, (n, m): rows over the first, columns over the second.

    `exponent` and `standard_error` per unit tau, `label` of the motion; `order_amplitude_y` and
    `order_amplitude_z` (n, m, 6) in m at HARMONICS and the ball-pass order; `converged`.
    """

    over: tuple[str, str]
    units: tuple[str, str]
    values: tuple[Array, Array]
    exponent: Array
    standard_error: Array
    label: NDArray[np.str_]
    order_amplitude_y: Array
    order_amplitude_z: Array
    length_scale_m: Array
    converged: NDArray[np.bool_]


@dataclass(frozen=True)
class LyapunovExponent:
    """Largest exponent per unit tau and its standard error; NaN if it could not be found.

    `running` (revolutions kept,): the estimate as it settles. `spectrum` (12,) in descending
    order and `spectrum_standard_error`, or None if not asked for; the direction of time is not in
    it. Its sum is -8 xi (1 + m/m_b), the trace of eq. (6), up to what RK4 damps of its own.
    `diverged_at`: revolution after the start at which the motion left the model, None if it did
    not; without it NaN means that the growth was lost in rounding.
    """

    exponent: float
    standard_error: float
    running: Array
    spectrum: Array | None = None
    spectrum_standard_error: Array | None = None
    diverged_at: int | None = None


@dataclass(frozen=True)
class PoincareSection:
    """A motion's section at tau = 2 pi j (revolutions,) and orbit (revolutions, 64), m and m/s.

    `label`, `reason`, `diverged_at`, `difference` and `converged` as in a Survey; `evidence`: see
    `motion`.
    """

    y: Array
    z: Array
    velocity_y: Array
    velocity_z: Array
    orbit_y: Array
    orbit_z: Array
    orbit_velocity_y: Array
    orbit_velocity_z: Array
    length_scale_m: float
    label: str
    reason: str
    diverged_at: float
    evidence: dict[str, Any]
    difference: float
    converged: bool


def orbit_diagram(
    parameters: RotorParameters,
    *,
    over: str,
    values: ArrayLike,
    speed_rad_s: float | None = None,
    load_factor: float | None = None,
    transient_revolutions: int = 1000,
    revolutions: int = 300,
    steps_per_revolution: int = 256,
    initial_state: ArrayLike | None = None,
    direction: Direction = 'fixed',
    executor: concurrent.futures.Executor | None = None,
    cache: ResultCache | None = None,
) -> OrbitDiagram:
    """Return the orbit (bifurcation) diagram: the section at each value of a parameter.

    `direction` 'up' and 'down' go through the values in ascending or descending order, each
    point starting where the one before ended; the result keeps the order of `values`.
    Raises AnalysisError or ConfigError for what cannot be computed.
    """
    plan = Plan(transient_revolutions, revolutions, steps_per_revolution)
    points = sweep(parameters, over, values, speed_rad_s=speed_rad_s, load_factor=load_factor)
    found = _directed(
        points,
        plan,
        initial_state,
        values=values,
        direction=direction,
        executor=executor,
        cache=cache,
    )
    return OrbitDiagram(
        *_axis(over, values),
        found.y,
        found.z,
        found.length_scale_m,
        found.label,
        found.reason,
        found.converged,
        found.steps_per_revolution,
        direction,
    )


def _directed(
    points: Sequence[OperatingPoint],
    plan: Plan,
    initial_state: ArrayLike | None,
    *,
    values: ArrayLike,
    direction: Direction,
    executor: concurrent.futures.Executor | None,
    cache: ResultCache | None,
) -> Survey:
    """Survey points from one start, or one after the other up or down the values."""
    if direction == 'fixed':
        return survey(points, plan, initial_state=initial_state, executor=executor, cache=cache)
    return continuation([(points, direction)], values, plan, initial_state)[0]


def continuation(
    sweeps: Sequence[tuple[Sequence[OperatingPoint], Direction]],
    values: ArrayLike,
    plan: Plan,
    initial_state: ArrayLike | None = None,
) -> list[Survey]:
    """Return the surveys of several sweeps over the same values, each followed up or down.

    A sweep is its points, one for each value; the results keep the order of `values`. See
    `continuations.follow`. Raises AnalysisError for an unknown direction.
    """
    rising = np.argsort(np.asarray(values, np.float64).ravel(), kind='stable')
    orders = []
    for _, direction in sweeps:
        if direction not in {'up', 'down'}:
            raise AnalysisError(
                f"direction = {direction!r} is not known; it must be 'fixed', 'up' or 'down'"
            )
        orders.append(rising if direction == 'up' else rising[::-1])
    followed = follow(
        [[points[i] for i in order] for (points, _), order in zip(sweeps, orders, strict=True)],
        plan,
        initial_state,
    )
    return [found[np.argsort(order)] for found, order in zip(followed, orders, strict=True)]


def waterfall(
    parameters: RotorParameters,
    *,
    over: str,
    values: ArrayLike,
    speed_rad_s: float | None = None,
    load_factor: float | None = None,
    transient_revolutions: int = 1000,
    revolutions: int = 300,
    steps_per_revolution: int = 256,
    initial_state: ArrayLike | None = None,
    highest_order: float = BAND,
    direction: Direction = 'fixed',
    executor: concurrent.futures.Executor | None = None,
    cache: ResultCache | None = None,
) -> Waterfall:
    """Return the amplitude spectra of the disk's displacement at each value of a parameter.

    `direction` as in `orbit_diagram`; `highest_order` at most 32.
    """
    plan = Plan(
        transient_revolutions, revolutions, steps_per_revolution, highest_order=highest_order
    )
    points = sweep(parameters, over, values, speed_rad_s=speed_rad_s, load_factor=load_factor)
    found = _directed(
        points,
        plan,
        initial_state,
        values=values,
        direction=direction,
        executor=executor,
        cache=cache,
    )
    speeds = np.array([point.speed_rad_s for point in points])
    return Waterfall(
        *_axis(over, values),
        found.orders,
        np.outer(speeds, found.orders),
        found.amplitude_y,
        found.amplitude_z,
        found.length_scale_m,
        found.converged,
        direction,
    )


def lyapunov_diagram(
    parameters: RotorParameters,
    *,
    over: str,
    values: ArrayLike,
    speed_rad_s: float | None = None,
    load_factor: float | None = None,
    transient_revolutions: int = 1000,
    revolutions: int = 500,
    steps_per_revolution: int = 256,
    initial_state: ArrayLike | None = None,
    executor: concurrent.futures.Executor | None = None,
    cache: ResultCache | None = None,
) -> LyapunovDiagram:
    """Return the largest Lyapunov exponent at each value of a parameter, from tangents."""
    plan = Plan(
        transient_revolutions,
        steps_per_revolution=steps_per_revolution,
        exponent_revolutions=revolutions,
    )
    points = sweep(parameters, over, values, speed_rad_s=speed_rad_s, load_factor=load_factor)
    found = survey(points, plan, initial_state=initial_state, executor=executor, cache=cache)
    return LyapunovDiagram(
        *_axis(over, values),
        found.exponent,
        found.standard_error,
        found.exponent_difference,
        found.converged,
        found.label,
        found.reason,
    )


def parameter_map(
    parameters: RotorParameters,
    *,
    over: tuple[str, str],
    values: tuple[ArrayLike, ArrayLike],
    plan: Plan,
    speed_rad_s: float | None = None,
    load_factor: float | None = None,
    initial_state: ArrayLike | None = None,
    executor: concurrent.futures.Executor | None = None,
    cache: ResultCache | None = None,
    on_progress: Progress | None = None,
) -> ParameterMap:
    """Return exponents, labels and amplitudes over a grid of two parameters.

    Worked off in strips of STRIP points, of which only the numbers of ParameterMap are kept:
    the memory it takes does not grow with the sections and spectra of the grid.
    """
    names = [ALIASES.get(name, name) for name in over]
    if names[0] == names[1]:
        raise AnalysisError(f'a map over {names[0]} and itself is a line; name two parameters')
    # each sweep needs the numbers that the other one gives
    given = {'speed_rad_s': speed_rad_s, 'load_factor': load_factor}
    spare = given | {name: 1.0 for name in names if name in given}
    points = [
        point
        for row in sweep(parameters, over[0], values[0], **spare)
        for point in sweep(
            row.parameters,
            over[1],
            values[1],
            speed_rad_s=row.speed_rad_s,
            load_factor=row.load_factor,
        )
    ]
    if len(points) > MOST_POINTS:
        raise AnalysisError(
            f'a map of {len(points)} points is too large; allowed: {MOST_POINTS}, 500 x 500'
        )
    first, second = (_axis(name, wanted) for name, wanted in zip(over, values, strict=True))
    parts = []
    for begin in range(0, len(points), STRIP):

        def report(done: int, _: int, begin: int = begin) -> None:
            if on_progress is not None:
                on_progress(begin + done, len(points))

        found = survey(
            points[begin : begin + STRIP],
            plan,
            initial_state=initial_state,
            executor=executor,
            cache=cache,
            on_progress=report,
        )
        parts.append([getattr(found, name) for name in _MAPPED])
    shape = (len(first[2]), len(second[2]))
    joined = {
        name: np.concatenate([part[index] for part in parts]) for index, name in enumerate(_MAPPED)
    }
    return ParameterMap(
        (first[0], second[0]),
        (first[1], second[1]),
        (first[2], second[2]),
        **{name: array.reshape(*shape, *array.shape[1:]) for name, array in joined.items()},
    )


_MAPPED = (
    'exponent',
    'standard_error',
    'label',
    'order_amplitude_y',
    'order_amplitude_z',
    'length_scale_m',
    'converged',
)


def lyapunov_exponent(
    parameters: RotorParameters,
    *,
    speed_rad_s: float,
    load_factor: float,
    transient_revolutions: int = 1000,
    revolutions: int = 500,
    steps_per_revolution: int = 256,
    initial_state: ArrayLike | None = None,
    method: Method = 'tangent',
    saltation: bool = True,
    spectrum: bool = False,
) -> LyapunovExponent:
    """Return the largest Lyapunov exponent at one operating point, per unit tau.

    `tangent` integrates the variational equations with the same steps; with `saltation` the
    tangent jumps where the right-hand side does (all variants but `derived`). `two_trajectories`
    follows a neighbour, SEPARATION away; between two steps it hardly ever sees a jump of the
    right-hand side, and is not to be trusted there. `spectrum` adds all 12 exponents by QR.
    A tenth of the revolutions is left to the tangent to align.
    """
    plan = Plan(
        transient_revolutions,
        steps_per_revolution=steps_per_revolution,
        exponent_revolutions=revolutions,
    )
    point = OperatingPoint(parameters, float(speed_rad_s), float(load_factor))
    steps = steps_needed(point, plan.steps_per_revolution)
    check_breathing(point)
    ensemble = Ensemble([point], steps, checked_start(initial_state))
    left = settle(ensemble, plan.transient_revolutions)
    start, revolution = ensemble.states, ensemble.revolution
    if method == 'two_trajectories' and (spectrum or not saltation):
        raise AnalysisError('spectrum and saltation belong to the tangent; leave them out')
    if method == 'two_trajectories':
        logs = _two_trajectories(point, steps, start, revolution, revolutions)
    elif method == 'tangent':
        logs = tangent_growth(ensemble, revolutions, saltation=saltation)
    else:
        raise AnalysisError(
            f"method = {method!r} is not known; it must be 'tangent' or 'two_trajectories'"
        )
    if method == 'two_trajectories':
        ensemble.advance(revolutions)
    last = ensemble.advance(1, SAMPLES)
    diverged_at = None
    if diverged([point], last, start)[0] or diverged([point], last, ensemble.states)[0]:
        again = Ensemble([point], steps, start, revolution)
        left = np.fmin(left, settle(again, revolutions + 1))
        logs, diverged_at = np.full_like(logs, np.nan), int(left[0])
    estimated = functools.partial(
        estimate,
        interval_length=2.0 * math.pi,
        discard=revolutions // ALIGNMENT,
    )
    largest = estimated(logs[:, 0, 0])
    exponents, errors = None, None
    if spectrum:
        crowd = Ensemble([point] * 12, steps, start, revolution)
        logs = tangent_growth(crowd, revolutions, directions=12, saltation=saltation)
        if diverged_at is not None:
            logs[:] = np.nan
        everything = estimated(logs[:, 0])
        # QR leaves nearly equal ones in any order
        order = np.argsort(-everything.exponent)
        exponents, errors = everything.exponent[order], everything.standard_error[order]
    return LyapunovExponent(
        float(largest.exponent),
        float(largest.standard_error),
        largest.running,
        exponents,
        errors,
        diverged_at,
    )


def _two_trajectories(
    point: OperatingPoint, steps: int, start: Array, revolution: int, revolutions: int
) -> Array:
    pair = Ensemble([point, point], steps, start, revolution)
    # m/s over the speed is m/rad, the unit of the tangents
    scale: Array = np.repeat([1.0, point.speed_rad_s], 6)

    def advance(states: Array) -> Array:
        pair.states = states * scale
        pair.advance(1)
        return pair.states / scale

    direction = np.random.default_rng(0).standard_normal((1, 12))
    distance = SEPARATION * point.parameters.length_scale_m
    result = two_trajectory_growth(
        advance, start / scale, direction, revolutions, separation=distance
    )
    return result.logs


def poincare_section(
    parameters: RotorParameters,
    *,
    speed_rad_s: float,
    load_factor: float,
    transient_revolutions: int = 1000,
    revolutions: int = 300,
    steps_per_revolution: int = 256,
    exponent_revolutions: int = 500,
    check_steps: bool = True,
    initial_state: ArrayLike | None = None,
) -> PoincareSection:
    """Return the section at tau = 2 pi j, the orbit between, and the motion's label.

    The label rests on the section, on the exponent over the next `exponent_revolutions` and, with
    `check_steps`, on both at 2N steps. Without an exponent (0) no motion is called chaotic.
    """
    plan = Plan(
        transient_revolutions,
        revolutions,
        steps_per_revolution,
        exponent_revolutions,
        check_steps=check_steps,
    )
    point = OperatingPoint(parameters, float(speed_rad_s), float(load_factor))
    check_breathing(point)
    start = checked_start(initial_state)
    ensemble = Ensemble([point], steps_needed(point, steps_per_revolution), start)
    ensemble.advance(transient_revolutions)
    record = ensemble.advance(revolutions, SAMPLES)
    measured = run_chunk([point], plan, start)
    found = label_motions(measured)
    if found['label'][0] == 'diverged':
        record[:] = np.nan
    evidence = judge(measured).evidence
    orbit = record[0].reshape(revolutions, SAMPLES, 4)
    section = orbit[:, 0]
    y, z, velocity_y, velocity_z = section.T
    orbit_y, orbit_z, orbit_velocity_y, orbit_velocity_z = orbit.transpose(2, 0, 1)
    return PoincareSection(
        y,
        z,
        velocity_y,
        velocity_z,
        orbit_y,
        orbit_z,
        orbit_velocity_y,
        orbit_velocity_z,
        length_scale_m=parameters.length_scale_m,
        label=str(found['label'][0]),
        reason=str(found['reason'][0]),
        diverged_at=float(measured['diverged_at'][0]),
        evidence={name: value[0].item() for name, value in evidence.items()},
        difference=float(measured['difference'][0]),
        converged=bool(measured['converged'][0]),
    )


def _axis(over: str, values: ArrayLike) -> tuple[str, str, Array]:
    """Return the parameter's full name, its unit and the values."""
    name = ALIASES.get(over, over)
    units = {'speed_rad_s': 'rad/s', 'load_factor': '1'}
    if name not in units:
        extra = RotorParameters.model_fields[name].json_schema_extra
        units[name] = str(extra.get('unit', '1')) if isinstance(extra, dict) else '1'
    return name, units[name], np.asarray(values, np.float64).ravel()
