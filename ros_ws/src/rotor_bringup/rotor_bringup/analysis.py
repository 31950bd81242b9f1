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

from rotor_bringup.display import RunState, shown_channel
from rotor_bringup.errors import ScenarioError
from rotor_bringup.out_path import check_file
from rotor_bringup.pipeline import analyze
from vibration_monitor.config import MonitorConfig
from vibration_monitor.monitor import IndicatorRecord, VibrationMonitor
from vibration_monitor.reading import Recording

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
    """What the monitor said about one recording; `damage` are sentences about what is missing."""

    records: list[IndicatorRecord]
    state: RunState
    damage: list[str]
    lost_samples: int

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
        return {
            **self.state.as_dict(),
            'lost_samples': self.lost_samples,
            'damage': self.damage,
            'indicators': {
                name: {'median': median, 'largest': largest}
                for name, median, largest in self.highlights()
            },
        }


def analyze_recording(path: Path) -> Analysis:
    """Run the monitor, configured as in the recorded run, over a recording.

    Raises:
        RecordingError: not a recording, or no `rotor/waveform` in it.

    """
    recording = Recording(path)
    scenario = (recording.config() or {}).get('scenario', {})
    if not isinstance(scenario, dict):
        recording.note('the scenario in its run configuration is not a mapping and is ignored')
        scenario = {}
    monitor = VibrationMonitor(MonitorConfig.from_mapping(scenario.get('monitor', {}), 'monitor'))
    state = RunState(0.0)
    start_ns = recording.start_ns or 0
    records = []
    for window in analyze(recording, monitor):
        state.advance((window.stamp_ns - start_ns) * 1e-9)
        state.take_indicators(dict(zip(window.names, window.values, strict=True)))
        state.take_alarm(
            int(window.alarm.level), '; '.join(window.alarm.reasons), state.simulated_s
        )
        records.append(window)
    if not monitor.status()['blocks [1]']:
        raise ScenarioError(f'{path} holds no rotor/waveform, so there is nothing to analyse')
    return Analysis(
        records, state, list(recording.damage), int(monitor.status()['lost samples [1]'])
    )


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
