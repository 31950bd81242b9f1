# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A claim of the paper and the verdict on it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from rotor_bringup.paper.judging import (
    AGREES,
    DOES_NOT,
    PARTLY,
    BoolArray,
    Judgement,
    Results,
)
from rotor_sim.analysis import Survey


@dataclass(frozen=True)
class Verdict:
    """What became of a claim for one variant; `value` holds our numbers, all JSON types.

    `unconverged` and `lost` count the points it rests on that change at 2N steps, or that
    diverged; None where 2N was not computed.
    """

    verdict: str
    why: str
    value: dict[str, Any]
    points: int
    unconverged: int | None
    lost: int


@dataclass(frozen=True)
class Claim:
    """A statement of the paper, in its words or numbers, and the rule it is judged by.

    `needs` are the keys of the diagrams, `index` the one point of them it is about, `rests_on`
    the field of a survey that must be finite.
    """

    name: str
    figure: int
    paper: str
    rule: str
    needs: tuple[str, ...]
    judge: Callable[[Results], Judgement]
    rests_on: str = 'order_amplitude_z'
    index: int | None = None

    def evaluate(self, results: Results) -> Verdict | None:
        """Return the verdict on one variant; None where a diagram it needs was not computed.

        Points that diverged never count as agreeing: with all of them lost the claim does not
        hold, with some of them lost it holds partly at best.
        """
        if any(key not in results.surveys for key in self.needs):
            return None
        surveys = [self._part(results.surveys[key]) for key in self.needs]
        points = sum(len(survey.points) for survey in surveys)
        gone = sum(int(lost(survey, self.rests_on).sum()) for survey in surveys)
        unconverged = _unconverged(surveys, self.rests_on)
        if gone == points:
            why = f'all {points} points diverged or gave no number'
            return Verdict(DOES_NOT, why, {}, points, unconverged, gone)
        verdict, why, value = self.judge(results)
        if gone:
            verdict = PARTLY if verdict == AGREES else verdict
            why += f'; {gone} of {points} points diverged or gave no number'
        if unconverged:
            why += f'; {unconverged} of {points} points did not converge at 2N steps'
        return Verdict(verdict, why, value, points, unconverged, gone)

    def _part(self, survey: Survey) -> Survey:
        return survey if self.index is None else survey[self.index : self.index + 1]


def lost(survey: Survey, field: str) -> BoolArray:
    """Return which points have no finite `field` of a survey, (n,)."""
    values = np.asarray(getattr(survey, field), dtype=float)
    return ~np.isfinite(values.reshape(len(survey.points), -1)).all(axis=1)


def _unconverged(surveys: list[Survey], field: str) -> int | None:
    if not all(survey.plan.check_steps for survey in surveys):
        return None
    return sum(int((~survey.converged & ~lost(survey, field)).sum()) for survey in surveys)
