# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Amplitude and phase over order, with a 4-term Blackman-Harris window.

Sign and scale: a component is the complex number Z = A exp(i phase) of
x = A cos(order * angle + phase); A is zero-to-peak in the unit of x. Only FFT and plain sums are
used, so that the same samples always give the same bits.
"""

import functools

import numpy as np
from numpy.typing import NDArray

from vibration_monitor.errors import MonitorError

# Harris, Proceedings of the IEEE 66 (1978) 51-83, table 1: highest side lobe -92 dB. Written out
# because `import scipy.signal` takes longer than everything else at start.
BLACKMAN_HARRIS = (0.35875, -0.48829, 0.14128, -0.01168)

MAIN_LOBE_BINS = 4
"""Half width of the main lobe of the window."""


@functools.lru_cache(maxsize=8)
def blackman_harris(count: int) -> NDArray[np.float64]:
    """Return the periodic 4-term Blackman-Harris window, peak 1; (count,), read-only."""
    angle = 2 * np.pi * np.arange(count) / count
    window = np.zeros(count)
    for term, factor in enumerate(BLACKMAN_HARRIS):
        window += factor * np.cos(term * angle)
    window.flags.writeable = False
    return window


@functools.lru_cache(maxsize=8)
def overlap_inflation(window_revolutions: int, hop_revolutions: int) -> float:
    """Return how many times larger the variance of a mean is because windows overlap.

    1 + 2 sum of the correlations of windows k hops apart, for white noise (Harris, Proceedings of
    the IEEE 66 (1978) 51-83, section 4 C).
    """
    window = blackman_harris(64 * window_revolutions)
    shift = 64 * hop_revolutions
    total = 1.0
    for start in range(shift, len(window), shift):
        correlation = np.sum(window[start:] * window[:-start]) / np.sum(window**2)
        total += 2.0 * float(correlation)
    return total


def weighted(signal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return w (x - m) / sum(w), with m the mean under the window w, so that its sum is zero.

    Removing m keeps a constant offset from leaking into orders that fall between bins.
    """
    window = blackman_harris(len(signal))
    total = np.sum(window)
    return window * (signal - np.sum(window * signal) / total) / total


def order_components(signal: NDArray[np.float64], revolutions: int) -> NDArray[np.complex128]:
    """Return the one-sided amplitude spectrum: component Z at each order k / revolutions.

    Scaling: amplitude (zero-to-peak, unit of x), bin width 1 / revolutions, window corrected by
    its sum. Parseval: sum(w^2 (x - m)^2) / sum(w^2) = sum(|Z|^2) / 2 / B with the noise
    bandwidth B = N sum(w^2) / sum(w)^2 = 2.0044 bins, where the last bin (half the points of a
    revolution) counts twice because it has no mirror image.

    Args:
        signal: `weighted` values at equal angles over whole revolutions; (N,), N even.
        revolutions: number of revolutions in the signal.

    Returns:
        Z at orders 0, 1 / revolutions, ... N / (2 revolutions); phases relative to the first
        point; (N / 2 + 1,).

    Raises:
        MonitorError: N is odd or no multiple of the revolutions.

    """
    if len(signal) % 2 or len(signal) % revolutions:
        raise MonitorError(
            f'{len(signal)} points do not make {revolutions} whole revolutions with an even '
            'number of points'
        )
    components: NDArray[np.complex128] = 2.0 * np.fft.rfft(signal)
    components[0] /= 2.0
    components[-1] /= 2.0
    return components


def component(signal: NDArray[np.float64], revolutions: int, order: float) -> complex:
    """Return the component Z at any order, on a bin or between bins, by the plain sum.

    Args:
        signal: `weighted` values at equal angles over whole revolutions; (N,).
        revolutions: number of revolutions in the signal.
        order: cycles in a revolution.

    """
    cosine, sine = _carrier(len(signal), revolutions, order)
    return complex(2.0 * np.sum(signal * cosine), -2.0 * np.sum(signal * sine))


@functools.lru_cache(maxsize=32)
def _carrier(
    count: int, revolutions: int, order: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    angle = 2 * np.pi * ((order * revolutions * np.arange(count) / count) % 1.0)
    return np.cos(angle), np.sin(angle)
