# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A queue of consecutive samples in contiguous memory."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

_FIRST_CAPACITY = 1 << 14


class SampleBuffer:
    """Rows of float64 samples: appended at the end, dropped at the front, seldom moved."""

    def __init__(self, rows: int) -> None:
        self.first_sample = 0
        """Index of the first sample held."""
        self._data = np.empty((rows, _FIRST_CAPACITY))
        self._start = self._end = 0

    def __len__(self) -> int:
        return self._end - self._start

    @property
    def rows(self) -> NDArray[np.float64]:
        """All samples held, a view; (rows, samples)."""
        return self._data[:, self._start : self._end]

    def append(self, first_sample: int, columns: Sequence[NDArray[np.generic]]) -> None:
        """Add the next samples: one column per row, all of equal length, of any numeric type."""
        if not len(self):
            self.first_sample = first_sample
            self._start = self._end = 0
        count = len(columns[0])
        if self._end + count > self._data.shape[1]:
            self._make_room(count)
        for row, column in zip(self._data, columns, strict=True):
            row[self._end : self._end + count] = column
        self._end += count

    def drop(self, count: int) -> None:
        """Drop the first `count` samples."""
        self._start += count
        self.first_sample += count

    def clear(self) -> None:
        """Drop everything."""
        self.drop(len(self))

    def _make_room(self, count: int) -> None:
        held = self.rows
        data = self._data
        # at most half full afterwards, so that a sample is moved twice at most on average
        if 2 * (len(self) + count) > data.shape[1]:
            capacity = 1 << (2 * (len(self) + count) - 1).bit_length()
            data = np.empty((len(data), capacity))
        # the ranges may overlap; NumPy copies as if through a second array
        data[:, : len(self)] = held
        self._data, self._start, self._end = data, 0, len(self)
