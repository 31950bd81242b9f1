# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Statistics of the raw samples, for recordings too short for a window of revolutions."""

import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.table import Table

from rotor_interfaces.channels import channel_unit, channels_of
from rotor_interfaces.waveform import WaveformBlock
from rotor_recording.reading import Recording, waveform_blocks
from vibration_monitor.monitor_config import MonitorConfig


@dataclass(frozen=True)
class ChannelStatistics:
    """Statistics of one channel over all its samples that are numbers, about their mean.

    `peak` is the largest distance from the mean; `rms` and `peak` are in `unit`.
    """

    samples: int
    samples_without_number: int
    rms: float
    peak: float
    crest_factor: float
    kurtosis: float
    unit: str


@dataclass(frozen=True)
class SampleStatistics:
    """Why there is no window, and the statistics of each channel."""

    reason: str
    channels: dict[str, ChannelStatistics]

    def as_dict(self) -> dict[str, Any]:
        """Return the statistics for --json."""
        return {name: asdict(found) for name, found in self.channels.items()}

    def table(self) -> Table:
        """Return the statistics as a table for the terminal."""
        heads = ('channel', 'unit', 'rms', 'peak', 'crest factor', 'kurtosis', 'samples', 'lost')
        table = Table(*heads, title='all samples, about their mean')
        for name, found in self.channels.items():
            numbers = (found.rms, found.peak, found.crest_factor, found.kurtosis)
            counts = (found.samples, found.samples_without_number)
            table.add_row(name, found.unit, *(f'{x:.4g}' for x in numbers), *map(str, counts))
        return table


def sample_statistics(
    path: Path, config: MonitorConfig, fault: str = '', waveform_topic: str | None = None
) -> SampleStatistics:
    """Return the statistics of the samples of a recording without a valid window.

    The file is read twice, for the means and for the moments about them, so that its length does
    not matter.

    Args:
        path: the recording, which holds the waveform.
        config: of the monitor that found no window.
        fault: the monitor's last fault, '' if it has none.
        waveform_topic: full name of the waveform; None: `rotor/waveform` of the one rig there.

    """
    recording = Recording(path, waveform_topic)
    told = (recording.config() or {}).get('column_units')
    units = told if isinstance(told, dict) else {}
    found: dict[str, _Moments] = {}
    turned = _Turned()
    for block in waveform_blocks(recording):
        turned.take(block)
        for name in channels_of(block.columns, config.channels):
            if name in block.columns:
                found.setdefault(name, _Moments()).take_for_mean(block.rows[name])
    for block in waveform_blocks(recording):
        for name in found.keys() & set(block.columns):
            found[name].take_for_moments(block.rows[name])
    channels = {
        name: moments.statistics(str(units.get(name) or channel_unit(name)))
        for name, moments in found.items()
    }
    return SampleStatistics(turned.reason(config, fault), channels)


class _Turned:
    """The revolutions that a recording spans."""

    def __init__(self) -> None:
        self._first, self._last = math.inf, -math.inf

    def take(self, block: WaveformBlock) -> None:
        """Take the next block."""
        if 'angle' not in block.columns:
            return
        angles = block.rows['angle'][np.isfinite(block.rows['angle'])] / (2 * math.pi)
        self._first = min(self._first, float(angles.min(initial=math.inf)))
        self._last = max(self._last, float(angles.max(initial=-math.inf)))

    def reason(self, config: MonitorConfig, fault: str) -> str:
        """Return why no window fits."""
        if self._first > self._last:
            return fault or 'the shaft angle is missing'
        window, hop = config.window_revolutions, config.hop_revolutions
        if self._last - self._first < window:
            return (
                f'the shaft turns {self._last - self._first:.1f} times, and a window takes '
                f'{window} revolutions'
            )
        return fault or (
            f'no {window} revolutions from a multiple of {hop} on lie between revolutions '
            f'{self._first:.1f} and {self._last:.1f}'
        )


class _Moments:
    """Mean of one channel, then its second and fourth moment about that mean."""

    def __init__(self) -> None:
        self._count = 0
        self._without_number = 0
        self._sum = 0.0
        self._lowest, self._highest = math.inf, -math.inf
        self._second = self._fourth = 0.0

    def take_for_mean(self, samples: NDArray[Any]) -> None:
        """Take the next samples, in the first reading."""
        finite = samples[np.isfinite(samples)].astype(np.float64)
        self._count += len(finite)
        self._without_number += len(samples) - len(finite)
        self._sum += float(finite.sum())
        self._lowest = min(self._lowest, float(finite.min(initial=math.inf)))
        self._highest = max(self._highest, float(finite.max(initial=-math.inf)))

    def take_for_moments(self, samples: NDArray[Any]) -> None:
        """Take the next samples, in the second reading."""
        finite = samples[np.isfinite(samples)].astype(np.float64)
        with np.errstate(over='ignore', invalid='ignore'):  # beyond float64 there is no moment
            squares = (finite - self._sum / max(self._count, 1)) ** 2
            self._second += float(squares.sum())
            self._fourth += float((squares**2).sum())

    def statistics(self, unit: str) -> ChannelStatistics:
        """Return the statistics, NaN for a sensor that does not move at all, as in a window."""
        rms = peak = crest_factor = kurtosis = math.nan
        if self._count and self._highest > self._lowest:
            mean, square = self._sum / self._count, np.float64(self._second / self._count)
            rms = float(np.sqrt(square))
            peak = max(self._highest - mean, mean - self._lowest)
            with np.errstate(all='ignore'):
                crest_factor = float(peak / np.sqrt(square))
                kurtosis = float(self._fourth / self._count / square**2)
        return ChannelStatistics(
            samples=self._count,
            samples_without_number=self._without_number,
            rms=rms,
            peak=peak,
            crest_factor=crest_factor,
            kurtosis=kurtosis,
            unit=unit,
        )
