# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Lyapunov exponents of any system: growth of tangents or of a neighbour, and its estimate.

The system enters only as a function that takes a batch of n states one interval further. It is
called exactly once an interval and in order, so it may keep a clock of its own. Time, step and
unit belong to it.

Failure is NaN. A trajectory whose state or tangent stops being finite, whose tangent vanishes, or
whose growth is lost in rounding yields NaN from there on; its neighbours in the batch do not feel
it. Warnings of numpy about such trajectories are silenced here, since the NaN says it.

Sources: Benettin, Galgani, Giorgilli, Strelcyn, Meccanica 15 (1980) 9-20 (tangents and
reorthonormalisation); Benettin, Galgani, Strelcyn, Phys. Rev. A 14 (1976) 2338 (two trajectories);
Geist, Parlitz, Lauterborn, Prog. Theor. Phys. 83 (1990) 875 (QR).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotor_dynamics.errors import AnalysisError

Array = NDArray[np.float64]
Advance = Callable[[Array, Array], tuple[Array, Array]]
"""States (n, d) and tangents (n, k, d) to the same one interval later."""
AdvanceStates = Callable[[Array], Array]
"""States (2n, d) to the same one interval later; rows n + i are the neighbours of rows i."""

BATCHES = 20
"""Schmeiser, Oper. Res. 30 (1982) 556: 10 to 30 batches; more gain little and are correlated."""
SHORTEST_BATCH = 2
"""Intervals in a batch: batches of one would give the naive standard error, far too small."""
ROUNDING = 1e3 * np.finfo(np.float64).eps
"""A relative difference above this keeps three digits after cancellation."""
LARGEST_GROWTH = 1e6
"""A trajectory whose distance grows by more than this in one interval is no neighbour any more."""


@dataclass(frozen=True)
class Growth:
    """Logarithmic growth of every trajectory in every interval, and where it ended.

    `logs` (intervals, n, k): natural logarithm of the growth of tangent direction k; `states`
    (n, d); `tangents` (n, k, d): orthonormal. NaN where a trajectory failed, and after.
    """

    logs: Array
    states: Array
    tangents: Array


@dataclass(frozen=True)
class Estimate:
    """Exponents per unit of time; the shapes are those of the logs without their first axis.

    `standard_error` has 19 degrees of freedom (BATCHES - 1): a 95 % interval is +-2.09 of it.
    `running` (intervals kept, ...): the estimate after each interval.
    """

    exponent: Array
    standard_error: Array
    running: Array


def growth(advance: Advance, states: Array, tangents: Array, intervals: int) -> Growth:
    """Growth of k tangents over consecutive intervals, reorthonormalised after each.

    states (n, d); tangents (n, k, d), k <= d, any length, independent. One tangent is normalised,
    several are decomposed by QR (Householder). Exponents come sorted once the tangents have
    aligned. Use intervals so short that the tangents do not become parallel to rounding: about
    (largest - smallest exponent) * interval < 29.
    AnalysisError: shapes that do not fit, fewer than one interval.
    """
    states, tangents = _batch(states), np.array(tangents, dtype=np.float64)
    n, d = states.shape
    if tangents.ndim != 3 or tangents.shape[::2] != (n, d) or not 1 <= tangents.shape[1] <= d:
        raise AnalysisError(
            f'the tangents have the shape {tangents.shape}; give ({n}, k, {d}) with k from 1 to {d}'
        )
    logs = np.empty((_count(intervals), n, tangents.shape[1]))
    with np.errstate(all='ignore'):
        tangents, first = _orthonormal(states, tangents)
        failed = np.isnan(first).any(axis=1)
        for row in logs:
            states, tangents = advance(states, tangents)
            tangents, row[:] = _orthonormal(states, tangents)
            failed |= np.isnan(row).any(axis=1)
            row[failed] = np.nan
            tangents[failed] = np.nan
    return Growth(logs, np.array(states), tangents)


def two_trajectory_growth(
    advance: AdvanceStates,
    states: Array,
    directions: Array,
    intervals: int,
    *,
    separation: float | Array,
) -> Growth:
    """Growth of the distance to a neighbour, which is reset to `separation` every interval.

    states (n, d); directions (n, d), any length: towards the neighbours; separation, in units
    of the state, a scalar or (n,): about 1e-8 of the state's size halves the digits between
    rounding and nonlinearity. The distance is Euclidean. NaN also when the distance leaves the
    band from ROUNDING times the state's largest component to LARGEST_GROWTH times `separation`.
    Returns k = 1. AnalysisError: shapes that do not fit, separation <= 0, fewer than one interval.
    """
    states, directions = _batch(states), np.array(directions, dtype=np.float64)
    n = len(states)
    if directions.shape != states.shape:
        raise AnalysisError(
            f'the directions have the shape {directions.shape}; give one a state, {states.shape}'
        )
    distance = np.asarray(separation, dtype=np.float64)
    if distance.shape not in {(), (n,)} or not np.all((distance > 0) & np.isfinite(distance)):
        raise AnalysisError(
            f'the separation is {separation}; give one positive number, or {n} of them'
        )
    distance = np.broadcast_to(distance, n)[:, np.newaxis]
    logs = np.empty((_count(intervals), n, 1))
    failed = np.zeros(n, dtype=np.bool_)
    with np.errstate(all='ignore'):
        offsets, _ = _unit(directions)
        for row in logs:
            neighbours = states + distance * offsets
            # the neighbour is rounded: its true distance counts, not the requested one
            _, before = _unit(neighbours - states)
            both = advance(np.concatenate([states, neighbours]))
            states, neighbours = both[:n], both[n:]
            offsets, after = _unit(neighbours - states)
            size = np.max(np.abs(states), axis=1)
            lost = np.exp(after) <= ROUNDING * size
            far = np.exp(after - before) > LARGEST_GROWTH
            row[:, 0] = after - before
            failed |= lost | far | ~np.isfinite(row[:, 0]) | ~np.isfinite(states).all(axis=1)
            row[failed] = np.nan
            offsets[failed] = np.nan
    return Growth(logs, np.array(states), offsets[:, np.newaxis, :])


def estimate(logs: Array, interval_length: float, *, discard: int = 0) -> Estimate:
    """Exponents, their standard errors and running values from logs of growth.

    logs (intervals, ...); interval_length in the unit of time wanted; discard = first intervals
    not used, in which the tangents align with the growing directions.
    The standard error is that of the means of BATCHES consecutive batches, which allows for the
    correlation of neighbouring intervals (Schmeiser 1982; Law, Simulation Modeling and Analysis,
    5th ed., 9.5.3). For regular motion it is too large, 4 to 13 times on the rotor: the length of a
    rotating tangent oscillates within bounds, and batches count that as scatter. It does not
    account for a transient or for correlation times longer than a batch. NaN when fewer than
    BATCHES * SHORTEST_BATCH intervals are kept.
    A log that is not finite, discarded or not, makes exponent and error of its column NaN.
    AnalysisError: nothing left after `discard`, an interval that is not positive.
    """
    logs = np.asarray(logs, dtype=np.float64)
    if not 0 <= discard < len(logs):
        raise AnalysisError(
            f'{discard} of {len(logs)} intervals are to be discarded; keep at least one'
        )
    if not (np.isfinite(interval_length) and interval_length > 0):
        raise AnalysisError(f'the interval is {interval_length} long; give a positive length')
    # all later sums inherit the NaN of the first log that is not finite
    broken = np.logical_or.accumulate(~np.isfinite(logs), axis=0)
    rates = np.where(broken, np.nan, logs)[discard:] / interval_length
    kept = len(rates)
    numbers = np.arange(1.0, kept + 1).reshape(-1, *[1] * (logs.ndim - 1))
    running = np.cumsum(rates, axis=0) / numbers
    return Estimate(running[-1], _standard_error(rates), running)


def _standard_error(rates: Array) -> Array:
    """Return the batch means error of the mean over axis 0, without a remainder at the start."""
    length = len(rates) // BATCHES
    if length < SHORTEST_BATCH:
        return np.full(rates.shape[1:], np.nan)
    used = rates[len(rates) - BATCHES * length :]
    means = used.reshape(BATCHES, length, *rates.shape[1:]).mean(axis=1)
    return np.asarray(means.std(axis=0, ddof=1) / np.sqrt(BATCHES))


def _batch(states: Array) -> Array:
    """Copy the states, (n, d)."""
    states = np.array(states, dtype=np.float64)
    if states.ndim != 2:
        raise AnalysisError(f'the states have the shape {states.shape}; give (n, d)')
    return states


def _count(intervals: int) -> int:
    if intervals < 1:
        raise AnalysisError(f'{intervals} intervals are asked for; ask for at least 1')
    return intervals


def _unit(vectors: Array) -> tuple[Array, Array]:
    """Split vectors (..., d) into unit vectors and log lengths without overflow; zero gives NaN."""
    scale = np.max(np.abs(vectors), axis=-1, keepdims=True)
    # subnormal numbers have fewer digits, so the direction would be meaningless
    scale = np.where((scale >= np.finfo(np.float64).tiny) & np.isfinite(scale), scale, np.nan)
    scaled = vectors / scale
    length = np.linalg.norm(scaled, axis=-1, keepdims=True)
    return scaled / length, (np.log(scale) + np.log(length))[..., 0]


def _orthonormal(states: Array, tangents: Array) -> tuple[Array, Array]:
    """Make tangents (n, k, d) orthonormal; also logs (n, k) of their lengths; NaN on failure."""
    units, logs = _unit(tangents)
    good = np.isfinite(logs).all(axis=1) & np.isfinite(states).all(axis=1)
    if tangents.shape[1] > 1:
        q, r = np.linalg.qr(np.where(good[:, np.newaxis, np.newaxis], units, 0.0).swapaxes(1, 2))
        # the columns are unit vectors: the remaining length is also the remaining share
        left = np.abs(np.diagonal(r, axis1=1, axis2=2))
        good &= (left > ROUNDING).all(axis=1)
        units, logs = np.ascontiguousarray(q.swapaxes(1, 2)), logs + np.log(left)
    units[~good], logs[~good] = np.nan, np.nan
    return units, logs
