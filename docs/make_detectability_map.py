# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Draw docs/images/detectability.png: which crack our detector finds at which speed and load.

    python docs/make_detectability_map.py [FILE.png]

One machine with realistic sensors and a misalignment at steady speed. Each flight of 40 s pulls
three times to the same load factor (1: level flight). The detector knows one healthy flight at each
speed. Prints the smallest crack that raises the alarm, and from which up all do.
"""

import copy
import itertools
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray

from maneuver_gen.load_grid import load_grid
from rotor_interfaces.waveform import WaveformBlock
from rotor_rig.scenario_model import Scenario
from rotor_sim.stream import fleet
from rotor_sim.stream.load_grid import LoadGrid
from rotor_sim.stream.simulator import RotorSimulator
from vibration_monitor.detectors.baseline import BaselineDetector

SPEEDS_RAD_S = np.array([*range(200, 460, 40), *range(460, 641, 20)], float)
PEAKS = (1.0, 2.0, 3.0, 5.0, 9.0)
CRACKS = (0.0, 0.01, 0.02, 0.03, 0.05, 0.1)
DURATION_S = 40.0
BLOCK_SAMPLES = 4096
REFERENCE = (5.0, 0.0)
LEVELS = (-0.01, 0.0, 0.005, 0.01, 0.02, 0.03, 0.05, 0.1)

Array = NDArray[np.float64]


def scenario(
    speed_rad_s: float, peak: float, crack: float, seed: int, *, misalignment_n: float = 20.0
) -> Scenario:
    """Return the flight: three pulls to `peak` between level legs."""
    legs = [(1.0, 5.0)] + [(peak, 6.0), (1.0, 5.0)] * 3
    probe = {'scale_error': 0.03, 'cross_axis': 0.02}
    runout = [{'order': order, 'amplitude_m': 5e-7, 'phase_rad': 1.0} for order in (1, 2, 3)]
    segments: list[dict[str, Any]] = [
        {'duration_s': length, 'maneuver': {'profile': 'constant', 'load_factor': load}}
        for load, length in legs
    ]
    return Scenario.from_mapping(
        {
            'name': 'map',
            'seed': seed,
            'duration_s': DURATION_S,
            'rotor': {
                'crack_stiffness_ratio': crack,
                'eccentricity_m': 1e-5,
                'clearance_m': 2e-6,
            },
            'forcing': {'amplitude_n': misalignment_n, 'phase_rad': 0.5},
            'speed': {'initial_rad_s': speed_rad_s, 'highest_rad_s': float(SPEEDS_RAD_S[-1])},
            'steps_per_revolution': 256,
            'settle_revolutions': 60,
            'maneuver': {'profile': 'sequence', 'blend_s': 2.0, 'segments': segments},
            'sensors': {
                'preset': 'realistic',
                'imu_rate_hz': 0,
                'proximity': {'disk_y': {**probe, 'runout': runout}},
            },
        }
    )


def fly(scenarios: Sequence[Scenario]) -> Iterator[list[WaveformBlock]]:
    """Yield a block of every flight at a time."""
    grids = [LoadGrid.from_points(load_grid(one.maneuver, DURATION_S)) for one in scenarios]
    simulators = [RotorSimulator(one.rotor_sim()) for one in scenarios]
    for _ in range(int(DURATION_S * scenarios[0].rate_hz) // BLOCK_SAMPLES):
        blocks = fleet.advance(simulators, BLOCK_SAMPLES, grids)
        yield [WaveformBlock(0, block.rows) for block in blocks]


def scores(speed_rad_s: float) -> Array:
    """Return the largest score of each flight at this speed, (peaks, cracks)."""
    fitted = BaselineDetector()
    reference = scenario(speed_rad_s, *REFERENCE, seed=1)
    fitted.fit([(blocks[0] for blocks in fly([reference]))])
    grid = list(itertools.product(PEAKS, CRACKS))
    detectors = [copy.deepcopy(fitted) for _ in grid]
    best = np.full(len(grid), np.nan)
    flights = [scenario(speed_rad_s, *point, seed=2 + i) for i, point in enumerate(grid)]
    for blocks in fly(flights):
        for i, (detector, block) in enumerate(zip(detectors, blocks, strict=True)):
            best[i] = np.fmax(best[i], detector.push(block).score)
    return best.reshape(len(PEAKS), len(CRACKS))


def main() -> None:
    """Compute, print and draw."""
    default = Path(__file__).parent / 'images' / 'detectability.png'
    file = Path(sys.argv[1]) if len(sys.argv) > 1 else default
    with ProcessPoolExecutor() as workers:
        found = np.array(list(workers.map(scores, SPEEDS_RAD_S.tolist())))
    limit = BaselineDetector.alarm_score
    print('smallest K from which on every crack raises the alarm')  # noqa: T201
    heads = ''.join(f'{peak:>9g} g' for peak in PEAKS)
    print(f'rad/s {heads}   highest score at K = 0')  # noqa: T201
    for speed, table in zip(SPEEDS_RAD_S, found, strict=True):
        row = f'{speed:5.0f} '
        for scores_of_peak in table:
            alarmed = scores_of_peak[1:] >= limit
            missed = np.flatnonzero(~alarmed)
            first = CRACKS[1 + (missed[-1] + 1 if len(missed) else 0)] if alarmed[-1] else np.nan
            row += f'{first:>11g}'
        print(row + f'   {table[:, 0].max():.4f}')  # noqa: T201 - a script for the page
    draw(found, limit, file)


def draw(found: Array, limit: float, file: Path) -> None:
    """Draw one panel for each peak load factor."""
    figure = Figure(figsize=(13, 4.2), layout='constrained')
    panels = figure.subplots(1, len(PEAKS), sharey=True)
    norm = BoundaryNorm(LEVELS, 256, extend='both')
    shade = None
    for place, (axes, peak) in enumerate(zip(panels, PEAKS, strict=True)):
        values = found[:, place, :].T
        shade = axes.pcolormesh(
            SPEEDS_RAD_S, np.arange(len(CRACKS)), values, norm=norm, cmap='viridis'
        )
        axes.contour(SPEEDS_RAD_S, np.arange(len(CRACKS)), values, levels=[limit], colors='red')
        axes.set_title('level flight' if peak == 1.0 else f'pulls to {peak:g} g')
        axes.set_xlabel('speed (rad/s)')
    panels[0].set_yticks(np.arange(len(CRACKS)), [f'{crack:g}' for crack in CRACKS])
    panels[0].set_ylabel('crack stiffness ratio K')
    figure.colorbar(shade, ax=panels, label='score: K is at least ...; red line: alarm')
    figure.savefig(file, dpi=110)


if __name__ == '__main__':
    main()
