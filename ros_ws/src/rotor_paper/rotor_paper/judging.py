# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Judge the paper's claims: verdicts, thresholds and rules.

A rule takes numbers and returns a `Judgement`; NaN fails every comparison, so that it never
agrees. Exponents are per unit tau, amplitudes zero-to-peak, lengths dimensionless (over delta).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor_dynamics import Survey
from rotor_dynamics.labels import CHANGES
from rotor_dynamics.surveys import HARMONICS
from rotor_paper.figures import Diagram

AGREES, PARTLY, DOES_NOT = 'agrees', 'partly', 'does not'

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IndexArray = NDArray[np.intp]

ORDERS = HARMONICS
"""The first columns of a survey's order amplitudes, 1x and the super-harmonics up to 4x."""

TICK_SLACK = 0.1
"""How far beyond its outer ticks an axis may go, over the distance between them: the section of
Fig. 7 reaches 4.62 in a portrait whose last tick is 4.6 of a span of 0.6."""

TICK_FILL = 0.5
"""Least part of the ticks that a curve fills. Axes fitted to a curve end at the first tick beyond
it, with steps of 1, 2 or 5 times a power of ten: for a curve that fills less than half of the axis
the next finer step, half or two fifths as wide, would have given a narrower one."""

TICK_OVERLAP = 0.1
"""Least common part of two ranges, over their union, that counts as partly the same."""

NEAR_SPEED = 0.03
"""Relative distance of two speeds that are the same resonance: the paper's own four differ by 3 %
in the critical speed they stand for (1052 to 1084 rad/s)."""

SEARCH = 0.1
"""Relative distance from the paper's speed within which our resonance is looked for."""

VISIBLE = 0.05
"""Least amplitude that can be seen in a waterfall, over the highest of the picture."""

MOST = 0.8
"""Least share of values beyond a threshold that 'above' means; figures have windows of order."""

JUMP, STEP = 0.1, 0.05
"""Change of the section between neighbouring values, or between up- and down-sweep, that is a
jump or a step, over the range of the diagram: a smooth curve changes by about one 400th."""

OUTSTANDING = 5.0
"""A jump is also this many times the median change between neighbours: chaos always changes."""

NOISE = 3.0
"""Sweeps differ if their distance is more than this many times that between the two halves of
either one's section, which is the uncertainty of so few points."""

GROWS = 2.0
"""Least factor from the first to the last value of an amplitude that grows with a parameter."""

FOLLOWS = 0.9
"""Least correlation with the parameter of an amplitude that grows with it."""

UNCHANGED, LITTLE = 0.25, 0.5
"""Largest range of an amplitude over its mean that is 'almost unchanged', or changed a little."""


TICKS_RULE = (
    f'agrees: our range lies within the ticks (slack {TICK_SLACK:.0%}) and fills '
    f'{TICK_FILL:.0%} of them; partly: it lies within, or both share '
    f'{TICK_OVERLAP:.0%}. Ticks bound a curve, they do not give its values'
)


class Judgement(NamedTuple):
    """Result of a rule: the verdict, one sentence with the numbers, and the numbers."""

    verdict: str
    why: str
    value: dict[str, Any]


@dataclass(frozen=True)
class Sweeps:
    """An up- and a down-sweep: the values in rising order (n,), Z at tau = 2 pi k (n, m) each."""

    values: FloatArray
    up: FloatArray
    down: FloatArray


@dataclass(frozen=True)
class Path:
    """A motion sample by sample: tau, Y and Z (m,), dimensionless; the window of tau to show."""

    tau: FloatArray
    window: tuple[float, float]
    y: FloatArray
    z: FloatArray


@dataclass(frozen=True)
class Results:
    """Everything computed for one variant: surveys and sweeps by diagram, paths by its points."""

    diagrams: Mapping[str, Diagram]
    surveys: Mapping[str, Survey]
    sweeps: Mapping[str, Sweeps]
    paths: Mapping[str, Sequence[Path]]

    def swept(self, key: str) -> FloatArray:
        """Return the values of the swept parameter at the points of a survey, SI."""
        return self.diagrams[key].swept(self.surveys[key].points)


def graded(full: bool, part: bool) -> str:
    """Return the verdict of a rule whose two conditions are met or not."""
    return AGREES if full else PARTLY if part else DOES_NOT


def orders(survey: Survey, coordinate: str = 'z') -> FloatArray:
    """Return the dimensionless amplitudes at `ORDERS`, (n, 5)."""
    amplitude = survey.order_amplitude_z if coordinate == 'z' else survey.order_amplitude_y
    return np.asarray(amplitude[:, : len(ORDERS)] / survey.length_scale_m[:, None])


def super_harmonics(survey: Survey, coordinate: str = 'z') -> FloatArray:
    """Return the root sum of squares of the amplitudes above 1x, dimensionless, (n,)."""
    return np.asarray(np.sqrt(np.sum(orders(survey, coordinate)[:, 1:] ** 2, axis=1)))


def section(survey: Survey, coordinate: str) -> FloatArray:
    """Return the stroboscopic positions, dimensionless, (n, revolutions)."""
    positions = survey.z if coordinate == 'z' else survey.y
    return np.asarray(positions / survey.length_scale_m[:, None])


def against_ticks(values: FloatArray, ticks: Sequence[float], what: str) -> Judgement:
    """Judge the range of a curve against the outer ticks of the axis it was drawn on."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (np.nan, np.nan)
    first, last = float(ticks[0]), float(ticks[1])
    span = last - first
    inside = first - TICK_SLACK * span <= low and high <= last + TICK_SLACK * span
    filled = (high - low) / span
    common = max(0.0, min(high, last) - max(low, first)) / (max(high, last) - min(low, first))
    verdict = graded(inside and filled >= TICK_FILL, inside or common >= TICK_OVERLAP)
    where = 'within' if inside else 'beyond' if common > 0.0 else 'outside'
    why = (
        f'{what} runs from {low:.4g} to {high:.4g}, {where} the ticks {first:g} and {last:g}, '
        f'and spans {100 * filled:.0f} % of their distance'
    )
    return Judgement(verdict, why, {'lowest': low, 'highest': high})


def near(speeds: FloatArray, speed: float) -> IndexArray:
    """Return the indices of the speeds among which a resonance near `speed` is looked for."""
    return np.flatnonzero(np.abs(speeds / speed - 1.0) <= SEARCH)


def nearest(x: FloatArray, values: Sequence[float]) -> IndexArray:
    """Return for each of `values` the index of the parameter x (n,) nearest to it."""
    return np.array([np.argmin(np.abs(x - value)) for value in values], np.intp)


def resonance(survey: Survey, speeds: FloatArray, speed: float, order: float) -> Judgement:
    """Judge whether Z has its resonance of `order` near `speed`, where that order leads."""
    amplitude = orders(survey)
    column = ORDERS.index(order) if order in ORDERS else -1
    searched = near(speeds, speed)
    usable = searched[np.isfinite(amplitude[searched, column])]
    if column < 0 or not usable.size:
        why = f'no finite point within {100 * SEARCH:.0f} % of {speed:g} rad/s'
        return Judgement(DOES_NOT, why, {})
    peak = int(usable[np.argmax(amplitude[usable, column])])
    here = int(usable[np.argmin(np.abs(speeds[usable] - speed))])
    leads_at_peak = _leading(amplitude[peak]) == order
    leads_here = _leading(amplitude[here]) == order
    found = leads_at_peak and abs(speeds[peak] / speed - 1.0) <= NEAR_SPEED
    why = (
        f'{order:g}x is largest at {speeds[peak]:.1f} rad/s (Z {amplitude[peak, column]:.3g}), '
        f'where {_leading(amplitude[peak]):g}x leads; at {speeds[here]:.1f} rad/s '
        f'{_leading(amplitude[here]):g}x leads'
    )
    value = {
        'peak_speed_rad_s': float(speeds[peak]),
        'peak_amplitude': float(amplitude[peak, column]),
        'leading_order': _leading(amplitude[here]),
        'leading_order_at_peak': _leading(amplitude[peak]),
    }
    return Judgement(graded(found and leads_here, found or leads_here), why, value)


def _leading(amplitudes: FloatArray) -> float:
    """Return the order of the largest amplitude; NaN where one is not finite."""
    return ORDERS[int(np.argmax(amplitudes))] if np.isfinite(amplitudes).all() else np.nan


def labels(survey: Survey, x: FloatArray, wanted: str, values: Sequence[float]) -> Judgement:
    """Judge whether the motions at `values` of the parameter carry the label `wanted`."""
    rows = nearest(x, values)
    found = {f'{value:g}': str(survey.label[row]) for value, row in zip(values, rows, strict=True)}
    right = sum(label == wanted for label in found.values())
    each = ', '.join(
        f'{value} {found[value]} ({_evidence(survey, row)})'
        for value, row in zip(found, rows.tolist(), strict=True)
    )
    why = f'{right} of {len(found)} are {wanted} (label, exponent): {each}'
    reasons = {
        value: str(survey.reason[row])
        for value, row in zip(found, rows, strict=True)
        if survey.reason[row]
    }
    value = {'labels': found, 'reasons': reasons}
    return Judgement(graded(right == len(found), right > 0), why, value)


def _evidence(survey: Survey, row: int) -> str:
    """Return the exponent of a point, or in which revolution it diverged."""
    if survey.label[row] == 'diverged':
        return f'in revolution {survey.diverged_at[row]:.0f}'
    changes = f'; {CHANGES}' if str(survey.reason[row]).startswith(CHANGES) else ''
    return f'{survey.exponent[row]:.4f}{changes}'


def one_motion(survey: Survey, wanted: str) -> Judgement:
    """Judge the label of a single point; a motion that is regular in another way agrees partly."""
    label, exponent = str(survey.label[0]), float(survey.exponent[0])
    regular = label in {'periodic', 'quasi-periodic'} and wanted != 'chaotic'
    because = f' ({survey.reason[0]})' if survey.reason[0] else ''
    why = f'labelled {label}{because}, exponent {exponent:.4f} +- {survey.standard_error[0]:.4f}'
    value = {'label': label, 'exponent': exponent}
    return Judgement(graded(label == wanted, regular), why, value)


def jumps(z: FloatArray, x: FloatArray, sweeps: Sweeps | None) -> Judgement:
    """Judge whether the orbit diagram `z` (n, m) over x jumps, or its two sweeps differ.

    Two sections differ by the mean distance of their sorted points (Wasserstein), here over the
    range of the whole diagram. The sweeps differ if their distance exceeds their own noise at two
    neighbouring values.
    """
    good = np.isfinite(z).all(axis=1)
    z, x = z[good], x[good]
    span = float(np.ptp(z)) if z.size else np.nan
    rows = np.sort(z, axis=1)
    change = np.abs(np.diff(rows, axis=0)).mean(axis=1) / span if len(z) > 1 else np.array([np.nan])
    at = int(np.argmax(change))
    step = float(change[at])
    outstanding = step >= OUTSTANDING * float(np.median(change))
    apart, where = _hysteresis(sweeps)
    full = (step >= JUMP and outstanding) or apart >= JUMP
    part = (step >= STEP and outstanding) or apart >= STEP
    place = f' at G = {x[at + 1]:.3g}' if x.size > at + 1 else ''
    why = f'largest step between neighbours {100 * step:.1f} % of the range of Z{place}' + (
        f'; {_difference(apart, where)} (sweeps are not checked at 2N steps)'
        if sweeps is not None
        else ''
    )
    value = {'largest_step': step, 'outstanding': outstanding, 'largest_hysteresis': apart}
    return Judgement(graded(full, part), why, value)


def no_jump(z: FloatArray, x: FloatArray, sweeps: Sweeps | None) -> Judgement:
    """Judge whether the orbit diagram does not jump, by the measures of `jumps`."""
    found = jumps(z, x, sweeps)
    apart = found.value['largest_hysteresis'] if sweeps is not None else 0.0
    step = found.value['largest_step']
    if np.isfinite(step) and not found.value['outstanding']:
        step = 0.0  # chaos always changes
    verdict = graded(step < STEP and apart < STEP, step < JUMP and apart < JUMP)
    return Judgement(verdict, found.why, found.value)


def mostly(surveys: Sequence[Survey], wanted: str, *, full: float, part: float) -> Judgement:
    """Judge whether the share `full` of all motions carries the label `wanted`."""
    found = np.concatenate([survey.label for survey in surveys])
    share = float(np.mean(found == wanted))
    names, counts = np.unique(found, return_counts=True)
    counted = {str(name): int(count) for name, count in zip(names, counts, strict=True)}
    each = ', '.join(f'{count} {name}' for name, count in counted.items())
    why = f'{100 * share:.0f} % of {found.size} motions are {wanted}: {each}'
    return Judgement(graded(share >= full, share >= part), why, {'labels': counted})


def _difference(apart: float, where: float) -> str:
    if np.isnan(apart):
        return 'up- and down-sweep were not finite'
    if apart == 0.0:
        return 'up- and down-sweep do not differ beyond their noise at two neighbouring values'
    return f'up- and down-sweep differ by {100 * apart:.1f} % at G = {where:.3g} and the next'


def _hysteresis(sweeps: Sweeps | None) -> tuple[float, float]:
    """Return the largest distance that two neighbouring values both reach, and the first value.

    A distance is over the range of both sweeps, 0 where it is within `NOISE` or not finite.
    """
    if sweeps is None or len(sweeps.values) < 2:
        return np.nan, np.nan
    up, down = sweeps.up, sweeps.down
    good = np.isfinite(up).all(axis=1) & np.isfinite(down).all(axis=1)
    if not good.any():
        return np.nan, np.nan
    span = float(np.ptp(np.concatenate([up[good], down[good]])))
    half = up.shape[1] // 2
    noise = np.maximum(*(_distance(one[:, :half], one[:, -half:]) for one in (up, down)))
    apart = _distance(up, down)
    apart = np.where(good & (apart > NOISE * noise), apart / span, 0.0)
    both = np.minimum(apart[:-1], apart[1:])
    return float(both.max()), float(sweeps.values[np.argmax(both)])


def _distance(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return the Wasserstein distance of the rows (n, m) of two arrays, (n,)."""
    apart = np.abs(np.sort(one, axis=1) - np.sort(other, axis=1)).mean(axis=1)
    return np.asarray(apart)


def grows(amplitudes: Mapping[str, FloatArray], x: FloatArray) -> Judgement:
    """Judge whether every amplitude (n,) grows with x; NaN where one does not."""
    factor = {name: float(values[-1] / values[0]) for name, values in amplitudes.items()}
    follows = {name: _correlation(x, values) for name, values in amplitudes.items()}
    full = all(factor[name] >= GROWS and follows[name] >= FOLLOWS for name in amplitudes)
    part = all(value > 1.0 for value in factor.values())
    why = '; '.join(
        f'{name} from {values[0]:.3g} to {values[-1]:.3g} (correlation {follows[name]:.2f})'
        for name, values in amplitudes.items()
    )
    value = {'last_over_first': factor, 'correlation': follows}
    return Judgement(graded(full, part), why, value)


def unchanged(amplitudes: Mapping[str, FloatArray]) -> Judgement:
    """Judge whether every amplitude (n,) stays almost the same."""
    spread = {name: float(np.ptp(v) / np.mean(v)) for name, v in amplitudes.items()}
    full = all(value <= UNCHANGED for value in spread.values())
    part = all(value <= LITTLE for value in spread.values())
    why = '; '.join(
        f'{name} between {values.min():.3g} and {values.max():.3g} ({100 * spread[name]:.0f} % of '
        f'its mean)'
        for name, values in amplitudes.items()
    )
    return Judgement(graded(full, part), why, {'range_over_mean': spread})


def _correlation(x: FloatArray, y: FloatArray) -> float:
    if not np.isfinite(y).all() or np.ptp(y) == 0.0:
        return np.nan
    return float(np.corrcoef(x, y)[0, 1])
