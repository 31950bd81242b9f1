# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A claim of the paper, and the verdict on it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor_dynamics import Survey
from rotor_paper.judging import AGREES, DOES_NOT, PARTLY, BoolArray, Judgement, Results

MOST_UNCONVERGED = 0.5
"""Largest share of points that may change at 2N steps if a claim is to agree: with more of them it
depends on the step rather than on the equations."""

Rows = Callable[[Results, str], NDArray[np.intp]]
"""Returns the indices of the points that a claim uses of a diagram, given by its key."""


@dataclass(frozen=True)
class ClaimVerdict:
    """The verdict on a claim for one variant; `value` holds our numbers, all JSON types.

    `points` counts the points the claim uses, `unconverged` and `lost` those of them that change
    at 2N steps (None where 2N was not computed) or that diverged.
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

    `needs` are the keys of the diagrams, `rows` says which points of them it uses (None: all),
    `rests_on` names the field of a survey that must be finite there.
    """

    name: str
    figure: int
    paper: str
    rule: str
    needs: tuple[str, ...]
    judge: Callable[[Results], Judgement]
    rests_on: str = 'order_amplitude_z'
    rows: Rows | None = None

    def evaluate(self, results: Results) -> ClaimVerdict | None:
        """Return the verdict on one variant; None where a diagram it needs was not computed.

        Points that diverged never count as agreeing: with all of them lost the claim does not
        hold, with some of them lost it holds partly at best. The same applies if more than the
        share `MOST_UNCONVERGED` did not converge.
        """
        if any(key not in results.surveys for key in self.needs):
            return None
        used = [(results.surveys[key], self._used(results, key)) for key in self.needs]
        points = sum(rows.size for _, rows in used)
        gone = sum(int(lost(survey, self.rests_on)[rows].sum()) for survey, rows in used)
        unconverged = self._unconverged(used)
        if points and gone == points:
            why = f'all {points} points diverged or gave no number'
            return ClaimVerdict(DOES_NOT, why, {}, points, unconverged, gone)
        verdict, why, value = self.judge(results)
        if gone:
            verdict = PARTLY if verdict == AGREES else verdict
            why += f'; {gone} of {points} points diverged or gave no number'
        if unconverged:
            if verdict == AGREES and unconverged > MOST_UNCONVERGED * points:
                verdict = PARTLY
            why += f'; {unconverged} of {points} points did not converge at 2N steps'
        return ClaimVerdict(verdict, why, value, points, unconverged, gone)

    def _used(self, results: Results, key: str) -> NDArray[np.intp]:
        if self.rows is None:
            return np.arange(len(results.surveys[key]))
        return self.rows(results, key)

    def _unconverged(self, used: list[tuple[Survey, NDArray[np.intp]]]) -> int | None:
        if not all(survey.plan.check_steps for survey, _ in used):
            return None
        changed = [
            (~survey.converged & ~lost(survey, self.rests_on))[rows] for survey, rows in used
        ]
        return sum(int(which.sum()) for which in changed)


def lost(survey: Survey, field: str) -> BoolArray:
    """Return which points have no finite `field` of a survey, (n,)."""
    values = np.asarray(getattr(survey, field), dtype=float)
    return ~np.isfinite(values.reshape(len(survey.points), -1)).all(axis=1)
