# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Passage of a super-harmonic through its resonance, in a run-up or a run-down.

Order n excites the shaft's bending when the speed is critical speed / n. A crack makes 2x and 3x
that a sound shaft has not: Gasch, Journal of Sound and Vibration 160 (1993) 313-332.
"""

import math

import numpy as np
from numpy.typing import NDArray

PASSAGE_BAND = 0.15
"""Half width of the band of speeds around critical speed / n, in parts of it."""


class PassageTracker:
    """Follows one order from one end of the band of speeds to the other."""

    def __init__(self, resonance_rad_s: float, channels: int) -> None:
        self._low = (1 - PASSAGE_BAND) * resonance_rad_s
        self._high = (1 + PASSAGE_BAND) * resonance_rad_s
        self._none = np.full(channels, math.nan)
        self.forget()

    def forget(self) -> None:
        """Start afresh: what was seen so far does not belong to what follows."""
        self._from_below: bool | None = None
        self._side: bool | None = None
        """Whether the last window outside the band lay below it."""
        self._peak = self._none.copy()
        self._speed = self._none.copy()

    def update(
        self, speed_rad_s: float, amplitudes: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Take the next window; return what a passage that it ends has shown.

        Args:
            speed_rad_s: mean speed of the window.
            amplitudes: of the order, one a channel, in its unit; NaN where there is none.

        Returns:
            Largest amplitude of each channel within the band and the mean speed of its window in
            rad/s, in the first window beyond the band; NaN in all others. A shaft that turns back
            within the band has not passed, nor has one of which no window lay in the band.

        """
        if self._low <= speed_rad_s <= self._high:
            if self._from_below is None:
                self._from_below = self._side
            larger = ~(amplitudes <= self._peak) & np.isfinite(amplitudes)
            self._peak[larger] = amplitudes[larger]
            self._speed[larger] = speed_rad_s
            return self._none, self._none
        below = speed_rad_s < self._low
        passed = self._from_below is not None and self._from_below != below
        peak, speed = self._peak, self._speed
        self.forget()
        self._side = below
        return (peak, speed) if passed else (self._none, self._none)
