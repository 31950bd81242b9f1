# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Draw docs/images/sensors.png: the truth and what the preset `realistic` says of it.

    python docs/make_sensors_figure.py [FILE.png]

`derived` with K = 0.1 at 352 rad/s in level flight: a probe over two revolutions, its density and
that of an accelerometer on the journal and on its housing.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy import signal

from rotor_sim import LoadGrid, RotorSimConfig, RotorSimulator
from rotor_sim.stream.simulator import SimulatedBlock

RATE_HZ, SECONDS = 10_240, 20

Array = NDArray[np.float64]


def run(preset: str) -> SimulatedBlock:
    """Return a level flight with the sensors of a preset."""
    config = RotorSimConfig.from_mapping({'seed': 1, 'sensors': {'preset': preset}})
    grid = LoadGrid.from_points(np.tile([9.81, 0.0], (SECONDS * 100 + 2, 1)))
    return RotorSimulator(config).advance(SECONDS * RATE_HZ, grid)


def density(rows: NDArray[np.void], name: str) -> tuple[Array, Array]:
    """Return frequency in Hz and the one-sided amplitude density of a column."""
    values = rows[name].astype(np.float64)
    frequency, power = signal.welch(values, RATE_HZ, 'hann', nperseg=RATE_HZ)
    return frequency[1:], np.sqrt(power[1:])


def main() -> None:
    """Compute and draw."""
    default = Path(__file__).parent / 'images' / 'sensors.png'
    file = Path(sys.argv[1]) if len(sys.argv) > 1 else default
    bare, real = run('none'), run('realistic')
    config = RotorSimConfig.from_mapping({'sensors': {'preset': 'realistic'}}).sensors
    figure = Figure(figsize=(13, 3.8), layout='constrained')
    left, middle, right = figure.subplots(1, 3)
    shown = slice(0, 366)  # two revolutions
    time_ms = 1e3 * np.arange(366) / RATE_HZ
    for rows, label, style in ((real.rows, 'sensed', '-'), (real.truth_rows, 'truth', '--')):
        left.plot(time_ms, 1e6 * rows['disk_z'][shown], style, label=label, linewidth=1.2)
    left.set_xlabel('time, ms')
    left.set_ylabel('disk_z, um')
    left.set_title('probe: runout, scale, noise, delay')
    left.legend(fontsize='small', loc='upper right')
    for rows, label in ((real.rows, 'sensed'), (real.truth_rows, 'truth')):
        middle.loglog(*density(rows, 'disk_z'), label=label, linewidth=0.8)
    middle.axhline(
        config.proximity.noise_density, color='k', linewidth=0.8, label='stated noise density'
    )
    middle.set_ylabel('disk_z, m/sqrt(Hz)')
    middle.set_title('probe')
    middle.set_ylim(1e-13, 1e-4)
    for rows, label in (
        (bare.truth_rows, 'journal'),
        (real.rows, 'housing, sensed'),
        (real.truth_rows, 'housing, truth'),
    ):
        right.loglog(*density(rows, 'brg1_ay'), label=label, linewidth=0.8)
    right.axhline(
        config.accelerometers.noise_density, color='k', linewidth=0.8, label='stated noise density'
    )
    right.set_ylabel('brg1_ay, m/s^2/sqrt(Hz)')
    right.set_title('accelerometer')
    right.set_ylim(1e-7, 1e1)
    for axes in (middle, right):
        axes.set_xlim(4, RATE_HZ / 2)
        axes.set_xlabel('frequency, Hz')
        axes.legend(fontsize='small', loc='upper left')
    figure.savefig(file, dpi=110)


if __name__ == '__main__':
    main()
