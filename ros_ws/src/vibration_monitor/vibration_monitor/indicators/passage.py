# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Passage of a super-harmonic through resonance during a run-up or run-down.

Order n excites the shaft's bending when the speed is critical speed / n. A crack makes 2x and 3x
that a sound shaft has not: Gasch, Journal of Sound and Vibration 160 (1993) 313-332.
"""

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibration_monitor.indicators.family import OF_SOURCE, Family, Indicator
from vibration_monitor.indicators.window import Array, Window

if TYPE_CHECKING:
    from vibration_monitor.monitor_config import MonitorConfig

PASSAGE_BAND = 0.15
"""Half width of the band of speeds around critical speed / n, in parts of it."""


class Passage(Family):
    """Largest amplitude at 2x, 3x and 4x while a run-up or run-down passes their resonance.

    Order n is resonant when the speed is `critical_speed_rad_s` / n (the key has no default: the
    monitor cannot know it). While the mean speed of the windows is within 15 % of that, the largest
    amplitude is kept for each channel. The first window beyond the other end of the band carries
    it; every other window has NaN there. A shaft that turns back, a gap within the band, or a
    stream that starts or ends in it gives none.
    """

    key = 'passage'
    title = 'Passage'
    needs = (
        'A slow run-up or run-down: the vector averages over 64 revolutions, about half of them '
        'with weight, and in that time the speed should change by less than the half width of the '
        'resonance (damping ratio times its speed).'
    )
    fooled_by = (
        'A fast passage (the peak is too low and late: the shaft also needs time to respond); a '
        'load that changes within the band; a critical speed that is off by more than 15 %.'
    )
    source = 'Gasch, Journal of Sound and Vibration 160 (1993) 313-332.'
    orders = (2.0, 3.0, 4.0)
    indicators = (
        Indicator('passage_amplitude_order_{order}', OF_SOURCE, 'largest amplitude in the band'),
        Indicator('passage_speed_order_{order}', 'rad/s', 'mean speed of the window with the peak'),
    )

    @classmethod
    def refusal(cls, config: 'MonitorConfig') -> str:
        """Return why these settings rule it out, '' where they do not."""
        if config.critical_speed_rad_s is None:
            return "extras holds 'passage', which needs critical_speed_rad_s; give it"
        return ''

    def __init__(
        self, config: 'MonitorConfig', channels: tuple[str, ...], sources: tuple[str, ...]
    ) -> None:
        super().__init__(config, channels, sources)
        critical = config.critical_speed_rad_s or math.nan
        self._trackers = {
            order: PassageTracker(critical / order, len(sources))
            for order in self.orders
            if order in config.orders
        }

    def compute(self, window: Window) -> Array:
        """Return amplitude and speed of each channel's passage, order by order."""
        columns: list[Array] = []
        for order, tracker in self._trackers.items():
            if not window.follows:
                tracker.forget()
            amplitudes = window.amplitudes[:, window.orders.index(order)]
            columns += tracker.update(window.speed_rad_s, amplitudes)
        return np.array(columns).reshape(len(columns), len(self.sources)).T


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
        """Take the next window; return the result of the passage that it ends.

        Args:
            speed_rad_s: mean speed of the window.
            amplitudes: of the order, one per channel, in its unit; NaN where there is none.

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
