# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Judge claims about spectra: what changes most, is visible, is continuous."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor_dynamics import Survey
from rotor_paper import judging
from rotor_paper.judging import DOES_NOT, MOST, VISIBLE, FloatArray, Judgement

END = 0.8
"""Largest amplitude at either end of a diagram over the highest in it that 'peaks' allows."""

CONTINUUM = 0.001
"""Least median of a spectrum over its highest line that is a continuum: lines fill few bins."""


def changes_most(amplitudes: FloatArray, load_factor: FloatArray, order: float) -> Judgement:
    """Judge whether of all super-harmonics (n, 5) over G that of `order` changes most and peaks."""
    good = np.isfinite(amplitudes).all(axis=1)
    if not good.any():
        return Judgement(DOES_NOT, 'no finite value', {})
    amplitudes, load_factor = amplitudes[good, 1:], load_factor[good]
    ranges = np.ptp(amplitudes, axis=0)
    most = judging.ORDERS[1 + int(ranges.argmax())]
    own = amplitudes[:, judging.ORDERS.index(order) - 1]
    at, height = float(load_factor[own.argmax()]), float(own.max())
    ends = float(max(own[0], own[-1])) / height if height > 0.0 else np.nan
    verdict = judging.graded(most == order and ends <= END, most == order or ends <= END)
    itself = '' if most == order else f', {order:g}x by {np.ptp(own):.3g}'
    why = (
        f'{most:g}x changes most, by {ranges.max():.3g}{itself}; {order:g}x is largest at G = '
        f'{at:.3g} ({height:.3g}), the larger of its ends has {100 * ends:.0f} % of it'
    )
    return Judgement(verdict, why, {'changes_most': most, 'largest_at': at, 'end': ends})


def visible_order(survey: Survey, order: float) -> Judgement:
    """Judge whether a line of Z at `order` can be seen somewhere in a diagram."""
    if not np.any(np.isclose(survey.orders, order)):
        return Judgement(DOES_NOT, f'no spectrum reaches {order:g}x', {})
    line = survey.amplitude_z[:, np.isclose(survey.orders, order)].max(axis=1)
    share = float(np.nanmax(line) / np.nanmax(survey.amplitude_z[:, 1:]))
    why = f'{order:g}x reaches {100 * share:.1f} % of the highest line of the diagram'
    return Judgement(judging.graded(share >= VISIBLE, share >= VISIBLE / 2), why, {'share': share})


def continuum(spectra: NDArray[Any]) -> FloatArray:
    """Return the median of each spectrum (n, bins) over its highest line, (n,)."""
    lines = np.asarray(spectra, np.float64)[:, 1:]  # the mean is no line
    return np.asarray(np.median(lines, axis=1) / lines.max(axis=1))


def continuous_above(survey: Survey, x: FloatArray, threshold: float, unit: str) -> Judgement:
    """Judge whether the spectra of Y and Z are continuous above `threshold` and not below it."""
    floor = np.minimum(*(continuum(a) for a in (survey.amplitude_y, survey.amplitude_z)))
    finite, wide = np.isfinite(floor), floor >= CONTINUUM
    above, below = finite & (x > threshold), finite & (x <= threshold)
    shares = [
        float(np.mean(wide[which])) if which.any() else float('nan') for which in (above, below)
    ]
    why = (
        f'continuous in Y and Z at {100 * shares[0]:.0f} % of the values above {threshold:g}{unit} '
        f'and {100 * shares[1]:.0f} % of those up to it'
    )
    verdict = judging.graded(
        shares[0] >= MOST and shares[1] <= 1.0 - MOST,
        shares[0] > 1.0 - MOST and shares[0] > shares[1],
    )
    return Judgement(verdict, why, {'share_above': shares[0], 'share_up_to': shares[1]})
