# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The monitor over a recording: windows, summary, and files of both."""

import csv
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rotor_bringup.display import RunState
from rotor_bringup.errors import ScenarioError
from rotor_bringup.out_path import check_file
from rotor_bringup.pipeline import analyze_blocks
from rotor_bringup.sample_statistics import SampleStatistics, sample_statistics
from rotor_interfaces.messages import NANOSECONDS
from rotor_interfaces.waveform import WaveformBlock
from vibration_monitor.config import MonitorConfig
from vibration_monitor.monitor import IndicatorRecord, VibrationMonitor
from vibration_monitor.names import shown_channel
from vibration_monitor.reading import Recording, waveform_name

HIGHLIGHTS = (
    *(f'amplitude_order_{order}' for order in ('1', '2', '3')),
    *(f'ratio_{order}_1' for order in ('2', '2.5', '3', '4')),
    'rms',
    'crest_factor',
    'kurtosis',
)
"""Of the shown channel."""


@dataclass(frozen=True)
class Analysis:
    """What the monitor said about one recording; `damage` are sentences about what is missing.

    `samples` is there where no window is valid.
    """

    records: list[IndicatorRecord]
    state: RunState
    damage: list[str]
    lost_samples: int
    samples: SampleStatistics | None = None

    def highlights(self) -> Iterator[tuple[str, float, float]]:
        """Yield name, median and largest value over the valid windows (SI units)."""
        names = self.records[0].names if self.records else ()
        channel = shown_channel(names)
        for name in ('speed_rad_s', 'load_factor', *(f'{channel}/{kind}' for kind in HIGHLIGHTS)):
            values = np.array([dict(zip(r.names, r.values, strict=True)).get(name, math.nan)
                               for r in self.records if r.valid])  # fmt: skip
            values = values[np.isfinite(values)]
            if values.size:
                yield name, float(np.median(values)), float(values.max())

    def summary(self) -> dict[str, Any]:
        """Return the summary for --json."""
        short = self.samples
        return {
            **self.state.as_dict(),
            'lost_samples': self.lost_samples,
            'damage': self.damage,
            'indicators': {
                name: {'median': median, 'largest': largest}
                for name, median, largest in self.highlights()
            },
            **({'no_window': short.reason, 'sample_statistics': short.as_dict()} if short else {}),
        }


def analyze_recording(path: Path, waveform_topic: str | None = None) -> Analysis:
    """Run the monitor, configured as in the recorded run, over a recording.

    Times are those of the samples: they count from the first sample of the run in the recording.

    Args:
        path: folder of a bag or a file of one.
        waveform_topic: full name of the waveform; None: `rotor/waveform` of the one rig there.

    Raises:
        RecordingError: not a recording, or no `rotor/waveform` in it.
        ScenarioError: no block of it can be analyzed.

    """
    recording = Recording(path, waveform_topic)
    name = waveform_name(recording)
    config = recording.config() or {}
    if not isinstance(config.get('scenario', {}), dict):
        recording.note('the scenario in its run configuration is not a mapping and is ignored')
    monitor = VibrationMonitor(MonitorConfig.of_run(config))
    state = RunState(0.0)
    start_ns = None
    runs = 0
    records = []
    for block, windows in analyze_blocks(recording, monitor):
        first_ns, end_ns = _span_ns(block)
        status = monitor.status()
        if start_ns is None or runs != status['restarts [1]']:
            start_ns, runs = first_ns, int(status['restarts [1]'])
        for window in windows:
            state.take_record(window, (window.stamp_ns - start_ns) / NANOSECONDS)
            records.append(window)
        state.advance((end_ns - start_ns) / NANOSECONDS)
    if start_ns is None:
        reasons = '; '.join(recording.damage) or 'its topic is empty'
        raise ScenarioError(f'{path} holds no block of {name} that can be analyzed ({reasons})')
    if runs:
        recording.note(
            f'the sample index falls back {runs} times: another run begins there, and times count '
            'from its first sample'
        )
    samples = None
    if not any(record.valid for record in records):
        fault = records[-1].reason if records else str(monitor.status()['last fault'])
        samples = sample_statistics(path, monitor.config, fault, waveform_topic)
    return Analysis(
        records, state, list(recording.damage), int(monitor.status()['lost samples [1]']), samples
    )


def _span_ns(block: WaveformBlock) -> tuple[int, int]:
    """Return the times of the first sample of a block, and of the one after its last, in ns."""
    time_s = block.rows['time'].astype(float)
    step_s = (time_s[-1] - time_s[0]) / max(len(time_s) - 1, 1)
    first_ns, end_ns = (round(float(t) * NANOSECONDS) for t in (time_s[0], time_s[-1] + step_s))
    return block.stamp_ns + first_ns, block.stamp_ns + end_ns


def check_windows_path(path: Path) -> None:
    """Raise ConfigError unless `path` ends in .json or .csv and can be written."""
    check_file(path, _WRITERS)


def save_windows(analysis: Analysis, path: Path) -> None:
    """Write every window to `path`: .json, or .csv with one row a window; NaN is null or empty.

    Raises:
        ConfigError: another ending, or a folder that is not there.
        ScenarioError: a path that cannot be written.

    """
    check_windows_path(path)
    try:
        _WRITERS[path.suffix](analysis, path)
    except OSError as error:
        raise ScenarioError(f'--out {path} cannot be written: {error.strerror}') from None


def _rows(analysis: Analysis) -> Iterator[dict[str, Any]]:
    for record in analysis.records:
        yield {
            'window': record.window,
            'first_sample': record.first_sample,
            'last_sample': record.last_sample,
            'stamp_ns': record.stamp_ns,
            'valid': record.valid,
            'alarm': record.alarm.level.name,
            **{
                name: value if math.isfinite(value) else None
                for name, value in zip(record.names, record.values.tolist(), strict=True)
            },
        }


def _write_json(analysis: Analysis, path: Path) -> None:
    path.write_text(json.dumps(list(_rows(analysis)), indent=1), 'utf-8')


def _write_csv(analysis: Analysis, path: Path) -> None:
    with path.open('w', newline='', encoding='utf-8') as file:
        rows = list(_rows(analysis))
        writer = csv.DictWriter(file, list(rows[0]) if rows else ['window'])
        writer.writeheader()
        writer.writerows(rows)


_WRITERS = {'.json': _write_json, '.csv': _write_csv}
