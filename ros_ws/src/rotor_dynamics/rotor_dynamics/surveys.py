# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""From operating points to results: the one computation behind every diagram.

At each point: a transient is left out, a stretch is recorded, from it come the stroboscopic
section, means and spectra, then the largest exponent; all of it again with half the step.
"""

import concurrent.futures
import contextlib
import dataclasses
import itertools
import math
import numbers
import os
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor_common import interrupt
from rotor_common.tapers import hann
from rotor_dynamics.cache import Arrays, ResultCache
from rotor_dynamics.ensemble import (
    FEWEST_STEPS,
    Array,
    Ensemble,
    OperatingPoint,
    checked_start,
    engine_of,
    steps_needed,
)
from rotor_dynamics.errors import AnalysisError
from rotor_dynamics.labels import label_motions
from rotor_dynamics.lyapunov import estimate, growth
from rotor_sim.plant.parameters import RotorParameters

SAMPLES = 64
"""Recorded samples a revolution: orders up to 32; divides every allowed number of steps."""

HARMONICS = (1.0, 2.0, 2.5, 3.0, 4.0)
"""Orders whose amplitudes are reported; the ball-pass order of the bearing comes after them."""

LARGEST_DIFFERENCE = 0.05
"""For convergence, halving the step changes means and amplitudes by less than this share."""

EXPONENT_ERRORS = 3.0
EXPONENT_RESOLUTION = 1e-3
"""For convergence, the exponent changes by less than EXPONENT_ERRORS standard errors plus this,
per unit tau."""

ALIGNMENT = 10
"""The first 1/ALIGNMENT of the exponent's revolutions is discarded while the tangent aligns."""

CHUNK = 64
"""Points of one task: four groups of lanes, 80 MB at 300 revolutions, some seconds in all."""

LONG_CHUNK = 16
MOST_REVOLUTIONS = 4000
"""Recordings of more than 1000 revolutions are made in chunks of LONG_CHUNK points: 270 MB at
MOST_REVOLUTIONS."""

RUNAWAY = 1000.0
"""Static deflections beyond which even a finite trajectory has diverged: millimetres outside the
bearing are no small displacement."""

STRETCH = 100
"""Revolutions of a transient that are checked together: 13 MB for a chunk."""

LARGEST_IN_MEMORY = 64 * 2**20
"""Bytes of one array of a Survey beyond which it is kept on disk."""

ALIASES = {
    'speed': 'speed_rad_s',
    'G': 'load_factor',
    'K': 'crack_stiffness_ratio',
    'clearance': 'clearance_m',
    'eccentricity': 'eccentricity_m',
}
"""Short names of parameters to sweep; other numbers of RotorParameters go by their own name."""

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Plan:
    """What is computed at every point.

    `steps_per_revolution` is N; slow revolutions take 2, 4, ... times more (`steps_needed`).
    `exponent_revolutions` 0 leaves the exponent out, `highest_order` 0 the spectra, and
    `check_steps` False the second run with 2N, after which no point counts as converged.
    """

    transient_revolutions: int = 1000
    revolutions: int = 300
    steps_per_revolution: int = 256
    exponent_revolutions: int = 0
    highest_order: float = 0.0
    check_steps: bool = True

    def __post_init__(self) -> None:
        limits = {
            'transient_revolutions': (0, 10**6),
            'revolutions': (16, MOST_REVOLUTIONS),
            'steps_per_revolution': (FEWEST_STEPS, 2**16),
            'exponent_revolutions': (0, 10**6),
            'highest_order': (0, SAMPLES // 2),
        }
        for name, (low, high) in limits.items():
            value = getattr(self, name)
            if name != 'highest_order' and not isinstance(value, numbers.Integral):
                raise AnalysisError(f'{name} = {value!r} is not a whole number')
            if not low <= value <= high:
                raise AnalysisError(f'{name} = {value:g} is out of range; allowed: {low} to {high}')
        if 0 < self.exponent_revolutions < 50:
            raise AnalysisError(
                f'exponent_revolutions = {self.exponent_revolutions} is out of range; allowed: '
                '0 (none), or at least 50 for a standard error'
            )


@dataclass(frozen=True)
class Survey:
    """The results at n points; frame `rotor`, SI, NaN where a trajectory diverged.

    `y`, `z`, `velocity_y`, `velocity_z` (n, revolutions): the disk at tau = 2 pi j, m and m/s.
    `mean_y`, `mean_z` (n,): over the recorded revolutions, m.
    `orders` (b,): 1/revolutions apart; `amplitude_y`, `amplitude_z` (n, b), float32: zero-to-peak
    in m, Hann window, mean removed. b = 0 without spectra.
    `order_amplitude_y`, `order_amplitude_z` (n, 6): zero-to-peak in m at HARMONICS and the
    ball-pass order, by the plain sum over all recorded samples, with the same window.
    `exponent`, `standard_error` (n,): largest Lyapunov exponent per unit tau, from tangents.
    `naive_exponent` (n,): the same without saltation, as by a program that ignores the jumps of f,
    and wrong there; NaN where f is continuous or no exponent is asked for.
    `diverged_at` (n,): revolution after the start at which it left the model; NaN if it did not.
    `label`, `reason`, `zero_one` (n,): see `labels`.
    `steps_per_revolution` (n,): N as used.
    `difference` (n,): largest change of means and order amplitudes from N to 2N over the larger of
    the static deflection and the largest amplitude; `exponent_difference` likewise, per unit tau.
    `converged` (n,): both within LARGEST_DIFFERENCE and EXPONENT_ERRORS.
    """

    points: tuple[OperatingPoint, ...]
    plan: Plan
    y: Array
    z: Array
    velocity_y: Array
    velocity_z: Array
    mean_y: Array
    mean_z: Array
    orders: Array
    amplitude_y: NDArray[np.float32]
    amplitude_z: NDArray[np.float32]
    order_amplitude_y: Array
    order_amplitude_z: Array
    exponent: Array
    standard_error: Array
    naive_exponent: Array
    diverged_at: Array
    zero_one: Array
    label: NDArray[np.str_]
    reason: NDArray[np.str_]
    steps_per_revolution: NDArray[np.int64]
    difference: Array
    exponent_difference: Array
    converged: NDArray[np.bool_]

    @property
    def length_scale_m(self) -> Array:
        """The static deflection delta (n,), m: y and z over it are the paper's Y and Z."""
        return np.array([point.parameters.length_scale_m for point in self.points])

    def __len__(self) -> int:
        return len(self.points)

    def __getitem__(self, part: slice | NDArray[np.int64]) -> Self:
        """Return the survey of some of the points, or of all in another order."""
        return dataclasses.replace(
            self,
            points=tuple(self.points[i] for i in np.arange(len(self))[part]),
            **{name: getattr(self, name)[part] for name in _BY_POINT},
        )


_BY_POINT = tuple(
    field.name
    for field in dataclasses.fields(Survey)
    if field.name not in {'points', 'plan', 'orders'}
)


def sweep(
    parameters: RotorParameters,
    over: str,
    values: ArrayLike,
    *,
    speed_rad_s: float | None = None,
    load_factor: float | None = None,
) -> tuple[OperatingPoint, ...]:
    """Return one operating point for each value of `over`, a name in ALIASES or of a parameter.

    Speed and load factor are needed unless the sweep runs over them. Raises AnalysisError for an
    unknown name, no values or a value that is impossible for the rotor.
    """
    name = ALIASES.get(over, over)
    fields = RotorParameters.model_fields
    numbers = [key for key, field in fields.items() if field.annotation is float]
    if name not in {'speed_rad_s', 'load_factor', *numbers}:
        raise AnalysisError(
            f'{over!r} is nothing to sweep over; allowed: {", ".join(ALIASES)}, '
            f'{", ".join(numbers)}'
        )
    wanted = np.asarray(values, np.float64).ravel()
    if not wanted.size:
        raise AnalysisError(f'the range over {name} is empty; give at least one value')
    fixed = {'speed_rad_s': speed_rad_s, 'load_factor': load_factor}
    points = []
    for value in wanted.tolist():
        where = {key: value if key == name else given for key, given in fixed.items()}
        missing = [key for key, given in where.items() if given is None]
        if missing:
            raise AnalysisError(f'{missing[0]} is missing; the sweep over {name} needs one')
        changed = parameters
        if name not in fixed:
            changed = with_value(parameters, name, value)
        points.append(OperatingPoint(changed, **{k: float(v or 0.0) for k, v in where.items()}))
    return tuple(points)


def with_value(parameters: RotorParameters, name: str, value: float) -> RotorParameters:
    """Return the rotor with one parameter changed; raises ConfigError for an impossible value."""
    fields = {key: getattr(parameters, key) for key in type(parameters).model_fields}
    return RotorParameters(**(fields | {name: value}))


def survey(
    points: Sequence[OperatingPoint],
    plan: Plan,
    *,
    initial_state: ArrayLike | None = None,
    executor: concurrent.futures.Executor | None = None,
    cache: ResultCache | None = None,
    on_progress: Progress | None = None,
) -> Survey:
    """Compute `plan` at every point, in chunks on `executor` (default: a thread for each core).

    `initial_state` (12,) in SI is the start of every point; by default that of the reference
    values (`fixed_start`). A finished chunk is stored in `cache` at once and not computed again.
    `on_progress` gets the number of points done and in total. The results do not depend on the
    executor: the same points and plan give the same bits.

    Raises:
        AnalysisError: no points, a bad start, too few steps, or a cache that cannot be written.

    """
    chunks = _chunks(points, plan)
    start = checked_start(initial_state)
    arrays: Arrays = {}
    done = 0

    def keep(chunk: list[int], part: Arrays) -> None:
        nonlocal done
        for name, values in part.items():
            if name not in arrays:
                arrays[name] = _room((len(points), *values.shape[1:]), values.dtype)
            arrays[name][chunk] = values
        done += len(chunk)
        if on_progress is not None:
            on_progress(done, len(points))

    with contextlib.ExitStack() as stack:
        if executor is None:
            executor = stack.enter_context(concurrent.futures.ThreadPoolExecutor(os.cpu_count()))
        pending: dict[concurrent.futures.Future[Arrays], tuple[list[int], str]] = {}
        # an interrupt must not wait for chunks that have not begun
        stack.callback(lambda: [future.cancel() for future in pending])
        for chunk in chunks:
            task = ([points[i] for i in chunk], plan, start)
            key = cache.key('survey', task) if cache is not None else ''
            known = cache.load(key) if cache is not None else None
            if known is not None:
                keep(chunk, known)
            else:
                pending[executor.submit(run_chunk, *task)] = chunk, key
        for future in concurrent.futures.as_completed(pending):
            chunk, key = pending.pop(future)  # and with it the result, once it is kept
            result = future.result()
            with interrupt.held():  # an interrupt must not fall between storing and counting
                if cache is not None:
                    cache.store(key, result)
                keep(chunk, result)
    return of_arrays(points, plan, arrays)


def of_arrays(points: Sequence[OperatingPoint], plan: Plan, arrays: Arrays) -> Survey:
    """Return the survey of points whose arrays are complete; the labels are made here."""
    bins = arrays['amplitude_y'].shape[1]
    known = {name: values for name, values in arrays.items() if name in _BY_POINT}
    with np.errstate(all='ignore'):  # NaN marks a diverged trajectory
        known |= label_motions(arrays)
    return Survey(tuple(points), plan, orders=np.arange(bins) / plan.revolutions, **known)


def _room(shape: tuple[int, ...], dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return an array; a large one is in an unnamed file that is deleted with the array."""
    if math.prod(shape) * dtype.itemsize <= LARGEST_IN_MEMORY:
        return np.empty(shape, dtype)
    with tempfile.TemporaryFile() as file:
        return np.memmap(file, dtype, 'w+', shape=shape)


def _chunks(points: Sequence[OperatingPoint], plan: Plan) -> list[list[int]]:
    """Return the indices of the points that are computed side by side, CHUNK at most."""
    if not points:
        raise AnalysisError('there are no points to survey; give at least one')

    def kind(index: int) -> tuple[Any, ...]:
        point = points[index]
        return (steps_needed(point, plan.steps_per_revolution), engine_of(point))

    size = CHUNK if plan.revolutions <= 1000 else LONG_CHUNK
    chunks = []
    for _, same in itertools.groupby(sorted(range(len(points)), key=kind), kind):
        chunks += [list(part) for part in _batched(list(same), size)]
    return chunks


def _batched(items: list[int], size: int) -> list[list[int]]:
    return [items[i : i + size] for i in range(0, len(items), size)]


def run_chunk(points: Sequence[OperatingPoint], plan: Plan, start: Array | None) -> Arrays:
    """Return the arrays of a Survey without labels, (len(points), ...), for points of one kind.

    With a check at 2N steps also the results of that run that the label needs: `finer_y`,
    `finer_z`, `finer_exponent`, `finer_standard_error`.
    """
    steps = steps_needed(points[0], plan.steps_per_revolution)
    with np.errstate(all='ignore'):  # NaN marks a diverged trajectory
        arrays = _measure(points, steps, plan, start, finer=False) | unchecked(len(points), steps)
        if plan.check_steps:
            finer = _measure(points, 2 * steps, plan, start, finer=True)
            scale = np.array([point.parameters.length_scale_m for point in points])
            arrays |= _compare(arrays, finer, scale, asked=plan.exponent_revolutions > 0)
            arrays |= {f'finer_{name}': finer[name] for name in _LABELLED_BY}
    return arrays


_LABELLED_BY = ('y', 'z', 'exponent', 'standard_error')


def _measure(
    points: Sequence[OperatingPoint],
    steps: int,
    plan: Plan,
    start: Array | None,
    *,
    finer: bool,
) -> Arrays:
    ensemble = Ensemble(points, steps, start)
    left = settle(ensemble, plan.transient_revolutions)
    record = ensemble.advance(plan.revolutions, SAMPLES)
    states, revolution = ensemble.states, ensemble.revolution
    left = np.fmin(left, departure(points, record, plan.transient_revolutions))
    left = np.where(np.isnan(left) & _outside(points, states), revolution, left)
    failed = diverged(points, record, states)
    exponent, error = _exponents(ensemble, plan.exponent_revolutions)
    late = _outside(points, ensemble.states) & ~failed
    if late.any():
        again = Ensemble(points, steps, states, revolution)
        left[late] = settle(again, plan.exponent_revolutions)[late]
        failed |= late
    record[failed] = np.nan
    arrays = summarise(points, record, 0.0 if finer else plan.highest_order)
    exponent[failed], error[failed] = np.nan, np.nan
    arrays |= {
        'exponent': exponent,
        'standard_error': error,
        'diverged_at': np.where(failed, left, np.nan),
    }
    if not finer:
        naive = np.full(len(points), np.nan)
        jumps = np.array([point.parameters.breathing_jumps for point in points])
        if jumps.any():
            again = Ensemble(points, steps, states, revolution)
            found, _ = _exponents(again, plan.exponent_revolutions, saltation=False)
            naive[jumps & ~failed] = found[jumps & ~failed]
        arrays['naive_exponent'] = naive
    return arrays


def settle(ensemble: Ensemble, revolutions: int) -> Array:
    """Advance by whole revolutions; return (n,) the revolution at which each left the model.

    Counted like `ensemble.revolution`; NaN for a trajectory that did not leave it.
    """
    left = np.full(len(ensemble.points), np.nan)
    until = ensemble.revolution + revolutions
    while ensemble.revolution < until:
        first = ensemble.revolution
        record = ensemble.advance(min(STRETCH, until - first), SAMPLES)
        left = np.fmin(left, departure(ensemble.points, record, first))
    return np.where(np.isnan(left) & _outside(ensemble.points, ensemble.states), until, left)


def diverged(points: Sequence[OperatingPoint], record: Array, states: Array) -> NDArray[np.bool_]:
    """Return (n,) whether recording (n, samples, 4) or final state (n, 12) has left the model."""
    return np.asarray(_beyond(points, record).any(axis=1) | _outside(points, states))


def _outside(points: Sequence[OperatingPoint], states: Array) -> NDArray[np.bool_]:
    """Return (n,) whether the state (n, 12) has left the model."""
    outside = _beyond(points, states[:, np.newaxis])[:, 0]
    return np.asarray(outside | ~np.isfinite(states).all(axis=1))


def _beyond(points: Sequence[OperatingPoint], places: Array) -> NDArray[np.bool_]:
    """Return which samples (n, samples, 2 or more) of y and z lie beyond RUNAWAY or are NaN."""
    farthest = RUNAWAY * np.array([point.parameters.length_scale_m for point in points])
    inside = np.abs(places[..., :2]).max(axis=2) <= farthest[:, np.newaxis]  # False for NaN
    return np.asarray(~inside)


def departure(points: Sequence[OperatingPoint], record: Array, first: int) -> Array:
    """Return (n,) the revolution in which a recording from `first` on leaves the model, or NaN."""
    beyond = _beyond(points, record)
    return np.where(beyond.any(axis=1), first + beyond.argmax(axis=1) // SAMPLES, np.nan)


def summarise(points: Sequence[OperatingPoint], record: Array, highest_order: float) -> Arrays:
    """Return the arrays of a Survey from a recording (n, revolutions * SAMPLES, 4), m and m/s."""
    section = record[:, ::SAMPLES]
    ball_pass = np.array([point.parameters.ball_pass_order for point in points])
    arrays: Arrays = {
        'y': section[..., 0].copy(),
        'z': section[..., 1].copy(),
        'velocity_y': section[..., 2].copy(),
        'velocity_z': section[..., 3].copy(),
    }
    kept = math.floor(highest_order * section.shape[1]) + 1 if highest_order > 0.0 else 0
    for name, column in (('y', 0), ('z', 1)):
        mean, spectrum = _spectrum(record[..., column])
        arrays[f'mean_{name}'] = mean
        arrays[f'amplitude_{name}'] = spectrum[:, :kept].astype(np.float32)
        arrays[f'order_amplitude_{name}'] = _order_amplitudes(record[..., column], ball_pass)
    return arrays


def _spectrum(x: Array) -> tuple[Array, Array]:
    """Return the means (n,) and one-sided zero-to-peak amplitudes (n, bins) of (n, samples)."""
    mean = x.mean(axis=1)
    window = hann(x.shape[1])
    transform = np.fft.rfft((x - mean[:, np.newaxis]) * window, axis=1)
    return mean, np.abs(transform) * (2.0 / window.sum())


def _order_amplitudes(x: Array, ball_pass: Array) -> Array:
    """Return the amplitudes (n, 6) at HARMONICS and each point's ball-pass order, zero-to-peak."""
    samples = x.shape[1]
    window = hann(samples)
    weighted = (x - x.mean(axis=1, keepdims=True)) * (window * (2.0 / window.sum()))
    tau = np.arange(samples) * (2.0 * np.pi / SAMPLES)
    # the ball-pass order is the same at all points, unless the sweep is over a radius
    bearings, which = np.unique(ball_pass, return_inverse=True)
    phase = np.outer(tau, [*HARMONICS, *bearings])
    found = np.hypot(weighted @ np.cos(phase), weighted @ np.sin(phase))
    own = np.take_along_axis(found, len(HARMONICS) + which[:, np.newaxis], axis=1)
    return np.concatenate([found[:, : len(HARMONICS)], own], axis=1)


def _exponents(
    ensemble: Ensemble, revolutions: int, *, saltation: bool = True
) -> tuple[Array, Array]:
    count = len(ensemble.points)
    if revolutions == 0:
        return np.full(count, np.nan), np.full(count, np.nan)
    logs = tangent_growth(ensemble, revolutions, saltation=saltation)
    result = estimate(logs[:, :, 0], 2.0 * math.pi, discard=revolutions // ALIGNMENT)
    return result.exponent, result.standard_error


def tangent_growth(
    ensemble: Ensemble, revolutions: int, *, directions: int = 1, saltation: bool = True
) -> Array:
    """Return the logarithmic growth (revolutions, n / directions, directions) of tangents.

    With more than one direction, trajectories must come in groups of `directions` equal ones: each
    carries one tangent, and those of a group are made orthogonal after every revolution.
    """
    count = len(ensemble.points) // directions
    first = np.random.default_rng(0).standard_normal((directions, 12))
    tangents = np.broadcast_to(first, (count, directions, 12))

    def advance(_: Array, tangents: Array) -> tuple[Array, Array]:
        moved = ensemble.advance_tangents(tangents.reshape(-1, 12), saltation=saltation)
        return ensemble.states[::directions], moved.reshape(tangents.shape)

    return growth(advance, ensemble.states[::directions], tangents, revolutions).logs


def unchecked(count: int, steps: int) -> Arrays:
    """Return the convergence arrays of a Survey for points computed with one step only."""
    return {
        'steps_per_revolution': np.full(count, steps),
        'difference': np.full(count, np.nan),
        'exponent_difference': np.full(count, np.nan),
        'converged': np.zeros(count, np.bool_),
    }


def _compare(coarse: Arrays, fine: Arrays, length_scale_m: Array, *, asked: bool) -> Arrays:
    """Return the changes when the step is halved, and whether they are small enough."""
    names = ('order_amplitude_y', 'order_amplitude_z')
    changes = [np.abs(coarse[name] - fine[name]).max(axis=1) for name in names]
    changes += [np.abs(coarse[name] - fine[name]) for name in ('mean_y', 'mean_z')]
    largest = np.max([coarse[name].max(axis=1) for name in names], axis=0)
    difference = np.max(changes, axis=0) / np.maximum(largest, length_scale_m)
    exponent = np.abs(coarse['exponent'] - fine['exponent'])
    error = np.hypot(coarse['standard_error'], fine['standard_error'])
    converged = difference <= LARGEST_DIFFERENCE
    if asked:
        converged &= exponent <= EXPONENT_ERRORS * error + EXPONENT_RESOLUTION
    return {
        'difference': difference,
        'exponent_difference': exponent,
        'converged': converged,
    }
