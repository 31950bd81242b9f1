# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""What the monitor says of sound and cracked shafts over speed and size of the test signal.

Realistic sensors, a load factor of 1 that swings by so many g at 0.2 Hz, flights of 30 s: the worst
alarm of each, OK only where the monitor called the shaft sound at some time.
"""

import itertools
import sys
from collections.abc import Iterator

from rotor_bringup.display import RunState
from rotor_rig.pipeline import simulate
from rotor_rig.scenario_model import Scenario
from vibration_monitor.crack_model import PROBES

SPEEDS_RAD_S = (220.0, 300.0, 352.0, 431.0, 500.0, 540.0, 580.0, 620.0, 650.0)
SWINGS_G = (0.12, 0.2, 0.35, 0.6)
CRACK_STIFFNESS_RATIOS = (0.0, 0.05, 0.1, 0.3)


def verdict(crack: float, speed_rad_s: float, swing_g: float) -> str:
    """Return the worst alarm of a flight of 30 s."""
    swing = {'profile': 'sinusoid', 'mean': 1.0, 'amplitude': swing_g, 'frequency_hz': 0.2}
    monitor = {
        'channels': list(PROBES),
        'orders': [1, 2, 3],
        'extras': ['crack'],
        'hop_revolutions': 32,
    }
    scenario = Scenario.from_mapping(
        {
            'name': 'verdict',
            'duration_s': 30.0,
            'seed': 3,
            'rotor': {'crack_stiffness_ratio': crack},
            'speed': {'initial_rad_s': speed_rad_s},
            'maneuver': swing,
            'sensors': {'preset': 'realistic'},
            'monitor': monitor,
        }
    )
    state = RunState(scenario.duration_s)
    for step in simulate(scenario):
        for record in step.records:
            state.take_record(record, 0.0)
    return state.verdict


def rows() -> Iterator[tuple[float, float, list[str]]]:
    """Yield crack, swing in g, and the verdicts at SPEEDS_RAD_S."""
    for crack, swing in itertools.product(CRACK_STIFFNESS_RATIOS, SWINGS_G):
        yield crack, swing, [verdict(crack, speed, swing) for speed in SPEEDS_RAD_S]


def main() -> None:
    """Print a row for each crack and swing."""
    heads = ''.join(f'{speed:8g}' for speed in SPEEDS_RAD_S)
    sys.stdout.write(f'   K   swing{heads} rad/s\n')
    for crack, swing, verdicts in rows():
        cells = ''.join(f'{level:>8}' for level in verdicts)
        sys.stdout.write(f'{crack:4g}  {swing:4g} g{cells}\n')
        sys.stdout.flush()


if __name__ == '__main__':
    main()
