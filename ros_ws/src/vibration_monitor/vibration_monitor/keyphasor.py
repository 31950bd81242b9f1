# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The shaft angle from a key-phasor: one positive pulse per revolution, angle 0 at its centre.

Everything is decided at pulses, or at the end of chunks of fixed length counted from the first
sample, so that it does not matter in which blocks the samples came.

Source: Fyfe and Munck, Analysis of computed order tracking, Mechanical Systems and Signal
Processing 11 (1997) 187-205. They take a parabola through three pulses; here it is a cubic through
four, two before and two after, which follows a changing acceleration.
"""

import math
import statistics
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

CHUNK_SAMPLES = 1024
MAX_PERIOD_SAMPLES = 1 << 14
"""Longest period: later pulses do not belong together (4 rad/s at 10 240 Hz)."""

MAX_MISSED = 3
"""Up to this many consecutive missing pulses are bridged."""

SLACK = 0.25
"""Largest deviation of a pulse from its expected time, in parts of the expected period."""

_HISTORY = MAX_PERIOD_SAMPLES // CHUNK_SAMPLES
_ON, _OFF = 0.5, 0.3
_NOISE_RATIO = 4.0
_FIRST_PULSES = 6
_FIRST_SLACK = 0.15

Array = NDArray[np.float64]
Curve = tuple[float, float, float, float, float, float, float]
"""A cubic by time in Newton's form, see `_curve`."""

_NO_CURVE: Curve = (math.nan,) * 7


@dataclass
class PulseCounts:
    """What was wrong with the pulses; the counts only ever grow."""

    missed: int = 0
    extra: int = 0
    lost_trains: int = 0


class KeyphasorAngle:
    """Turns key-phasor samples into the shaft angle in revolutions, NaN where there is none.

    The first revolution that can be placed between two pulses before and two after starts at
    `revolution`, a whole number. An angle is known two pulses and up to a chunk later.
    """

    def __init__(self, revolution: int, counts: PulseCounts) -> None:
        self._counts = counts
        self._finder = _PulseFinder()
        self._chunk = np.empty(CHUNK_SAMPLES)
        self._filled = 0
        self._samples = 0
        self._known = 0
        """Samples whose angle has been returned."""
        self._ready: list[tuple[int, Curve]] = []
        """Number of samples and their curve, of those known and not returned."""
        self._next_turn = revolution - 1
        self._start_search()

    def push(self, volts: Array) -> Array:
        """Take the next samples in V; return the angles of the next samples that are known."""
        self._samples += len(volts)
        while len(volts):
            part = volts[: CHUNK_SAMPLES - self._filled]
            self._chunk[self._filled : self._filled + len(part)] = part
            self._filled += len(part)
            volts = volts[len(part) :]
            if self._filled == CHUNK_SAMPLES:
                self._filled = 0
                self._take_chunk()
        return self._take_ready()

    def finish(self) -> Array:
        """Return NaN for all samples whose angle has not been returned yet."""
        self._fill(self._samples)
        return self._take_ready()

    def _take_ready(self) -> Array:
        ready, self._ready = self._ready, []
        if not ready:
            return np.empty(0)
        counts = [count for count, _ in ready]
        samples = np.arange(self._known - sum(counts), self._known, dtype=np.float64)
        curves = np.array([curve for _, curve in ready])
        return _angles(samples, np.repeat(curves.T, counts, axis=1))

    def _take_chunk(self) -> None:
        for time in self._finder.find(self._chunk):
            self._take_pulse(time)
        self._look_at(self._finder.frontier)
        if self._times:
            return
        if self._queue and self._finder.frontier - self._queue[-1] > MAX_PERIOD_SAMPLES:
            self._queue.clear()
        self._fill(math.floor(self._queue[0] if self._queue else self._finder.frontier))

    def _start_search(self) -> None:
        """Forget the train of pulses; six new ones must agree before there is another."""
        self._queue: list[float] = []
        self._times: list[float] = []
        self._turns: list[int] = []
        self._period = math.nan
        self._placed = False
        self._best: float | None = None
        """A pulse at about the expected time; one still nearer may follow."""

    def _take_pulse(self, time: float) -> None:
        self._look_at(time)
        if not self._times:
            self._search(time)
            return
        turns = (time - self._times[-1]) / self._period
        expected = round(turns)
        if expected < 1 or abs(turns - expected) > SLACK:
            self._counts.extra += 1
        elif self._best is None:
            self._best = time
        else:
            self._counts.extra += 1
            before = (self._best - self._times[-1]) / self._period
            if abs(turns - expected) < abs(before - expected):
                self._best = time

    def _look_at(self, time: float) -> None:
        """Update the train of pulses, given that no other pulse comes before `time`."""
        if self._best is not None:
            expected = round((self._best - self._times[-1]) / self._period)
            if time > self._times[-1] + (expected + SLACK) * self._period:
                self._accept(self._best, expected)
        if self._times and time > self._times[-1] + (MAX_MISSED + 1 + SLACK) * self._period:
            self._counts.lost_trains += 1
            self._start_search()
            self._finder.forget_height()

    def _search(self, time: float) -> None:
        if self._queue and time - self._queue[-1] > MAX_PERIOD_SAMPLES:
            self._queue.clear()
        self._queue.append(time)
        if len(self._queue) < _FIRST_PULSES:
            return
        intervals = np.diff(self._queue)
        period = float(np.median(intervals))
        fits = np.abs(intervals / period - 1.0) <= _FIRST_SLACK
        # all but one, so that neither a second key nor noise can pass for a shaft
        if np.count_nonzero(fits) < _FIRST_PULSES - 2:
            del self._queue[0]
            return
        first = int(np.argmax(fits))
        later = self._queue[first + 1 :]
        self._times, self._turns = [self._queue[first]], [self._next_turn]
        self._queue, self._period = [], period
        for pulse in later:
            self._take_pulse(pulse)

    def _accept(self, time: float, turns: int) -> None:
        self._best = None
        self._counts.missed += turns - 1
        self._period = (time - self._times[-1]) / turns
        self._times.append(time)
        self._turns.append(self._turns[-1] + turns)
        if len(self._times) < 4:
            return
        last = math.ceil(self._times[2])
        # one sample more at the start of a train, so that its first revolution is whole
        first = math.ceil(self._times[1]) - (not self._placed)
        self._placed = True
        self._fill(first)
        self._ready.append((last - first, _curve(self._times, self._turns)))
        self._known = last
        self._next_turn = self._turns[2]
        del self._times[0], self._turns[0]

    def _fill(self, end: int) -> None:
        """Mark the samples before `end` as having no angle."""
        if end > self._known:
            self._ready.append((end - self._known, _NO_CURVE))
            self._known = end


def _curve(times: list[float], turns: list[int]) -> Curve:
    """Return the cubic through four pulses (Newton's form, from the second pulse on)."""
    t0, t1, t2, t3 = times
    r0, r1, r2, r3 = turns
    first_12, first_20, first_03 = (
        (r2 - r1) / (t2 - t1),
        (r2 - r0) / (t2 - t0),
        (r3 - r0) / (t3 - t0),
    )
    second_120 = (first_20 - first_12) / (t0 - t1)
    second_203 = (first_03 - first_20) / (t3 - t2)
    third = (second_203 - second_120) / (t3 - t1)
    return t1, t2 - t1, t0 - t1, r1, first_12, second_120, third


def _angles(samples: Array, curves: Array) -> Array:
    """Return the angle of each sample on its own curve; `curves` is (7, samples)."""
    start, to_next, to_last, turn, first, second, third = curves
    x = samples - start
    angle: Array = turn + x * (first + (x - to_next) * (second + (x - to_last) * third))
    return angle


class _PulseFinder:
    """Finds pulses and their centres, whatever their height, width and offset."""

    def __init__(self) -> None:
        self._middles: deque[float] = deque(maxlen=_HISTORY)
        self._depths: deque[float] = deque(maxlen=_HISTORY)
        self._tops: deque[float] = deque(maxlen=_HISTORY)
        self._heights: deque[float] = deque(maxlen=5)
        self._data = np.empty(0)
        self._first = 0
        """Index of the first sample in `_data`."""
        self._done = 0
        """Index of the first sample that does not belong to a pulse found already."""
        self.frontier = 0.0
        """All pulses before this sample have been found."""

    def forget_height(self) -> None:
        """Take the pulse height from the highest sample again, not from the last pulses."""
        self._heights.clear()

    def find(self, chunk: Array) -> list[float]:
        """Return the centres of the pulses that are complete with this chunk, in samples.

        A pulse goes above half the pulse height and lasts while it stays above 0.3 of it. Its
        centre is the centroid of the area over the base line, including half its width and two
        samples more on both sides.
        """
        present = np.isfinite(chunk)
        base, height = self._levels(chunk[present])
        self._data = np.concatenate((self._data, np.where(present, chunk, base)))
        over = self._data - base
        places = np.arange(len(over), dtype=np.float64)
        length = len(over)
        pulses = []
        pending = length
        found = _regions(over, _OFF * height, _ON * height) if height > 0 else []
        for index, (start, end, top) in enumerate(found):
            if self._first + start < self._done:
                continue
            beyond = (end - start) // 2 + 2
            if end + beyond > length and end - start < CHUNK_SAMPLES:
                pending = start
                break
            self._done = self._first + end
            # a pulse that was there at the first sample, or that never ends, has no centre
            if not start or end - start >= CHUNK_SAMPLES:
                continue
            before = max(start - beyond, found[index - 1][1] if index else 0)
            after = min(end + beyond, found[index + 1][0] if index + 1 < len(found) else length)
            area = over[before:after]
            centre = float((area * places[before:after]).sum() / area.sum())
            self._heights.append(top)
            pulses.append(self._first + float(min(max(centre, start), end - 1)))
        if length and over[-1] > _OFF * height > 0:
            # the start of a pulse that has not reached its height
            below = np.flatnonzero(over <= _OFF * height)
            pending = min(pending, int(below[-1]) + 1 if len(below) else 0)
        self.frontier = float(self._first + pending)
        keep = max(0, pending - CHUNK_SAMPLES)
        self._data = self._data[keep:].copy()
        self._first += keep
        return pulses

    def _levels(self, finite: Array) -> tuple[float, float]:
        """Return the base line and the height of the pulses; height 0 if there is only noise."""
        if len(finite):
            middle = _middle_of(finite)
            self._middles.append(middle)
            self._depths.append(middle - float(finite.min()))
            self._tops.append(float(finite.max()))
        if not self._middles:
            return 0.0, 0.0
        base = statistics.median(self._middles)
        if len(self._heights) == self._heights.maxlen:
            height = statistics.median(self._heights)
        else:
            height = max(self._tops) - base
        noise = statistics.median(self._depths)
        return base, height if height > _NOISE_RATIO * noise else 0.0


def _middle_of(values: Array) -> float:
    """Return the median as numpy does, without the checks that take longer than the search."""
    half = len(values) // 2
    if len(values) % 2:
        return float(np.partition(values, half)[half])
    parted = np.partition(values, (half - 1, half))
    return float((parted[half - 1] + parted[half]) / 2.0)


def _regions(values: Array, low: float, high: float) -> list[tuple[int, int, float]]:
    """Return start, end (exclusive) and top of the runs above `low` that go above `high`."""
    padded = np.zeros(len(values) + 2, np.int8)
    padded[1:-1] = values > low
    edges = np.flatnonzero(np.diff(padded))
    if not len(edges):
        return []
    # the largest value from each edge to the next: within a run, between two runs, and so on
    tops = np.maximum.reduceat(values, edges[edges < len(values)])[::2]
    runs = zip(edges[::2].tolist(), edges[1::2].tolist(), tops.tolist(), strict=True)
    return [(start, end, top) for start, end, top in runs if top >= high]
