# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Envelope spectrum: modulation of known depth, impulses at a known rate, noise, refusals."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from vibration_monitor.envelope import envelope, envelope_spectrum
from vibration_monitor.errors import MonitorError

RATE_HZ = 10_240.0
COUNT = 30_720
"""3 s, as long as a recording of MFPT."""
TIME = np.arange(COUNT) / RATE_HZ
BAND_HZ = (2000.0, 4000.0)
# -92 dB side lobes of the window, and as much from the ends of the record
LEAK = 1e-4


@settings(deadline=None, max_examples=30)
@given(
    st.floats(20.0, 400.0),
    st.floats(0.05, 0.95),
    st.floats(1e-6, 1e3),
    st.floats(-math.pi, math.pi),
)
def test_a_modulated_carrier_gives_depth_and_frequency(
    modulation_hz: float, depth: float, amplitude: float, phase: float
) -> None:
    outline = amplitude * (1 + depth * np.cos(2 * np.pi * modulation_hz * TIME + phase))
    spectrum = envelope_spectrum(outline * np.cos(2 * np.pi * 3000.0 * TIME), RATE_HZ, BAND_HZ)
    line = spectrum.line_near(modulation_hz)
    # scalloping of the window at an eighth of a resolution: 0.52 %; ends of the record as above
    assert line.amplitude == pytest.approx(amplitude * depth, rel=0.006)
    # half a bin of the padded spectrum
    assert abs(line.frequency_hz - modulation_hz) <= 0.51 * spectrum.frequency_hz[1]
    assert spectrum.mean == pytest.approx(amplitude, rel=0.01)
    # nothing elsewhere: the mean is removed, 2 f is absent
    elsewhere = np.abs(spectrum.frequency_hz - modulation_hz) > 4.5 * spectrum.resolution_hz
    assert spectrum.amplitudes[elsewhere].max() < 0.01 * amplitude


def test_the_envelope_is_exact_where_carrier_and_modulation_fit_the_record() -> None:
    outline = 2.0 * (1 + 0.5 * np.cos(2 * np.pi * 50.0 * TIME))
    found = envelope(outline * np.cos(2 * np.pi * 3000.0 * TIME), RATE_HZ, BAND_HZ)
    # whole periods in the record, so the sharp filter loses nothing: rounding of two transforms
    np.testing.assert_allclose(found, outline, atol=1e-11)


def test_what_is_outside_the_band_does_not_matter() -> None:
    carrier = (1 + 0.5 * np.cos(2 * np.pi * 50.0 * TIME)) * np.cos(2 * np.pi * 3000.0 * TIME)
    unbalance = 100.0 * np.cos(2 * np.pi * 25.0 * TIME) + 7.0
    alone = envelope_spectrum(carrier, RATE_HZ, BAND_HZ)
    both = envelope_spectrum(carrier + unbalance, RATE_HZ, BAND_HZ)
    # 1e-16 of the unbalance, times the transforms
    np.testing.assert_allclose(both.amplitudes, alone.amplitudes, atol=1e-11)
    assert both.line_near(25.0).amplitude < LEAK


def _impulses(rate_hz: float, slip: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return a resonance at 3 kHz, decay time 1 ms, struck at `rate_hz` with random slip."""
    gaps = (1 + slip * rng.standard_normal(round(3 * rate_hz) + 5)) / rate_hz
    signal = np.zeros(COUNT)
    for start in np.cumsum(gaps):
        rest = TIME[start <= TIME] - start
        signal[start <= TIME] += np.exp(-rest / 1e-3) * np.sin(2 * np.pi * 3000.0 * rest)
    return signal


@pytest.mark.parametrize('slip', [0.0, 0.01])
def test_impulses_stand_at_their_rate_in_the_envelope_and_not_in_the_signal(slip: float) -> None:
    rng = np.random.default_rng(5)
    rate_hz = 118.875
    noise = 0.2 * rng.standard_normal(COUNT)
    spectrum = envelope_spectrum(_impulses(rate_hz, slip, rng) + noise, RATE_HZ, BAND_HZ)
    lines = [spectrum.line_near(k * rate_hz) for k in (1, 2)]
    for k, line in enumerate(lines, 1):
        assert line.prominence > 4
        # random slip of sigma in N intervals moves the mean rate by sigma / sqrt(N)
        assert abs(line.frequency_hz - k * rate_hz) < 0.5 + 3 * slip * k * rate_hz / 18
    assert spectrum.line_near(0.73 * rate_hz).prominence < 4


def test_fourier_coefficients_of_impulses_are_those_of_their_envelope() -> None:
    spectrum = envelope_spectrum(
        _impulses(100.0, 0.0, np.random.default_rng(0)), RATE_HZ, (1000.0, 5000.0)
    )
    # exp(-t/T) every 1/f: mean f T, harmonic k of amplitude 2 f T / sqrt(1 + (2 pi k f T)^2);
    # the band cuts the edge of each impulse, which costs high harmonics a few percent
    for k in (1, 2, 3):
        expected = 0.2 / math.hypot(1.0, 0.2 * math.pi * k)
        assert spectrum.line_near(100.0 * k).amplitude == pytest.approx(expected, rel=0.06)
    # the ringing of the sharp band before and after each edge only adds to the mean
    assert 0.1 < spectrum.mean < 0.12


def test_noise_has_the_floor_of_a_rayleigh_envelope() -> None:
    sigma = 3.0
    floors, means = [], []
    for seed in range(8):
        noise = sigma * np.random.default_rng(seed).standard_normal(COUNT)
        spectrum = envelope_spectrum(noise, RATE_HZ, BAND_HZ)
        # in-band: variance sigma^2 B / (rate / 2); the mean of a Rayleigh variable is
        # sqrt(pi / 2) sigma_in
        means.append(spectrum.mean)
        line = spectrum.line_near(120.0)
        floors.append(line.floor)
        assert line.prominence < 4
    inside = sigma * math.sqrt(2000.0 / 5120.0)
    assert np.mean(means) == pytest.approx(math.sqrt(math.pi / 2) * inside, rel=0.01)
    # The envelope's spectral density falls linearly to zero at B, as the triangle that a flat
    # band makes when folded with itself: variance (2 - pi/2) inside^2 = S B / 2 to first order.
    density = 2 * (2 - math.pi / 2) * inside**2 / 2000.0 * (1 - 120.0 / 2000.0)
    # amplitude of a bin: sqrt(2 S B_noise) rms, Rayleigh: median = sqrt(ln 2) of the rms
    expected = math.sqrt(2 * density * 2.0044 / 3.0 * math.log(2))
    # 8 seeds of 180 resolutions each: 1 % of scatter; higher terms of |.|: a few percent
    assert np.mean(floors) == pytest.approx(expected, rel=0.05)


def test_a_missing_sample_is_no_number() -> None:
    signal = np.cos(2 * np.pi * 3000.0 * TIME)
    signal[100] = math.nan
    spectrum = envelope_spectrum(signal, RATE_HZ, BAND_HZ)
    assert np.isnan(spectrum.amplitudes).all()
    assert math.isnan(spectrum.line_near(100.0).amplitude)
    assert math.isnan(spectrum.line_near(100.0).prominence)


def test_a_dead_sensor_has_no_prominence() -> None:
    line = envelope_spectrum(np.zeros(COUNT), RATE_HZ, BAND_HZ).line_near(100.0)
    assert line.amplitude == 0.0
    assert math.isnan(line.prominence)


def test_the_spectrum_ends_at_the_width_of_the_band() -> None:
    spectrum = envelope_spectrum(np.cos(2 * np.pi * 3000.0 * TIME), RATE_HZ, BAND_HZ)
    assert spectrum.frequency_hz[-1] == pytest.approx(2000.0, abs=spectrum.frequency_hz[1])
    for beyond in (1990.0, 2500.0, 1.0):
        assert math.isnan(spectrum.line_near(beyond).amplitude)


@pytest.mark.parametrize(
    ('band_hz', 'words'),
    [
        ((0.0, 100.0), 'lie above 0'),
        ((2000.0, 1000.0), 'must rise'),
        ((2000.0, 5121.0), '5120 Hz'),
        ((math.nan, 1000.0), 'is not allowed'),
        ((2000.0, 2001.0), 'at least 5.333 Hz wide'),
    ],
)
def test_a_band_that_does_not_serve_ends_in_one_sentence(
    band_hz: tuple[float, float], words: str
) -> None:
    with pytest.raises(MonitorError) as refused:
        envelope_spectrum(TIME, RATE_HZ, band_hz)
    assert words in str(refused.value)
    assert '\n' not in str(refused.value)


def test_an_empty_signal_and_wrong_places_are_refused() -> None:
    with pytest.raises(MonitorError, match='too narrow for 0 samples'):
        envelope(np.empty(0), RATE_HZ, BAND_HZ)
    spectrum = envelope_spectrum(TIME, RATE_HZ, BAND_HZ)
    for frequency_hz, tolerance in ((0.0, 0.02), (math.nan, 0.02), (10.0, 0.3), (10.0, -0.1)):
        with pytest.raises(MonitorError, match='out of range'):
            spectrum.line_near(frequency_hz, tolerance)
