# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Claims about Figs 11 to 19: sweeps of load, crack, clearance and eccentricity."""

import re
from functools import partial
from typing import Any

import numpy as np

from rotor_paper import exponents, judging
from rotor_paper.claim import Claim, lost
from rotor_paper.figures import LOAD_FACTORS, MICROMETRE, Facts
from rotor_paper.judging import FloatArray, Judgement, Results


def swept_claims(facts: Facts) -> tuple[Claim, ...]:
    """Return a claim for everything that `facts` states about Figs 11 to 19."""
    return (
        *_load_sweeps(facts['fig11_13']),
        *_crack(facts['fig14_15']),
        _unloaded(facts['fig16']),
        *_clearance(facts['fig17_18']),
        *_eccentricity(facts['fig19']),
    )


def _load_sweeps(row: Facts) -> list[Claim]:
    keys = {speed: f'G_at_{speed}' for speed in row['lyapunov_ticks']}

    def jump(results: Results, key: str) -> Judgement:
        z = judging.section(results.surveys[key], 'z')
        return judging.jumps(z, results.swept(key), results.sweeps.get(key))

    return [
        *(
            Claim(
                f'fig11_jump_{speed}',
                11,
                f'jumping phenomenon at {speed} rad/s, G from {LOAD_FACTORS[0]:g} to '
                f'{LOAD_FACTORS[1]:g}',
                f'agrees: the section of Z changes by {judging.JUMP:.0%} of the range of the '
                f'diagram between neighbouring G, {judging.OUTSTANDING:g} times the median '
                'change, or up- and down-sweep differ by that much at two neighbouring G, and by '
                f'{judging.NOISE:g} times the halves of their own sections; partly: '
                f'{judging.STEP:.0%}',
                (keys.get(speed, f'G_at_{speed}'),),
                partial(jump, key=f'G_at_{speed}'),
                rests_on='z',
            )
            for speed in row['jumps_at_speeds_rad_s']
        ),
        *(
            _exponent_ticks(13, keys[speed], f'{speed} rad/s', ticks, f'_{speed}')
            for speed, ticks in row['lyapunov_ticks'].items()
        ),
        Claim(
            'fig13_hardly_positive',
            13,
            row['text'],
            f'share of exponents {exponents.POSITIVE_RULE}; agrees: at most '
            f'{exponents.ALMOST_NONE:.0%}; partly: at most '
            f'{exponents.ALMOST_NONE + exponents.FEW:.0%}',
            tuple(keys.values()),
            lambda results: exponents.hardly_positive(
                (results.surveys[key] for key in keys.values()), exponents.ALMOST_NONE
            ),
            rests_on='exponent',
        ),
    ]


def _exponent_ticks(
    figure: int, key: str, where: str, ticks: list[float], suffix: str = ''
) -> Claim:
    return Claim(
        f'fig{figure}_exponent_range{suffix}',
        figure,
        f'largest Lyapunov exponent at {where} drawn between ticks {ticks[0]:g} and {ticks[1]:g}',
        judging.TICKS_RULE,
        (key,),
        lambda results: exponents.exponent_range(results.surveys[key], ticks),
        rests_on='exponent',
    )


def _chaos(
    figure: int, key: str, where: str, *, threshold: float, scale: float, unit: str
) -> Claim:
    return Claim(
        f'fig{figure}_chaos',
        figure,
        f'chaotic above {threshold:g}{unit} ({where})',
        f'agrees: the exponent is positive ({exponents.POSITIVE_RULE}) at {judging.MOST:.0%} of '
        f'the values above, at {exponents.ALMOST_NONE:.0%} of those below, and first within '
        f'{exponents.ONSET:.0%} of the range from the threshold; partly: at more than '
        f'{exponents.FEW:.0%} above',
        (key,),
        lambda results: exponents.chaos_above(
            results.surveys[key], results.swept(key) / scale, threshold, unit
        ),
        rests_on='exponent',
    )


def _labels(
    figure: int, key: str, wanted: str, *, values: list[float], where: str, scale: float = 1.0
) -> Claim:
    return Claim(
        f'fig{figure}_{wanted.replace("-", "_")}',
        figure,
        f'{wanted} at {", ".join(f"{value:g}" for value in values)} ({where})',
        'the computed labels; agrees: all; partly: some',
        (key,),
        lambda results: judging.labels(
            results.surveys[key], results.swept(key) / scale, wanted, values
        ),
        rests_on='exponent',
        rows=lambda results, key: np.unique(judging.nearest(results.swept(key) / scale, values)),
    )


def _held(row: Facts) -> str:
    return f'{row["speed_rad_s"]} rad/s, G = {row["load_factor"]}'


def _crack(row: Facts) -> list[Claim]:
    where = f'K from {row["K"][0]:g} to {row["K"][1]:g} at {_held(row)}'
    return [
        _chaos(14, 'K', where, threshold=row['chaotic_above_K'], scale=1.0, unit=''),
        _exponent_ticks(14, 'K', where, row['lyapunov_ticks']),
        _labels(
            15, 'K_sections', 'quasi-periodic', values=row['quasi_periodic_K'], where=f'K; {where}'
        ),
        _labels(15, 'K_sections', 'chaotic', values=row['chaotic_K'], where=f'K; {where}'),
    ]


def _unloaded(row: Facts) -> Claim:
    where = f'K from {row["K"][0]:g} to {row["K"][1]:g} at {_held(row)}'
    return _exponent_ticks(16, 'K_unloaded', where, row['lyapunov_ticks'])


def _clearance(row: Facts) -> list[Claim]:
    low, high = row['clearance_um']
    where = f'clearance {low} to {high} um at {_held(row)}, K = {row["K"]}'
    return [
        _chaos(
            17, 'clearance', where, threshold=row['chaotic_above_um'], scale=MICROMETRE, unit=' um'
        ),
        _exponent_ticks(17, 'clearance', where, row['lyapunov_ticks']),
        _leading_orders(row),
        _labels(
            18,
            'clearance_sections',
            'quasi-periodic',
            values=row['quasi_periodic_um'],
            where=where,
            scale=MICROMETRE,
        ),
        _labels(
            18,
            'clearance_sections',
            'chaotic',
            values=row['chaotic_um'],
            where=where,
            scale=MICROMETRE,
        ),
    ]


def _leading_orders(row: Facts) -> Claim:
    pattern = r'above (\d+) um (\d)x leads the vertical and (\d)x the horizontal'
    numbers = re.search(pattern, row['text'])
    if numbers is None:
        raise ValueError(f'the text of Fig. 17 has another form than expected: {row["text"]!r}')
    above_um, vertical, horizontal = (float(text) for text in numbers.groups())

    def above(results: Results, key: str) -> judging.IndexArray:
        return np.flatnonzero(results.swept(key) > above_um * MICROMETRE)

    def judge(results: Results) -> Judgement:
        survey, rows = results.surveys['clearance'], above(results, 'clearance')
        shares = {
            name: _share_led(judging.orders(survey, coordinate)[rows], order)
            for name, coordinate, order in (
                (f'{vertical:g}x in Y', 'y', vertical),
                (f'{horizontal:g}x in Z', 'z', horizontal),
            )
        }
        verdict = judging.graded(
            all(share >= judging.MOST for share in shares.values()),
            any(share >= 0.5 for share in shares.values()),
        )
        each = ', '.join(f'{name} at {100 * share:.0f} %' for name, share in shares.items())
        why = f'leading super-harmonic above {above_um:g} um: {each} of {rows.size} values'
        return Judgement(verdict, why, {'shares': shares})

    return Claim(
        'fig17_leading_orders',
        17,
        row['text'],
        'share of the values above at which that order is the largest super-harmonic (2x to 4x); '
        f'agrees: {judging.MOST:.0%} in both; partly: half in one',
        ('clearance',),
        judge,
        rows=above,
    )


def _share_led(amplitudes: FloatArray, order: float) -> float:
    """Return the share of rows (n, 5) whose largest super-harmonic is `order`; NaN for none."""
    finite = amplitudes[np.isfinite(amplitudes).all(axis=1)]
    if not len(finite):
        return float('nan')
    return float(np.mean(np.array(judging.ORDERS[1:])[finite[:, 1:].argmax(axis=1)] == order))


def _eccentricity(row: Facts) -> list[Claim]:
    key = 'eccentricity'
    low, high = row['eccentricity_um']
    where = (
        f'e from {low} to {high} um at {_held(row)}, K = {row["K"]}, clearance '
        f'{row["clearance_um"]} um'
    )
    text = f'{row["text"]} ({where})'

    def finite(results: Results, first: int, last: int) -> tuple[dict[str, Any], Any]:
        survey, x = results.surveys[key], results.swept(key)
        good = ~lost(survey, 'order_amplitude_z') & ~lost(survey, 'order_amplitude_y')
        rss = {
            name: np.sqrt((judging.orders(survey, c)[good, first:last] ** 2).sum(axis=1))
            for name, c in (('Y', 'y'), ('Z', 'z'))
        }
        return rss, x[good]

    return [
        _exponent_ticks(19, key, where, row['lyapunov_ticks']),
        Claim(
            'fig19_no_positive',
            19,
            text,
            f'no exponent {exponents.POSITIVE_RULE}; partly: at most {exponents.FEW:.0%}',
            (key,),
            lambda results: exponents.hardly_positive([results.surveys[key]], 0.0),
            rests_on='exponent',
        ),
        Claim(
            'fig19_harmonic_grows',
            19,
            text,
            f'1x of Y and Z grows {judging.GROWS:g} times and follows e (correlation '
            f'{judging.FOLLOWS:g}); partly: it is larger at the end',
            (key,),
            lambda results: judging.grows(*finite(results, 0, 1)),
        ),
        Claim(
            'fig19_super_harmonics_unchanged',
            19,
            text,
            'range of the super-harmonics (2x to 4x together, root of the sum of their squares) of '
            f'Y and Z over their mean; agrees: {judging.UNCHANGED:.0%}; partly: '
            f'{judging.LITTLE:.0%}',
            (key,),
            lambda results: judging.unchanged(finite(results, 1, len(judging.ORDERS))[0]),
        ),
    ]
