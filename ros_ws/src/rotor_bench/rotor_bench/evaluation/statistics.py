# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The statistics of an evaluation, on plain arrays.

A score of NaN is a flight on which the detector said nothing: it counts as lower than any number.
Intervals are for 95 % throughout.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

CONFIDENCE = 0.95
REPLICATES = 2000


@dataclass(frozen=True, eq=False)
class Roc:
    """Receiver operating characteristic: rates at or above each threshold, in falling order.

    The first threshold is infinite (nothing found); the last finds everything.
    """

    thresholds: Array
    false_positive_rate: Array
    true_positive_rate: Array


@dataclass(frozen=True)
class Auc:
    """Area under the ROC with its interval; NaN where one of the two kinds is missing."""

    value: float
    low: float
    high: float
    positives: int
    negatives: int


def roc(scores: Array, positive: Flags) -> Roc:
    """Return the ROC of scores (n,); `positive` marks the flights with a crack."""
    ranked = _without_nan(scores)
    thresholds = np.unique(ranked)[::-1]
    return Roc(
        np.concatenate(([math.inf], thresholds)),
        np.concatenate(([0.0], _rate_at(ranked[~positive], thresholds))),
        np.concatenate(([0.0], _rate_at(ranked[positive], thresholds))),
    )


def _rate_at(scores: Array, thresholds: Array) -> Array:
    """Return which part of the scores is at or above each threshold, NaN without any."""
    if not len(scores):
        return np.full(len(thresholds), math.nan)
    return 1.0 - np.searchsorted(np.sort(scores), thresholds, side='left') / len(scores)


def auc(
    scores: Array,
    positive: Flags,
    machines: NDArray[np.int64],
    *,
    seed: int = 0,
    replicates: int = REPLICATES,
) -> Auc:
    """Return the area under the ROC and its interval, with a machine as the unit drawn.

    The area is the probability that a flight with a crack scores above one without, a tie
    counting half (Mann and Whitney 1947; Hanley and McNeil 1982). The interval holds the middle
    95 % of `replicates` areas, each over as many machines drawn with replacement, all flights of
    a machine together (cluster bootstrap; Field and Welsh 2007): flights of one machine resemble
    one another. If the kinds are separated without exception it has no width and no meaning.
    """
    cracked, healthy = int(positive.sum()), int((~positive).sum())
    if not cracked or not healthy:
        return Auc(math.nan, math.nan, math.nan, cracked, healthy)
    wins, positives, negatives = _pairs(scores, positive, machines)
    drawn = _drawn(len(positives), replicates, seed)
    areas = _areas(drawn, wins, positives, negatives)
    low, high = _middle(areas[np.isfinite(areas)])
    return Auc(float(wins.sum() / (cracked * healthy)), low, high, cracked, healthy)


def _pairs(
    scores: Array, positive: Flags, machines: NDArray[np.int64]
) -> tuple[Array, Array, Array]:
    """Return wins (machines, machines) of cracked over healthy flights, and how many of each."""
    ranked = _without_nan(scores)
    names, machine = np.unique(machines, return_inverse=True)
    count = len(names)
    wins = np.zeros((count, count))
    healthy, healthy_machine = ranked[~positive], machine[~positive]
    for score, owner in zip(ranked[positive], machine[positive], strict=True):
        won = (score > healthy) + 0.5 * (score == healthy)
        wins[owner] += np.bincount(healthy_machine, won, count)
    positives = np.bincount(machine[positive], minlength=count).astype(np.float64)
    negatives = np.bincount(machine[~positive], minlength=count).astype(np.float64)
    return wins, positives, negatives


def _areas(drawn: Array, wins: Array, positives: Array, negatives: Array) -> Array:
    """Return the area of each replicate, NaN where one of the kinds was not drawn."""
    pairs = (drawn @ positives) * (drawn @ negatives)
    total = np.einsum('ri,ri->r', drawn @ wins, drawn)
    return np.where(pairs > 0, total / np.where(pairs > 0, pairs, 1.0), math.nan)


def _drawn(count: int, replicates: int, seed: int) -> Array:
    """Return how often each of `count` machines is drawn in each replicate."""
    generator = np.random.default_rng(seed)
    return generator.multinomial(count, np.full(count, 1 / count), replicates).astype(np.float64)


def _middle(values: Array) -> tuple[float, float]:
    if not len(values):
        return math.nan, math.nan
    tail = (1 - CONFIDENCE) / 2
    low, high = np.quantile(values, [tail, 1 - tail])
    return float(low), float(high)


@dataclass(frozen=True)
class Rate:
    """Events in a time, and the rate per hour with its upper bound."""

    events: int
    hours: float
    per_hour: float
    upper_per_hour: float


def poisson_rate(events: int, hours: float) -> Rate:
    """Return the rate of events and its exact one-sided 95 % upper bound.

    The bound is the rate at which this many events or fewer occur with 5 % probability:
    chi2.ppf(0.95, 2 (events + 1)) / (2 hours) (Garwood 1936); without any event 3.0 / hours.
    """
    if not hours > 0:
        return Rate(events, hours, math.nan, math.nan)
    upper = float(chi2.ppf(CONFIDENCE, 2 * (events + 1))) / 2 / hours
    return Rate(events, hours, events / hours, upper)


def threshold_at_rate(healthy_scores: Array, hours: float, per_hour: float) -> float:
    """Return the lowest threshold that gives at most `per_hour` alarms in healthy flights.

    A flight counts once, when its score is at or above the threshold. With `per_hour` 0 it lies
    just above the highest healthy score. It is finite where every threshold is allowed, so that
    silence is below it, infinite above a failure, and NaN where no healthy flight has a score.
    """
    if np.isnan(healthy_scores).all():
        return math.nan
    allowed = math.floor(per_hour * hours + 1e-9)
    ranked = np.sort(_without_nan(healthy_scores))[::-1]
    highest = ranked[allowed] if allowed < len(ranked) else -math.inf
    return float(np.nextafter(highest, math.inf))


def smallest_found(
    levels: Array, found: Flags, *, wanted: float = 0.9
) -> tuple[float, list[tuple[float, int, float]]]:
    """Return the smallest level from which on at least `wanted` of the flights are found.

    Args:
        levels: crack stiffness ratio of each flight (n,).
        found: whether it was found (n,).
        wanted: the part to be found there and at every level above.

    Returns:
        The level, NaN if even the highest is found too rarely, and (level, flights, part found) of
        each, rising.

    """
    table = [
        (float(level), int((levels == level).sum()), float(found[levels == level].mean()))
        for level in np.unique(levels)
    ]
    smallest = math.nan
    for level, _, part in reversed(table):
        if part < wanted:
            break
        smallest = level
    return smallest, table


@dataclass(frozen=True)
class Delays:
    """Quantiles of a value that some flights never reach; a quantile among those is infinite."""

    flights: int
    reached: int
    quantile_10: float
    median: float
    quantile_90: float


def delays(values: Sequence[float]) -> Delays:
    """Return the quantiles of values; NaN = not reached in the flight, so later than any.

    A quantile is the smallest value that at least that part of all flights does not exceed.
    """
    ranked = np.sort(_without_nan(np.asarray(values, dtype=np.float64), math.inf))
    reached = int(np.isfinite(ranked).sum())

    def quantile(part: float) -> float:
        return float(ranked[math.ceil(part * len(ranked)) - 1]) if len(ranked) else math.nan

    return Delays(len(ranked), reached, quantile(0.1), quantile(0.5), quantile(0.9))


def _without_nan(values: Array, instead: float = -math.inf) -> Array:
    return np.where(np.isnan(values), instead, values)
