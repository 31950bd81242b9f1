# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Speed and load of the window."""

import math

import numpy as np

from rotor_common.constants import GRAVITY_M_S2
from vibration_monitor.indicators.family import Family, Indicator
from vibration_monitor.indicators.window import Window


class Shaft(Family):
    """In which state of the machine the window was taken."""

    key = 'shaft'
    title = 'Speed and load'
    needs = 'The shaft angle; `load_y` for the load factor.'
    fooled_by = 'Sensor noise, which adds to the range of the load factor.'
    of = 'window'
    is_always_on = True
    indicators = (
        Indicator('speed_rad_s', 'rad/s', '2 pi revolutions / duration of the window', 'speed'),
        Indicator('load_factor', '1', 'mean of `load_y` / 9.81'),
        Indicator('load_factor_range', '1', 'largest minus smallest `load_y`, over 9.81'),
    )

    def compute(self, window: Window) -> list[list[float]]:
        """Return speed, load factor and its range."""
        load = window.load_m_s2 / GRAVITY_M_S2
        if math.isnan(load):
            return [[window.speed_rad_s, math.nan, math.nan]]
        spread = float(np.ptp(window.load_y[window.inside]))
        return [[window.speed_rad_s, load, spread / GRAVITY_M_S2]]
