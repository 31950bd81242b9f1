# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""What the samples of a recording say where it holds no window of revolutions."""

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.table import Table

from rotor_interfaces.waveform import WaveformBlock
from vibration_monitor.config import MonitorConfig
from vibration_monitor.indicators import channels_of, statistics
from vibration_monitor.names import indicator_unit
from vibration_monitor.reading import Recording, waveform_blocks


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
        """Return the statistics for people."""
        heads = ('channel', 'unit', 'rms', 'peak', 'crest factor', 'kurtosis', 'samples', 'lost')
        table = Table(*heads, title='all samples, about their mean')
        for name, found in self.channels.items():
            numbers = (found.rms, found.peak, found.crest_factor, found.kurtosis)
            counts = (found.samples, found.samples_without_number)
            table.add_row(name, found.unit, *(f'{x:.4g}' for x in numbers), *map(str, counts))
        return table


def sample_statistics(path: Path, config: MonitorConfig, fault: str = '') -> SampleStatistics:
    """Return the statistics of the samples of a recording without a valid window.

    Args:
        path: the recording, which holds `rotor/waveform`.
        config: of the monitor that found no window.
        fault: what the monitor says was wrong, where it says so.

    """
    recording = Recording(path)
    units = (recording.config() or {}).get('column_units', {})
    parts: dict[str, list[NDArray[np.float64]]] = {}
    turned = _Turned()
    for block in waveform_blocks(recording):
        turned.take(block)
        for name in channels_of(block.columns, config.channels):
            if name in block.columns:
                parts.setdefault(name, []).append(block.rows[name].astype(np.float64))
    channels = {
        name: _of_channel(pieces, units.get(name) or indicator_unit(f'{name}/rms'))
        for name, pieces in parts.items()
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


def _of_channel(pieces: Iterable[NDArray[np.float64]], unit: str) -> ChannelStatistics:
    samples = np.concatenate([*pieces])
    finite = samples[np.isfinite(samples)]
    rms, crest, kurtosis = math.nan, math.nan, math.nan
    # as in a window: a sensor that does not move at all is dead
    if len(finite) and finite.max() > finite.min():
        rms, crest, kurtosis = statistics(finite)
    return ChannelStatistics(
        samples=len(finite),
        samples_without_number=len(samples) - len(finite),
        rms=rms,
        peak=rms * crest,
        crest_factor=crest,
        kurtosis=kurtosis,
        unit=unit,
    )
