# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Anonymised blocks: the columns a detector under test may see, copied into fresh memory."""

import math

import numpy as np
from numpy.typing import NDArray

from rotor_common.errors import WireError
from rotor_interfaces.messages import sample_stamp_ns
from rotor_interfaces.topics import ROTOR_FRAME
from rotor_interfaces.waveform import BY_TYPE, WAVEFORM_DTYPE, WaveformBlock

_COPIED = tuple(name for name in WAVEFORM_DTYPE.names or () if name not in ('time', 'sample'))


class Anonymiser:
    """Makes the anonymous copies of the blocks of one flight.

    A copy has the columns of WAVEFORM_DTYPE and no others, in that order and in memory of its
    own; stamps and samples count from the first block's first sample, `time` is k / rate, the
    frame is `rotor`, and every NaN is the same NaN. A column that the block lacks is NaN.
    """

    def __init__(self, rate_hz: int) -> None:
        self._rate_hz = rate_hz
        self._origin: int | None = None

    def copy(self, block: WaveformBlock) -> WaveformBlock:
        """Return the anonymous copy of the next block.

        Raises:
            WireError: no rows, no `sample` column, samples that do not follow one another, or
                a block before the flight's first.

        """
        first = block.first_sample
        count = len(block.rows)
        self._origin = first if self._origin is None else self._origin
        since = first - self._origin
        if since < 0:
            raise WireError(f'the block at sample {first} lies before the first of its flight')
        counted = np.arange(count)
        if not np.array_equal(block.rows['sample'], first + counted):
            raise WireError(f'the samples of the block at sample {first} do not follow one another')
        rows = self._listed(block)
        rows['time'] = counted / self._rate_hz
        rows['sample'] = since + counted
        for part in BY_TYPE.names or ():
            values = rows.view(BY_TYPE)[part]
            missing = np.isnan(values)
            if missing.any():
                values[missing] = math.nan  # a NaN has 51 bits that could carry information
        return WaveformBlock(sample_stamp_ns(0, since, self._rate_hz), rows, ROTOR_FRAME)

    @staticmethod
    def _listed(block: WaveformBlock) -> NDArray[np.void]:
        """Return a copy of the columns of WAVEFORM_DTYPE."""
        if block.rows.dtype == WAVEFORM_DTYPE:
            return np.array(block.rows)
        rows = np.full(len(block.rows), math.nan, WAVEFORM_DTYPE)
        for name in _COPIED:
            if name in block.columns:
                rows[name] = block.rows[name]
        return rows
