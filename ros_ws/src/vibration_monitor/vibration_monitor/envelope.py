# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Envelope analysis: the repetition rate of impacts, as from a rolling-bearing fault.

Source: Randall and Antoni, Rolling element bearing diagnostics - a tutorial, Mechanical Systems
and Signal Processing 25 (2011) 485-520: a fault's line stands in the spectrum of the envelope,
not of the signal; its kinematic order is only right to 1 or 2 percent, since the balls slip.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from vibration_monitor.errors import MonitorError
from vibration_monitor.spectrum import weighted

SLIP = 0.02
"""Largest deviation of a bearing's line from its kinematic frequency, as a part of it."""

_FLOOR_REACH = 0.25
_PADDING = 4
_MIN_BAND_BINS = 16


@dataclass(frozen=True)
class Line:
    """The largest line in a range of frequencies, and the floor it stands on (unit of signal)."""

    frequency_hz: float
    amplitude: float
    floor: float

    @property
    def prominence(self) -> float:
        """Amplitude over floor; noise alone seldom reaches 4 (1 bin in 65 000)."""
        return self.amplitude / self.floor if self.floor > 0 else math.nan


@dataclass(frozen=True, eq=False)
class EnvelopeSpectrum:
    """One-sided amplitude spectrum of an envelope, the mean removed.

    `amplitudes` are zero-to-peak in the unit of the signal, Blackman-Harris window corrected by
    its sum: an envelope a (1 + m cos(2 pi f t)) has the line a m at f. `resolution_hz` is 1 / the
    duration; lines closer than 8 of it run into one another. The bins stand closer than that
    (zero padding), so that a line between two bins loses less than 0.6 percent.
    """

    frequency_hz: NDArray[np.float64]
    amplitudes: NDArray[np.float64]
    mean: float
    band_hz: tuple[float, float]
    resolution_hz: float

    def line_near(self, frequency_hz: float, tolerance: float = SLIP) -> Line:
        """Return the largest line within `tolerance` (a part of `frequency_hz`) or one bin.

        The floor is the median amplitude within a quarter of `frequency_hz` on both sides. For an
        order pass order times shaft frequency. Amplitude and floor are NaN where the spectrum has
        no lines: beyond the width of the band, and within 4 resolutions of zero.

        Raises:
            MonitorError: frequency_hz is not positive, or tolerance not between 0 and 0.25.

        """
        if not 0 < frequency_hz < math.inf:
            raise MonitorError(f'frequency_hz = {frequency_hz:g} is out of range; allowed: above 0')
        if not 0 <= tolerance <= _FLOOR_REACH:
            raise MonitorError(
                f'tolerance = {tolerance:g} is out of range; allowed: 0 to {_FLOOR_REACH:g}'
            )
        reach = max(tolerance * frequency_hz, self.resolution_hz / 2)
        low, high = self._bins(frequency_hz - reach, frequency_hz + reach)
        if frequency_hz - reach < 4 * self.resolution_hz or high > len(self.amplitudes):
            return Line(frequency_hz, math.nan, math.nan)
        best = low + int(np.argmax(self.amplitudes[low:high]))
        around = self._bins(*(frequency_hz * (1 + side) for side in (-_FLOOR_REACH, _FLOOR_REACH)))
        floor = float(np.median(self.amplitudes[slice(*around)]))
        return Line(float(self.frequency_hz[best]), float(self.amplitudes[best]), floor)

    def _bins(self, low_hz: float, high_hz: float) -> tuple[int, int]:
        """Return first and last + 1 of the bins in a range; the last may be beyond the end."""
        step = float(self.frequency_hz[1])
        return max(math.ceil(low_hz / step), 1), math.floor(high_hz / step) + 1


def is_resolved(band_hz: tuple[float, float], count: int, rate_hz: float) -> bool:
    """Say whether `count` samples can show the envelope of a rising band above 0 Hz."""
    low, high = band_hz
    return high <= rate_hz / 2 and (high - low) * count >= _MIN_BAND_BINS * rate_hz


def envelope(
    signal: NDArray[np.float64], rate_hz: float, band_hz: tuple[float, float]
) -> NDArray[np.float64]:
    """Return the envelope of the part of a signal in a band, by the Hilbert transform.

    Both steps are one: the spectrum is kept in the band, at positive frequencies only, and
    doubled; its inverse transform is the analytic signal (the source's 'Hilbert' procedure). The
    band has sharp edges, and the ends are joined: the first and last samples ring.

    Args:
        signal: samples at equal steps of time, any unit; (n,). One NaN makes the result NaN.
        rate_hz: sample rate.
        band_hz: lowest and highest frequency kept, such as around a resonance of the housing.

    Returns:
        The envelope in the unit of the signal, not negative; (n,).

    Raises:
        MonitorError: the band does not lie between 0 and half the sample rate, or holds less
            than 16 bins of the spectrum of so short a signal.

    """
    low, high = band_hz
    if not 0 < low < high <= rate_hz / 2:
        raise MonitorError(
            f'band_hz = {low:g} to {high:g} is not allowed; it must rise and lie above 0 and up '
            f'to half the sample rate, {rate_hz / 2:g} Hz'
        )
    count = len(signal)
    if (high - low) * count < _MIN_BAND_BINS * rate_hz:
        raise MonitorError(
            f'band_hz = {low:g} to {high:g} is too narrow for {count} samples at {rate_hz:g} Hz; '
            f'make it at least {_MIN_BAND_BINS * rate_hz / max(count, 1):.4g} Hz wide'
        )
    spectrum = fft.rfft(signal)
    first, last = math.ceil(low * count / rate_hz), math.floor(high * count / rate_hz)
    analytic = np.zeros(count, np.complex128)
    analytic[first : last + 1] = 2.0 * spectrum[first : last + 1]
    outline: NDArray[np.float64] = np.abs(fft.ifft(analytic))
    return outline


def envelope_spectrum(
    signal: NDArray[np.float64], rate_hz: float, band_hz: tuple[float, float]
) -> EnvelopeSpectrum:
    """Return the amplitude spectrum of the envelope of a signal in a band.

    Arguments and errors are those of `envelope`. The spectrum ends at the width of the band:
    two lines of the signal can beat no faster.
    """
    outline = envelope(signal, rate_hz, band_hz)
    count = fft.next_fast_len(_PADDING * len(outline), real=True)
    amplitudes = 2.0 * np.abs(fft.rfft(weighted(outline), count))
    frequency_hz = np.arange(len(amplitudes)) * (rate_hz / count)
    kept = slice(int(np.searchsorted(frequency_hz, band_hz[1] - band_hz[0], side='right')))
    return EnvelopeSpectrum(
        frequency_hz=frequency_hz[kept],
        amplitudes=amplitudes[kept],
        mean=float(np.mean(outline)),
        band_hz=band_hz,
        resolution_hz=rate_hz / len(outline),
    )
