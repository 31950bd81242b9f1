# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Flights put together from maneuvers, and courses of the speed, all drawn."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from maneuver_gen.maneuvers.climb_dive import ClimbDive
from maneuver_gen.maneuvers.recorded import SHIPPED, open_flight
from rotor_bench.dataset.suite_config import ManeuverDraws, SpeedDraws
from rotor_common.constants import GRAVITY_M_S2

RECORD = f'{SHIPPED}synthetic_record'
CLIMB_ANGLE_RAD = 0.5
PULLS = {'pulls_3g': 3.0, 'pulls_5g': 5.0, 'pulls_9g': 9.0}
DWELL = 0.05
"""Least part of a flight for which a sweep stays at each of its ends."""

Segments = list[dict[str, Any]]


class Pilot:
    """Draws maneuvers for one flight."""

    def __init__(self, table: ManeuverDraws, draw: np.random.Generator) -> None:
        self._table = table
        self._draw = draw

    def flight(self, family: str, duration_s: float) -> dict[str, Any]:
        """Return the plain data of a flight of one family, for `maneuver` of a scenario."""
        if family == 'level':
            return {'profile': 'constant', 'load_factor': 1.0}
        if family == 'recorded':
            return self._recorded(duration_s)
        segments = self._gusts(duration_s) if family == 'gusts' else self._legs(family, duration_s)
        return {'profile': 'sequence', 'blend_s': self._table.blend_s, 'segments': segments}

    def _between(self, limits: tuple[float, float]) -> float:
        return float(self._draw.uniform(*limits))

    def _legs(self, family: str, duration_s: float) -> Segments:
        """Return maneuvers between level legs: one in any case, more if they fit."""
        segments = [self._level_leg()]
        while True:
            figure = self._figure(family, first=len(segments) == 1)
            after = self._level_leg()
            length_s = _length(segments) + _length(figure) + after['duration_s']
            if length_s > duration_s and len(segments) > 1:
                return segments
            segments += [*figure, after]

    def _figure(self, family: str, *, first: bool) -> Segments:
        kinds: dict[str, Callable[[], Segments]] = {
            'climb_dive': self._climb_dive,
            'turns': self._turn,
        }
        if family == 'mixed':
            choices = ('pulls_5g', 'turns', 'climb_dive')
            family = choices[0] if first else choices[self._draw.integers(len(choices))]
        if family in kinds:
            return kinds[family]()
        return self._pull(PULLS[family], first=first)

    def _level_leg(self) -> dict[str, Any]:
        return _held(1.0, max(self._between(self._table.level_leg_s), self._table.blend_s))

    def _pull(self, load_factor: float, *, first: bool) -> Segments:
        depth = 1.0 if first else self._between(self._table.pull_depth)
        hold_s = self._between(self._table.pull_hold_s)
        return [_held(1.0 + depth * (load_factor - 1.0), self._table.blend_s + hold_s)]

    def _turn(self) -> Segments:
        bank = self._between(self._table.bank_rad)
        side = 1.0 if self._draw.random() < 0.5 else -1.0
        turn_s = self._between(self._table.turn_s)
        roll_s = self._table.blend_s
        maneuver = {
            'profile': 'turn',
            'bank_rad': side * bank,
            'level_s': 0.0,
            'roll_s': roll_s,
            'turn_s': turn_s,
            'slip_load_factor': self._between(self._table.slip_load_factor),
        }
        return [{'duration_s': turn_s + 2.0 * roll_s, 'maneuver': maneuver}]

    def _climb_dive(self) -> Segments:
        speed = self._between(self._table.climb_speed_m_s)
        pull = self._between(self._table.climb_pull_load_factor)
        push = self._between(self._table.climb_push_load_factor)
        maneuver = ClimbDive(
            speed_m_s=speed,
            pull_rate_rad_s=(pull - 1.0) * GRAVITY_M_S2 / speed,
            push_rate_rad_s=(1.0 - push) * GRAVITY_M_S2 / speed,
            climb_angle_rad=CLIMB_ANGLE_RAD,
            dive_angle_rad=CLIMB_ANGLE_RAD,
            level_s=0.0,
            weight=True,
        )
        end_s = maneuver.pulses()[-1].end_s
        return [{'duration_s': end_s, 'maneuver': maneuver.model_dump(mode='json')}]

    def _gusts(self, duration_s: float) -> Segments:
        segments: Segments = []
        while _length(segments) < duration_s:
            maneuver = {
                'profile': 'gusts',
                'rms': self._between(self._table.gust_rms),
                'seed': int(self._draw.integers(2**62)),
            }
            patch_s = max(self._between(self._table.gust_patch_s), self._table.blend_s)
            segments.append({'duration_s': patch_s, 'maneuver': maneuver})
        return segments

    def _recorded(self, duration_s: float) -> dict[str, Any]:
        last_s = float(open_flight(RECORD).times_s[-1])
        start_s = round(self._between((0.0, max(last_s - duration_s, 0.0))), 1)
        return {'profile': 'recorded', 'path': RECORD, 'start_s': min(start_s, last_s - duration_s)}


def speed_program(
    program: str,
    nominal_rad_s: float,
    duration_s: float,
    table: SpeedDraws,
    draw: np.random.Generator,
) -> dict[str, Any]:
    """Return the plain data of `speed` of a scenario, without the highest speed."""
    if program == 'governor_steps':
        return _steps(nominal_rad_s, duration_s, table, draw)
    if program == 'steady':
        return {'initial_rad_s': nominal_rad_s * float(draw.uniform(*table.steady))}
    low, high = table.reference_sweep if program == 'sweep' else table.sweep
    start, turn = (high, low) if program == 'run_down' else (low, high)
    return _there_and_back(nominal_rad_s * start, nominal_rad_s * turn, duration_s, draw)


def _there_and_back(
    start: float, turn: float, duration_s: float, draw: np.random.Generator
) -> dict[str, Any]:
    """Return a ramp to `turn` and one back, between dwells of drawn lengths."""
    dwells = DWELL * duration_s * (1.0 + draw.random(3))
    ramp_s = 0.5 * (duration_s - float(dwells.sum()))
    acceleration = abs(turn - start) / ramp_s
    back_s = float(dwells[0] + ramp_s + dwells[1])
    ramps = [(float(dwells[0]), turn), (back_s, start)]
    return {
        'initial_rad_s': start,
        'ramps': [
            {'at_s': at_s, 'to_rad_s': to, 'acceleration_rad_s2': acceleration}
            for at_s, to in ramps
        ],
    }


def _steps(
    nominal: float, duration_s: float, table: SpeedDraws, draw: np.random.Generator
) -> dict[str, Any]:
    """Return ramps of the governor to drawn levels."""
    level = nominal * float(draw.uniform(*table.steps))
    course: dict[str, Any] = {'initial_rad_s': level, 'ramps': []}
    free_s = 0.0
    at_s = float(draw.uniform(*table.step_every_s))
    while at_s < duration_s:
        target = nominal * float(draw.uniform(*table.steps))
        acceleration = table.governor_acceleration_rad_s2
        at_s = max(at_s, free_s)
        course['ramps'].append(
            {'at_s': at_s, 'to_rad_s': target, 'acceleration_rad_s2': acceleration}
        )
        free_s = at_s + abs(target - level) / acceleration + 1e-3
        level = target
        at_s += float(draw.uniform(*table.step_every_s))
    return course


def _held(load_factor: float, duration_s: float) -> dict[str, Any]:
    maneuver = {'profile': 'constant', 'load_factor': load_factor}
    return {'duration_s': duration_s, 'maneuver': maneuver}


def _length(segments: Segments) -> float:
    return math.fsum(segment['duration_s'] for segment in segments)
