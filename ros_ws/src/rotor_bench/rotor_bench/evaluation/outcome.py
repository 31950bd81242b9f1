# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The outcome of one flight under test: a few numbers for each detector."""

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

RISE_S = 1.0
"""Time between the entries of `rises`."""


@dataclass(frozen=True)
class Outcome:
    """What one detector said about one flight; times in s since its start.

    `score` is the largest, NaN where it never said anything; `alarms` counts how often the score
    rose to the alarm; `judged_s` is how long it had something to say. `rises` is the largest score
    so far, (time, score) where it has grown. A `failure` makes the rest meaningless.
    """

    score: float = math.nan
    score_s: float = math.nan
    evidence: str = ''
    first_alarm_s: float = math.nan
    alarms: int = 0
    judged_s: float = 0.0
    rises: tuple[tuple[float, float], ...] = ()
    failure: str = ''

    def first_at(self, threshold: float) -> float:
        """Return when the score first reached a threshold, NaN where it did not."""
        return next((time for time, score in self.rises if score >= threshold), math.nan)


@dataclass(frozen=True)
class FlightResult:
    """A flight under test, its labels, and the outcome of every detector."""

    machine: int
    number: int
    duration_s: float
    labels: dict[str, Any]
    crack_course: tuple[tuple[float, float], ...] = ()
    """(time in s, K) where the growth of the crack begins, ends or bends."""
    outcomes: dict[str, Outcome] = field(default_factory=dict)

    def plain(self) -> dict[str, Any]:
        """Return plain data that makes an equal result again."""
        return dataclasses.asdict(self)

    @classmethod
    def from_plain(cls, data: dict[str, Any]) -> Self:
        """Return the result of plain data; None, which JSON has for NaN, is NaN again."""
        outcomes = {name: _outcome(values) for name, values in data['outcomes'].items()}
        course = tuple((time, crack) for time, crack in data['crack_course'])
        return cls(**{**data, 'crack_course': course, 'outcomes': outcomes})

    def crack_at(self, time_s: float) -> float:
        """Return K at a time, NaN for NaN."""
        times, cracks = zip(*self.crack_course, strict=True)
        return float(np.interp(time_s, times, cracks))


@dataclass(frozen=True)
class Evaluated:
    """The flights under test, the isolation of the detectors, and their alarm scores."""

    flights: list[FlightResult]
    isolation: str
    alarm_scores: dict[str, float]


def _outcome(values: dict[str, Any]) -> Outcome:
    numbers: dict[str, Any] = {k: math.nan if v is None else v for k, v in values.items()}
    numbers['rises'] = tuple((time, score) for time, score in values['rises'])
    return Outcome(**numbers)


class Watch:
    """Follows what a detector says during one flight."""

    def __init__(self, alarm_score: float) -> None:
        self._alarm_score = alarm_score
        self._best = Outcome()
        self._first_alarm_s = math.nan
        self._alarms = 0
        self._is_alarm = False
        self._judged_s = 0.0
        self._rises: list[tuple[float, float]] = []

    def take(self, said_s: float, holds_s: float, score: float, evidence: str) -> None:
        """Take a verdict, its time, and for how long it holds; a score of NaN changes nothing."""
        if math.isnan(score):
            return
        self._judged_s += holds_s
        is_alarm = score >= self._alarm_score
        if is_alarm and not self._is_alarm:
            self._alarms += 1
            if math.isnan(self._first_alarm_s):
                self._first_alarm_s = said_s
        self._is_alarm = is_alarm
        if not score <= self._best.score:
            self._best = Outcome(score, said_s, evidence)
            if len(self._rises) > 1 and said_s - self._rises[-2][0] < RISE_S:
                self._rises.pop()  # the later time for both: no alarm is made earlier
            self._rises.append((said_s, score))

    def outcome(self, failure: str = '') -> Outcome:
        """Return the outcome of the flight."""
        return dataclasses.replace(
            self._best,
            first_alarm_s=self._first_alarm_s,
            alarms=self._alarms,
            judged_s=self._judged_s,
            rises=tuple(self._rises),
            failure=failure,
        )
