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
