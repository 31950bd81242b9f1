# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The decimated accelerometer of an IMU."""

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_STOPBAND_DB = 80.0
_PASS_EDGE = 0.35
_STOP_EDGE = 0.5
"""Edges of the IMU's anti-alias filter as fractions of its rate."""


@dataclass(frozen=True, slots=True)
class ImuSample:
    """Specific force at time index/imu_rate in frame `rotor`, m/s^2, gravity included (REP-145)."""

    index: int
    specific_force_y_m_s2: float
    specific_force_z_m_s2: float


class ImuDecimator:
    """Anti-alias filter and resampler from `rate_hz` to `imu_rate_hz`, any rational ratio.

    A linear-phase Kaiser-windowed sinc (80 dB from half the IMU rate on) is evaluated around the
    exact time m/imu_rate of each output, so there is no delay in the stamps. An output needs the
    samples of half the filter's length before and after it, so the first one is not at 0.
    """

    def __init__(self, rate_hz: int, imu_rate_hz: int) -> None:
        self._ratio = Fraction(rate_hz, imu_rate_hz)
        cutoff = 0.5 * (_PASS_EDGE + _STOP_EDGE) * imu_rate_hz / rate_hz
        transition = 2.0 * math.pi * (_STOP_EDGE - _PASS_EDGE) * imu_rate_hz / rate_hz
        # Kaiser 1974; two more taps on each side for the fractional centre
        self._half = math.ceil((_STOPBAND_DB - 7.95) / (2.285 * transition) / 2.0) + 2
        self._beta = 0.1102 * (_STOPBAND_DB + 5.0 - 8.7)
        self._cutoff = cutoff
        self._rows: dict[int, int] = {}  # numerator of the fractional centre -> row of taps
        self._taps = np.empty((1, 2 * self._half))
        self._kept = np.empty((0, 4))
        self._size = 0
        self._first = 0
        self._next = math.ceil(self._half / self._ratio)

    def push(self, channels: Array) -> tuple[int, Array]:
        """Take the next samples (n, 4); return first index and values (m, 4) of new outputs."""
        from rotor_sim.sensors import _noiseless_kernels  # noqa: PLC0415 - numba is slow to import

        self._append(channels)
        index, starts, rows = self._next, [], []
        numerator, denominator = self._ratio.numerator, self._ratio.denominator
        end = self._first + self._size
        while True:
            whole, rest = divmod(self._next * numerator, denominator)
            start = whole - self._half + 1
            if start + 2 * self._half > end:
                break
            starts.append(start - self._first)
            rows.append(self._row(rest))
            self._next += 1
        out = np.empty((len(starts), 4))
        _noiseless_kernels.decimate(
            self._kept, self._taps, np.array(starts, np.int64), np.array(rows, np.int64), out
        )
        return index, out

    def _append(self, channels: Array) -> None:
        """Append the samples to the buffer; if it is full, move those still needed to its start."""
        count = len(channels)
        if self._size + count > len(self._kept):
            needed = self._next * self._ratio.numerator // self._ratio.denominator - self._half + 1
            drop = min(max(needed - self._first, 0), self._size)
            kept = self._kept[drop : self._size].copy()
            room = len(kept) + count
            if 2 * room > len(self._kept):
                self._kept = np.empty((4 * room, 4))
            self._kept[: len(kept)] = kept
            self._size = len(kept)
            self._first += drop
        self._kept[self._size : self._size + count] = channels
        self._size += count

    def _row(self, rest: int) -> int:
        if rest not in self._rows:
            row = len(self._rows)
            if row == len(self._taps):
                self._taps = np.concatenate([self._taps, np.empty_like(self._taps)])
            self._taps[row] = self._filter(rest / self._ratio.denominator)
            self._rows[rest] = row
        return self._rows[rest]

    def _filter(self, fraction: float) -> Array:
        distance = np.arange(1 - self._half, self._half + 1) - fraction
        window = np.i0(self._beta * np.sqrt(np.maximum(1.0 - (distance / self._half) ** 2, 0.0)))
        taps = np.sinc(2.0 * self._cutoff * distance) * window
        return np.asarray(taps / taps.sum(), np.float64)
