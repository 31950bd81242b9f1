# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""RMS, crest factor and kurtosis of the samples."""

import math

import numpy as np

from vibration_monitor.indicators.family import OF_SOURCE, Family, Indicator
from vibration_monitor.indicators.window import Array, Window


class Statistics(Family):
    """Moments of the samples of each channel."""

    key = 'statistics'
    title = 'Statistics'
    needs = 'Nothing but samples; neither angle nor speed.'
    fooled_by = (
        'A load that changes in the window: the static deflection drifts, adds to the RMS and '
        'lowers the crest factor. RMS also by the ball-pass order, kurtosis by modulation, crest '
        'factor and kurtosis by one bad sample.'
    )
    source = 'Dyer and Stewart, Journal of Mechanical Design 100 (1978) 229-235.'
    indicators = (
        Indicator('rms', OF_SOURCE, 'sqrt(mean((x - mean)^2)) of the samples'),
        Indicator('crest_factor', '1', 'max abs(x - mean) / rms'),
        Indicator('kurtosis', '1', 'mean((x - mean)^4) / rms^4; noise 3, sine 1.5'),
    )

    def compute(self, window: Window) -> list[list[float]]:
        """Return RMS, crest factor and kurtosis of each channel."""
        return [statistics(window.samples[channel]) for channel in self.sources]


def statistics(samples: Array) -> list[float]:
    """Return RMS about the mean (unit of x), crest factor and kurtosis (Gaussian noise: 3).

    Crest factor = max|x - mean| / RMS, kurtosis = mean((x - mean)^4) / RMS^4; NaN where the motion
    is too small for a float64.
    """
    square = (samples - np.mean(samples)) ** 2
    mean_square = float(np.mean(square))
    if not mean_square**2 > 0.0:
        return [math.sqrt(mean_square), math.nan, math.nan]
    crest = math.sqrt(float(np.max(square)) / mean_square)
    return [math.sqrt(mean_square), crest, float(np.mean(square * square)) / mean_square**2]
