# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Vectors (amplitude and phase) at orders, by windowed sums over the raw samples.

The integral of x(angle) w(angle) exp(-i order angle) over a window of revolutions, by the
trapezoid rule on the samples. The window w (4-term Blackman-Harris) falls to 6e-5 at its ends, so
the rule is accurate far beyond its order, as for a periodic function (Trefethen and Weideman, SIAM
Review 56 (2014) 385-458), and nothing has to be resampled.
"""

import functools

import numpy as np
from numpy.typing import NDArray

from vibration_monitor._kernels import windowed_sums
from vibration_monitor.errors import MonitorError
from vibration_monitor.spectrum import MAIN_LOBE_BINS


def highest_vector_order(revolutions: NDArray[np.float64], count: int) -> float:
    """Return the highest order whose mirror image at the sample rate stays outside the main lobe.

    That is half the samples of a revolution, at the fastest point of the window, less 4 bins.

    Args:
        revolutions: shaft angle of each sample in revolutions, rising.
        count: number of revolutions in the window.

    """
    return float(0.5 / np.max(np.diff(revolutions))) - MAIN_LOBE_BINS / count


def order_vectors(
    revolutions: NDArray[np.float64],
    signals: NDArray[np.float64],
    *,
    start: float,
    count: int,
    orders: tuple[float, ...],
) -> NDArray[np.complex128]:
    """Return Z = A exp(i phase) of x = A cos(order (angle - start) + phase), the mean removed.

    The same samples always give the same bits: sums in a fixed order, no BLAS.

    Args:
        revolutions: shaft angle of each sample in revolutions, rising by at most 1/6 a sample;
            (samples,). The first and the last sample lie at or beyond the ends of the window and
            only give the angle steps at its ends.
        signals: finite values in any unit; (signals, samples).
        start: angle in revolutions at which the window starts.
        count: number of revolutions in the window, 64 or more.
        orders: cycles in a revolution, whole or not.

    Returns:
        A is zero-to-peak in the unit of the signals, phases relative to `start`; (signals, orders).

    Raises:
        MonitorError: the samples do not span the window, or there are fewer than three.

    """
    if len(revolutions) < 3 or revolutions[0] > start or revolutions[-1] < start + count:
        raise MonitorError(
            f'{len(revolutions)} samples do not span the {count} revolutions from {start:g}'
        )
    sums, totals = windowed_sums(revolutions, signals, start, count, *_plan(orders, count))
    mean = sums[:, :1] / totals[0]
    sums = (sums - mean * totals) * (2.0 / totals[0])
    vectors: NDArray[np.complex128] = sums[:, 1::2] - 1j * sums[:, 2::2]
    return vectors


@functools.lru_cache(maxsize=32)
def _plan(
    orders: tuple[float, ...], count: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Return how to compute the carriers of the orders from that of one turn over the window.

    Each power is a product of two smaller ones, without a cosine of its own. See `windowed_sums`.
    """
    powers = [1]
    products: list[tuple[int, int]] = []

    def place(power: int) -> int:
        if power not in powers:
            parts = [part for part in powers if power - part in powers]
            part = max(parts, default=power // 2)
            pair = (place(part), place(power - part))
            powers.append(power)
            products.append(pair)
        return powers.index(power)

    bins = [int(order * count) for order in orders]
    places = [place(number) if number else -1 for number in bins]
    remainders = [order * count - number for order, number in zip(orders, bins, strict=True)]
    return (
        np.array(products, np.int64).reshape(-1, 2),
        np.array(places, np.int64),
        np.array(remainders, np.float64),
    )
