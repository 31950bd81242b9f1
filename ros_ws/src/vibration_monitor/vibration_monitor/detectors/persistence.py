# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Agreement of N of the last M windows, as a score."""

import math
from collections import deque


class Persistence:
    """The highest level that at least `required` of the last `out_of` values reach.

    It is at or above a limit exactly while so many values are. NaN takes a place and reaches
    nothing.
    """

    def __init__(self, required: int, out_of: int) -> None:
        self._required = required
        self._values: deque[float] = deque(maxlen=out_of)

    def update(self, value: float) -> float:
        """Take the next value; return the level, NaN while fewer than `required` are numbers."""
        self._values.append(value)
        numbers = sorted((v for v in self._values if not math.isnan(v)), reverse=True)
        return numbers[self._required - 1] if len(numbers) >= self._required else math.nan
