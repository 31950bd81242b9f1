# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Sensor effects: white noise, key-phasor, and the decimated accelerometer of an IMU.

Each output is a function of absolute sample indices, so that every split into blocks gives the
same bits. Only +, -, x, /, square roots and scalar library code are used on blocks.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

KEYPHASOR_VOLT = 5.0
KEYPHASOR_WIDTH_RAD = math.radians(12.0)

_STOPBAND_DB = 80.0
_PASS_EDGE = 0.35
_STOP_EDGE = 0.5
"""Edges of the IMU's anti-alias filter as parts of its rate."""


def white_noise(seed: int, channel: int, first_sample: int, count: int) -> Array:
    """Return standard normal numbers (count,), a function of (seed, channel, sample) alone.

    Philox 4x64 (Salmon et al. 2011) keyed by seed and channel, counted by the sample, through the
    inverse of the normal distribution.
    """
    from scipy.special import ndtri  # noqa: PLC0415 - slow to import

    key = np.array([seed, channel], np.uint64)
    words, skip = divmod(first_sample, 4)  # a count of Philox makes four words
    raw = np.random.Philox(key=key, counter=words).random_raw(skip + count)[skip:]
    uniform = ((raw >> np.uint64(11)).astype(np.float64) + 0.5) * 2.0**-53
    return np.asarray(ndtri(uniform), np.float64)


def keyphasor(angle_rad: Array) -> Array:
    """Return the key-phasor's voltage: a smooth pulse of 5 V, 12 degrees wide, at angle 0.

    `angle_rad` is the shaft's angle in [0, 2 pi]; there is one pulse per revolution.
    """
    offset = np.where(angle_rad > np.pi, angle_rad - 2.0 * np.pi, angle_rad)
    inside = 1.0 - (offset / (0.5 * KEYPHASOR_WIDTH_RAD)) ** 2
    pulse = np.maximum(inside, 0.0)
    return np.asarray(KEYPHASOR_VOLT * pulse * pulse)


@dataclass(frozen=True)
class ImuSample:
    """Specific force at time index/imu_rate in frame `rotor`, m/s^2, gravity included (REP-145)."""

    index: int
    specific_force_y_m_s2: float
    specific_force_z_m_s2: float


class ImuDecimator:
    """Anti-alias filter and resampler from `rate_hz` to `imu_rate_hz`, any rational ratio.

    A linear-phase Kaiser-windowed sinc (80 dB from half the IMU rate on) is evaluated around the
    exact time m/imu_rate of each output, so there is no delay in the stamps; an output appears
    when the samples of half the filter's length behind it have come, the first one when the
    filter lies fully after sample 0.
    """

    def __init__(self, rate_hz: int, imu_rate_hz: int) -> None:
        self._ratio = Fraction(rate_hz, imu_rate_hz)
        cutoff = 0.5 * (_PASS_EDGE + _STOP_EDGE) * imu_rate_hz / rate_hz
        transition = 2.0 * math.pi * (_STOP_EDGE - _PASS_EDGE) * imu_rate_hz / rate_hz
        # Kaiser 1974; a few taps more for the fractional centre
        self._half = math.ceil((_STOPBAND_DB - 7.95) / (2.285 * transition) / 2.0) + 2
        self._beta = 0.1102 * (_STOPBAND_DB + 5.0 - 8.7)
        self._cutoff = cutoff
        self._taps: dict[Fraction, Array] = {}
        self._kept: list[Array] = []
        self._first = 0
        self._next = math.ceil(self._half / self._ratio)

    def push(self, channels: Sequence[Array]) -> list[tuple[int, list[float]]]:
        """Take the next samples of all channels; return (index, values) of what is complete."""
        if self._kept:
            self._kept = [np.concatenate([a, b]) for a, b in zip(self._kept, channels, strict=True)]
        else:
            self._kept = [np.array(c, np.float64) for c in channels]
        end = self._first + len(self._kept[0])
        done = []
        while True:
            centre = self._next * self._ratio
            start = math.floor(centre) - self._half + 1
            stop = start + 2 * self._half
            if stop > end:
                break
            taps = self._filter(centre - math.floor(centre))
            part = slice(start - self._first, stop - self._first)
            done.append((self._next, [float((taps * c[part]).sum()) for c in self._kept]))
            self._next += 1
        drop = max(math.floor(self._next * self._ratio) - self._half + 1 - self._first, 0)
        drop = min(drop, len(self._kept[0]))
        self._kept = [c[drop:] for c in self._kept]
        self._first += drop
        return done

    def _filter(self, fraction: Fraction) -> Array:
        if fraction not in self._taps:
            distance = np.arange(1 - self._half, self._half + 1) - float(fraction)
            window = np.i0(
                self._beta * np.sqrt(np.maximum(1.0 - (distance / self._half) ** 2, 0.0))
            )
            taps = np.sinc(2.0 * self._cutoff * distance) * window
            self._taps[fraction] = taps / taps.sum()
        return self._taps[fraction]
