# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Runs the monitor over a recording and writes its windows and summary to files."""

import csv
import json
import math
import os
import textwrap
from array import array
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from rotor_bringup.display import RunState
from rotor_bringup.sample_statistics import SampleStatistics, sample_statistics
from rotor_common.constants import NANOSECONDS
from rotor_common.errors import ConfigError
from rotor_common.out_path import check_file
from rotor_common.plugins import load, names_of, target_of
from rotor_interfaces.channels import shown_channel
from rotor_interfaces.waveform import WaveformBlock
from rotor_recording.reading import Recording, waveform_name
from rotor_rig.errors import ScenarioError
from rotor_rig.pipeline import analyze_blocks
from vibration_monitor.monitor import IndicatorRecord, VibrationMonitor
from vibration_monitor.monitor_config import MonitorConfig

FORMATS = 'rotor_rig.window_files'
"""The group of entry points of formats that users add: the name is the ending without its dot."""
HIGHLIGHTS = (
    *(f'amplitude_order_{order}' for order in ('1', '2', '3')),
    *(f'ratio_{order}_1' for order in ('2', '2.5', '3', '4')),
    'rms',
    'crest_factor',
    'kurtosis',
)
"""Indicators of the shown channel that the summary has."""


@dataclass(frozen=True)
class AnalyzedRecording:
    """The monitor's result for one recording; `damage` are sentences about what is missing.

    `highlights` are name, median and largest value over the valid windows (SI units); `samples`
    is set only if no window is valid.
    """

    state: RunState
    damage: list[str]
    lost_samples: int
    highlights: list[tuple[str, float, float]]
    samples: SampleStatistics | None = None

    def summary(self) -> dict[str, Any]:
        """Return the summary for --json."""
        short = self.samples
        return {
            **self.state.as_dict(),
            'lost_samples': self.lost_samples,
            'damage': self.damage,
            'indicators': {
                name: {'median': median, 'largest': largest}
                for name, median, largest in self.highlights
            },
            **({'no_window': short.reason, 'sample_statistics': short.as_dict()} if short else {}),
        }


class _Highlights:
    """The values over the valid windows for `AnalyzedRecording.highlights`.

    They take only a hundred bytes a window, so that all are kept and medians are exact.
    """

    def __init__(self) -> None:
        self._values: dict[str, array[float]] | None = None

    def take(self, record: IndicatorRecord) -> None:
        """Take the next window; the first one decides which channel is shown."""
        if self._values is None:
            channel = shown_channel(record.names)
            shown = ('speed_rad_s', 'load_factor', *(f'{channel}/{kind}' for kind in HIGHLIGHTS))
            self._values = {name: array('d') for name in shown}
        if not record.valid:
            return
        found = record.indicators()
        for name, values in self._values.items():
            if math.isfinite(value := found.get(name, math.nan)):
                values.append(value)

    def result(self) -> Iterator[tuple[str, float, float]]:
        """Yield name, median and largest value of all that had a value."""
        for name, values in (self._values or {}).items():
            if values:
                yield name, float(np.median(values)), max(values)


def analyze_recording(
    path: Path,
    waveform_topic: str | None = None,
    on_window: Callable[[IndicatorRecord], None] | None = None,
) -> AnalyzedRecording:
    """Run the monitor, configured as in the recorded run, over a recording of any length.

    Times are those of the samples: they count from the first sample of the run in the recording.

    Args:
        path: folder of a bag or a file of one.
        waveform_topic: full name of the waveform; None: `rotor/waveform` of the one rig there.
        on_window: takes every window as it comes; none is kept.

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
    highlights = _Highlights()
    fault = ''
    is_any_valid = False
    for block, windows in analyze_blocks(recording, monitor):
        first_ns, end_ns = _span_ns(block)
        status = monitor.status()
        if start_ns is None or runs != status['restarts [1]']:
            start_ns, runs = first_ns, int(status['restarts [1]'])
        for window in windows:
            state.take_record(window, (window.stamp_ns - start_ns) / NANOSECONDS)
            highlights.take(window)
            is_any_valid |= window.valid
            fault = window.reason
            if on_window is not None:
                on_window(window)
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
    if not is_any_valid:
        fault = fault if state.windows else str(monitor.status()['last fault'])
        samples = sample_statistics(path, monitor.config, fault, waveform_topic)
    lost_samples = int(monitor.status()['lost samples [1]'])
    return AnalyzedRecording(
        state, list(recording.damage), lost_samples, [*highlights.result()], samples
    )


def _span_ns(block: WaveformBlock) -> tuple[int, int]:
    """Return the times of the first sample of a block, and of the one after its last, in ns."""
    time_s = block.rows['time'].astype(float)
    step_s = (time_s[-1] - time_s[0]) / max(len(time_s) - 1, 1)
    first_ns, end_ns = (round(float(t) * NANOSECONDS) for t in (time_s[0], time_s[-1] + step_s))
    return block.stamp_ns + first_ns, block.stamp_ns + end_ns


def check_windows_path(path: Path) -> None:
    """Raise ConfigError unless `path` has the ending of a format and can be written."""
    check_file(path, (*_WRITERS, *(f'.{name}' for name in names_of(FORMATS))))


def _writer_class(ending: str) -> Any:
    """Return the class that writes such files: built in, or of a user's package."""
    target = target_of(ending[1:], FORMATS) or ''
    return _WRITERS.get(ending) or load(target, 'output format', ConfigError)


@contextmanager
def windows_file(path: Path) -> Iterator[Callable[[IndicatorRecord], None]]:
    """Yield a function that writes each window it is given, in the format of the ending.

    NaN is null or empty. The file gets its name when all is written; before that, and after an
    error, there is no file, or the old one.

    Raises:
        ConfigError: an unknown ending, or a missing folder.
        ScenarioError: a path that cannot be written.

    """
    check_windows_path(path)
    writer_class = _writer_class(path.suffix)
    unfinished = path.with_name(f'{path.name}.{os.getpid()}.tmp')
    try:
        with _refused(path):
            file = unfinished.open('w', newline='', encoding='utf-8')
        with file:
            writer = writer_class(file)

            def take(record: IndicatorRecord) -> None:
                with _refused(path):
                    writer.take(_row(record))

            yield take
            with _refused(path):
                writer.finish()
                file.flush()
        with _refused(path):
            unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)


@contextmanager
def _refused(path: Path) -> Iterator[None]:
    """Turn an OSError into a ScenarioError that names the file."""
    try:
        yield
    except OSError as error:
        raise ScenarioError(f'--out {path} cannot be written: {error.strerror}') from None


def _row(record: IndicatorRecord) -> dict[str, Any]:
    return {
        'window': record.window,
        'first_sample': record.first_sample,
        'last_sample': record.last_sample,
        'stamp_ns': record.stamp_ns,
        'valid': record.valid,
        'alarm': record.alarm.level.name,
        **{
            name: value if math.isfinite(value) else None
            for name, value in record.indicators().items()
        },
    }


class _JsonWriter:
    """A list of mappings, one a window."""

    def __init__(self, file: TextIO) -> None:
        self._file = file
        self._between = '['

    def take(self, row: dict[str, Any]) -> None:
        """Write the next window."""
        text = textwrap.indent(json.dumps(row, indent=1), ' ')
        self._file.write(f'{self._between}\n{text}')
        self._between = ','

    def finish(self) -> None:
        """End the list."""
        self._file.write('[]' if self._between == '[' else '\n]')


class _CsvWriter:
    """One row a window, below the names of the first."""

    def __init__(self, file: TextIO) -> None:
        self._file = file
        self._writer: csv.DictWriter[str] | None = None

    def take(self, row: dict[str, Any]) -> None:
        """Write the next window."""
        if self._writer is None:
            self._begin(list(row))
        assert self._writer is not None  # noqa: S101 - for mypy: just begun
        try:
            self._writer.writerow(row)
        except ValueError:
            raise ScenarioError(
                f'--out: window {row["window"]} has other indicators than the first, which one '
                'table cannot hold; write .json instead'
            ) from None

    def _begin(self, names: list[str]) -> None:
        self._writer = csv.DictWriter(self._file, names)
        self._writer.writeheader()

    def finish(self) -> None:
        """Write the head of a table without rows."""
        if self._writer is None:
            self._begin(['window'])


_WRITERS: dict[str, type[_JsonWriter | _CsvWriter]] = {'.json': _JsonWriter, '.csv': _CsvWriter}
