# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The error of the simulator in run-ups of 1.2 s with a changing load and a growing crack.

    python benchmarks/run_up.py [--scipy]

Largest difference, looked at every 10 ms, of the displacements (over the static deflection) and of
the velocities (over that times the speed at the start): the default of 512 steps a revolution at
the highest speed and 2048 against 8192. With
--scipy the finest is itself held against scipy's DOP853 (rtol = atol = 1e-10) for `derived`, where
f does not jump; that takes minutes. `docs/physics.md` quotes the table.
"""

import argparse

import numpy as np
from hou_equations import Drive, derivative
from numpy.typing import NDArray
from rich.console import Console
from scipy.integrate import solve_ivp

from rotor_common.constants import GRAVITY_M_S2
from rotor_sim import LoadGrid, RotorSimConfig, RotorSimulator
from rotor_sim.plant.parameters import VARIANTS

Array = NDArray[np.float64]

SECONDS = 1.2
BLOCK_S = 0.01
RATE_HZ = 10_000
REFERENCE_STEPS = 8192
STEPS = (512, 2048)
RUN_UPS = ((150.0, 300.0), (300.0, 360.0), (300.0, 540.0), (500.0, 800.0))
CRACK, GROWN = 0.1, 0.2

TIMES = np.arange(0.0, SECONDS + 0.05, BLOCK_S)
LOADS = GRAVITY_M_S2 * np.stack(
    [2.0 - np.cos(2.0 * np.pi * TIMES / SECONDS), 0.3 * np.sin(2.0 * np.pi * TIMES)], axis=1
)
"""n from 1 to 3 and back, with side load."""


def states(variant: str, first: float, last: float, steps: int) -> Array:
    """Return displacements over the static deflection and velocities over that times `first`.

    (121, 12), every 10 ms.
    """
    simulator = simulated(variant, first, last, steps)
    grid = LoadGrid.from_points(LOADS)
    simulator.prepare(grid)
    scale = scale_of(simulator, first)
    seen = [simulator.state]
    for _ in range(round(SECONDS / BLOCK_S)):
        simulator.advance(round(RATE_HZ * BLOCK_S), grid)
        seen.append(simulator.state)
    return np.array(seen) / scale


def scale_of(simulator: RotorSimulator, first: float) -> Array:
    """Return what makes a state (12,) dimensionless."""
    length = simulator.config.rotor.length_scale_m
    return np.repeat([length, length * first], 6)


def simulated(variant: str, first: float, last: float, steps: int) -> RotorSimulator:
    """Return the simulator of a run-up that takes all the time."""
    ramp = {'at_s': 0.0, 'to_rad_s': last, 'acceleration_rad_s2': (last - first) / SECONDS}
    return RotorSimulator(
        RotorSimConfig.from_mapping(
            {
                'variant': variant,
                'rotor': {'crack_stiffness_ratio': CRACK},
                'settle_revolutions': 0,  # the equilibrium, the same for every step
                'rate_hz': RATE_HZ,
                'steps_per_revolution': steps,
                'speed': {'initial_rad_s': first, 'ramps': [ramp]},
                'crack_growth': [{'at_s': 0.0, 'to': GROWN, 'over_s': SECONDS}],
            }
        )
    )


def by_scipy(first: float, last: float) -> Array:
    """Return what `states` returns, for `derived`, by DOP853."""
    simulator = simulated('derived', first, last, REFERENCE_STEPS)
    simulator.prepare(LoadGrid.from_points(LOADS))
    parameters = simulator.config.rotor
    scale = scale_of(simulator, first)
    acceleration = (last - first) / SECONDS

    def rates(time_s: float, state: Array) -> Array:
        drive = Drive(
            angle_rad=first * time_s + 0.5 * acceleration * time_s**2,
            speed_rad_s=first + acceleration * time_s,
            angular_acceleration_rad_s2=acceleration,
            load_y_m_s2=float(np.interp(time_s, TIMES, LOADS[:, 0])),
            load_z_m_s2=float(np.interp(time_s, TIMES, LOADS[:, 1])),
            crack_stiffness_ratio=CRACK + (GROWN - CRACK) * time_s / SECONDS,
        )
        return np.asarray(derivative(parameters, state * scale, drive) / scale)

    seen = [simulator.state / scale]
    for block in range(round(SECONDS / BLOCK_S)):  # the load has a kink at every 10 ms
        span = (block * BLOCK_S, (block + 1) * BLOCK_S)
        solution = solve_ivp(rates, span, seen[-1], 'DOP853', rtol=1e-10, atol=1e-10)
        seen.append(solution.y[:, -1])
    return np.array(seen)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--scipy', action='store_true', help='hold the reference against DOP853')
    arguments = parser.parse_args()
    console = Console(soft_wrap=True, highlight=False)
    console.print('variant, rad/s | displacements, velocities of', *STEPS, 'steps | reference')
    for variant in VARIANTS:
        for first, last in RUN_UPS:
            reference = states(variant, first, last, REFERENCE_STEPS)
            tried = [states(variant, first, last, steps) for steps in STEPS]
            if arguments.scipy and variant == 'derived':
                tried.append(by_scipy(first, last))
            cells = [
                ', '.join(f'{np.abs(part).max():.1e}' for part in np.hsplit(one - reference, 2))
                for one in tried
            ]
            console.print(f'{variant} {first:g} to {last:g}', *cells, sep=' | ')


if __name__ == '__main__':
    main()
