# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The shaft angle of a recording: from a constant speed, or from a tachometer."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from rotor_bringup.errors import ImportFileError

HYSTERESIS = 0.2
"""Of the range of the tacho signal: a rise counts once it has been this far below and above."""

STEADY = 1.5
"""Two neighbouring intervals of a tacho may differ by this factor, else a pulse was lost or
doubled."""

_MIN_PULSES = 3


@dataclass(frozen=True, eq=False)
class Shaft:
    """Angle in rad, rising, NaN where it is not known; lowest and highest speed in Hz."""

    angle_rad: NDArray[np.float64]
    slowest_hz: float
    fastest_hz: float
    revolutions: float
    doubtful_intervals: int = 0


def constant_speed(count: int, rate_hz: int, speed_hz: float) -> Shaft:
    """Return the angle of a constant speed, 0 at the first sample."""
    angle = 2 * math.pi * speed_hz * (np.arange(count) / rate_hz)
    return Shaft(angle, speed_hz, speed_hz, speed_hz * count / rate_hz)


def from_tacho(
    signal: NDArray[np.float64], rate_hz: int, pulses_per_revolution: int, name: str
) -> Shaft:
    """Return the angle from a tachometer: pulses, or a sine of one period a pulse.

    Each rise through the middle of the signal's range is a pulse, timed by linear interpolation
    (a sine of 20 samples a period: 2 mrad); the first is angle 0. Between pulses the angle is a
    monotone cubic (PCHIP) of time. It is NaN before the first and after the last pulse, and in
    two neighbouring intervals that differ by more than `STEADY`: there a pulse was lost or
    doubled. Behind such a place the angle is off by whole pulses.

    Raises:
        ImportFileError: fewer than 3 pulses, or samples without a number.

    """
    if not np.isfinite(signal).all():
        lost = int(np.count_nonzero(~np.isfinite(signal)))
        raise ImportFileError(f'the tacho column {name} has {lost} samples without a number')
    times = pulse_times(signal)
    if len(times) < _MIN_PULSES:
        raise ImportFileError(
            f'the tacho column {name} rises {len(times)} times through the middle of its range; '
            f'at least {_MIN_PULSES} pulses are needed'
        )
    intervals = np.diff(times)
    ratio = intervals[1:] / intervals[:-1]
    jump = (ratio > STEADY) | (ratio < 1 / STEADY)
    doubtful = np.append(jump, False) | np.append(False, jump)
    if doubtful.all():
        raise ImportFileError(
            f'the pulses of the tacho column {name} come at no steady pace anywhere; is it a tacho?'
        )
    angle = np.full(len(signal), math.nan)
    index = np.arange(len(signal))
    for first, last in _runs(~doubtful):
        inside = slice(math.ceil(times[first]), math.floor(times[last]) + 1)
        pulses = np.arange(first, last + 1)
        angle[inside] = PchipInterpolator(times[pulses], pulses)(index[inside])
    angle *= 2 * math.pi / pulses_per_revolution
    speeds_hz = rate_hz / (intervals[~doubtful] * pulses_per_revolution)
    return Shaft(
        angle,
        float(speeds_hz.min()),
        float(speeds_hz.max()),
        (len(times) - 1) / pulses_per_revolution,
        int(np.count_nonzero(doubtful)),
    )


def pulse_times(signal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the times, in samples, at which a signal rises through the middle of its range."""
    low, high = float(signal.min(initial=math.inf)), float(signal.max(initial=-math.inf))
    middle, margin = (low + high) / 2, HYSTERESIS * (high - low)
    if not margin > 0:
        return np.empty(0)
    outside = np.flatnonzero(np.abs(signal - middle) > margin)
    above = signal[outside] > middle
    risen = outside[1:][above[1:] & ~above[:-1]]
    # the last rise through the middle before the signal is safely above it
    rises = np.flatnonzero((signal[:-1] < middle) & (signal[1:] >= middle))
    before = rises[np.searchsorted(rises, risen) - 1]
    start, end = signal[before], signal[before + 1]
    times: NDArray[np.float64] = before + (middle - start) / (end - start)
    return times


def _runs(good: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return (first pulse, last pulse) of each run of good intervals."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], good, [False])).astype(np.int8)))
    return [(int(first), int(last)) for first, last in edges.reshape(-1, 2)]
