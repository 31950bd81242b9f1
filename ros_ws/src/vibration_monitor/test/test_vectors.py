# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Vectors at orders by windowed sums: against plain NumPy, against truth, up to Nyquist."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from vibration_monitor.errors import MonitorError
from vibration_monitor.spectrum import BLACKMAN_HARRIS
from vibration_monitor.vectors import highest_vector_order, order_vectors

COUNT = 64
ORDERS = (0.5, 1.0, 1.5, 3.0, 3.0846, 4.0, 5.125, 0.3)


def window_of(revolutions: NDArray[np.float64], start: float, count: int) -> NDArray[np.float64]:
    """Return the samples of a window and one on either side."""
    first, last = np.searchsorted(revolutions, [start, start + count])
    return revolutions[max(0, first - 1) : last + 1]


def plain(
    revolutions: NDArray[np.float64],
    signals: NDArray[np.float64],
    start: float,
    count: int,
    orders: tuple[float, ...],
) -> NDArray[np.complex128]:
    """The same sums as one would write them down."""
    angle = 2 * np.pi * (revolutions[1:-1] - start)
    window = sum(a * np.cos(m * angle / count) for m, a in enumerate(BLACKMAN_HARRIS))
    weights = window * (revolutions[2:] - revolutions[:-2]) / 2
    weights /= np.sum(weights)
    inside = signals[:, 1:-1]
    inside = inside - (inside @ weights)[:, np.newaxis]
    carriers = np.exp(-1j * np.outer(angle, orders))
    return np.asarray(2.0 * (inside * weights) @ carriers)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(64, 200), st.floats(-1e4, 1e4))
def test_the_kernel_computes_what_numpy_does(seed: int, count: int, offset: float) -> None:
    rng = np.random.default_rng(seed)
    start = 16 * round(offset)
    revolutions = start - 0.3 + np.cumsum(rng.uniform(0.003, 0.16, 30 * count))
    revolutions = window_of(revolutions, start, count)
    signals = rng.standard_normal((3, len(revolutions))) + 10.0
    found = order_vectors(revolutions, signals, start=start, count=count, orders=ORDERS)
    expected = plain(revolutions, signals, start, count, ORDERS)
    # rounding: power 5 * 200 of a number turned 512 times, and sums of values of 10
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize('samples', [7.3, 60.0, 183.2, 400.0])
@pytest.mark.parametrize('order', [0.5, 1.0, 2.0, 3.0])
def test_a_single_component_is_right_to_the_mirror_image(samples: float, order: float) -> None:
    # a steady acceleration of a third over the window
    index = np.arange(int(80 * samples))
    revolutions = 15.7 + index / samples + 8 * (index / (80 * samples)) ** 2
    revolutions = window_of(revolutions, 16, COUNT)
    signal = 20.0 + np.cos(2 * np.pi * order * revolutions + 0.7)
    found = order_vectors(revolutions, signal[np.newaxis], start=16, count=COUNT, orders=(order,))
    # The mirror image at -order stands 64 bins or more away, where on a bin the window has no
    # side lobe; what is left are the ends, 6e-5 of the window's peak, times a part of a sample of
    # 64 * 0.36 revolutions of window. The offset takes part in it only through its mean.
    tolerance = 2 * 6e-5 / (0.36 * COUNT * samples)
    assert abs(found[0, 0] - np.exp(0.7j)) < tolerance


@pytest.mark.parametrize('order', [10.0, 20.0, 26.0, 29.0, 29.5])
def test_orders_up_to_nyquist(order: float) -> None:
    # 60 samples a revolution; the spline with its 6 samples a cycle ends at order 10
    revolutions = window_of(-0.4 + np.arange(4000) / 60.013, 0, COUNT)
    signal = np.cos(2 * np.pi * order * revolutions + 0.3) + 1e3
    assert highest_vector_order(revolutions, COUNT) == pytest.approx(30.0065 - 0.0625, abs=1e-9)
    found = order_vectors(revolutions, signal[np.newaxis], start=0, count=COUNT, orders=(order,))
    # -92 dB of the mirror image at 60.013 - order
    assert abs(found[0, 0] - np.exp(0.3j)) < 2.6e-5


def test_a_signal_does_not_depend_on_its_neighbours() -> None:
    rng = np.random.default_rng(2)
    revolutions = window_of(np.cumsum(rng.uniform(0.005, 0.015, 8000)), 1, COUNT)
    signals = rng.normal(size=(7, len(revolutions))) * 10.0 ** rng.integers(-9, 9, (7, 1))
    everything = order_vectors(revolutions, signals, start=1, count=COUNT, orders=ORDERS)
    for chosen in ([0], [6, 2], [3, 4, 5], [5, 4, 3, 2, 1]):
        part = order_vectors(revolutions, signals[chosen], start=1, count=COUNT, orders=ORDERS)
        assert part.tobytes() == everything[chosen].tobytes()
    # nor on how the samples lie in memory
    apart = np.repeat(signals, 2, axis=1)[:, ::2]
    again = order_vectors(revolutions, apart, start=1, count=COUNT, orders=ORDERS)
    assert again.tobytes() == everything.tobytes()


def test_a_nan_spoils_its_own_signal_only() -> None:
    revolutions = window_of(np.arange(7000) / 100 - 0.5, 0, COUNT)
    signals = np.stack([np.cos(2 * np.pi * revolutions)] * 2)
    signals[1, 3000] = math.nan
    found = order_vectors(revolutions, signals, start=0, count=COUNT, orders=(1.0, 2.0))
    assert np.isnan(found[1]).all()
    assert abs(found[0, 0] - 1) < 1e-6


@pytest.mark.parametrize(
    'revolutions', [np.array([0.0, 64.0]), np.arange(640) / 10, np.arange(1, 700) / 10]
)
def test_nothing_is_extrapolated(revolutions: NDArray[np.float64]) -> None:
    signals = np.zeros((1, len(revolutions)))
    with pytest.raises(MonitorError, match='do not span the 64 revolutions from 0'):
        order_vectors(revolutions, signals, start=0, count=COUNT, orders=(1.0,))
