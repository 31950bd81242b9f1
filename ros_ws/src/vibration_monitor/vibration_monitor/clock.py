# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Sample rate and stamps of a stream of blocks."""

import numpy as np
from numpy.typing import NDArray

from rotor_interfaces.errors import WireError
from rotor_interfaces.messages import NANOSECONDS, sample_stamp_ns


class BlockClock:
    """Sample rate and stamps of a run, from the blocks' stamps and time column."""

    def __init__(self) -> None:
        self._rate_hz: int | None = None
        self._origin: tuple[int, int] | None = None
        self._latest = (0, 0)

    def take(self, first_sample: int, stamp_ns: int, time: NDArray[np.float64]) -> None:
        """Note a block: its first sample, its stamp, and its time column in s after the stamp."""
        self._latest = (first_sample, stamp_ns + round(float(time[0]) * NANOSECONDS))
        self._origin = self._origin or self._latest
        if self._rate_hz is None and len(time) > 1:
            self._rate_hz = whole_rate(len(time) - 1, float(time[-1] - time[0]))

    def rate_hz(self) -> int:
        """Return the sample rate, a whole number of Hz."""
        if self._rate_hz is None:
            # blocks of one sample: their stamps must do
            sample, stamp_ns = self._origin or self._latest
            samples = self._latest[0] - sample
            return whole_rate(samples, (self._latest[1] - stamp_ns) / NANOSECONDS)
        return self._rate_hz

    def stamp_ns(self, sample: int) -> int:
        """Return the stamp of a sample, the same whichever block it came in."""
        first_sample, stamp_ns = self._latest
        rate_hz = self.rate_hz()
        epoch_ns = stamp_ns - sample_stamp_ns(0, first_sample, rate_hz)
        return sample_stamp_ns(epoch_ns, sample, rate_hz)


def whole_rate(samples: int, duration_s: float) -> int:
    """Return the sample rate in Hz; raises WireError where time does not rise."""
    if not duration_s > 0 or not round(samples / duration_s):
        raise WireError(
            f'{samples} samples take {duration_s:g} s by the time column or the stamps; '
            'time must rise'
        )
    return round(samples / duration_s)
