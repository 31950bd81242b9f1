# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Agreement of N of the last M windows."""

import math
from collections import deque


class Persistence:
    """The level that `required` of the last `out_of` values reach, and one they do not exceed.

    `reached` is at or above a limit exactly while `required` values are, `undercut` below a limit
    exactly while `required` are; both are NaN while fewer than `required` are numbers. A NaN counts
    neither for nor against.
    """

    def __init__(self, required: int, out_of: int) -> None:
        self._required = required
        self.values: deque[float] = deque(maxlen=out_of)
        self.numbers: list[float] = []
        """Those of the last values that are numbers, oldest first."""
        self.reached = self.undercut = math.nan

    def update(self, value: float) -> float:
        """Take the next value; return the level that is reached."""
        self.values.append(value)
        self.numbers = [value for value in self.values if not math.isnan(value)]
        rising = sorted(self.numbers)
        self.reached = self.undercut = math.nan
        if len(rising) >= self._required:
            self.reached, self.undercut = rising[-self._required], rising[self._required - 1]
        return self.reached
