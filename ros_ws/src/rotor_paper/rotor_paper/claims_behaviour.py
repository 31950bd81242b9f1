# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Claims about how responses behave: what changes most, peaks, persists or gets worse."""

from functools import partial

from rotor_paper import exponents, judging, spectra
from rotor_paper.claim import Claim
from rotor_paper.figures import LOAD_FACTORS, MICROMETRE, Facts
from rotor_paper.judging import Judgement, Results

TWO_HALVES = 'agrees: both; partly: one of the two'
SEVERAL = f'agrees: {exponents.SEVERAL} or more; partly: one'


def behaviour_claims(facts: Facts) -> tuple[Claim, ...]:
    """Return the claims in the text of sections 3.1 to 3.5 that no axis or label shows."""
    crack, unloaded, clearance = facts['fig14_15'], facts['fig16'], facts['fig17_18']
    threshold, wide = crack['chaotic_above_K'], clearance['chaotic_above_um']
    return (
        *(_marked(order) for order in facts['fig5_6']['orders_marked_at_G0']),
        *_over_load(facts['fig11_13']),
        _continuous(14, 'K', crack['spectra_text'], threshold=threshold, scale=1.0, unit=''),
        *_crack_and_load(unloaded),
        _continuous(
            17, 'clearance', clearance['spectra_text'], threshold=wide, scale=MICROMETRE, unit=' um'
        ),
        *_eccentricity(facts['fig19']),
    )


def _marked(order: float) -> Claim:
    key = 'speed_at_G0'
    return Claim(
        f'fig6_order_{order:g}_without_load',
        6,
        f'a ridge at {order:g}x is marked in Fig. 6(a), at G = 0',
        f'largest line of Z at {order:g}x over the highest line of the diagram; agrees: from '
        f'{judging.VISIBLE:.0%}; partly: from half of that',
        (key,),
        lambda results: spectra.visible_order(results.surveys[key], order),
    )


def _over_load(row: Facts) -> list[Claim]:
    span = f'G from {LOAD_FACTORS[0]:g} to {LOAD_FACTORS[1]:g}'
    keys = tuple(f'G_at_{speed}' for speed in row['lyapunov_ticks'])

    def no_jump(results: Results, key: str) -> Judgement:
        z = judging.section(results.surveys[key], 'z')
        return judging.no_jump(z, results.swept(key), results.sweeps.get(key))

    def changes_most(results: Results, key: str, order: float) -> Judgement:
        amplitudes = judging.orders(results.surveys[key])
        return spectra.changes_most(amplitudes, results.swept(key), order)

    def peaks(results: Results, key: str) -> Judgement:
        return exponents.peaks(results.surveys[key], results.swept(key))

    return [
        *(
            Claim(
                f'fig11_no_jump_{speed}',
                11,
                f'no jumping phenomenon at {speed} rad/s, {span} (the text names the other speeds)',
                'by the measures of the jumps; agrees: no step and no difference of the sweeps of '
                f'{judging.STEP:.0%}; partly: of {judging.JUMP:.0%}',
                (f'G_at_{speed}',),
                partial(no_jump, key=f'G_at_{speed}'),
                rests_on='z',
            )
            for speed in row['no_jumps_at_speeds_rad_s']
        ),
        *(
            Claim(
                f'fig12_nearest_order_{speed}',
                12,
                f'{row["nearest_text"]}: {order:g}x at {speed} rad/s, {span}',
                'range of its amplitude in Z is the largest of the super-harmonics (2x to 4x), and '
                f'it has at most {spectra.END:.0%} of its largest value at either end; '
                f'{TWO_HALVES}',
                (f'G_at_{speed}',),
                partial(changes_most, key=f'G_at_{speed}', order=float(order)),
            )
            for speed, order in row['nearest_order'].items()
        ),
        *(
            Claim(
                f'fig13_peaks_{speed}',
                13,
                f'{row["peaks_text"]} at {speed} rad/s, {span}',
                f'peaks of the exponent with a prominence of {exponents.PEAK:g}; {SEVERAL}',
                (f'G_at_{speed}',),
                partial(peaks, key=f'G_at_{speed}'),
                rests_on='exponent',
            )
            for speed in row['lyapunov_ticks']
        ),
        Claim(
            'fig13_motion',
            13,
            f'{row["motion_text"]} ({span}, all four speeds)',
            f'share of the computed labels; agrees: {judging.MOST:.0%}; partly: half',
            keys,
            lambda results: judging.mostly(
                [results.surveys[key] for key in keys],
                'quasi-periodic',
                full=judging.MOST,
                part=0.5,
            ),
            rests_on='exponent',
        ),
    ]


def _continuous(
    figure: int, key: str, text: str, *, threshold: float, scale: float, unit: str
) -> Claim:
    return Claim(
        f'fig{figure}_continuous_spectra',
        figure,
        f'{text} above {threshold:g}{unit}',
        'a spectrum is continuous if its median is at least '
        f'{spectra.CONTINUUM:.1%} of its highest line; agrees: so are {judging.MOST:.0%} of those '
        f'above and at most {1.0 - judging.MOST:.0%} of those below; partly: more than '
        f'{1.0 - judging.MOST:.0%} above, and more than below',
        (key,),
        lambda results: spectra.continuous_above(
            results.surveys[key], results.swept(key) / scale, threshold, unit
        ),
    )


def _crack_and_load(row: Facts) -> list[Claim]:
    return [
        Claim(
            'fig16_deeper_crack',
            16,
            f'{row["depth_text"]} (G = {row["load_factor"]})',
            'mean exponent in the last third of K less that in the first; agrees: above '
            f'{exponents.EXPONENT_SCATTER:g}; partly: above 0',
            ('K_unloaded',),
            lambda results: exponents.grows_with(
                results.surveys['K_unloaded'], results.swept('K_unloaded')
            ),
            rests_on='exponent',
        ),
        Claim(
            'fig16_load_less_stable',
            16,
            row['load_text'],
            'the largest exponent is larger with the load, and more of them are positive '
            f'({exponents.POSITIVE_RULE}); {TWO_HALVES}',
            ('K', 'K_unloaded'),
            lambda results: exponents.less_stable(
                results.surveys['K'], results.surveys['K_unloaded']
            ),
            rests_on='exponent',
        ),
    ]


def _eccentricity(row: Facts) -> list[Claim]:
    key = 'eccentricity'
    low, high = row['eccentricity_um']
    where = f'e from {low} to {high} um'
    return [
        Claim(
            'fig19_bifurcations',
            19,
            f'{row["points_text"]} ({where})',
            'at a bifurcation the exponent is 0: peaks with a prominence of '
            f'{exponents.PEAK:g} that reach {-exponents.EXPONENT_SCATTER:g}; {SEVERAL}',
            (key,),
            lambda results: exponents.peaks(
                results.surveys[key], results.swept(key), near_zero=True
            ),
            rests_on='exponent',
        ),
        Claim(
            'fig19_motion',
            19,
            f'{row["motion_text"]} ({where})',
            'share of the computed labels; agrees: '
            f'{1.0 - exponents.ALMOST_NONE:.0%}; partly: half',
            (key,),
            lambda results: judging.mostly(
                [results.surveys[key]],
                'quasi-periodic',
                full=1.0 - exponents.ALMOST_NONE,
                part=0.5,
            ),
            rests_on='exponent',
        ),
    ]
