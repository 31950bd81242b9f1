# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The memory of what reads a recording does not grow with its length."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from live_flight import CLI

from rig_support import shared_folder
from rotor_common.constants import NANOSECONDS
from rotor_interfaces import topics
from rotor_interfaces.messages import OFFLINE, sample_stamp_ns, to_cdr
from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock, encode
from rotor_recording.recording import RecordingWriter

EPOCH_NS = 1_800_000_000 * NANOSECONDS
RATE_HZ = 10240
ROWS = 1024
SPEED_RAD_S = 1200.0
"""Fast, so that there are many windows: 12 a second."""

UNIT_S = 20
MOST_GROWTH_MB = 30
MOST_MB = {'analyze': 300, 'view': 350, 'verify': 300, 'recover': 300}
"""These recordings hold a waveform alone: a view has the monitor beside rerun, 313 to 341 MB in
all, more where the machine is busy (the same code, the same recording).

With recorded indicators, as a rig has, it loads no monitor: see the hour of docs/reliability.md.
"""


def write(path: Path, seconds: int) -> Path:
    """Write a shaft that turns steadily, with vibration at its first orders."""
    with RecordingWriter.single_file(path, config={}, compress=False) as writer:
        for first in range(0, seconds * RATE_HZ, ROWS):
            index = first + np.arange(ROWS)
            rows = np.zeros(ROWS, WAVEFORM_DTYPE)
            rows['sample'] = index
            rows['time'] = np.arange(ROWS) / RATE_HZ
            rows['angle'] = angle = SPEED_RAD_S * index / RATE_HZ
            for number, name in enumerate((WAVEFORM_DTYPE.names or ())[3:]):
                rows[name] = 1e-6 * (np.cos(angle + number) + 0.1 * np.cos(2 * angle))
            stamp_ns = sample_stamp_ns(EPOCH_NS, first, RATE_HZ)
            data = to_cdr(encode(WaveformBlock(stamp_ns, rows), OFFLINE))
            writer.write(topics.WAVEFORM, data, stamp_ns, stamp_ns)
    return path


PEAK = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""
"""Between us and the command: a process begins with the peak of the one that starts it."""


def peak_mb(*words: object) -> float:
    """Return the most memory that a command had, in MB."""
    between = [sys.executable, '-S', '-c', PEAK, *CLI, *(str(word) for word in words)]
    said = subprocess.run(between, capture_output=True, text=True, check=True)
    return int(said.stdout) / 1024


@pytest.fixture(scope='module')
def recordings(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    with shared_folder(tmp_path_factory, 'long') as (folder, is_new):
        files = {folder / f'{times}.mcap': times * UNIT_S for times in (2, 6)}
        if is_new:
            folder.mkdir()
            for file, seconds in files.items():
                write(file, seconds)
    return [*files]


@pytest.mark.slow
@pytest.mark.parametrize(
    'words',
    [
        ['analyze', '--json', '--out', 'x.json'],
        ['view', '--save', 'x.rrd'],
        ['verify'],
        ['recover', '--out', 'x'],
    ],
)
def test_the_length_of_a_recording_costs_no_memory(
    recordings: list[Path], words: list[str], tmp_path: Path
) -> None:
    peaks = []
    for number, recording in enumerate(recordings):
        verb, *options = words
        places = [tmp_path / f'{number}{word}' if word[0] == 'x' else word for word in options]
        peaks.append(peak_mb(verb, recording, *places))
    short, long = peaks
    assert long - short < MOST_GROWTH_MB, peaks
    assert long < MOST_MB[verb], peaks
