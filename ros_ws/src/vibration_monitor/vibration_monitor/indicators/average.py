# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Synchronous average: the part that repeats every revolution, and the residual.

Source: McFadden, A revised model for the extraction of periodic waveforms by time domain
averaging, Mechanical Systems and Signal Processing 1 (1987) 83-95.
"""

import numpy as np
from numpy.typing import NDArray

from vibration_monitor.indicators.family import OF_SOURCE, Family, Indicator
from vibration_monitor.indicators.window import Array, Window


class Average(Family):
    """What repeats in every revolution of the window, and what does not.

    The residual holds ball-pass and half orders, noise, and the drift of the load.
    """

    key = 'average'
    title = 'Synchronous average'
    needs = (
        'Equal angles (the spline of the [monitor](monitor.md)); noise in the average falls by 8 '
        '(square root of 64 revolutions).'
    )
    fooled_by = (
        'A load that changes in the window (drift counts as residual); noise near half the sample '
        'rate, of which the spline passes about 7 % less power.'
    )
    source = 'McFadden, Mechanical Systems and Signal Processing 1 (1987) 83-95.'
    indicators = (
        Indicator('synchronous_rms', OF_SOURCE, 'RMS of the mean revolution, without its mean'),
        Indicator(
            'residual_rms',
            OF_SOURCE,
            'RMS of the signal without the mean revolution; the squares of the two add up',
        ),
    )

    def compute(self, window: Window) -> Array:
        """Return the RMS of both parts of each channel."""
        return np.stack(average_and_residual_rms(window.tracked, window.count), axis=1)


def synchronous_average(tracked: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return the mean revolution of signals at equal angles.

    Noise falls with sqrt(count); an order that is not whole is left with its comb response
    sin(pi count order) / (count sin(pi order)), at most 1 / (count sin(pi order)).

    Args:
        tracked: values at equal angles over `count` whole revolutions; (signals, points).
        count: number of revolutions.

    Returns:
        One revolution in the unit of the signals; (signals, points / count).

    """
    average: NDArray[np.float64] = tracked.reshape(len(tracked), count, -1).mean(axis=1)
    return average


def average_and_residual_rms(
    tracked: NDArray[np.float64], count: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the RMS of the synchronous average about its mean, and that of the residual.

    Arguments as of `synchronous_average`; both in the unit of the signals, (signals,). Their
    squares add up to the square of the RMS of the whole.
    """
    average = synchronous_average(tracked, count)
    residual = tracked.reshape(len(tracked), count, -1) - average[:, np.newaxis]
    average -= average.mean(axis=1, keepdims=True)
    return np.sqrt(np.mean(average**2, axis=1)), np.sqrt(np.mean(residual**2, axis=(1, 2)))
