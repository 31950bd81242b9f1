# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Amplitude and phase of each channel at each order."""

import math

import numpy as np

from vibration_monitor.indicators.family import OF_SOURCE, Family, Indicator
from vibration_monitor.indicators.window import Array, Window


class Vectors(Family):
    """The component A cos(order angle + phase) of each channel at each order of the settings.

    The ball-pass order is `ball_pass_order`. Orders are 0.5, 1, 1.5, 2, 2.5, 3, 4, 5 by default.
    """

    key = 'vectors'
    title = 'Vectors'
    needs = (
        'The shaft angle; an order below half the samples of a revolution, less 4 bins, else NaN; '
        'for a phase an amplitude well above the noise; for the ball-pass order the geometry of '
        'the bearing.'
    )
    fooled_by = (
        'A motion that changes within the window (the vector is an average); a component closer '
        'than 4 bins (0.0625 order); noise (see [monitor](monitor.md)); what lies above half the '
        'sample rate, if the sensor has no anti-alias filter. A phase also by an angle whose zero '
        'is not the heavy spot, and by sensor delay; from a key-phasor those of the half orders '
        'can be turned by pi. The ball-pass order by a cage that slips: 1 % moves it by 0.03 = 2 '
        'bins, and the amplitude drops.'
    )
    source = (
        'Fyfe and Munck, Mechanical Systems and Signal Processing 11 (1997) 187-205 (orders of a '
        'shaft whose speed changes).'
    )
    is_always_on = True
    indicators = (
        Indicator(
            'amplitude_order_{order}', OF_SOURCE, 'A of x = A cos(X angle + phase)', 'amplitude'
        ),
        Indicator('phase_order_{order}', 'rad', 'phase of the same, -pi to pi', 'phase'),
        Indicator('amplitude_ball_pass', OF_SOURCE, 'A at the ball-pass order'),
        Indicator('phase_ball_pass', 'rad', 'phase at the ball-pass order'),
    )

    def compute(self, window: Window) -> Array:
        """Return amplitude and phase at each order, then at the ball-pass order."""
        count = len(self.config.orders) + 1
        amplitudes = window.amplitudes[:, :count]
        phases = np.angle(window.vectors[:, :count])
        phases[phases <= -math.pi] = math.pi
        phases[amplitudes == 0] = math.nan
        return np.stack([amplitudes, phases], axis=2).reshape(len(amplitudes), -1)
