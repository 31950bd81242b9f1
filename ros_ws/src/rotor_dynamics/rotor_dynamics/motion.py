# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Classifies a motion from its Poincare section: periodic, quasi-periodic or chaotic.

A section is the displacement (y, z) once a revolution, m points (300 serve; below SHORTEST only
periodic motion is recognised). Three views of it, none of which needs the equations:
- 0-1 test: a chaotic series drives a plane walk that diffuses (K near 1), a regular one does not;
- line spectrum: a quasi-periodic series is a sum of few lines, a chaotic one has a continuum;
- return: a quasi-periodic series has almost periods (Bohr), lags after which all of it nearly
  comes back; a chaotic one has none.

Forced quasi-periodic motion: the ball-pass order (3.0846) is no multiple of the shaft's and the
response follows it with a negative exponent. With the printed radii the order is 401/130, so this
motion comes back after 130 revolutions; like the paper, we call it quasi-periodic all the same.
A torus that folds or jumps has more lines than are counted: then the return shows that it is
regular. Two free frequencies have no short almost period: then the lines show it.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor_common.tapers import hann
from rotor_dynamics.errors import AnalysisError

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]

FREQUENCIES = 100
"""Number of values of c, as in Gottwald and Melbourne; the median ignores those that resonate."""
LARGEST_LAG_SHARE = 10
"""The walk is followed over m/10 points, as they recommend: later displacements are noisy."""
SHORTEST = 100
"""With fewer points the counted lines cover most bins, and any spectrum looks like lines."""
LONGEST_PERIOD = 16
"""Four period doublings; 300 points cannot distinguish a longer one from quasi-periodicity."""
RECURRENCE = 1e-4
"""Share of the largest displacement: the remainder, after 1000 revolutions, of a transient with
exponent -0.0015. The weakest ball-pass responses seen have a share of 3e-4 or more."""
LINES = 6
"""Lines counted: a fundamental and five of its harmonics or combinations."""
LINE_WIDTH = 2
"""Bins on either side of a peak that belong to it: the main lobe of the Hann window."""
LINE_SHARE = 0.999
"""Above this share the power is in lines: with 300 points, three sines of any frequency leave 1e-4
outside the lines, weak banded chaos (logistic map, r = 3.58) 1.5e-3 or more."""
CONTINUOUS_SHARE = 0.997
"""Below this share the spectrum is continuous, if there is no return either: banded chaos
(r = 3.62) leaves 0.02 or more outside the lines. Between the two shares it is inconclusive."""
BROAD_SHARE = 0.9
"""Below this share chaos needs no exponent to confirm it: the Henon map has 0.5, the logistic map
at r = 3.7 up to 0.83, while forced motion with many harmonics was seen down to 0.92."""
RETURN = 0.05
"""Return distance of regular motion. Dirichlet: one frequency comes back to 1/150 turn within 150
lags, sqrt(2) sin(pi/150) = 0.03 of its size; banded chaos (r = 3.62) keeps 0.2."""
DIFFUSION = 0.8
"""K above this is near 1: at 300 points the logistic map gives 0.98 from r = 3.7. A regular
motion of many lines can reach it too, so lines and return are checked first."""
NO_DIFFUSION = 0.5
"""K below this, halfway between its two limits, indicates a regular motion."""
SIGNIFICANCE = 3.0
"""Standard errors above zero that make an exponent positive."""


@dataclass(frozen=True)
class QuasiPeriodicity:
    """Each (...,), NaN (lag 0) for a section that is too short or not finite.

    line_share: share of the section's power in its LINES strongest lines; return_distance: rms
    distance from the point `return_lag` (1 to m/2) later, 0 if all comes back, about 1 if nothing
    does; return_lag: the lag with the smallest distance, in revolutions.
    """

    line_share: Array
    return_distance: Array
    return_lag: Integers


@dataclass(frozen=True)
class Motion:
    """label (n,): 'periodic', 'quasi-periodic', 'chaotic', 'undecided' or 'diverged'.

    evidence: arrays (n,) by name: period (revolutions, 0 = none up to LONGEST_PERIOD), recurrence
    (largest distance between repetitions over the largest displacement; without a period the
    smallest of all), zero_one (K of z), line_share, return_distance, return_lag, exponent and
    standard_error (as given).
    reason (n,): why a motion is undecided or diverged, '' for the others.
    """

    label: NDArray[np.str_]
    evidence: dict[str, NDArray[Any]]
    reason: NDArray[np.str_]


def zero_one_test(series: Array) -> Array:
    """K of the 0-1 test for chaos: about 0 for regular, about 1 for chaotic series (..., m).

    Correlation of the mean square displacement with time, median over FREQUENCIES values of c at
    equal distances in (pi/5, 4 pi/5). The oscillating term comes from the mean and is removed
    with it. A series that varies by less than RECURRENCE of its size is constant: K = 0. NaN for
    a series that is not finite or shorter than SHORTEST.
    Source: Gottwald and Melbourne, SIAM J. Appl. Dyn. Syst. 8 (2009) 129, section 3.
    """
    series = np.asarray(series, dtype=np.float64)
    points = series.shape[-1]
    if points < SHORTEST:
        return np.full(series.shape[:-1], np.nan)
    finite = np.isfinite(series).all(axis=-1)
    series = np.where(finite[..., np.newaxis], series, 0.0)
    centred = _centred(series)
    size = np.max(np.abs(centred), axis=-1)
    steady = size <= RECURRENCE * np.max(np.abs(series), axis=-1)
    displacement = _mean_square_displacement(centred / np.where(steady, 1.0, size)[..., np.newaxis])
    time = np.arange(displacement.shape[-2], dtype=np.float64)
    time -= time.mean()
    displacement = displacement - displacement.mean(axis=-2, keepdims=True)
    spread = np.sqrt((time**2).sum() * (displacement**2).sum(axis=-2))
    covariance = np.einsum('t,...tc->...c', time, displacement)
    k = np.median(covariance / np.where(spread > 0.0, spread, 1.0), axis=-1)
    return np.where(finite, np.where(steady, 0.0, k), np.nan)


def quasi_periodicity(y: Array, z: Array) -> QuasiPeriodicity:
    """Share of power in few lines, and how closely the section (y, z), each (..., m), comes back.

    Spectrum: Hann window over all m points, mean removed, power of y and z added; a line is a peak
    with LINE_WIDTH bins on either side. A section that does not vary is one line and comes back.
    AnalysisError: y and z differ in shape.
    """
    section = _section(y, z)
    finite = np.isfinite(section).all(axis=(0, -1))
    if section.shape[-1] < SHORTEST:
        finite = np.zeros_like(finite)
    section = np.where(finite[..., np.newaxis], section, 0.0)
    distance, lag = _best_return(section)
    return QuasiPeriodicity(
        np.where(finite, _line_share(section), np.nan),
        np.where(finite, distance, np.nan),
        np.where(finite, lag, 0),
    )


def classify(y: Array, z: Array, exponent: Array, standard_error: Array) -> Motion:
    """Label n motions by section (y, z), each (n, m), and largest exponent (n,), NaN if unknown.

    - diverged: a point that is not finite;
    - periodic: all points repeat after 1 to LONGEST_PERIOD revolutions, exponent not positive;
    - chaotic: exponent positive by SIGNIFICANCE standard errors, and a section that is irregular:
      K near 1 or a continuous spectrum, and neither few lines nor a return;
    - quasi-periodic: exponent not positive, and few lines or a return; or exponent negative by
      SIGNIFICANCE and K not near 1: where f jumps, a crossing is seen up to a step late, and that
      jitter blurs the lines and the return of a motion that is regular with smaller steps;
    - undecided: everything else, as when section and exponent contradict each other.
    Without an exponent (or its error) the section decides, and chaos needs both K near 1 and a
    broad spectrum. The exponent of a forced quasi-periodic motion is negative, not zero.
    AnalysisError: shapes that do not fit.
    """
    section = _section(y, z)
    exponent, standard_error = np.asarray(exponent), np.asarray(standard_error)
    if section.ndim != 3 or not exponent.shape == standard_error.shape == section.shape[1:2]:
        raise AnalysisError(
            f'the section has the shape {section.shape[1:]}, the exponents {exponent.shape} and '
            f'their errors {standard_error.shape}; give (n, m), (n,) and (n,)'
        )
    finite = np.isfinite(section).all(axis=(0, -1))
    period, recurrence = _period(np.where(finite[:, np.newaxis], section, np.nan))
    k = zero_one_test(section[1])
    torus = quasi_periodicity(section[0], section[1])

    known = np.isfinite(exponent) & np.isfinite(standard_error)
    positive = known & (exponent > SIGNIFICANCE * standard_error)
    negative = known & (exponent < -SIGNIFICANCE * standard_error)
    # comparisons with NaN are False: without evidence nothing is regular, irregular or broad
    regular = (torus.return_distance <= RETURN) | (torus.line_share >= LINE_SHARE)
    diffusive = k >= DIFFUSION
    irregular = ~regular & (diffusive | (torus.line_share <= CONTINUOUS_SHARE))
    broad = ~regular & diffusive & (torus.line_share <= BROAD_SHARE)
    calm = (regular & ~positive) | (negative & (k <= NO_DIFFUSION))
    wild = (irregular & positive) | (broad & ~known)
    label = np.select(
        [
            ~finite,
            (period > 0) & ~positive,
            period > 0,
            calm,
            wild,
        ],
        ['diverged', 'periodic', 'undecided', 'quasi-periodic', 'chaotic'],
        default='undecided',
    )
    reason = np.select(
        [
            ~finite,
            (period > 0) & ~positive,
            period > 0,
            calm | wild,
            regular,
            np.isnan(k),
            irregular & negative,
            irregular & known,
            irregular,
        ],
        [
            'the section is not finite',
            '',
            'the section repeats, but the exponent is positive',
            '',
            'the section is regular, but the exponent is positive',
            f'the section has fewer than {SHORTEST} points',
            'the section is irregular, but the exponent is negative',
            'the section is irregular, and the exponent is not told from zero',
            'the section is irregular, and there is no exponent',
        ],
        default='the section is neither clearly regular nor clearly irregular',
    )
    evidence: dict[str, NDArray[Any]] = {
        'period': period,
        'recurrence': recurrence,
        'zero_one': k,
        'line_share': torus.line_share,
        'return_distance': torus.return_distance,
        'return_lag': torus.return_lag,
        'exponent': exponent,
        'standard_error': standard_error,
    }
    return Motion(label, evidence, reason)


def _section(y: Array, z: Array) -> Array:
    """Both components in one array (2, ..., m)."""
    y, z = np.asarray(y, dtype=np.float64), np.asarray(z, dtype=np.float64)
    if y.shape != z.shape or y.ndim < 1 or y.shape[-1] < 1:
        raise AnalysisError(
            f'y has the shape {y.shape}, z {z.shape}; give two equal ones, (..., m)'
        )
    return np.stack([y, z])


def _centred(series: Array) -> Array:
    return np.asarray(series - series.mean(axis=-1, keepdims=True))


def _mean_square_displacement(series: Array) -> Array:
    """M(t, c) of the plane walk with steps series_j e^(icj): (..., lags, FREQUENCIES).

    The square of a sum of t steps depends on c only by cos(c (i - l)), so the means over the
    starting point, R(i, l) = <series_(j+i) series_(j+l)>, are computed once for all c.
    """
    lags = series.shape[-1] // LARGEST_LAG_SHARE
    windows = np.lib.stride_tricks.sliding_window_view(series, lags, axis=-1)
    r = windows.swapaxes(-1, -2) @ windows / windows.shape[-2]
    growth = np.zeros_like(r)  # from t to t + 1 steps, by the distance i - l
    for distance in range(lags):
        pairs = 2.0 if distance else 1.0
        growth[..., distance:, distance] = pairs * np.diagonal(r, distance, -2, -1)
    c = np.pi / 5 + 3 * np.pi / 5 * (np.arange(FREQUENCIES) + 0.5) / FREQUENCIES
    return np.cumsum(growth @ np.cos(np.multiply.outer(np.arange(lags), c)), axis=-2)


def _line_share(section: Array) -> Array:
    """Share of power in the strongest lines of (2, ..., m); each is removed before the next."""
    points = section.shape[-1]
    power = (np.abs(np.fft.rfft(_centred(section) * hann(points), axis=-1)) ** 2).sum(axis=0)
    total = power.sum(axis=-1)
    bins = np.arange(power.shape[-1])
    for _ in range(LINES):
        peak = power.argmax(axis=-1)[..., np.newaxis]
        power = np.where(np.abs(bins - peak) <= LINE_WIDTH, 0.0, power)
    rest: Array = power.sum(axis=-1) / np.where(total > 0.0, total, 1.0)
    return 1.0 - rest


def _best_return(section: Array) -> tuple[Array, Integers]:
    """Smallest rms distance of (2, ..., m) from itself over the lags to m/2, and that lag.

    In units of sqrt(2) times the standard deviation: 1 for independent points.
    """
    lags = range(1, section.shape[-1] // 2 + 1)
    size = np.sqrt(2.0 * section.var(axis=-1).sum(axis=0))
    if not lags:
        return size, np.zeros(size.shape, dtype=np.int64)
    distances = np.stack(
        [
            np.sqrt(((section[..., lag:] - section[..., :-lag]) ** 2).mean(axis=-1).sum(axis=0))
            for lag in lags
        ]
    )
    return distances.min(axis=0) / np.where(size > 0.0, size, 1.0), 1 + distances.argmin(axis=0)


def _period(section: Array) -> tuple[Integers, Array]:
    """Smallest period of (2, n, m), 0 if none, and how well it repeats; NaN stays NaN.

    A period has to be seen three times, and all its repetitions must be close to each other:
    consecutive ones would also be close in a slow drift.
    """
    _, n, points = section.shape
    periods = range(1, min(LONGEST_PERIOD, points // 3) + 1)
    if not periods:
        return np.zeros(n, dtype=np.int64), np.full(n, np.nan)
    size = np.max(np.abs(section), axis=(0, -1))
    size = np.where(size == 0.0, 1.0, size)
    spread = np.empty((len(periods), n))
    for period in periods:
        repeats = points // period
        rows = section[..., points - repeats * period :].reshape(2, n, repeats, period)
        spread[period - 1] = np.ptp(rows, axis=2).max(axis=(0, -1)) / size
    close: Flags = spread <= RECURRENCE
    found = close.any(axis=0)
    # argmax: the first period that repeats
    best = np.where(found, close.argmax(axis=0), spread.argmin(axis=0))
    return np.where(found, best + 1, 0), spread[best, np.arange(n)]
