# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Synthetic rotors with known orders, for the tests of the monitor."""

import math
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from rotor_interfaces.messages import sample_stamp_ns
from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock
from vibration_monitor import IndicatorRecord, VibrationMonitor

RATE_HZ = 10240
EPOCH_NS = 1_700_000_000_123_456_789
BALL_PASS = 8 * 40.1 / (40.1 + 63.9)

Component = tuple[float, float, float]
"""Order, amplitude, phase."""


def steady_angle(
    duration_s: float, speed_rad_s: float, rate_hz: int = RATE_HZ
) -> NDArray[np.float64]:
    """Return the shaft angle in rad at constant speed from angle 0."""
    return speed_rad_s * np.arange(round(duration_s * rate_hz)) / rate_hz


def ramp_angle(duration_s: float, speed_rad_s: float, ramp_rad_s2: float) -> NDArray[np.float64]:
    """Return the shaft angle in rad of a steady acceleration from angle 0."""
    time = np.arange(round(duration_s * RATE_HZ)) / RATE_HZ
    return speed_rad_s * time + ramp_rad_s2 * time**2 / 2


def signal(angle: NDArray[np.float64], components: Iterable[Component]) -> NDArray[np.float64]:
    """Return the sum of A cos(order angle + phase)."""
    total = np.zeros(len(angle))
    for order, amplitude, phase in components:
        total += amplitude * np.cos(order * angle + phase)
    return total


def table(
    angle: NDArray[np.float64],
    channels: Mapping[str, NDArray[np.float64]],
    dtype: np.dtype[np.void] = WAVEFORM_DTYPE,
    load_factor: float = 1.0,
) -> NDArray[np.void]:
    """Return waveform rows; channels that are not given are at rest. `time` is set by `blocks`."""
    rows = np.zeros(len(angle), dtype)
    rows['sample'] = np.arange(len(angle))
    if 'angle' in (dtype.names or ()):
        rows['angle'] = angle
    if 'load_y' in (dtype.names or ()):
        rows['load_y'] = 9.81 * load_factor
    for name, values in channels.items():
        rows[name] = values
    return rows


def blocks(
    rows: NDArray[np.void], sizes: int | Iterable[int], rate_hz: int = RATE_HZ
) -> list[WaveformBlock]:
    """Cut rows into blocks of equal size, or of the given sizes and a last one of the rest."""
    given = range(sizes, len(rows), sizes) if isinstance(sizes, int) else np.cumsum(list(sizes))
    cuts = [int(cut) for cut in given if 0 < cut < len(rows)]
    result = []
    for start, stop in zip([0, *cuts], [*cuts, len(rows)], strict=True):
        part = rows[start:stop].copy()
        part['time'] = np.arange(stop - start) / rate_hz
        stamp_ns = sample_stamp_ns(EPOCH_NS, int(part['sample'][0]), rate_hz)
        result.append(WaveformBlock(stamp_ns, part))
    return result


def run(monitor: VibrationMonitor, stream: Iterable[WaveformBlock]) -> list[IndicatorRecord]:
    """Return all records of a stream."""
    return [record for block in stream for record in monitor.push(block)]


def wrapped(angle: float) -> float:
    """Return an angle difference in (-pi, pi]."""
    return math.remainder(angle, 2 * math.pi)


def same(
    first: list[IndicatorRecord], second: list[IndicatorRecord], *, alarm: bool = True
) -> bool:
    """Say whether two lists of records agree in every bit (NaN equals NaN)."""

    def key(record: IndicatorRecord) -> tuple[object, ...]:
        spectrum = record.spectrum
        return (
            record.window,
            record.first_sample,
            record.last_sample,
            record.stamp_ns,
            record.valid,
            record.reason,
            record.names,
            record.values.tobytes(),
            None
            if spectrum is None
            else (
                spectrum.orders.tobytes(),
                spectrum.frequency_hz.tobytes(),
                [(name, values.tobytes()) for name, values in spectrum.amplitudes.items()],
            ),
            record.alarm if alarm else None,
        )

    return [key(record) for record in first] == [key(record) for record in second]
