# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Time the ensemble kernel against a straightforward C kernel of the same equations.

    python benchmarks/kernels.py [--json FILE] [--markdown FILE]

The C kernel (peer.c) is compiled here with gcc -O3 -march=native -ffast-math. One core; each row
times peer and ours in turn, PAIRS times, and gives the median of the ratios, which is what may be
compared: the nanoseconds are those of the machine at that moment. The states are compared first.
"""

import argparse
import ctypes
import json
import math
import os
import platform
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import report
from rich.console import Console
from rich.table import Table

from rotor_sim import RotorParameters
from rotor_sim.analysis import Ensemble, OperatingPoint
from rotor_sim.analysis.ensemble import fixed_start

PAIRS = 5
STEPS = 256
SPEED_RAD_S = 352.0
LOAD_FACTOR = 3.0
REVOLUTIONS = 400
AGREEMENT = 1e-8
BALLS_MAX = 64
FLAGS = ('-O3', '-march=native', '-ffast-math', '-shared', '-fPIC')

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


class Rotor(ctypes.Structure):
    """The struct of peer.c."""

    _fields_ = [
        *(
            (name, ctypes.c_double)
            for name in (
                *('m', 'm_b', 'k', 'damping_ratio', 'crack', 'beta', 'alpha', 'clearance', 'e'),
                *('contact', 'cage_ratio', 'speed', 'load'),
            )
        ),
        ('balls', ctypes.c_int),
        ('cos_ball', ctypes.c_double * BALLS_MAX),
        ('sin_ball', ctypes.c_double * BALLS_MAX),
    ]


def load_peer() -> ctypes.CDLL:
    """Compile peer.c for this machine and load it."""
    library = Path(tempfile.mkdtemp(prefix='rotor-rig-benchmark-')) / 'peer.so'
    source = Path(__file__).with_name('peer.c')
    subprocess.run(['gcc', *FLAGS, '-o', str(library), str(source), '-lm'], check=True)
    return ctypes.CDLL(str(library))


class Peer:
    """The C kernel with one trajectory at the benchmark's operating point."""

    def __init__(self, library: ctypes.CDLL, p: RotorParameters) -> None:
        angles = 2.0 * np.pi * np.arange(p.ball_count) / p.ball_count
        self._advance = library.advance
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


def compare(library: ctypes.CDLL, changes: dict[str, Any]) -> dict[str, Any]:
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
        Peer(library, parameters),
        Ensemble(crowd, STEPS),
        Ensemble([point], STEPS),
    )
    tangents = np.ones((len(crowd), 12))
    peer.advance(20)
    single.advance(20)
    ensemble.advance(1)
    ensemble.advance_tangents(tangents)
    scale = parameters.length_scale_m * np.repeat([1.0, SPEED_RAD_S], 6)
    agreement = float(np.max(np.abs(peer.state - single.states[0]) / scale))
    if agreement > AGREEMENT:
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
    if hasattr(os, 'sched_setaffinity'):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    library = load_peer()
    results = {name: compare(library, changes) for name, changes in CASES.items()}
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
        compiler = subprocess.run(['gcc', '--version'], capture_output=True, text=True, check=True)
        versions = {
            'machine': platform.processor() or platform.machine(),
            'cpu': next(
                line.split(':', 1)[1].strip()
                for line in Path('/proc/cpuinfo').read_text(encoding='utf-8').splitlines()
                if line.startswith('model name')
            ),
            'gcc': compiler.stdout.splitlines()[0],
            'gcc_flags': ' '.join(FLAGS[:3]),
        }
        options.json.write_text(
            json.dumps({'versions': versions, 'rows': results}, indent=2) + '\n', encoding='utf-8'
        )


if __name__ == '__main__':
    main()
