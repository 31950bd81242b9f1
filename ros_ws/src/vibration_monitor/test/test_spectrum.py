# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Order spectrum: window, scaling, Parseval, bins and the sum between bins."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal.windows import blackmanharris

from vibration_monitor.errors import MonitorError
from vibration_monitor.spectrum import blackman_harris, component, order_components, weighted

REVOLUTIONS = 64
POINTS = 128
COUNT = REVOLUTIONS * POINTS
ANGLE = 2 * np.pi * np.arange(COUNT) / POINTS


def test_window_is_scipys() -> None:
    # two ways to sum four cosines: a few units in the last place
    np.testing.assert_allclose(
        blackman_harris(COUNT), blackmanharris(COUNT, sym=False), rtol=0, atol=1e-15
    )


def test_side_lobes_lie_below_92_db() -> None:
    padded = np.abs(np.fft.rfft(blackman_harris(64), 64 * 64))
    # beyond the main lobe of 4 bins, here 4 * 64 points; -92 dB is Harris' table 1
    assert 20 * math.log10(padded[4 * 64 :].max() / padded[0]) < -92.0


@settings(deadline=None)
@given(
    st.integers(4, REVOLUTIONS * POINTS // 2 - 4),
    st.floats(1e-9, 1e3),
    st.floats(-math.pi, math.pi),
    st.floats(-10.0, 10.0),
)
def test_a_component_on_a_bin_is_exact(
    bin_number: int, amplitude: float, phase: float, mean: float
) -> None:
    order = bin_number / REVOLUTIONS
    signal = weighted(mean + amplitude * np.cos(order * ANGLE + phase))
    expected = amplitude * np.exp(1j * phase)
    # order * ANGLE reaches 26 000 rad, where a double is spaced 3.6e-12
    tolerance = 3.6e-12 * amplitude + 1e-13 * abs(mean)
    spectrum = order_components(signal, REVOLUTIONS)
    assert abs(spectrum[bin_number] - expected) < tolerance
    assert abs(component(signal, REVOLUTIONS, order) - expected) < tolerance


@settings(deadline=None)
@given(st.floats(0.3, 20.0), st.floats(-math.pi, math.pi))
def test_a_component_between_bins_is_within_the_side_lobe_of_its_mirror(
    order: float, phase: float
) -> None:
    signal = weighted(np.cos(order * ANGLE + phase) + 5.0)
    # The mirror image at -order leaks with 2.5e-5 (-92 dB), and so does the mean of the cosine
    # under the window, which is removed; 0.3 x 64 bins are far outside the main lobe.
    assert abs(component(signal, REVOLUTIONS, order) - np.exp(1j * phase)) < 6e-5


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(1e-9, 1e6), st.floats(-1e3, 1e3))
def test_parseval(seed: int, scale: float, mean: float) -> None:
    signal = mean + scale * np.random.default_rng(seed).standard_normal(COUNT)
    window = blackman_harris(COUNT)
    under_window = float(np.sum(window * signal) / np.sum(window))
    in_time = float(np.sum(window**2 * (signal - under_window) ** 2) / np.sum(window**2))
    power = np.abs(order_components(weighted(signal), REVOLUTIONS)) ** 2 / 2
    bandwidth = COUNT * float(np.sum(window**2) / np.sum(window) ** 2)
    in_orders = (float(np.sum(power)) + float(power[-1])) / bandwidth
    # rounding of the offset, relative to the scale, squared
    assert in_orders == pytest.approx(in_time, rel=1e-10, abs=(1e-14 * mean) ** 2 * 100)


def test_noise_bandwidth_is_harris() -> None:
    window = blackman_harris(COUNT)
    # Harris, table 1: 2.00 bins
    assert COUNT * np.sum(window**2) / np.sum(window) ** 2 == pytest.approx(2.0, abs=0.01)


def test_the_highest_bin_has_no_mirror() -> None:
    spectrum = order_components(weighted(np.cos(POINTS / 2 * ANGLE)), REVOLUTIONS)
    assert spectrum[-1].real == pytest.approx(1.0, abs=1e-12)


def test_a_constant_has_no_components() -> None:
    spectrum = order_components(weighted(np.full(COUNT, 3.0)), REVOLUTIONS)
    assert np.abs(spectrum).max() < 1e-14


@pytest.mark.parametrize(('count', 'revolutions'), [(129, 3), (130, 64)])
def test_no_whole_revolutions_are_refused(count: int, revolutions: int) -> None:
    with pytest.raises(MonitorError, match=f'{count} points do not make {revolutions} whole'):
        order_components(np.zeros(count), revolutions)
