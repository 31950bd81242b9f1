# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Sample rate and time stamps of a block stream."""

import numpy as np
from numpy.typing import NDArray

from rotor_common.constants import NANOSECONDS
from rotor_common.errors import WireError
from rotor_interfaces.messages import sample_stamp_ns

FASTEST_HZ = NANOSECONDS
"""Highest sample rate that the stamps resolve."""

_LARGEST_STAMP_S = (1 << 31) - 10_000_000
"""ROS counts seconds to 2^31; 115 days less leave room for the stamps of windows and alarms."""


class BlockClock:
    """Sample rate and stamps of a run, from the blocks' stamps and time column."""

    def __init__(self) -> None:
        self._rate_hz: int | None = None
        self._origin: tuple[int, int] | None = None
        self._latest = (0, 0)

    def take(self, first_sample: int, stamp_ns: int, time: NDArray[np.float64]) -> None:
        """Note a block: its first sample, its stamp, and its time column in s after the stamp.

        Raises:
            WireError: its time does not rise, or is out of the range of a stamp.

        """
        rate_hz = own_rate(stamp_ns, time)
        latest = (first_sample, stamp_ns + round(float(time[0]) * NANOSECONDS))
        if rate_hz is None and self._rate_hz is None and self._origin is not None:
            # blocks of one sample: the rate comes from their stamps
            sample, origin_ns = self._origin
            try:
                whole_rate(first_sample - sample, (latest[1] - origin_ns) / NANOSECONDS)
            except WireError:
                self._origin = latest  # else one wrong stamp would make every later block refused
                raise
        self._latest = latest
        self._origin = self._origin or latest
        self._rate_hz = self._rate_hz or rate_hz

    def rate_hz(self) -> int:
        """Return the sample rate, a whole number of Hz."""
        if self._rate_hz is None:
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


def own_rate(stamp_ns: int, time: NDArray[np.float64]) -> int | None:
    """Return the sample rate of one block in Hz, None if it holds one sample.

    Raises:
        WireError: its time does not rise, or is out of the range of a stamp.

    """
    start_s, end_s = float(time[0]), float(time[-1])
    rate_hz = whole_rate(len(time) - 1, end_s - start_s) if len(time) > 1 else None
    if not abs(stamp_ns / NANOSECONDS + start_s) < _LARGEST_STAMP_S:
        raise WireError(
            f'time = {start_s:g} after a stamp of {stamp_ns / NANOSECONDS:.0f} s is out of '
            f'range; allowed: up to {_LARGEST_STAMP_S} s'
        )
    return rate_hz


def whole_rate(samples: int, duration_s: float) -> int:
    """Return the sample rate in Hz; raises WireError if time does not rise or the rate is high."""
    rate_hz = samples / duration_s if duration_s > 0 else 0.0
    if not 0.5 < rate_hz <= FASTEST_HZ:
        raise WireError(
            f'{samples} samples take {duration_s:g} s by the time column or the stamps; '
            f'time must rise, by 1 to {FASTEST_HZ} samples a second'
        )
    return round(rate_hz)
