# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The statements in `facts.yaml` as claims, judged by the surveys of one variant.

A claim says what the paper says, how it is judged, and which diagrams it needs. Numbers of the
paper come from the facts, our numbers from the surveys; the rules are in `judging`.
"""

from functools import partial
from typing import Any

import numpy as np

from rotor_paper import judging
from rotor_paper.claim import Claim
from rotor_paper.claims_behaviour import behaviour_claims
from rotor_paper.claims_swept import swept_claims
from rotor_paper.figures import RESONANCE_LOAD_FACTOR, Facts
from rotor_paper.judging import Judgement, Results


def claims(facts: Facts) -> tuple[Claim, ...]:
    """Return the claims that `facts` states."""
    return (
        *_resonances(facts),
        *_super_harmonics(facts['fig5_6']),
        *(claim for index, row in enumerate(facts['fig7_10']) for claim in _motion(index, row)),
        *swept_claims(facts),
        *behaviour_claims(facts),
    )


def _resonances(facts: Facts) -> list[Claim]:
    key, rows = f'speed_at_G{RESONANCE_LOAD_FACTOR}', facts['resonances_G3']
    critical = facts['critical_speed_rad_s']

    def searched(results: Results, key: str, wanted: list[Facts]) -> judging.IndexArray:
        found = [judging.near(results.swept(key), row['speed_rad_s']) for row in wanted]
        return np.unique(np.concatenate(found))

    def at(results: Results, row: Facts) -> Judgement:
        speed, order = row['speed_rad_s'], float(row['dominant_order'])
        return judging.resonance(results.surveys[key], results.swept(key), speed, order)

    def critical_speed(results: Results) -> Judgement:
        found = {}
        for row in rows:
            value = at(results, row).value
            if value.get('leading_order_at_peak') == row['dominant_order']:
                order = row['dominant_order']
                found[f'{order:g}x'] = float(order * value['peak_speed_rad_s'])
        low = critical['low'] * (1.0 - judging.NEAR_SPEED)
        high = critical['high'] * (1.0 + judging.NEAR_SPEED)
        right = sum(low <= value <= high for value in found.values())
        each = ', '.join(f'{name} {value:.0f}' for name, value in found.items()) or 'none'
        why = f'order times speed of its peak, where that order leads, in rad/s: {each}'
        verdict = judging.graded(right == len(rows), 2 * right >= len(rows))
        return Judgement(verdict, why, {'critical_speed_rad_s': found})

    return [
        Claim(
            'critical_speed',
            6,
            f'critical speed {critical["low"]} to {critical["high"]} rad/s ({critical["kind"]}): '
            f'{critical["note"]}',
            'order times speed of each super-harmonic peak of Z lies in that range, within '
            f'{judging.NEAR_SPEED:.0%}; agrees: all peaks; partly: half of them',
            (key,),
            critical_speed,
            rows=partial(searched, wanted=rows),
        ),
        *(
            Claim(
                f'resonance_{row["speed_rad_s"]}',
                6,
                f'resonance at {row["speed_rad_s"]} rad/s, G = {RESONANCE_LOAD_FACTOR}, '
                f'{row["dominant_order"]}x leads in Z',
                f'largest amplitude of that order within {judging.SEARCH:.0%} of the speed; '
                f'agrees: it leads there, within {judging.NEAR_SPEED:.0%} of the speed, and leads '
                'at the speed itself; partly: one of the two',
                (key,),
                partial(at, row=row),
                rows=partial(searched, wanted=[row]),
            )
            for row in rows
        ),
    ]


def _super_harmonics(row: Facts) -> list[Claim]:
    loads, speeds = row['load_factors'], row['speeds_rad_s']
    keys = {load: f'speed_at_G{load}' for load in loads}
    loaded = tuple(load for load in loads if load >= 1)
    text = f'{row["text"]} (speed {speeds[0]} to {speeds[1]} rad/s, G = {loads})'
    seen = f'over the highest peak of the diagram; visible from {judging.VISIBLE:.0%}'

    def peak(results: Results, load: float) -> float:
        amplitudes = judging.orders(results.surveys[keys[load]])
        return float(np.nanmax(amplitudes[:, 1:]) / np.nanmax(amplitudes))

    def absent(results: Results) -> Judgement:
        share = peak(results, 0)
        verdict = judging.graded(share < judging.VISIBLE, share < 2 * judging.VISIBLE)
        why = f'largest super-harmonic {100 * share:.1f} % of the highest peak at G = 0'
        return Judgement(verdict, why, {'share': share})

    def apparent(results: Results) -> Judgement:
        shares = {str(load): peak(results, load) for load in loaded}
        seen = [share >= judging.VISIBLE for share in shares.values()]
        each = ', '.join(f'{100 * share:.0f} % at G = {load}' for load, share in shares.items())
        why = f'largest super-harmonic over the highest peak: {each}'
        return Judgement(judging.graded(all(seen), any(seen)), why, {'shares': shares})

    def stronger(results: Results) -> Judgement:
        mean = {
            str(load): float(np.nanmean(judging.super_harmonics(results.surveys[keys[load]])))
            for load in loaded
        }
        values = list(mean.values())
        verdict = judging.graded(bool(np.all(np.diff(values) > 0.0)), values[-1] > values[0])
        each = ', '.join(f'{value:.3g} at G = {load}' for load, value in mean.items())
        why = f'mean of the super-harmonics of Z together: {each}'
        return Judgement(verdict, why, {'mean': mean})

    loaded_keys = tuple(keys[load] for load in loaded)
    return [
        Claim(
            'super_harmonics_absent_without_load',
            6,
            text,
            f'largest super-harmonic of Z (2x to 4x) at G = 0 {seen}; partly: below twice that',
            tuple(key for load, key in keys.items() if load == 0),
            absent,
        ),
        Claim(
            'super_harmonics_apparent_with_load',
            6,
            text,
            f'largest super-harmonic of Z (2x to 4x) at each G >= 1 {seen}; partly: at some '
            'of the loads',
            loaded_keys,
            apparent,
        ),
        Claim(
            'super_harmonics_grow_with_load',
            6,
            text,
            'mean over speed of the super-harmonics of Z (2x to 4x together, root of the sum of '
            'their squares); agrees: rises from load to load; partly: higher at the last than at '
            'the first',
            loaded_keys,
            stronger,
        ),
    ]


def _motion(index: int, row: Facts) -> list[Claim]:
    key, number, speed = 'four_speeds', 7 + index, row['speed_rad_s']

    def path(results: Results, coordinate: str) -> Judgement:
        values = np.asarray(getattr(results.paths[key][index], coordinate))
        return judging.against_ticks(values, row[f'{coordinate}_ticks'], coordinate.upper())

    def points(results: Results, coordinate: str) -> Judgement:
        values = judging.section(results.surveys[key], coordinate)[index]
        ticks = row[f'poincare_{coordinate}_ticks']
        return judging.against_ticks(values, ticks, f'{coordinate.upper()} at tau = 2 pi n')

    def ticks(what: str, pair: list[float]) -> str:
        return f'{what} at {speed} rad/s drawn between ticks {pair[0]:g} and {pair[1]:g}'

    common: dict[str, Any] = {
        'figure': number,
        'needs': (key,),
        'rows': lambda _results, _key: np.array([index]),
    }
    return [
        *(
            Claim(
                f'fig{number}_{coordinate}_range',
                paper=ticks(coordinate.upper(), row[f'{coordinate}_ticks']),
                rule=judging.TICKS_RULE,
                judge=partial(path, coordinate=coordinate),
                rests_on=coordinate,
                **common,
            )
            for coordinate in ('z', 'y')
        ),
        *(
            Claim(
                f'fig{number}_section_{coordinate}',
                paper=ticks(
                    f'{coordinate.upper()} of the Poincaré section',
                    row[f'poincare_{coordinate}_ticks'],
                ),
                rule=judging.TICKS_RULE,
                judge=partial(points, coordinate=coordinate),
                rests_on=coordinate,
                **common,
            )
            for coordinate in ('z', 'y')
        ),
        Claim(
            f'fig{number}_motion',
            paper=f'{row["motion"]} motion at {speed} rad/s, G = {RESONANCE_LOAD_FACTOR}',
            rule='the computed label; partly: regular, but by another name',
            judge=lambda results: judging.one_motion(
                results.surveys[key][index : index + 1], row['motion']
            ),
            rests_on='exponent',
            **common,
        ),
    ]
