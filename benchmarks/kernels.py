# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Time the ensemble kernel against a straightforward C kernel of the same equations.

    python benchmarks/kernels.py [--json FILE] [--markdown FILE]

The C kernel (peer.c) is compiled here with gcc -O3 -march=native -ffast-math. One core; each row
times peer and ours in turn, PAIRS times, and gives the median of the ratios, which is what may be
compared: the nanoseconds are those of the machine at that moment. The states of all the code that
is timed are compared first.
"""

import argparse
import ctypes
import json
import math
import shutil
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import report
from c_peer import BALLS_MAX, FLAGS, Rotor, c_compiler, c_library
from rich.console import Console
from rich.table import Table

from rotor_dynamics import Ensemble, OperatingPoint
from rotor_dynamics.ensemble import fixed_start
from rotor_sim import RotorParameters

PAIRS = 5
STEPS = 256
SPEED_RAD_S = 352.0
LOAD_FACTOR = 3.0
REVOLUTIONS = 400
AGREEMENT = 1e-8
LANES = 16

CASES: dict[str, dict[str, Any]] = {
    'paper: 8 balls, alpha 30 degrees, clearance 0': {},
    'clearance 5 um': {'clearance_m': 5e-6},
    'alpha 50 degrees': {'crack_half_angle_rad': math.radians(50.0)},
    '9 balls': {'ball_count': 9},
    '9 balls, alpha 50 degrees, clearance 5 um': {
        'ball_count': 9,
        'crack_half_angle_rad': math.radians(50.0),
        'clearance_m': 5e-6,
    },
}

COLUMNS = ('rotor', 'C, ns/step', 'ensemble', 'C/ensemble', 'single', 'C/single', 'with tangent')


class Peer:
    """The C kernel with one trajectory at the benchmark's operating point."""

    def __init__(self, p: RotorParameters) -> None:
        angles = 2.0 * np.pi * np.arange(p.ball_count) / p.ball_count
        self._advance = c_library().advance
        self._rotor = Rotor(
            *(p.disk_mass_kg, p.bearing_mass_kg, p.shaft_stiffness_n_m, p.damping_ratio),
            *(p.crack_stiffness_ratio, p.crack_angle_rad, p.crack_half_angle_rad),
            *(p.clearance_m, p.eccentricity_m, p.contact_stiffness_n_m15, p.cage_ratio),
            *(SPEED_RAD_S, LOAD_FACTOR * 9.81, p.ball_count),
            (ctypes.c_double * BALLS_MAX)(*np.cos(angles)),
            (ctypes.c_double * BALLS_MAX)(*np.sin(angles)),
        )
        self.state = fixed_start(p)
        self._done = 0

    def advance(self, revolutions: int) -> None:
        """Go on by whole revolutions."""
        steps = revolutions * STEPS
        self._advance(
            ctypes.byref(self._rotor),
            self.state.ctypes.data_as(ctypes.POINTER(ctypes.c_double)),
            ctypes.c_long(self._done),
            ctypes.c_long(steps),
            ctypes.c_double(2.0 * math.pi / (SPEED_RAD_S * STEPS)),
        )
        self._done += steps


def seconds(call: Callable[[], Any]) -> float:
    """Return how long one call takes."""
    begin = time.perf_counter()
    call()
    return time.perf_counter() - begin


def agreement_of(peer: Peer, single: Ensemble) -> float:
    """Go on by 20 revolutions; return the largest difference of a state from C, dimensionless.

    Equal points in all lanes go half of the way with tangents, which is code of its own.
    """
    (point,) = single.points
    lanes = Ensemble([point] * LANES, STEPS)
    peer.advance(20)
    single.advance(20)
    lanes.advance(10)
    lanes.advance_tangents(np.ones((LANES, 12)), 10)
    scale = point.parameters.length_scale_m * np.repeat([1.0, SPEED_RAD_S], 6)
    states = np.concatenate([single.states, lanes.states])
    return float(np.max(np.abs(states - peer.state) / scale))


def compare(changes: dict[str, Any]) -> dict[str, Any]:
    """Time one rotor: peer, ensemble of 64, single trajectory, and the ensemble's tangents."""
    parameters = RotorParameters.hou2016('derived', **changes)
    point = OperatingPoint(parameters, SPEED_RAD_S, LOAD_FACTOR)
    # the ensemble's lanes differ in speed, load and crack, as in a sweep
    crowd = [
        OperatingPoint(
            RotorParameters.hou2016('derived', **(changes | {'crack_stiffness_ratio': 0.004 * i})),
            300.0 + 2.0 * i,
            0.1 * i,
        )
        for i in range(64)
    ]
    peer, ensemble, single = (
        Peer(parameters),
        Ensemble(crowd, STEPS),
        Ensemble([point], STEPS),
    )
    tangents = np.ones((len(crowd), 12))
    agreement = agreement_of(peer, single)
    if not agreement <= AGREEMENT:
        raise SystemExit(f'{changes}: the peer differs by {agreement:g}; nothing to compare')

    per_step = 1e9 / (REVOLUTIONS * STEPS)
    rows = [
        (
            seconds(lambda: peer.advance(REVOLUTIONS)) * per_step,
            seconds(lambda: ensemble.advance(REVOLUTIONS // 10)) * per_step * 10 / len(crowd),
            seconds(lambda: single.advance(REVOLUTIONS)) * per_step,
            seconds(lambda: ensemble.advance_tangents(tangents, REVOLUTIONS // 20))
            * (per_step * 20 / len(crowd)),
        )
        for _ in range(PAIRS)
    ]
    c, many, one, tangent = (statistics.median(column) for column in zip(*rows, strict=True))
    return {
        'peer_ns': c,
        'ensemble_ns': many,
        'single_ns': one,
        'tangent_ns': tangent,
        'ensemble_ratio': statistics.median(row[0] / row[1] for row in rows),
        'single_ratio': statistics.median(row[0] / row[2] for row in rows),
        'agreement': agreement,
    }


def main() -> None:
    """Print the table; with --json write it too."""
    parser = argparse.ArgumentParser(description='Time the kernels against C.')
    parser.add_argument('--json', type=Path, help='write the numbers to this file')
    parser.add_argument('--markdown', type=Path, help='replace the table in this page')
    options = parser.parse_args()
    if shutil.which('gcc') is None:
        parser.exit(2, 'gcc is not on PATH; install it, since the kernel in C is compiled here\n')
    report.use_one_core()
    results = {name: compare(changes) for name, changes in CASES.items()}
    rows = [
        (
            name,
            f'{row["peer_ns"]:.0f}',
            f'{row["ensemble_ns"]:.0f}',
            f'{row["ensemble_ratio"]:.1f}',
            f'{row["single_ns"]:.0f}',
            f'{row["single_ratio"]:.1f}',
            f'{row["tangent_ns"]:.0f}',
        )
        for name, row in results.items()
    ]
    table = Table(
        *COLUMNS, title=f'ns a step and trajectory; median of {PAIRS} alternations, one core'
    )
    for row in rows:
        table.add_row(*row)
    Console().print(table)
    if options.markdown is not None:
        report.write_markdown(options.markdown, 'kernels.py', [COLUMNS, *rows])
    if options.json is not None:
        data = {
            'machine': report.machine(),
            'gcc': c_compiler(),
            'gcc_flags': ' '.join(FLAGS),
            'rows': results,
        }
        options.json.write_text(json.dumps(data, indent=2) + '\n', encoding='utf-8')


if __name__ == '__main__':
    main()
