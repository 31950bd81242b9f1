# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The order spectrum of each channel: a table, not indicators."""

import math
from dataclasses import dataclass

import numpy as np

from vibration_monitor.indicators.family import Family
from vibration_monitor.indicators.window import Array, Window
from vibration_monitor.spectrum import order_components, weighted


@dataclass(frozen=True, eq=False)
class OrderSpectrum:
    """One-sided order spectrum of each channel.

    Amplitudes are zero-to-peak in the unit of the channel (m, m/s^2), Blackman-Harris window,
    bin width 1 / window revolutions, the mean removed. `frequency_hz` is order times mean shaft
    frequency. NaN where a channel has NaN or the samples do not resolve the order.
    """

    orders: Array
    frequency_hz: Array
    amplitudes: dict[str, Array]


class Spectrum(Family):
    """One-sided amplitude spectrum of each channel over the order, on `monitor/spectrum`."""

    key = 'spectrum'
    title = 'Spectrum'
    needs = 'Equal angles (the spline of the [monitor](monitor.md)); 6 samples a cycle, else NaN.'
    fooled_by = 'What fools the vectors.'
    source = 'Fyfe and Munck, Mechanical Systems and Signal Processing 11 (1997) 187-205.'
    of = 'window'

    def compute(self, window: Window) -> list[list[float]]:
        """Store the spectrum in the window; return no values."""
        from vibration_monitor.order_tracking import highest_order

        count = window.count
        orders = np.arange(math.floor(self.config.spectrum_max_order * count) + 1) / count
        resolved = highest_order(window.revolutions)
        amplitudes = {}
        for channel, signal in zip(self.channels, window.tracked, strict=True):
            amplitudes[channel] = np.full(len(orders), math.nan)
            components = order_components(weighted(signal), count)
            found = min(len(components), int(np.searchsorted(orders, resolved, side='right')))
            amplitudes[channel][:found] = np.abs(components[:found])
        frequency_hz = orders * (window.speed_rad_s / (2 * math.pi))
        window.spectrum = OrderSpectrum(orders, frequency_hz, amplitudes)
        return [[]]
