# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Quantities that are piecewise linear on the sample grid, and the exact integral of one.

Every value is a function of the absolute sample index alone: nothing is accumulated from block to
block, so no result depends on where blocks end.
"""

import bisect
import itertools
import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_TURN = Fraction('6.28318530717958647692528676655900576839433879875021')
_ANCHOR_SAMPLES = 1024
"""Angles are exact at multiples of this from a segment's start, in floating point in between."""


@dataclass(frozen=True)
class Ramp:
    """From `start_sample` (0 or later) to `target` at `rate_per_s`, or, if None, in `duration_s`.

    A duration of 0 is a step. The number of samples is rounded up, so the slope is rounded down.
    """

    start_sample: int
    target: float
    rate_per_s: float | None = None
    duration_s: float = 0.0


@dataclass(frozen=True)
class _Segment:
    start: int
    value: float
    increment: float  # per sample
    target: float


class RampSchedule:
    """An initial value, then ramps; a ramp starts from the value at its start sample.

    A later ramp ends an earlier one that is still under way; of two that start at one sample the
    one added last is used. Before the first ramp, at negative samples too, the value is initial.
    """

    def __init__(self, initial: float, rate_hz: int) -> None:
        self._rate_hz = rate_hz
        self._ramps: list[Ramp] = []
        self._segments = [_Segment(0, initial, 0.0, initial)]
        self._table()

    def add(self, ramp: Ramp) -> None:
        """Add a ramp; the values before its start never change."""
        place = bisect.bisect_right([r.start_sample for r in self._ramps], ramp.start_sample)
        self._ramps.insert(place, ramp)
        initial = self._segments[0].value
        self._segments = [_Segment(0, initial, 0.0, initial)]
        for following in self._ramps:
            self._append(following)
        self._table()

    def _append(self, ramp: Ramp) -> None:
        start = ramp.start_sample
        value = self._value_in_last(start)
        while len(self._segments) > 1 and self._segments[-1].start >= start:
            self._segments.pop()
        change = ramp.target - value
        rate = ramp.rate_per_s
        duration_s = ramp.duration_s if rate is None else abs(change) / rate
        samples = math.ceil(duration_s * self._rate_hz - 1e-6)  # not one more for rounding
        if samples and change:
            self._segments.append(_Segment(start, value, change / samples, ramp.target))
            start += samples
        self._segments.append(_Segment(start, ramp.target, 0.0, ramp.target))

    def _value_in_last(self, sample: int) -> float:
        # the last two segments are a ramp and the level that it reaches
        segment = next(s for s in reversed(self._segments) if s.start <= sample)
        return segment.value + segment.increment * (sample - segment.start)

    def _table(self) -> None:
        self._starts = [s.start for s in self._segments]
        self._origins = [(0, 0.0)]
        for before, after in itertools.pairwise(self._segments):
            turns, angle = self._exact_angle(before, self._origins[-1], after.start - before.start)
            self._origins.append((turns, angle))

    def values(self, first_sample: int, count: int) -> tuple[Array, Array]:
        """Return the value at each sample and its increment to the left limit at the next one."""
        values, increments = np.empty(count), np.empty(count)
        sample, end = first_sample, first_sample + count
        while sample < end:
            _, segment, stop = self._piece(sample, end)
            part = slice(sample - first_sample, stop - first_sample)
            increments[part] = segment.increment
            values[part] = segment.value
            if segment.increment:
                values[part] += segment.increment * np.arange(
                    sample - segment.start, stop - segment.start
                )
            sample = stop
        return values, increments

    def value(self, sample: int) -> float:
        """Return the value at one sample."""
        segment = self._segments[self._place(sample)]
        return segment.value + segment.increment * (sample - segment.start)

    def target(self, sample: int) -> float:
        """Return the target of the ramp under way at `sample`, or the level there."""
        return self._segments[self._place(sample)].target

    def highest(self) -> float:
        """Return the highest value that is ever reached."""
        return max(segment.value for segment in self._segments)

    def _place(self, sample: int) -> int:
        return max(bisect.bisect_right(self._starts, sample) - 1, 0)

    def _piece(self, sample: int, end: int) -> tuple[int, _Segment, int]:
        """Return index and segment at `sample`, and the end of the segment or of the request."""
        place = self._place(sample)
        if place + 1 < len(self._segments):
            end = min(end, self._starts[place + 1])
        return place, self._segments[place], end

    def angles(self, first_sample: int, count: int) -> tuple[NDArray[np.int64], Array]:
        """Return the integral since sample 0 of the value, taken as a speed in rad/s.

        As whole turns (negative before sample 0) and the rest in rad, in [0, 2 pi).
        """
        from rotor_sim.stream._kernels import turn  # noqa: PLC0415 - numba is slow to import

        turns = np.empty(count, np.int64)
        angles = np.empty(count)
        sample, end = first_sample, first_sample + count
        while sample < end:
            place, segment, stop = self._piece(sample, end)
            anchor = (sample - segment.start) // _ANCHOR_SAMPLES * _ANCHOR_SAMPLES
            stop = min(stop, segment.start + anchor + _ANCHOR_SAMPLES)
            whole, rest = self._exact_angle(segment, self._origins[place], anchor)
            speed = segment.value + segment.increment * anchor
            part = slice(sample - first_sample, stop - first_sample)
            turn(
                turns[part],
                angles[part],
                sample - (segment.start + anchor),
                whole,
                rest,
                speed,
                segment.increment,
                self._rate_hz,
            )
            sample = stop
        return turns, angles

    def _exact_angle(
        self, segment: _Segment, origin: tuple[int, float], samples: int
    ) -> tuple[int, float]:
        turns, angle = origin
        # in integers, since blocks ask often: total = number/denominator, without rounding
        value, value_over = segment.value.as_integer_ratio()
        increment, increment_over = segment.increment.as_integer_ratio()
        start, start_over = angle.as_integer_ratio()
        over = 2 * max(value_over, increment_over, start_over)  # all are powers of two
        twice = 2 * value * (over // value_over) + increment * (over // increment_over) * samples
        number = start * (over // start_over) * 2 * self._rate_hz + samples * twice
        denominator = 2 * over * self._rate_hz
        extra, rest = divmod(number * _TURN.denominator, denominator * _TURN.numerator)
        return turns + extra, rest / (denominator * _TURN.denominator)
