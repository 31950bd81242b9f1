# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Orbit diagrams, spectrum waterfalls, exponents and Poincare sections of the cracked rotor.

A study is asked with few objects: an OperatingPoint (rotor, speed, load), a Sweep (what varies) and
a Plan (how long, how fine). Diagrams are an `xarray.Dataset` whose first dimension is the swept
parameter, in frame `rotor` and SI, with units in the attrs; `length_scale_m` makes them
dimensionless.
"""

import concurrent.futures
import dataclasses
import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from rotor_common.configuration import unit_of
from rotor_dynamics.cache import ResultCache
from rotor_dynamics.continuations import follow
from rotor_dynamics.datasets import (
    ABOUT_A_MOTION,
    on_grid,
    section_dataset,
    survey_dataset,
)
from rotor_dynamics.ensemble import (
    Array,
    Ensemble,
    OperatingPoint,
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

if TYPE_CHECKING:
    import xarray

Direction = Literal['fixed', 'up', 'down']
Method = Literal['tangent', 'two_trajectories']

SEPARATION = 1e-8
"""Distance of the two trajectories over the static deflection."""
STRIP = 4096
"""Points of a map that are computed at once."""
MOST_POINTS = 250_000
"""Most points of a map; the point objects alone take 0.5 GB."""
BAND = 8.0
"""Highest order of a waterfall by default."""


@dataclass(frozen=True)
class LyapunovExponent:
    """Largest exponent per unit tau and its standard error; NaN if it could not be found.

    `running` (revolutions kept,): the estimate as it settles. `spectrum` (12,) in descending
    order and `spectrum_standard_error`, or None if not asked for; without the zero exponent of
    time. Its sum is -8 xi (1 + m/m_b), the trace of eq. (6), up to the numerical damping of RK4.
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
class Sweep:
    """What varies: `over`, a name in `ALIASES` or of a rotor parameter, and its `values` in SI.

    `direction` 'fixed' gives every value the same start; 'up' and 'down' follow the values in
    ascending or descending order, each point starting where the previous one ended.
    """

    over: str
    values: ArrayLike
    direction: Direction = 'fixed'

    @property
    def name(self) -> str:
        """The full name of the parameter."""
        return ALIASES.get(self.over, self.over)

    @property
    def axis(self) -> tuple[str, Array, dict[str, str]]:
        """The parameter as a coordinate: dimension, values (n,), unit and name."""
        units = {'speed_rad_s': 'rad/s', 'load_factor': '1'}
        unit = units.get(self.name) or unit_of(RotorParameters.model_fields[self.name]) or '1'
        about = {'units': unit, 'long_name': self.name}
        return self.name, np.asarray(self.values, np.float64).ravel(), about

    def points(self, point: OperatingPoint) -> tuple[OperatingPoint, ...]:
        """Return the point at each of the values; AnalysisError for impossible values."""
        return sweep(
            point.parameters,
            self.over,
            self.values,
            speed_rad_s=point.speed_rad_s,
            load_factor=point.load_factor,
        )


def orbit_diagram(
    point: OperatingPoint,
    sweep: Sweep,
    plan: Plan = Plan(),  # noqa: B008 - frozen
    *,
    initial_state: ArrayLike | None = None,
    executor: concurrent.futures.Executor | None = None,
    cache: ResultCache | None = None,
) -> 'xarray.Dataset':
    """Return the orbit (bifurcation) diagram: the section at each value of a parameter.

    `y`, `z` (n, revolutions) in m at tau = 2 pi j, `length_scale_m` (n,), `label` (n,) of the
    motion, `reason` (n,) why it is undecided or diverged, `converged` (n,): the same with half the
    step (never for a continuation, which is not repeated), `steps_per_revolution` (n,).
    The point's own value of the swept parameter is ignored; the result keeps the order of the
    values. Raises AnalysisError or ConfigError for what cannot be computed.
    """
    found = _directed(
        point, sweep, plan, initial_state=initial_state, executor=executor, cache=cache
    )
    names = ('y', 'z', 'label', 'reason', 'converged', 'steps_per_revolution')
    return survey_dataset(found, names, [sweep.axis], direction=sweep.direction)


def waterfall(
    point: OperatingPoint,
    sweep: Sweep,
    plan: Plan = Plan(highest_order=BAND),  # noqa: B008 - frozen
    *,
    initial_state: ArrayLike | None = None,
    executor: concurrent.futures.Executor | None = None,
    cache: ResultCache | None = None,
) -> 'xarray.Dataset':
    """Return the amplitude spectra of the disk's displacement at each value of a parameter.

    `amplitude_y`, `amplitude_z` (n, order) in m: one-sided, zero-to-peak, Hann window, mean
    removed; `frequency_rad_s` (n, order), the order times the speed; `length_scale_m`, `converged`.
    A plan without spectra computes them up to order BAND; see `orbit_diagram` for the rest.
    """
    if not plan.highest_order:
        plan = dataclasses.replace(plan, highest_order=BAND)
    found = _directed(
        point, sweep, plan, initial_state=initial_state, executor=executor, cache=cache
    )
    names = ('amplitude_y', 'amplitude_z', 'converged')
    about = {'direction': sweep.direction, 'window': 'hann', 'scaling': 'zero-to-peak'}
    result = survey_dataset(found, names, [sweep.axis], **about)
    speeds = np.array([point.speed_rad_s for point in found.points])
    frequency = (sweep.name, 'order'), np.outer(speeds, found.orders)
    about = {'units': 'rad/s', 'long_name': 'order times speed'}
    return result.assign(frequency_rad_s=(*frequency, about))


def lyapunov_diagram(
    point: OperatingPoint,
    sweep: Sweep,
    plan: Plan = Plan(exponent_revolutions=500),  # noqa: B008 - frozen
    *,
    initial_state: ArrayLike | None = None,
    executor: concurrent.futures.Executor | None = None,
    cache: ResultCache | None = None,
) -> 'xarray.Dataset':
    """Return the largest Lyapunov exponent at each value of a parameter, from tangents.

    `exponent`, `standard_error`, `exponent_difference` (n,) per unit tau, `converged`, `label`,
    `reason` (n,). A plan without exponents gets them over 500 revolutions.
    """
    if sweep.direction != 'fixed':
        raise AnalysisError(
            f"direction = {sweep.direction!r} has no meaning for exponents; leave it 'fixed'"
        )
    if not plan.exponent_revolutions:
        plan = dataclasses.replace(plan, exponent_revolutions=500)
    found = _directed(
        point, sweep, plan, initial_state=initial_state, executor=executor, cache=cache
    )
    names = ('exponent', 'standard_error', 'exponent_difference', 'converged', 'label', 'reason')
    return survey_dataset(found, names, [sweep.axis])


def _directed(
    point: OperatingPoint,
    sweep: Sweep,
    plan: Plan,
    *,
    initial_state: ArrayLike | None,
    executor: concurrent.futures.Executor | None,
    cache: ResultCache | None,
) -> Survey:
    """Survey all points from one start, or follow them up or down the values."""
    points = sweep.points(point)
    if sweep.direction == 'fixed':
        return survey(points, plan, initial_state=initial_state, executor=executor, cache=cache)
    return continuation([(points, sweep.direction)], sweep.values, plan, initial_state)[0]


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


def parameter_map(
    point: OperatingPoint,
    sweeps: tuple[Sweep, Sweep],
    plan: Plan,
    *,
    initial_state: ArrayLike | None = None,
    executor: concurrent.futures.Executor | None = None,
    cache: ResultCache | None = None,
    on_progress: Progress | None = None,
) -> 'xarray.Dataset':
    """Return exponents, labels and amplitudes over a grid (n, m) of two parameters.

    `exponent`, `standard_error`, `label`, `converged`, `length_scale_m` (n, m) and
    `order_amplitude_y`, `order_amplitude_z` (n, m, 6) in m, at HARMONICS and the ball-pass order.
    Computed in strips of STRIP points, of which only these numbers are kept: the memory needed
    does not grow with the sections and spectra of the grid.
    """
    first, second = sweeps
    if first.name == second.name:
        raise AnalysisError(f'a map over {first.name} and itself is a line; name two parameters')
    points = [each for row in first.points(point) for each in second.points(row)]
    if len(points) > MOST_POINTS:
        raise AnalysisError(
            f'a map of {len(points)} points is too large; allowed: {MOST_POINTS}, 500 x 500'
        )
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
        parts.append(survey_dataset(found, _MAPPED, []))
    return on_grid(parts, [first.axis, second.axis])


_MAPPED = (
    'exponent',
    'standard_error',
    'label',
    'order_amplitude_y',
    'order_amplitude_z',
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
    follows a neighbour at the distance SEPARATION; with a right-hand side that jumps it is
    unreliable, as it hardly ever sees a jump between two steps. `spectrum` adds all 12 exponents
    by QR. The first tenth of the revolutions is discarded while the tangent aligns.
    """
    plan = Plan(
        transient_revolutions,
        steps_per_revolution=steps_per_revolution,
        exponent_revolutions=revolutions,
    )
    point = OperatingPoint(parameters, float(speed_rad_s), float(load_factor))
    steps = steps_needed(point, plan.steps_per_revolution)
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
        # QR returns nearly equal exponents in any order
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
    point: OperatingPoint,
    plan: Plan = Plan(exponent_revolutions=500),  # noqa: B008 - frozen
    *,
    initial_state: ArrayLike | None = None,
) -> 'xarray.Dataset':
    """Return the section at tau = 2 pi j, the orbit in between, and the motion's label.

    `y`, `z`, `velocity_y`, `velocity_z` (revolution,) and `orbit_y`, ... (revolution, 64), m and
    m/s; `label`, `reason`, `diverged_at`, `difference`, `converged` as in a Survey, without a
    dimension; the evidence of the label (see `motion`) by names that begin with `evidence_`.
    The label rests on the section, on the exponent over the next `exponent_revolutions` and, with
    `check_steps`, on both at 2N steps. Without an exponent (0) no motion is called chaotic.
    """
    start = checked_start(initial_state)
    ensemble = Ensemble([point], steps_needed(point, plan.steps_per_revolution), start)
    ensemble.advance(plan.transient_revolutions)
    record = ensemble.advance(plan.revolutions, SAMPLES)
    measured = run_chunk([point], plan, start)
    found = label_motions(measured)
    if found['label'][0] == 'diverged':
        record[:] = np.nan
    evidence = judge(measured).evidence
    orbit = record[0].reshape(plan.revolutions, SAMPLES, 4).transpose(2, 0, 1)
    return section_dataset(
        dict(zip(('y', 'z', 'velocity_y', 'velocity_z'), orbit, strict=True)),
        {name: (measured | found)[name][0] for name in ABOUT_A_MOTION},
        {name: value[0].item() for name, value in evidence.items()},
        point,
    )
