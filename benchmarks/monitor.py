# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""CPU time of the monitor a window and a second of data: `python benchmarks/monitor.py`."""

import math
import sys
import time
from typing import Any

import numpy as np

from rotor_interfaces.channels import CHANNEL_COLUMNS
from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock
from vibration_monitor import MonitorConfig, VibrationMonitor
from vibration_monitor.indicators import EXTRAS

RATE_HZ, SPEED_RAD_S, DURATION_S, BLOCK_SAMPLES, REPEATS = 10240, 352.0, 6, 2048, 5
FOUR = ['disk_y', 'disk_z', 'brg1_ay', 'brg1_az']
CASES: dict[str, dict[str, Any]] = {
    'vectors of 4 channels at 1, 2, 3 and ball pass': {
        'channels': FOUR,
        'orders': [1.0, 2.0, 3.0],
        'extras': [],
    },
    'vectors of 10 channels at 9 orders': {'extras': []},
    'default': {},
    **{
        f'10 channels and {extra}': {'extras': [extra], 'critical_speed_rad_s': 530.0}
        for extra in EXTRAS
    },
}


def blocks(encoder: bool) -> list[WaveformBlock]:
    """Return a steady shaft with noise on every channel."""
    rng = np.random.default_rng(1)
    index = np.arange(DURATION_S * RATE_HZ)
    angle = SPEED_RAD_S * index / RATE_HZ
    rows = np.zeros(len(index), WAVEFORM_DTYPE)
    rows['sample'], rows['angle'], rows['load_y'] = index, angle if encoder else math.nan, 9.81
    for name in CHANNEL_COLUMNS:
        rows[name] = 1e-6 * np.cos(angle) + 1e-8 * rng.standard_normal(len(index))
    offset = (angle + math.pi) % (2 * math.pi) - math.pi
    rows['keyphasor'] = 5.0 * np.exp(-((offset / 0.05) ** 2) / 2)
    result = []
    for first in range(0, len(rows), BLOCK_SAMPLES):
        part = rows[first : first + BLOCK_SAMPLES].copy()
        part['time'] = np.arange(len(part)) / RATE_HZ
        result.append(WaveformBlock(round(first * 1e9 / RATE_HZ), part))
    return result


def cost_ms(config: MonitorConfig, stream: list[WaveformBlock]) -> tuple[float, float]:
    """Return the least CPU time of some runs, a window and a second of data."""
    least, windows = math.inf, 0
    for _ in range(REPEATS):
        monitor = VibrationMonitor(config)
        start = time.process_time()
        windows = sum(len(monitor.push(block)) for block in stream)
        least = min(least, 1e3 * (time.process_time() - start))
    return least / windows, least / DURATION_S


def main() -> None:
    """Print a line a case."""
    for encoder in (True, False):
        stream = blocks(encoder)
        sys.stdout.write(f'angle from the {"encoder" if encoder else "key-phasor"}\n')
        for name, settings in CASES.items() if encoder else list(CASES.items())[:1]:
            window, second = cost_ms(MonitorConfig.from_mapping(settings), stream)
            sys.stdout.write(f'  {name:48} {window:7.2f} ms a window {second:7.2f} ms a second\n')


if __name__ == '__main__':
    main()
