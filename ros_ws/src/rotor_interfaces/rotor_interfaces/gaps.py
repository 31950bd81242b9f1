# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Continuity of a block stream, proved by the absolute sample index."""

import enum
from dataclasses import dataclass


class Continuity(enum.Enum):
    """How a block follows the one before it."""

    FIRST = 'first'
    CONTIGUOUS = 'contiguous'
    GAP = 'gap'
    RESTART = 'restart'


@dataclass
class SampleContinuity:
    """Counts what a stream of blocks lost; a jump backwards is a new run, not a loss.

    `next_sample` is the index that the next block should start with (None before the first),
    `blocks`, `gaps`, `lost_samples` and `restarts` only ever grow.
    """

    next_sample: int | None = None
    blocks: int = 0
    gaps: int = 0
    lost_samples: int = 0
    restarts: int = 0

    def check(self, first_sample: int, count: int) -> Continuity:
        """Take the block [first_sample, first_sample + count) and say how it follows."""
        expected = self.next_sample
        self.next_sample = first_sample + count
        self.blocks += 1
        if expected is None:
            return Continuity.FIRST
        if first_sample == expected:
            return Continuity.CONTIGUOUS
        if first_sample < expected:
            self.restarts += 1
            return Continuity.RESTART
        self.gaps += 1
        self.lost_samples += first_sample - expected
        return Continuity.GAP


@dataclass
class FirstSource:
    """Holds on to the source that was heard first, where a node belongs to no run.

    While one source publishes, every block is its own, also after a jump: a replay that loops, a
    rig started again. While several do, a block must follow the newest one that was accepted: a
    later sample, at the time at which this sample is due, to half a block. `other_blocks` counts
    those that do not.
    """

    other_blocks: int = 0
    _newest: tuple[int, int, int] | None = None  # stamp in ns, first sample, samples

    def accepts(
        self, stamp_ns: int, first_sample: int, count: int, *, step_s: float, is_alone: bool
    ) -> bool:
        """Say whether a block is of the first source.

        Args:
            stamp_ns: time of the first sample, ns.
            first_sample: its absolute index.
            count: number of samples.
            step_s: time from one sample to the next, s; NaN where the block does not say.
            is_alone: whether only one source publishes.

        """
        if not is_alone and self._newest is not None:
            newest_ns, newest_sample, newest_count = self._newest
            passed = first_sample - newest_sample
            late_s = (stamp_ns - newest_ns) * 1e-9 - passed * step_s
            if passed < newest_count or not abs(late_s) <= 0.5 * count * step_s:
                self.other_blocks += 1
                return False
        self._newest = (stamp_ns, first_sample, count)
        return True
