# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Ratios of the super-harmonics to 1x."""

from rotor_interfaces.channels import is_acceleration
from vibration_monitor.indicators.family import OF_SOURCE, Family, Indicator
from vibration_monitor.indicators.window import Window


class Ratios(Family):
    """Amplitudes at 2x, 3x, 4x and 2.5x over that at 1x.

    The denominator is never less than a floor (`displacement_floor_m`,
    `acceleration_floor_m_s2`); where it equals the floor the ratios are no ratios to 1x.
    """

    key = 'ratios'
    title = 'Ratios'
    needs = 'What the vectors need, and unbalance that is the same before and after.'
    fooled_by = (
        'A change of unbalance; misalignment and a loose bearing, which also make 2x and 3x; '
        'speed: a super-harmonic resonance (critical speed / X) multiplies a ratio; load: the '
        'crack must open and close.'
    )
    source = (
        'Gasch, Journal of Sound and Vibration 160 (1993) 313-332 (2x and 3x as the signs of a '
        'breathing crack, and their resonances).'
    )
    is_always_on = True
    orders = (2.0, 3.0, 4.0, 2.5)
    indicators = (
        Indicator('ratio_{order}_1', '1', 'A_X / max(A_1, floor)', 'ratio'),
        Indicator('ratio_denominator', OF_SOURCE, 'max(A_1, floor), the denominator used'),
    )

    def compute(self, window: Window) -> list[list[float]]:
        """Return the ratios and their denominator."""
        config = self.config
        places = [config.orders.index(order) for order in self.orders if order in config.orders]
        first = config.orders.index(1.0)
        rows = []
        for channel, amplitudes in zip(self.sources, window.amplitudes.tolist(), strict=True):
            floor = config.displacement_floor_m
            if is_acceleration(channel):
                floor = config.acceleration_floor_m_s2
            denominator = max(amplitudes[first], floor)  # NaN stays NaN: it stands first
            rows.append([*(amplitudes[place] / denominator for place in places), denominator])
        return rows
