# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The mean of each channel."""

import numpy as np

from vibration_monitor.indicators.family import OF_SOURCE, Family, Indicator
from vibration_monitor.indicators.window import Window


class Mean(Family):
    """The static part of each channel."""

    key = 'mean'
    title = 'Mean'
    needs = 'Nothing but samples.'
    fooled_by = "The probe's bias and its drift."
    is_always_on = True
    indicators = (Indicator('mean', OF_SOURCE, 'mean of the samples of the window'),)

    def compute(self, window: Window) -> list[list[float]]:
        """Return the mean of each channel."""
        return [[float(np.mean(window.samples[channel]))] for channel in self.sources]
