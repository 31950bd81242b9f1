# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Sweeps in which every point starts where the one before ended."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from rotor_dynamics.cache import Arrays
from rotor_dynamics.ensemble import (
    Ensemble,
    OperatingPoint,
    checked_start,
    fixed_start,
    steps_needed,
)
from rotor_dynamics.errors import AnalysisError
from rotor_dynamics.surveys import (
    SAMPLES,
    Plan,
    Survey,
    departure,
    diverged,
    of_arrays,
    settle,
    summarise,
    unchecked,
)


def follow(
    sweeps: Sequence[Sequence[OperatingPoint]], plan: Plan, initial_state: ArrayLike | None = None
) -> list[Survey]:
    """Follow the points of each sweep in their order; all sweeps are integrated side by side.

    All sweeps have the same number of points and of steps, as many as the most demanding point
    needs. A point that diverges is NaN, and the next one starts at the fixed start. No exponents,
    and no second run with half the step: its history would differ.

    Raises:
        AnalysisError: sweeps of different lengths, a plan with exponents.

    """
    lengths = {len(points) for points in sweeps}
    if len(lengths) != 1 or plan.exponent_revolutions:
        raise AnalysisError(
            f'{len(sweeps)} sweeps of {sorted(lengths)} points, exponent_revolutions = '
            f'{plan.exponent_revolutions}; a continuation takes sweeps of one length and 0'
        )
    steps = max(steps_needed(p, plan.steps_per_revolution) for points in sweeps for p in points)
    states = checked_start(initial_state)
    revolution = 0
    found: list[Arrays] = []
    for column in zip(*sweeps, strict=True):
        ensemble = Ensemble(column, steps, states, revolution)
        left = settle(ensemble, plan.transient_revolutions)
        record = ensemble.advance(plan.revolutions, SAMPLES)
        left = np.fmin(left, departure(column, record, revolution + plan.transient_revolutions))
        states = ensemble.states
        left = np.fmin(left, ensemble.revolution)
        failed = diverged(column, record, states)
        left = np.where(failed, left - revolution, np.nan)
        revolution = ensemble.revolution
        record[failed] = np.nan
        for lost in np.flatnonzero(failed):
            states[lost] = fixed_start(column[lost].parameters)
        with np.errstate(all='ignore'):  # NaN marks what diverged
            found.append(summarise(column, record, plan.highest_order) | {'diverged_at': left})
    surveys = []
    for number, points in enumerate(sweeps):
        arrays = {name: np.stack([part[name][number] for part in found]) for name in found[0]}
        for name in ('exponent', 'standard_error', 'naive_exponent'):
            arrays[name] = np.full(len(points), np.nan)
        surveys.append(of_arrays(points, plan, arrays | unchecked(len(points), steps)))
    return surveys
