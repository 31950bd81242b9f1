# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The shaft angle of a recording, from a constant speed or a tachometer.

`vibration_monitor.keyphasor` does the same for one clean pulse a revolution, sample by sample as it
comes. Here the whole record is at hand, so that sines, several pulses a revolution and falling
edges can be read, and a lost pulse is seen from both sides; the two share no step.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from rotor_common.constants import MIN_SAMPLES_PER_CYCLE
from rotor_recording.errors import ImportFileError

HYSTERESIS = 0.2
"""As part of the tacho's range: a pulse rises from this far below the middle to as far above."""

STEADY = 1.5
"""Two neighbouring intervals of a tacho may differ by this factor, else a pulse was lost or
doubled."""

_MIN_PULSES = 3

_ENOUGH = 0.95
"""Share of the samples with an angle, or of the intervals that are steady."""

_STILL = 0.05
"""As part of the largest range: where the range is smaller, the shaft stands still."""

_PROPORTIONAL = 4.0
"""A pick-up's pulse height over pulse rate may vary by this factor; it drops at high speed."""

_SHORTEST_REACH = 32


@dataclass(frozen=True, eq=False)
class Shaft:
    """Angle in rad, rising, NaN where it is not known; lowest and highest speed in Hz."""

    angle_rad: NDArray[np.float64]
    slowest_hz: float
    fastest_hz: float
    revolutions: float
    doubtful_intervals: int = 0
    follows_height: bool = False


def constant_speed(count: int, rate_hz: int, speed_hz: float) -> Shaft:
    """Return the angle of a constant speed, 0 at the first sample."""
    angle = 2 * math.pi * speed_hz * (np.arange(count) / rate_hz)
    return Shaft(angle, speed_hz, speed_hz, speed_hz * count / rate_hz)


def from_tacho(
    signal: NDArray[np.float64], rate_hz: int, pulses_per_revolution: int, name: str
) -> Shaft:
    """Return the angle from a tachometer: pulses, or a sine of one period a pulse.

    Each rise through the middle of the signal's range is a pulse, timed by linear interpolation
    (a sine of 20 samples a period: 2 mrad), or each fall where falls are more than twice as steep;
    the first is angle 0. If that leaves a twentieth of the samples without angle, the range of the
    surrounding samples is used, provided that the pulse height then follows the pulse rate, as
    with a magnetic pick-up. Between pulses the angle is a monotone cubic (PCHIP) of time. It is NaN
    before the first and after the last pulse, and in two neighbouring intervals that differ by
    more than `STEADY`: there a pulse was lost or doubled. After such a place the angle is off by
    whole pulses.

    Raises:
        ImportFileError: fewer than 3 pulses, samples without a number, no steady pulse rate, or
            more than a sixth of a revolution a sample.

    """
    if not np.isfinite(signal).all():
        lost = int(np.count_nonzero(~np.isfinite(signal)))
        raise ImportFileError(f'the tacho column {name} has {lost} samples without a number')
    times, follows = _pulses(signal)
    if len(times) < _MIN_PULSES:
        raise ImportFileError(
            f'the tacho column {name} passes {len(times)} times through the middle of its range; '
            f'at least {_MIN_PULSES} pulses are needed'
        )
    intervals = np.diff(times)
    doubtful = _doubtful(intervals)
    if doubtful.all():
        raise ImportFileError(
            f'the pulses of the tacho column {name} come at no steady pace anywhere; is it a tacho?'
        )
    speeds_hz = rate_hz / (intervals[~doubtful] * pulses_per_revolution)
    usual_hz, most_hz = float(np.median(speeds_hz)), rate_hz / MIN_SAMPLES_PER_CYCLE
    if usual_hz > most_hz:
        raise ImportFileError(
            f'the tacho column {name} with --pulses-per-revolution {pulses_per_revolution} gives '
            f'{usual_hz:.4g} Hz, more than a sixth of the sample rate, {most_hz:g} Hz; give the '
            'pulses of a revolution'
        )
    angle = np.full(len(signal), math.nan)
    index = np.arange(len(signal))
    for first, last in _runs(~doubtful):
        inside = slice(math.ceil(times[first]), math.floor(times[last]) + 1)
        pulses = np.arange(first, last + 1)
        angle[inside] = PchipInterpolator(times[pulses], pulses)(index[inside])
    angle *= 2 * math.pi / pulses_per_revolution
    return Shaft(
        angle,
        float(speeds_hz.min()),
        float(speeds_hz.max()),
        (len(times) - 1) / pulses_per_revolution,
        int(np.count_nonzero(doubtful)),
        follows_height=follows,
    )


def pulse_times(signal: NDArray[np.float64], reach: int | None = None) -> NDArray[np.float64]:
    """Return the times, in samples, at which a signal passes the middle of its range.

    Upwards, or downwards where falls are more than twice as steep as rises.

    Args:
        signal: finite; (samples,).
        reach: number of samples around each sample that give its range; None: all. Where the range
            is less than a twentieth of the largest, the shaft stands still.

    """
    low, high = _range(signal, reach)
    margin = HYSTERESIS * (high - low)
    if not len(signal) or not margin.max() > 0:
        return np.empty(0)
    margin[margin < _STILL * margin.max()] = math.inf
    above_middle = signal - (low + high) / 2
    outside = np.flatnonzero(np.abs(above_middle) > margin)
    steps = np.diff(np.sign(above_middle[outside]))
    lengths = np.diff(outside)
    if _median(lengths[steps < 0]) * 2 < _median(lengths[steps > 0]):
        above_middle, steps = -above_middle, -steps
    risen = outside[1:][steps > 0]
    # the last rise through the middle before the signal is safely above it
    rises = np.flatnonzero((above_middle[:-1] < 0) & (above_middle[1:] >= 0))
    before = rises[np.searchsorted(rises, risen) - 1]
    start, end = above_middle[before], above_middle[before + 1]
    times: NDArray[np.float64] = before - start / (end - start)
    return times


def _pulses(signal: NDArray[np.float64]) -> tuple[NDArray[np.float64], bool]:
    """Return the times of the pulses, and whether the threshold follows their height."""
    whole = pulse_times(signal)
    least = _samples_with_angle(whole) + (1 - _ENOUGH) * len(signal)
    best: NDArray[np.float64] | None = None
    reach = len(signal) // 2
    while least < len(signal) and reach >= _SHORTEST_REACH:
        times = pulse_times(signal, reach)
        found = _samples_with_angle(times)
        if found > least and _is_pickup(signal, times, reach):
            best, least = times, found
        reach //= 2
    return (whole, False) if best is None else (best, True)


def _is_pickup(signal: NDArray[np.float64], times: NDArray[np.float64], reach: int) -> bool:
    """Say whether the pulses are steady and their height follows their rate: noise does neither."""
    intervals = np.diff(times)
    if np.count_nonzero(_doubtful(intervals)) > (1 - _ENOUGH) * len(intervals):
        return False
    low, high = _range(signal, reach)
    heights = (high - low)[times[1:].astype(np.intp)]
    least, largest = np.quantile(heights * intervals, [0.05, 0.95])
    return bool(largest < _PROPORTIONAL * least)


def _samples_with_angle(times: NDArray[np.float64]) -> float:
    intervals = np.diff(times)
    return float(intervals[~_doubtful(intervals)].sum()) if len(times) >= _MIN_PULSES else 0.0


def _doubtful(intervals: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which intervals differ from a neighbour by more than `STEADY`."""
    ratio = intervals[1:] / intervals[:-1]
    jump = (ratio > STEADY) | (ratio < 1 / STEADY)
    doubtful: NDArray[np.bool_] = np.append(jump, False) | np.append(False, jump)
    return doubtful


def _range(
    signal: NDArray[np.float64], reach: int | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lowest and the highest value around each sample."""
    if reach is None:
        low, high = signal.min(initial=math.inf), signal.max(initial=-math.inf)
        return np.full(len(signal), low), np.full(len(signal), high)
    return minimum_filter1d(signal, reach), maximum_filter1d(signal, reach)


def _median(lengths: NDArray[np.intp]) -> float:
    return float(np.median(lengths)) if len(lengths) else math.inf


def _runs(good: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return (first pulse, last pulse) of each run of good intervals."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], good, [False])).astype(np.int8)))
    return [(int(first), int(last)) for first, last in edges.reshape(-1, 2)]
