# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Make the flight `shipped:synthetic_record` of `maneuver_gen`: not measured, but made to look so.

Twenty minutes of an aerobatic trainer at 5 rows a second: turns, pull-ups, push-overs, loops and
level legs of drawn lengths and depths, blended; rough air on top; an accelerometer that rounds to
0.01 g, with white noise of 0.01 g, and a slip ball that follows the turns.

Usage: python docs/make_synthetic_record.py [FILE.csv]
"""

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np

from maneuver_gen import load_grid, parse_maneuver
from rotor_common.constants import GRAVITY_M_S2, LOAD_RATE_HZ

FLIGHTS = Path(__file__).parent.parent / 'ros_ws/src/maneuver_gen/maneuver_gen/flights'
DEFAULT_FILE = FLIGHTS / 'synthetic_record.csv'
DURATION_S = 1200.0
ROWS_PER_S = 5
SEED = 20260101
NOISE = 0.01
"""Standard deviation of the accelerometer's noise, in load factors."""

Segment = dict[str, Any]


def held(load_factor: float, duration_s: float) -> Segment:
    """Return a segment at one load factor."""
    maneuver = {'profile': 'constant', 'load_factor': load_factor}
    return {'duration_s': duration_s, 'maneuver': maneuver}


def turn(draw: np.random.Generator) -> list[Segment]:
    """Return a turn with 30 to 75 degrees of bank and a little slip."""
    turn_s = draw.uniform(8.0, 25.0)
    maneuver = {
        'profile': 'turn',
        'bank_rad': math.radians(draw.uniform(30.0, 75.0)) * draw.choice((-1.0, 1.0)),
        'level_s': 0.0,
        'roll_s': 2.0,
        'turn_s': turn_s,
        'slip_load_factor': draw.uniform(-0.1, 0.1),
    }
    return [{'duration_s': turn_s + 4.0, 'maneuver': maneuver}]


def pull_up(draw: np.random.Generator) -> list[Segment]:
    """Return a pull-up to 2.5 to 6 g and a push-over, one time in two, to 0 to 0.6 g."""
    pull = held(draw.uniform(2.5, 6.0), draw.uniform(3.0, 7.0))
    push = held(draw.uniform(0.0, 0.6), draw.uniform(3.0, 5.0))
    return [pull, push] if draw.random() < 0.5 else [pull]


def loop(draw: np.random.Generator) -> list[Segment]:
    """Return a loop: 4 to 5 g at the bottom, about 1.5 g over the top, the same again."""
    bottom = draw.uniform(4.0, 5.0)
    return [held(bottom, 5.0), held(draw.uniform(1.2, 1.8), 6.0), held(bottom, 5.0)]


def sortie(draw: np.random.Generator) -> Segment:
    """Return the whole flight as a sequence."""
    segments: list[Segment] = [held(1.0, 10.0)]
    while sum(segment['duration_s'] for segment in segments) < DURATION_S:
        figure = draw.choice(3, p=(0.45, 0.4, 0.15))
        segments += (turn, pull_up, loop)[figure](draw)
        segments.append(held(1.0, draw.uniform(4.0, 20.0)))
    return {'profile': 'sequence', 'blend_s': 2.0, 'segments': segments}


def main(path: Path) -> None:
    """Write the record to `path`."""
    draw = np.random.Generator(np.random.Philox(SEED))
    loads = load_grid(parse_maneuver(sortie(draw)), DURATION_S)
    for rms, seed in ((0.05, 1), (0.08, 2)):
        gusts = load_grid(
            parse_maneuver({'profile': 'gusts', 'rms': rms, 'seed': seed}), DURATION_S
        )
        loads[:, 0] += gusts[:, 0] - GRAVITY_M_S2
    step = LOAD_RATE_HZ // ROWS_PER_S
    rows = int(DURATION_S) * ROWS_PER_S + 1
    factors = loads[: rows * step : step] / GRAVITY_M_S2
    factors += NOISE * draw.standard_normal(factors.shape)
    lines = ['time_s,load_factor,lateral_load_factor']
    lines += [f'{k / ROWS_PER_S:g},{n:.2f},{side:.2f}' for k, (n, side) in enumerate(factors)]
    path.write_text('\n'.join(lines).replace(',-0.00', ',0.00') + '\n', 'utf-8')


if __name__ == '__main__':
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else DEFAULT_FILE)
