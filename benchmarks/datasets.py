# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Time the simulator alone and in a fleet of 16: the kernel, up to the block, up to the file.

    python benchmarks/datasets.py [--json FILE]

One core, CPU time of the process; each round times all in turn, ROUNDS times. The table gives the
fastest round (what the machine can do when nothing else runs on it) and the median. The last rows
are flights of the suite `standard` from start to closed and hashed file, FILE_ROUNDS times.
"""

import argparse
import json
import statistics
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import report
from rich.console import Console

from rotor_bench.dataset.suite import plan_suite
from rotor_bench.dataset.write import write_flights
from rotor_common.versions import versions
from rotor_sim import LoadGrid, RotorSimConfig, RotorSimulator
from rotor_sim.plant.integration import integrate
from rotor_sim.stream import fleet

ROUNDS = 15
FILE_ROUNDS = 3
LANES = 16
BLOCK = 2048
RATE_HZ = 10_240

Case = tuple[Callable[[], Any], float, int]
"""A call, the seconds that it simulates and its integration steps."""


def machine_of(i: int, sensors: dict[str, Any]) -> RotorSimulator:
    """Return one of 16 rotors that differ in speed, crack, its opening, clearance and forcing.

    2 steps a sample, as in the suites. Speed and crack are under way for all of the run.
    """
    return RotorSimulator(
        RotorSimConfig.from_mapping(
            {
                'settle_revolutions': 5,
                'steps_per_revolution': 200,
                'rotor': {
                    'clearance_m': 1e-6 * (i % 4),
                    'crack_stiffness_ratio': 0.01 * i,
                    'crack_half_angle_rad': 0.4 + 0.015 * i,
                },
                'speed': {
                    'initial_rad_s': 280.0 + i,
                    'highest_rad_s': 360.0,
                    'ramps': [{'at_s': 0.0, 'to_rad_s': 352.0, 'acceleration_rad_s2': 1.0}],
                },
                'crack_growth': [{'at_s': 0.0, 'to': 0.2, 'over_s': 100.0}],
                'forcing': {'amplitude_n': 5.0 * i},
                'sensors': {'imu_rate_hz': 0} | sensors,
                'seed': i,
            }
        )
    )


def flight(i: int, seconds: float) -> LoadGrid:
    """Return a load that never stands still."""
    k = np.arange(round(100 * seconds) + 2)
    return LoadGrid.from_points(
        np.column_stack([9.81 * (2.0 + np.sin(k / 50.0 + i)), np.cos(k / 33.0)])
    )


def cases(sensors: dict[str, dict[str, Any]]) -> dict[str, Case]:
    """Return what is timed, by name."""
    seconds = (ROUNDS + 2) * BLOCK / RATE_HZ
    grids = [flight(i, seconds) for i in range(LANES)]
    still = [machine_of(i, {}) for i in range(LANES)]
    plans = [one.plan(BLOCK, grid) for one, grid in zip(still, grids, strict=True)]
    steps, block_s = BLOCK * still[0].substeps, BLOCK / RATE_HZ
    found: dict[str, Case] = {
        'kernel, 1 lane': (partial(integrate, plans[:1], 1), block_s, steps),
        'kernel, 16 lanes': (partial(integrate, plans, LANES), LANES * block_s, LANES * steps),
    }
    for name, config in sensors.items():
        alone = machine_of(0, config)
        together = [machine_of(i, config) for i in range(LANES)]
        found[f'RotorSimulator.advance, {name}'] = (
            partial(alone.advance, BLOCK, grids[0]),
            block_s,
            steps,
        )
        found[f'fleet.advance, {name}'] = (
            partial(fleet.advance, together, BLOCK, grids),
            LANES * block_s,
            LANES * steps,
        )
    return found


def file_cases(folder: Path) -> dict[str, Case]:
    """Return what is timed from the start of a flight to its file in a data set."""
    machines = [machine for machine in plan_suite('standard') if machine.split == 'test']
    found: dict[str, Case] = {}
    for name, count in (('1 lane', 1), ('16 lanes', LANES)):
        flights = [machine.flights[3] for machine in machines[:count]]
        simulated_s = sum(flight.duration_s for flight in flights)
        steps = round(simulated_s * RATE_HZ) * flights[0].scenario.rotor_sim().substeps()
        found[f'data set with files, {name}'] = (
            partial(write_flights, flights, folder, versions()),
            simulated_s,
            steps,
        )
    return found


def timed_rounds(timed: dict[str, Case], rounds: int) -> dict[str, dict[str, float]]:
    """Return the numbers of every case, fastest and median of the rounds, after one to warm up."""
    for call, _, _ in timed.values():
        call()
    taken = [
        {name: report.timed(call)[0] for name, (call, _, _) in timed.items()} for _ in range(rounds)
    ]
    results = {}
    for name, (_, simulated_s, steps) in timed.items():
        seconds = [one[name] for one in taken]
        best, median = min(seconds), statistics.median(seconds)
        results[name] = {
            'ns_per_step': 1e9 * best / steps,
            'ns_per_step_median': 1e9 * median / steps,
            'times_real_time': simulated_s / best,
            'times_real_time_median': simulated_s / median,
        }
    return results


def main() -> None:
    """Print the table; with --json write it too."""
    parser = argparse.ArgumentParser(description='Time the simulator alone and in a fleet.')
    parser.add_argument('--json', type=Path, help='write the numbers to this file')
    options = parser.parse_args()
    report.use_one_core()
    results = timed_rounds(
        cases({'clean': {}, 'realistic sensors': {'preset': 'realistic'}}), ROUNDS
    )
    with tempfile.TemporaryDirectory() as folder:
        results |= timed_rounds(file_cases(Path(folder)), FILE_ROUNDS)
    rows = [['what', 'ns/step', 'median', 'x real time', 'median']] + [
        [name, *(f'{value:.0f}' for value in row.values())] for name, row in results.items()
    ]
    report.show(Console(), rows)
    if options.json is not None:
        data = {'machine': report.machine(), 'rows': results}
        options.json.write_text(json.dumps(data, indent=2) + '\n', encoding='utf-8')


if __name__ == '__main__':
    main()
