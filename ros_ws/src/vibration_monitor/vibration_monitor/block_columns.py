# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Extract checked columns from a block, whatever types its publisher used."""

import itertools
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor_common.errors import WireError
from rotor_interfaces.channels import channels_of
from rotor_interfaces.waveform import WaveformBlock
from vibration_monitor.monitor_config import MAX_CHANNELS

MAX_REVOLUTIONS = 1 << 40
"""A larger shaft angle counts as missing: float64 is too coarse there, after decades of running."""

_LARGEST_VALUE = float(np.finfo(np.float32).max)

Column = NDArray[Any]


def first_sample_of(block: WaveformBlock) -> int:
    """Return the index of the first sample; raises WireError if `time` or a sample is missing."""
    first = block.first_sample
    if 'time' not in block.columns:
        raise WireError('the block has no `time` column, so its sample rate is unknown')
    if not np.array_equal(block.rows['sample'], first + np.arange(len(block.rows))):
        raise WireError(f'the samples of the block at sample {first} do not follow one another')
    return first


def channels_to_use(block: WaveformBlock, chosen: tuple[str, ...]) -> tuple[str, ...]:
    """Return the channels of a block, or those chosen; raises WireError if they are too many."""
    channels = channels_of(block.columns, chosen)
    if len(channels) > MAX_CHANNELS:
        raise WireError(
            f'the block has {len(channels)} channels; allowed: up to {MAX_CHANNELS}; name those '
            'to use in monitor.channels'
        )
    return channels


def revolutions_of(block: WaveformBlock) -> NDArray[np.float64]:
    """Return the shaft angle in revolutions, NaN where there is none."""
    revolutions: NDArray[np.float64] = _values(block, 'angle') / (2 * math.pi)
    return np.where(np.abs(revolutions) < MAX_REVOLUTIONS, revolutions, math.nan)


def column_of(block: WaveformBlock, name: str) -> Column:
    """Return a column, NaN where it is missing or out of the range of float32."""
    column = _values(block, name)
    if column.dtype.itemsize < np.dtype(np.float64).itemsize:
        return column
    # a larger number is no measurement, and its powers would overflow
    return np.where(np.abs(column) <= _LARGEST_VALUE, column, math.nan)


def stretches(present: NDArray[np.bool_]) -> Iterator[tuple[slice, bool]]:
    """Yield each stretch of equal values of `present`, with its value."""
    cuts = (np.flatnonzero(present[1:] != present[:-1]) + 1).tolist()
    for start, stop in itertools.pairwise([0, *cuts, len(present)]):
        yield slice(start, stop), bool(present[start])


def _values(block: WaveformBlock, name: str) -> Column:
    if name not in block.columns:
        return np.full(len(block.rows), math.nan)
    column: Column = block.rows[name]
    return column
