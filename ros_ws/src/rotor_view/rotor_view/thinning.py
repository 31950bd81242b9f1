# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Reduce a long waveform for a screenshot: newest rows, and min and max before."""

import numpy as np
from numpy.typing import NDArray

from rotor_common.constants import NANOSECONDS

KEPT_S = 2.0
"""Newest flight time that stays complete: several revolutions for the orbit, 0.1 s for curves."""

BIN_S = 0.1
"""Rows before that are given by their least and largest values in bins of this length."""

Rows = tuple[NDArray[np.int64], NDArray[np.void]]
"""Flight times in ns, shape (rows,), and the rows of the waveform."""


class NewestRows:
    """Holds the newest rows; hands out the envelope of those that have grown old."""

    def __init__(self) -> None:
        self._held: Rows | None = None

    def push(self, offsets_ns: NDArray[np.int64], rows: NDArray[np.void]) -> list[Rows]:
        """Take the next rows; return the envelopes of the rows that are no longer held."""
        old = []
        if self._held is not None:
            if self._held[1].dtype == rows.dtype:
                offsets_ns = np.concatenate([self._held[0], offsets_ns])
                rows = np.concatenate([self._held[1], rows])
            else:
                old.append(envelope(*self._held))
        cut = int(np.searchsorted(offsets_ns, offsets_ns[-1] - round(KEPT_S * NANOSECONDS)))
        if cut:
            old.append(envelope(offsets_ns[:cut], rows[:cut]))
        self._held = offsets_ns[cut:].copy(), rows[cut:].copy()
        return old

    def take(self) -> Rows | None:
        """Return the rows held and hold none."""
        held, self._held = self._held, None
        return held


def envelope(offsets_ns: NDArray[np.int64], rows: NDArray[np.void]) -> Rows:
    """Return two rows for each BIN_S: the least, then the largest value of every column.

    The time of both is that of the first row of the bin; NaN only where a whole bin is NaN.
    """
    bins = offsets_ns // round(BIN_S * NANOSECONDS)
    starts = np.concatenate([[0], np.flatnonzero(np.diff(bins)) + 1])
    thin = np.empty(2 * len(starts), rows.dtype)
    for name in rows.dtype.names or ():
        thin[name][0::2] = np.fmin.reduceat(rows[name], starts)
        thin[name][1::2] = np.fmax.reduceat(rows[name], starts)
    return np.repeat(offsets_ns[starts], 2), thin
