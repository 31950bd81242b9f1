# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Load dependence of an order: how its vector changes with the load factor.

The vectors Z of the last windows at similar speed are fitted by Z = a + b n, n the load factor, by
least squares in the complex plane. What does not depend on the load (unbalance, misalignment) is in
a, what does (a crack that the weight opens and closes) in b.
"""

import math
from collections import deque
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotor_common.constants import GRAVITY_M_S2
from vibration_monitor.indicators.family import OF_SOURCE, Family, Indicator
from vibration_monitor.indicators.window import Array, Window
from vibration_monitor.spectrum import overlap_inflation

if TYPE_CHECKING:
    from vibration_monitor.monitor_config import MonitorConfig

SPEED_TOLERANCE = 0.02
"""Windows whose speed differs by a larger part from that of the newest one are left out."""

MIN_WINDOWS = 6
MIN_LOAD_SPREAD = 0.1
"""Least standard deviation of the load factor for which there is a slope."""

Complex = NDArray[np.complex128]


class Trend(Family):
    """How the vectors at 1x, 2x and 3x change with the load factor.

    Least squares Z = a + b n over the last `trend_windows` (40) windows whose speed is within 2 %
    of the newest one's; Z is the vector, n the load factor of the window, b complex. What does not
    depend on the load, such as unbalance and misalignment, is in a and does not enter the slope.
    The error counts the overlap of windows (variance times 2.0 for a hop of 16 in 64). Without any
    dependence the slope is about its error, not 0: compare the two.
    """

    key = 'trend'
    title = 'Load trend'
    needs = '6 windows and a load factor with a standard deviation of 0.1 among them, else NaN.'
    fooled_by = (
        "What else depends on the load: the bearings' own stiffness and clearance (near half the "
        'critical speed a sound rotor has a slope); a dependence that is not a line (near a '
        'super-harmonic resonance); a load that changes within the windows.'
    )
    source = "Harris, Proceedings of the IEEE 66 (1978) 51-83 (the overlap's share in the error)."
    orders = (1.0, 2.0, 3.0)
    indicators = (
        Indicator(
            'load_slope_order_{order}', OF_SOURCE, 'abs(b), for each unit of the load factor'
        ),
        Indicator('load_slope_error_order_{order}', OF_SOURCE, 'standard error of the slope'),
    )

    def __init__(
        self, config: 'MonitorConfig', channels: tuple[str, ...], sources: tuple[str, ...]
    ) -> None:
        super().__init__(config, channels, sources)
        self._places = [config.orders.index(n) for n in self.orders if n in config.orders]
        inflation = overlap_inflation(config.window_revolutions, config.hop_revolutions)
        self._trend = LoadTrend(config.trend_windows, inflation)

    def compute(self, window: Window) -> Array:
        """Return slope and error of each channel, order by order."""
        load_factor = window.load_m_s2 / GRAVITY_M_S2
        vectors = window.vectors[:, self._places]
        found = self._trend.update(window.speed_rad_s, load_factor, vectors)
        return np.stack(found, axis=2).reshape(len(vectors), -1)


def load_slope(
    load_factor: NDArray[np.float64], vectors: Complex, inflation: float = 1.0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the magnitude of the slope of each vector over the load factor, and its error.

    Args:
        load_factor: of each window; (windows,).
        vectors: A exp(i phase) of each window; (windows, vectors).
        inflation: how many times larger the variance is because the windows share samples.

    Returns:
        |b| and its standard error, in the unit of the vectors per unit of load factor;
        (vectors,). NaN with fewer than 6 windows or a load that hardly varies. Without any
        dependence |b| is about the size of its error, not 0: it is the length of a vector.

    """
    windows = len(load_factor)
    deviation = load_factor - np.mean(load_factor) if windows else load_factor
    spread = float(np.sum(deviation**2))
    if windows < MIN_WINDOWS or spread < windows * MIN_LOAD_SPREAD**2:
        nothing = np.full(vectors.shape[1], math.nan)
        return nothing, nothing
    centred = vectors - np.mean(vectors, axis=0)
    slope = np.sum(deviation[:, np.newaxis] * centred, axis=0) / spread
    rest = np.abs(centred - deviation[:, np.newaxis] * slope) ** 2
    variance = np.sum(rest, axis=0) / (windows - 2)
    return np.abs(slope), np.sqrt(variance * inflation / spread)


class LoadTrend:
    """Keeps the last windows and fits the slopes of all channels and orders."""

    def __init__(self, windows: int, inflation: float) -> None:
        self._windows: deque[tuple[float, float, Complex]] = deque(maxlen=windows)
        self._inflation = inflation

    def update(
        self, speed_rad_s: float, load_factor: float, vectors: Complex
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Take the next window; return slope and error of each channel and order.

        Args:
            speed_rad_s: mean speed of the window.
            load_factor: mean of the window; a window without one is left out.
            vectors: A exp(i phase); (channels, orders).

        """
        if math.isfinite(load_factor):
            self._windows.append((speed_rad_s, load_factor, vectors))
        near = [
            (load, values)
            for speed, load, values in self._windows
            if abs(speed - speed_rad_s) <= SPEED_TOLERANCE * speed_rad_s
        ]
        slopes, errors = np.full((2, *vectors.shape), math.nan)
        if not near or not math.isfinite(load_factor):
            return slopes, errors
        loads = np.array([load for load, _ in near])
        history = np.stack([values for _, values in near])
        for channel in range(len(vectors)):
            known = np.isfinite(history[:, channel]).all(axis=1)
            slopes[channel], errors[channel] = load_slope(
                loads[known], history[known, channel], self._inflation
            )
        return slopes, errors
