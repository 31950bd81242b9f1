# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Draw docs/images/crack.png: why the size of 2x does not tell a crack, and its load does.

    python docs/make_crack_figure.py [FILE.png]

Three flights at 352 rad/s with pulls to 5 g and realistic sensors: a sound rotor, a sound rotor
with a strong misalignment, and a rotor with a crack of K = 0.03. Prints the estimate at the end.
"""

import sys
from pathlib import Path

import numpy as np
from make_detectability_map import fly, scenario
from matplotlib.figure import Figure
from numpy.typing import NDArray

from vibration_monitor.crack_model import PROBES, CrackWindow, equivalent_loads
from vibration_monitor.monitor import VibrationMonitor
from vibration_monitor.monitor_config import MonitorConfig

SPEED_RAD_S, PEAK = 352.0, 5.0
FLIGHTS = {
    'sound': {'crack': 0.0, 'misalignment_n': 5.0},
    'sound, misaligned': {'crack': 0.0, 'misalignment_n': 60.0},
    'K = 0.03': {'crack': 0.03, 'misalignment_n': 5.0},
}
SETTINGS = MonitorConfig(channels=PROBES, orders=(1.0, 2.0, 3.0), extras=('crack',))
RIGID = np.full(2, SETTINGS.crack.rigid_critical_speed_rad_s**2)
DAMPING = np.full(2, SETTINGS.crack.damping_ratio)
UM = 1e6

Array = NDArray[np.float64]


def measure() -> dict[str, dict[str, Array]]:
    """Return time, load factor, A2/A1, static bend, forward 2x load and the estimate of K."""
    plans = [scenario(SPEED_RAD_S, PEAK, seed=3, **flight) for flight in FLIGHTS.values()]
    monitors = [VibrationMonitor(SETTINGS) for _ in plans]
    rows: list[list[tuple[float, ...]]] = [[] for _ in plans]
    for blocks in fly(plans):
        for monitor, found, block in zip(monitors, rows, blocks, strict=True):
            for record in monitor.push(block):
                window = CrackWindow.of(record.indicators(), SETTINGS.hop_revolutions)
                loads = equivalent_loads(window, RIGID, DAMPING).loads
                bend = 2 * window.mean[0] - window.mean[2] - window.mean[4]
                found.append(
                    (
                        record.last_sample / plans[0].rate_hz,
                        record.value('load_factor'),
                        record.value('disk_z/ratio_2_1'),
                        bend * UM,
                        abs(loads[0]) * UM,
                        record.value('crack_ratio'),
                        record.value('crack_ratio_low'),
                    )
                )
    names = ('time', 'load', 'ratio', 'bend', 'q2', 'K', 'lowest')
    return {
        name: dict(zip(names, np.array(found).T, strict=True))
        for name, found in zip(FLIGHTS, rows, strict=True)
    }


def main() -> None:
    """Compute, print and draw."""
    default = Path(__file__).parent / 'images' / 'crack.png'
    file = Path(sys.argv[1]) if len(sys.argv) > 1 else default
    found = measure()
    figure = Figure(figsize=(11, 6.4), layout='constrained')
    (load, ratio), (line, estimate) = figure.subplots(2, 2)
    for i, (name, flight) in enumerate(found.items()):
        colour = f'C{i}'
        final, lowest = flight['K'][-1], flight['lowest'][-1]
        print(f'{name:18s} K = {final:.4f}, at least {lowest:.4f}')  # noqa: T201 - a script for the page
        ratio.plot(flight['time'], flight['ratio'], color=colour, label=name)
        line.plot(flight['bend'], flight['q2'], '.', color=colour, ms=4, label=name)
        estimate.plot(flight['time'], flight['K'], color=colour, label=name)
        estimate.plot(flight['time'], flight['lowest'], '--', color=colour)
    load.plot(found['sound']['time'], found['sound']['load'], color='0.3')
    load.set(title='the flight', ylabel='load factor', xlabel='time (s)')
    ratio.set(title='the textbook: A2/A1 of disk_z', ylabel='A2/A1', xlabel='time (s)')
    ratio.legend()
    line.set(
        title='equivalent load at 2x against the load',
        xlabel='static bend (um)',
        ylabel='forward q at 2x (um)',
    )
    estimate.set(
        title='crack estimate K (dashed: at least)',
        ylabel='K',
        xlabel='time (s)',
        ylim=(-0.02, 0.06),
    )
    estimate.axhline(0.0, color='0.7', lw=0.8)
    figure.savefig(file, dpi=110)


if __name__ == '__main__':
    main()
