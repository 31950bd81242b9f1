# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""From the flights of an evaluation to its numbers, as plain data.

A flight on which a detector failed counts against it: as the highest score without a crack and as
the lowest with one, so that no detector gains by failing. Flights with a growing crack have
numbers of their own and are in no area under a curve, and neither are decoys, the healthy flights
as long: the largest score of a longer flight is no match for that of a shorter one.
"""

import dataclasses
import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor_bench.evaluation import statistics
from rotor_bench.evaluation.outcome import FlightResult

GOAL_CRACK = 0.03
"""Least K of the goal: cracks this deep are to be told from none."""
GOAL_GROWTH = 0.04
"""A growing crack is to be found before this K."""
VARYING = 1.0
"""A flight whose load factor varies by this much is no steady level flight."""
REALISTIC = 'realistic'
FALSE_ALARMS_PER_HOUR = (0.0, 0.1)
"""Rates of false alarms for which the smallest crack found is given."""
SPEED_BANDS_RAD_S = (300.0, 400.0, 500.0)

Flags = NDArray[np.bool_]


def summary(
    flights: Sequence[FlightResult],
    alarm_scores: Mapping[str, float],
    *,
    seed: int = 0,
    replicates: int = statistics.REPLICATES,
) -> dict[str, Any]:
    """Return the statistics of each detector; `seed` is that of the bootstrap."""
    return {
        name: _Numbers(flights, name, alarm_score, seed, replicates).plain()
        for name, alarm_score in alarm_scores.items()
    }


def speed_band(speed_rad_s: float) -> str:
    """Return the name of the band that a speed lies in."""
    low, *_, high = SPEED_BANDS_RAD_S
    if speed_rad_s < low:
        return f'below {low:g} rad/s'
    if speed_rad_s >= high:
        return f'from {high:g} rad/s'
    above = max(edge for edge in SPEED_BANDS_RAD_S if edge <= speed_rad_s)
    return f'{above:g} to {min(e for e in SPEED_BANDS_RAD_S if e > above):g} rad/s'


class _Numbers:
    """The statistics of one detector."""

    def __init__(
        self,
        flights: Sequence[FlightResult],
        name: str,
        alarm_score: float,
        seed: int,
        replicates: int,
    ) -> None:
        self._name = name
        self._alarm_score = alarm_score
        self._seed = seed
        self._replicates = replicates
        self._flights = [f for f in flights if f.labels['crack'] != 'growing']
        self._growing = [f for f in flights if f.labels['crack'] == 'growing']
        outcomes = [flight.outcomes[name] for flight in self._flights]
        self._cracked = np.array([f.labels['crack'] == 'constant' for f in self._flights], bool)
        self._depth = np.array(self._labels('crack_stiffness_ratio'), float)
        self._machine = np.array([flight.machine for flight in self._flights], np.int64)
        self._failed = np.array([bool(outcome.failure) for outcome in outcomes], bool)
        worst = np.where(self._cracked, -math.inf, math.inf)
        scores = np.array([outcome.score for outcome in outcomes], float)
        self._score = np.where(self._failed, worst, scores)
        self._alarms = np.where(self._failed, 1, [outcome.alarms for outcome in outcomes])
        judged_s = np.array([outcome.judged_s for outcome in outcomes], float)
        self._hours = np.where(self._failed, 0.0, judged_s) / 3600
        self._flown_hours = np.array([f.duration_s for f in self._flights], float) / 3600
        realistic = np.array(self._labels('noise')) == REALISTIC
        self._usual = realistic if realistic.any() else ~realistic
        self._decoy = np.array(self._labels('decoy'), bool)
        self._varying = np.array(self._labels('load_factor_range'), float) >= VARYING

    def _labels(self, label: str) -> list[Any]:
        return [flight.labels[label] for flight in self._flights]

    def plain(self) -> dict[str, Any]:
        usual, varying = self._usual & ~self._decoy, self._varying
        thresholds = self._thresholds()
        all_flights = self._flights + self._growing
        outcomes = [flight.outcomes[self._name] for flight in all_flights]
        return {
            'alarm_score': self._alarm_score,
            'flights': len(all_flights),
            'failed': sum(bool(outcome.failure) for outcome in outcomes),
            'failures': dict(Counter(o.failure for o in outcomes if o.failure).most_common(10)),
            'silent': sum(math.isnan(o.score) and not o.failure for o in outcomes),
            'thresholds': thresholds,
            'auc': {
                'goal': self._auc(usual & varying, GOAL_CRACK),
                'all depths': self._auc(usual & varying),
                'steady level flight': self._auc(usual & ~varying, GOAL_CRACK),
                'all flights': self._auc(usual, GOAL_CRACK),
            },
            'auc_by': {
                'crack_stiffness_ratio': self._by_depth(usual & varying),
                'maneuver': self._by('maneuver', usual),
                'confounder': self._by('confounder', usual & varying),
                'speed_program': self._by('speed_program', usual & varying),
                'speed_band': self._by('speed_rad_s', usual & varying, speed_band),
                'held_out_family': self._by(
                    'held_out_family', usual & varying, lambda held: 'held out' if held else 'known'
                ),
                'encoder': self._by(
                    'encoder', usual & varying, lambda on: 'angle' if on else 'key-phasor only'
                ),
                'noise': self._by('noise', varying & ~self._decoy),
            },
            'false_alarms': {
                'all': self._false_alarms(self._usual),
                'load factor varies': self._false_alarms(self._usual & varying),
                'steady level flight': self._false_alarms(self._usual & ~varying),
                'decoys of growing cracks': self._false_alarms(self._usual & self._decoy),
            },
            'false_alarms_by': {
                'maneuver': self._rates('maneuver'),
                'confounder': self._rates('confounder'),
            },
            'smallest_crack': {
                name: self._smallest(threshold, usual & varying)
                for name, threshold in thresholds.items()
            },
            'growth': {name: self._growth(value) for name, value in thresholds.items()},
            'roc': self._roc(usual & varying),
        }

    def _thresholds(self) -> dict[str, float]:
        """Return the detector's alarm score, and the thresholds for given rates of false alarms.

        The latter are NaN without healthy flights. The unknown alarm score of a detector that
        could not be made is infinite: it is never reached.
        """
        healthy = self._usual & ~self._cracked
        hours = float(self._hours[healthy].sum())
        return {
            'own alarm': math.inf if math.isnan(self._alarm_score) else self._alarm_score,
            **{
                f'{rate:g} false alarms per hour': statistics.threshold_at_rate(
                    self._score[healthy], hours, rate
                )
                for rate in FALSE_ALARMS_PER_HOUR
            },
        }

    def _auc(self, which: Flags, least_depth: float = 0.0) -> dict[str, Any]:
        which = which & (~self._cracked | (self._depth >= least_depth))
        found = statistics.auc(
            self._score[which],
            self._cracked[which],
            self._machine[which],
            seed=self._seed,
            replicates=self._replicates,
        )
        return dataclasses.asdict(found)

    def _by_depth(self, which: Flags) -> dict[str, Any]:
        return {
            f'{depth:g}': self._auc(which & (~self._cracked | (self._depth == depth)))
            for depth in np.unique(self._depth[which & self._cracked])
        }

    def _groups(
        self, label: str, which: Flags, name_of: Callable[[Any], str] = str
    ) -> dict[str, Flags]:
        names = np.array([name_of(value) for value in self._labels(label)])
        return {str(name): which & (names == name) for name in np.unique(names[which])}

    def _by(self, label: str, which: Flags, name_of: Callable[[Any], str] = str) -> dict[str, Any]:
        return {
            name: self._auc(group, GOAL_CRACK)
            for name, group in self._groups(label, which, name_of).items()
        }

    def _false_alarms(self, which: Flags) -> dict[str, Any]:
        healthy = which & ~self._cracked
        rate = statistics.poisson_rate(
            int(self._alarms[healthy].sum()), float(self._hours[healthy].sum())
        )
        return {
            **dataclasses.asdict(rate),
            'flown_hours': float(self._flown_hours[healthy].sum()),
            'flights': int((self._alarms[healthy] > 0).sum()),
            'of': int(healthy.sum()),
        }

    def _rates(self, label: str) -> dict[str, Any]:
        return {
            name: self._false_alarms(group)
            for name, group in self._groups(label, self._usual & ~self._cracked).items()
        }

    def _smallest(self, threshold: float, which: Flags) -> dict[str, Any]:
        which = which & self._cracked & ~np.isnan(threshold)
        found = np.isfinite(self._score) & (self._score >= threshold)
        smallest, table = statistics.smallest_found(self._depth[which], found[which])
        return {'crack_stiffness_ratio': smallest, 'found': table}

    def _growth(self, threshold: float) -> dict[str, Any]:
        """Return when growing cracks were found, how deep they were, and how many decoys were.

        Without a threshold no flight is counted.
        """
        is_known = not math.isnan(threshold)
        times, depths = [], []
        for flight in self._growing if is_known else ():
            outcome = flight.outcomes[self._name]
            time_s = math.nan if outcome.failure else outcome.first_at(threshold)
            times.append(time_s)
            depths.append(flight.crack_at(time_s))
        decoys = self._score[self._decoy & is_known]  # a failure is infinite, silence is NaN
        return {
            'time_s': dataclasses.asdict(statistics.delays(times)),
            'crack_stiffness_ratio': dataclasses.asdict(statistics.delays(depths)),
            'found_before_goal': sum(depth < GOAL_GROWTH for depth in depths),
            'each': list(zip(times, depths, strict=True)),
            'decoys': {'alarmed': int((decoys >= threshold).sum()), 'flights': len(decoys)},
        }

    def _roc(self, which: Flags) -> dict[str, list[float]]:
        which = which & (~self._cracked | (self._depth >= GOAL_CRACK))
        if not (which & self._cracked).any() or not (which & ~self._cracked).any():
            return {'thresholds': [], 'false_positive_rate': [], 'true_positive_rate': []}
        curve = statistics.roc(self._score[which], self._cracked[which])
        return {
            field.name: getattr(curve, field.name).tolist() for field in dataclasses.fields(curve)
        }
