# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Judge claims about Lyapunov exponents, with saltation, and reported without it."""

import dataclasses
from collections.abc import Callable, Iterable, Sequence

import numpy as np
from scipy.signal import find_peaks

from rotor_dynamics import Survey
from rotor_paper.judging import MOST, BoolArray, FloatArray, Judgement, against_ticks, graded

EXPONENT_SCATTER = 0.002
"""Scatter of an exponent over 500 revolutions; less cannot be distinguished from zero."""

STANDARD_ERRORS = 3.0
"""An exponent is positive when it is beyond this many standard errors, and the scatter."""

POSITIVE_RULE = (
    f'beyond {STANDARD_ERRORS:g} standard errors, {EXPONENT_SCATTER:g}, and what 2N steps change, '
    'where that was checked'
)

ALMOST_NONE, FEW = 0.05, 0.2
"""Largest share of values that the words 'almost no' and 'partly' allow."""

PEAK = EXPONENT_SCATTER
"""Least prominence of a peak of an exponent over a parameter."""

SEVERAL = 3
"""Least number of peaks that the paper's word means."""

ONSET = 0.05
"""Distance of our first chaotic value from the paper's, over the range of the diagram."""


def positive(survey: Survey) -> BoolArray:
    """Return where the exponent is positive beyond its errors, (n,); false where it is NaN.

    Where 2N steps were computed it must be further from zero than it moved: an exponent that may
    change its sign with the step shows nothing.
    """
    least = np.maximum(STANDARD_ERRORS * survey.standard_error, EXPONENT_SCATTER)
    if survey.plan.check_steps:
        least = np.maximum(least, survey.exponent_difference)  # NaN stays NaN
    return np.asarray(survey.exponent > least)


def naive(survey: Survey) -> Survey:
    """Return the survey with the exponents without saltation, NaN where f is continuous.

    They are computed with N steps only, so they count as not checked at 2N. Their own standard
    errors are not kept: those with saltation, of the same revolutions, stand in for them.
    """
    return dataclasses.replace(
        survey,
        plan=dataclasses.replace(survey.plan, check_steps=False),
        exponent=survey.naive_exponent,
        exponent_difference=np.full(len(survey), np.nan),
    )


def _both_ways(rule: Callable[[list[Survey]], Judgement], surveys: Iterable[Survey]) -> Judgement:
    """Return the judgement with saltation; that of the same rule without is only reported."""
    each = list(surveys)
    found, without = rule(each), [naive(survey) for survey in each]
    if not any(np.isfinite(survey.exponent).any() for survey in without):
        return found
    other = rule(without)
    why = f'{found.why}; without saltation: {other.verdict} ({other.why})'
    told = {'verdict': other.verdict, **other.value}
    return Judgement(found.verdict, why, {**found.value, 'without_saltation': told})


def exponent_range(survey: Survey, ticks: Sequence[float]) -> Judgement:
    """Judge the range of the exponents."""
    return _both_ways(lambda each: against_ticks(each[0].exponent, ticks, 'the exponent'), [survey])


def chaos_above(survey: Survey, x: FloatArray, threshold: float, unit: str) -> Judgement:
    """Judge whether the exponent is positive above `threshold` and not below it."""
    return _both_ways(lambda each: _chaos_above(each[0], x, threshold, unit), [survey])


def _chaos_above(survey: Survey, x: FloatArray, threshold: float, unit: str) -> Judgement:
    chaotic, finite = positive(survey), np.isfinite(survey.exponent)
    above, below = finite & (x > threshold), finite & (x <= threshold)
    share_above, share_below = _share(chaotic, above), _share(chaotic, below)
    first = float(x[chaotic].min()) if chaotic.any() else np.nan
    at_threshold = abs(first - threshold) <= ONSET * np.ptp(x)
    full = share_above >= MOST and share_below <= ALMOST_NONE and bool(at_threshold)
    begins = f'first at {first:.4g}{unit}' if chaotic.any() else 'nowhere'
    why = (
        f'the exponent is positive {begins}, at {100 * share_above:.0f} % of the values above '
        f'{threshold:g}{unit} and {100 * share_below:.0f} % of those up to it; largest '
        f'{np.max(survey.exponent[finite], initial=-np.inf):.4f}'
    )
    value = {'first': first, 'share_above': share_above, 'share_up_to': share_below}
    some = share_above > FEW and share_above > share_below
    return Judgement(graded(full, some), why, value)


def hardly_positive(surveys: Iterable[Survey], allowed: float) -> Judgement:
    """Judge whether at most the share `allowed` of all exponents is positive."""
    return _both_ways(lambda each: _hardly_positive(each, allowed), surveys)


def _hardly_positive(each: list[Survey], allowed: float) -> Judgement:
    exponents = np.concatenate([survey.exponent for survey in each])
    finite = np.isfinite(exponents)
    share = _share(np.concatenate([positive(survey) for survey in each]), finite)
    largest = float(np.max(exponents[finite], initial=-np.inf)) if finite.any() else np.nan
    why = (
        f'{100 * share:.1f} % of {int(finite.sum())} exponents are positive beyond their errors; '
        f'the largest is {largest:.4f}'
    )
    value = {'share_positive': share, 'largest': largest}
    return Judgement(graded(share <= allowed, share <= allowed + FEW), why, value)


def peaks(survey: Survey, x: FloatArray, *, near_zero: bool = False) -> Judgement:
    """Judge whether the exponent has several peaks over x, or several that come near zero."""
    return _both_ways(lambda each: _peaks(each[0], x, near_zero=near_zero), [survey])


def _peaks(survey: Survey, x: FloatArray, *, near_zero: bool) -> Judgement:
    finite = np.isfinite(survey.exponent)
    exponent, x = survey.exponent[finite], x[finite]
    height = (-EXPONENT_SCATTER, None) if near_zero else None
    at, _ = find_peaks(exponent, prominence=PEAK, height=height)
    largest = float(np.max(exponent[at], initial=-np.inf)) if at.size else np.nan
    where = f'peaks that come within {EXPONENT_SCATTER:g} of zero' if near_zero else 'peaks'
    why = f'{at.size} {where}' + (f', the highest {largest:.4f}' if at.size else '')
    verdict = graded(at.size >= SEVERAL, at.size >= 1)
    return Judgement(verdict, why, {'peaks': int(at.size), 'highest': largest})


def less_stable(loaded: Survey, unloaded: Survey) -> Judgement:
    """Judge whether exponents under load are larger and more often positive than without."""
    return _both_ways(lambda each: _less_stable(*each), [loaded, unloaded])


def _less_stable(loaded: Survey, unloaded: Survey) -> Judgement:
    share, largest = {}, {}
    for name, survey in (('loaded', loaded), ('unloaded', unloaded)):
        finite = np.isfinite(survey.exponent)
        share[name] = _share(positive(survey), finite)
        largest[name] = float(np.max(survey.exponent[finite], initial=-np.inf))
    larger = largest['loaded'] > largest['unloaded']
    oftener = share['loaded'] > share['unloaded']
    why = (
        f'largest exponent {largest["loaded"]:.4f} with the load and {largest["unloaded"]:.4f} '
        f'without; positive at {100 * share["loaded"]:.0f} % and {100 * share["unloaded"]:.0f} % '
        'of the values'
    )
    value = {'largest': largest, 'share_positive': share}
    return Judgement(graded(larger and oftener, larger or oftener), why, value)


def grows_with(survey: Survey, x: FloatArray) -> Judgement:
    """Judge whether the exponent is larger in the last third of x than in the first."""
    return _both_ways(lambda each: _grows_with(each[0], x), [survey])


def _grows_with(survey: Survey, x: FloatArray) -> Judgement:
    finite = np.isfinite(survey.exponent)
    low, high = np.quantile(x, (1.0 / 3.0, 2.0 / 3.0))
    means = [
        float(survey.exponent[finite & part].mean()) if (finite & part).any() else float('nan')
        for part in (x <= low, x >= high)
    ]
    rise = means[1] - means[0]
    why = f'mean exponent {means[0]:.4f} in the first third and {means[1]:.4f} in the last'
    verdict = graded(rise > EXPONENT_SCATTER, rise > 0.0)
    return Judgement(verdict, why, {'first_third': means[0], 'last_third': means[1]})


def _share(which: BoolArray, among: BoolArray) -> float:
    """Return the share of `among` that is also `which`; NaN for none."""
    return float(np.sum(which & among) / np.sum(among)) if among.any() else np.nan
