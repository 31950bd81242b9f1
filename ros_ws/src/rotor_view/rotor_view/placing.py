# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The place of a waveform block on the time axis of the view."""

import numpy as np

from rotor_common.constants import NANOSECONDS
from rotor_common.errors import WireError
from rotor_interfaces.waveform import WaveformBlock
from vibration_monitor.block_columns import first_sample_of
from vibration_monitor.clock import whole_rate

LONGEST_BLOCK_S = 1e5

LONGEST_RUN_S = 2.0**31
"""Largest time that stamps can hold."""


def placed(block: WaveformBlock) -> WaveformBlock:
    """Return the block; raises WireError if its place on the time axis is not known."""
    first = first_sample_of(block)
    time_s = block.rows['time'].astype(np.float64)
    if not (time_s[0] >= 0.0 and time_s[-1] < LONGEST_BLOCK_S and (np.diff(time_s) > 0.0).all()):
        raise WireError('the `time` column does not count seconds upwards from the stamp')
    first_s = first / _rate_hz(block)
    if not abs(first_s) < LONGEST_RUN_S:
        raise WireError(f'sample {first} is {first_s:.3g} s into the run')
    return block


def _rate_hz(block: WaveformBlock) -> int:
    """Return the sample rate of a block in Hz, 1 for a single sample; raises WireError."""
    count = len(block.rows)
    return whole_rate(count - 1, block.step_s * (count - 1)) if count > 1 else 1


def origin_ns(block: WaveformBlock) -> int:
    """Return the stamp of sample 0, from the stamp and the sample index of a block."""
    time = block.rows['time']
    first_ns = block.stamp_ns + round(float(time[0]) * NANOSECONDS)
    if len(time) < 2:
        return first_ns
    return first_ns - round(block.first_sample * NANOSECONDS / _rate_hz(block))
