# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Detector (b): zones on the RMS velocity of the bearing housings, in the style of ISO 20816.

Taken from ISO 20816-1 and -3: the quantity (RMS velocity of the bearing housings, 10 to 1000 Hz),
four zones A to D, and an alarm at the reference value plus a quarter of the upper limit of zone B.
Not taken: the limits in mm/s, which hold for industrial machines at steady speed on the ground.
Zone A ends here at the highest value of the machine's own reference flights, and the other limits
keep the proportions of ISO 20816-3 (2.8 and 4.5 to 1.4). No compliance is claimed: the standard
excludes aircraft engines and speeds that change.
"""

import math
from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from rotor_common.tapers import hann
from rotor_interfaces.channels import ACCELERATION_COLUMNS
from rotor_interfaces.waveform import WaveformBlock
from vibration_monitor.detectors.protocol import SILENT, Verdict
from vibration_monitor.persistence import Persistence

BAND_HZ = (10.0, 1000.0)
WINDOW_S = 1.0
ZONES = {'A': 1.0, 'B': 2.8 / 1.4, 'C': 4.5 / 1.4}
"""Upper limits of the zones in multiples of the reference; above C is D."""
ALARM = 1.0 + 0.25 * ZONES['B']
"""In multiples of the reference."""

Array = NDArray[np.float64]


class ZoneDetector:
    """RMS velocity over the limit of the alarm, the worst of the four accelerometers.

    Consecutive windows of 1 s; score = the level that 3 of the last 5 reach. A window with a gap or
    a NaN does not count for the channels concerned; without reference flights there is no verdict.
    """

    alarm_score = 1.0

    def __init__(self) -> None:
        self._reference = np.full(len(ACCELERATION_COLUMNS), math.nan)
        self._windows = _Windows()
        self._levels = [Persistence(3, 5) for _ in ACCELERATION_COLUMNS]
        self._verdict = SILENT

    def fit(self, flights: Iterable[Iterable[WaveformBlock]]) -> None:
        """Take the highest window of the reference flights as the end of zone A."""
        for flight in flights:
            windows = _Windows()
            for block in flight:
                for velocities in windows.push(block):
                    self._reference = np.fmax(self._reference, velocities)

    def push(self, block: WaveformBlock) -> Verdict:
        """Take the next block; the verdict is that of the last complete window."""
        for velocities in self._windows.push(block):
            self._verdict = self._judge(velocities)
        return self._verdict

    def _judge(self, velocities: Array) -> Verdict:
        best = SILENT
        for index, level in enumerate(self._levels):
            reference = float(self._reference[index])
            multiple = float(velocities[index]) / reference if reference > 0 else math.nan
            reached = level.update(multiple)
            if math.isnan(reached) or reached / ALARM <= best.score:
                continue
            text = (
                f'{ACCELERATION_COLUMNS[index]}: {reached * reference * 1e3:.3g} mm/s RMS, '
                f'{reached:.2f} times the reference, zone {zone_of(reached)}'
            )
            best = Verdict(reached / ALARM, text)
        return best


def zone_of(multiple: float) -> str:
    """Return the zone of an RMS velocity in multiples of the reference."""
    return next((zone for zone, limit in ZONES.items() if multiple <= limit), 'D')


class _Windows:
    """Cuts a stream into windows of consecutive samples and returns their RMS velocities."""

    def __init__(self) -> None:
        self._parts: list[Array] = []
        self._length = 0
        self._next_sample = -1

    def push(self, block: WaveformBlock) -> Iterator[Array]:
        """Yield the RMS velocities (channels,) in m/s of each window that the block completes."""
        if block.first_sample != self._next_sample:
            self._parts, self._length = [], 0
        self._next_sample = block.first_sample + len(block.rows)
        rate_hz = rate_of(block)
        if math.isnan(rate_hz):
            return
        columns = [_column(block, name) for name in ACCELERATION_COLUMNS]
        self._parts.append(np.stack(columns))
        self._length += len(block.rows)
        count = round(WINDOW_S * rate_hz)
        if self._length < count:
            return
        signals = np.concatenate(self._parts, axis=1)
        while signals.shape[1] >= count:
            yield rms_velocity(signals[:, :count], rate_hz)
            signals = signals[:, count:]
        self._parts, self._length = [signals], signals.shape[1]


def _column(block: WaveformBlock, name: str) -> Array:
    if name not in block.columns:
        return np.full(len(block.rows), math.nan)
    return block.rows[name].astype(np.float64)


def rate_of(block: WaveformBlock) -> float:
    """Return the sample rate in Hz by the time column, NaN for a block of one sample."""
    time = block.rows['time']
    return float((len(time) - 1) / (time[-1] - time[0])) if len(time) > 1 else math.nan


def rms_velocity(accelerations: Array, rate_hz: float) -> Array:
    """Return the RMS velocity (channels,) in m/s between the limits of the band.

    By Parseval's theorem from the spectrum of `accelerations` (channels, samples) in m/s^2, each
    line divided by its angular frequency; Hann window, whose mean square is 3/8.
    """
    count = accelerations.shape[1]
    centred = accelerations - accelerations.mean(axis=1, keepdims=True)
    spectrum = np.fft.rfft(centred * hann(count), axis=1)
    frequency_hz = np.fft.rfftfreq(count, 1 / rate_hz)
    inside = (frequency_hz >= BAND_HZ[0]) & (frequency_hz <= BAND_HZ[1])
    velocity = spectrum[:, inside] / (2 * np.pi * frequency_hz[inside])
    square = 2 * np.sum(np.abs(velocity) ** 2, axis=1) / count**2 / 0.375
    return np.asarray(np.sqrt(square))
