# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Rolling-bearing lines in the envelope spectrum of the accelerations."""

import math
from typing import TYPE_CHECKING

import numpy as np

from rotor_interfaces.channels import is_acceleration
from vibration_monitor.indicators.family import OF_SOURCE, Family, Indicator
from vibration_monitor.indicators.window import Array, Window

if TYPE_CHECKING:
    from vibration_monitor.monitor_config import MonitorConfig

_LINES = {
    'cage': '`ball_pass_order` / `ball_count` = 0.386',
    'ball_pass_outer': '`ball_pass_order` = 3.085',
    'ball_pass_inner': '`ball_count` - `ball_pass_order` = 4.915',
}


class Envelope(Family):
    """How strongly, and how regularly, a resonance of the housing is struck.

    The envelope is that of each acceleration in the band `envelope_band_hz` (1 to 4 kHz); a line
    is the largest within 2 % of its kinematic place. This tells a bearing from a crack, whose lines
    stand at whole orders. The balls of the simulated rotor are perfect: it has
    `amplitude_ball_pass`, and hardly an envelope. See also [real data](real_data.md).
    """

    key = 'envelope'
    title = 'Envelope'
    needs = (
        "An acceleration with a band in which the bearing's strokes ring, below half the sample "
        'rate (else NaN), and a speed that changes by less than about 1 % in the window: the '
        'envelope is taken in time.'
    )
    fooled_by = (
        'Two shaft orders in the band (they beat at their distance); a wrong band; 5x beside the '
        'inner-race order 4.915.'
    )
    source = 'Randall and Antoni, Mechanical Systems and Signal Processing 25 (2011) 485-520.'
    indicators = tuple(
        indicator
        for line, order in _LINES.items()
        for indicator in (
            Indicator(f'envelope_line_{line}', OF_SOURCE, f'largest line near order {order}'),
            Indicator(
                f'envelope_prominence_{line}',
                '1',
                'its ratio to the median around it; noise alone seldom reaches 4',
            ),
        )
    )

    @classmethod
    def is_of(cls, source: str) -> bool:
        """Say whether it is computed for this channel."""
        return is_acceleration(source)

    @classmethod
    def refusal(cls, config: 'MonitorConfig') -> str:
        """Return why these settings rule it out, '' where they do not."""
        if config.ball_pass_order < config.ball_count:
            return ''
        return (
            f'ball_pass_order = {config.ball_pass_order:g} is not below ball_count = '
            f'{config.ball_count}; a cage turns slower than the shaft'
        )

    def compute(self, window: Window) -> list[list[float]]:
        """Return amplitude and prominence of the lines of each acceleration."""
        return [self._lines(window, window.samples[channel]) for channel in self.sources]

    def _lines(self, window: Window, signal: Array) -> list[float]:
        from vibration_monitor.envelope import envelope_spectrum, is_resolved

        band_hz = self.config.envelope_band_hz
        if np.isnan(signal[0]) or not is_resolved(band_hz, len(signal), window.rate_hz):
            return [math.nan] * len(self.indicators)
        spectrum = envelope_spectrum(signal, window.rate_hz, band_hz)
        balls, outer = self.config.ball_count, self.config.ball_pass_order
        values = []
        for order in (outer / balls, outer, balls - outer):
            line = spectrum.line_near(order * window.speed_rad_s / (2 * math.pi))
            values += [line.amplitude, line.prominence]
        return values
