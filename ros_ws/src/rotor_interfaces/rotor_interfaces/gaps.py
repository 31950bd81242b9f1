# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Detect gaps in a block stream by the absolute sample index."""

import enum
import math
from dataclasses import dataclass, replace
from typing import NamedTuple

from rotor_common.errors import WireError

CLOCK_DRIFT = 1e-3
"""Correct clocks of stamps and samples differ by less than this share of the elapsed time."""


class Continuity(enum.Enum):
    """How a block follows the one before it."""

    FIRST = 'first'
    CONTIGUOUS = 'contiguous'
    GAP = 'gap'
    RESTART = 'restart'


class BlockTime(NamedTuple):
    """Time of a block: its stamp, its first time after the stamp, the time between samples.

    The last is NaN if the block does not say.
    """

    stamp_ns: int
    start_s: float
    step_s: float


UNTIMED = BlockTime(0, math.nan, math.nan)


@dataclass(frozen=True)
class _Place:
    """Position of a block by the index and by the clock."""

    first_sample: int
    count: int
    time: BlockTime

    @property
    def next_sample(self) -> int:
        return self.first_sample + self.count

    def with_step(self, step_s: float) -> '_Place':
        return replace(self, time=self.time._replace(step_s=step_s))

    def since_s(self, other: '_Place') -> float:
        """Return how much later than another block this one begins by the clock."""
        passed_ns = self.time.stamp_ns - other.time.stamp_ns
        return passed_ns * 1e-9 + (self.time.start_s - other.time.start_s)

    def late_s(self, newest: '_Place', sample: int) -> float:
        """Return how much later it begins than a sample is due, counted from the newest block."""
        return self.since_s(newest) - (sample - newest.first_sample) * newest.time.step_s

    def is_due(self, newest: '_Place', sample: int) -> bool:
        """Say whether it begins when a sample is due, to half a block; False if unknown."""
        samples = max(self.count, newest.count) / 2 + CLOCK_DRIFT * abs(sample - newest.next_sample)
        return abs(self.late_s(newest, sample)) <= samples * newest.time.step_s > 0


class _Pace(enum.Enum):
    """Whether the stamps of a run keep pace with its samples."""

    UNKNOWN = 'unknown'
    KEPT = 'kept'
    NOT_KEPT = 'not kept'


@dataclass
class SampleContinuity:
    """Counts what a stream of blocks lost; a jump backwards is a new run, not a loss.

    A jump that the stamps contradict is neither: if they have kept pace with the samples so far,
    the block is refused, unless it continues the one refused before, since then the source really
    counts differently. After the first block of a run it is unknown which of the two is wrong, and
    a new run begins. If the stamps have not kept pace, only the index counts.

    `next_sample` is the index that the next block should start with (None before the first),
    `blocks`, `gaps`, `lost_samples` and `restarts` only ever grow.
    """

    next_sample: int | None = None
    blocks: int = 0
    gaps: int = 0
    lost_samples: int = 0
    restarts: int = 0
    _newest: _Place | None = None
    _refused: _Place | None = None
    _pace: _Pace = _Pace.UNKNOWN

    def check(self, first_sample: int, count: int, time: BlockTime = UNTIMED) -> Continuity:
        """Take the block [first_sample, first_sample + count) and say how it follows.

        Raises:
            WireError: see `follows`; the block is not taken.

        """
        how = self.follows(first_sample, count, time)
        block, newest, expected = _Place(first_sample, count, time), self._newest, self.next_sample
        self._newest, self._refused, self.next_sample = block, None, block.next_sample
        self.blocks += 1
        if newest is None or expected is None:
            return how
        if how is Continuity.RESTART:
            self.restarts += 1
            self._pace = _Pace.UNKNOWN
            return how
        step_s = newest.time.step_s
        if how is Continuity.GAP:
            self.gaps += 1
            self.lost_samples += first_sample - expected
        else:
            if math.isnan(step_s):  # one sample, or no times: by the stamps
                step_s = block.since_s(newest) / newest.count
            is_due = block.is_due(newest.with_step(step_s), first_sample)
            self._pace = _Pace.KEPT if is_due else _Pace.NOT_KEPT
            step_s = step_s if is_due else time.step_s
        self._newest = block.with_step(step_s)
        return how

    def follows(self, first_sample: int, count: int, time: BlockTime) -> Continuity:
        """Say how a block follows those that were taken.

        Raises:
            WireError: it jumps ahead, but its stamp is not that of such a sample; or it jumps
                back, but its stamp is that of the sample that is due.

        """
        newest, expected = self._newest, self.next_sample
        if newest is None or expected is None:
            return Continuity.FIRST
        if first_sample == expected:
            return Continuity.CONTIGUOUS
        block = _Place(first_sample, count, time)
        is_ahead = first_sample > expected
        how = Continuity.GAP if is_ahead else Continuity.RESTART
        if self._pace is _Pace.NOT_KEPT or not newest.time.step_s > 0:
            return how
        is_due = block.is_due(newest, first_sample if is_ahead else expected)
        if is_due is is_ahead:
            return how
        goes_on = (
            self._refused is not None
            and first_sample == self._refused.next_sample
            and block.is_due(self._refused, first_sample)
        )
        if goes_on or self._pace is _Pace.UNKNOWN:
            return Continuity.RESTART
        self._refused = block if time.step_s > 0 else block.with_step(newest.time.step_s)
        raise WireError(
            f'sample = {first_sample} after {expected - 1} does not fit the stamp, which is '
            f'{abs(block.late_s(newest, first_sample)):.3g} s off that of such a sample'
        )


@dataclass
class FirstSource:
    """Accepts only the source that was heard first.

    While one source publishes, every block is its own, also after a jump: a replay that loops, a
    rig started again. While several do, a block must follow the newest accepted one: a later
    sample, at the time at which this sample is due by the step of that block, to half a block. For
    blocks of one sample, the step comes from the stamps of accepted ones; until it is known, the
    next sample is accepted. `other_blocks` counts those that are not accepted.
    """

    other_blocks: int = 0
    _newest: _Place | None = None

    def accepts(self, first_sample: int, count: int, time: BlockTime, *, is_alone: bool) -> bool:
        """Say whether a block is of the first source.

        Args:
            first_sample: absolute index of its first sample.
            count: number of samples.
            time: when it begins.
            is_alone: whether only one source publishes.

        """
        block, newest = _Place(first_sample, count, time), self._newest
        if newest is not None:
            is_next = first_sample == newest.next_sample
            if is_next and math.isnan(newest.time.step_s):
                newest = newest.with_step(block.since_s(newest) / newest.count)
            follows = first_sample >= newest.next_sample and block.is_due(newest, first_sample)
            if not (is_alone or follows):
                self.other_blocks += 1
                return False
            if math.isnan(time.step_s) and (follows or is_next):
                block = block.with_step(newest.time.step_s)
        self._newest = block
        return True
