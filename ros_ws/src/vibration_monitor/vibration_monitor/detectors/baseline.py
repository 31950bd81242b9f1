# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Our detector: the crack that the load's change, or the machine's own baseline, speaks for.

The estimate of `crack`, window after window, is what the live monitor publishes too. The score is
what the crack stiffness ratio K is at least, and must hold for a number of windows.
"""

import math
from collections import deque
from collections.abc import Iterable, Iterator

from rotor_interfaces.waveform import WaveformBlock
from vibration_monitor.config import MonitorConfig
from vibration_monitor.crack import (
    PROBES,
    UNKNOWN,
    CrackBaseline,
    CrackConfig,
    CrackEstimate,
    CrackEstimator,
    CrackWindow,
    learn_baseline,
)
from vibration_monitor.detectors.protocol import SILENT, Verdict
from vibration_monitor.monitor import VibrationMonitor
from vibration_monitor.trend import overlap_inflation

PERSISTENCE_WINDOWS = 5
"""The score is the least of so many estimates in a row; windows without one do not count."""

_LEVEL_SHARE = 0.8
"""The difference from the reference alone never takes the score beyond this part of the alarm."""

_MONITOR = MonitorConfig(channels=PROBES, orders=(1.0, 2.0, 3.0), extras=(), hop_revolutions=32)
_INFLATION = overlap_inflation(_MONITOR.window_revolutions, _MONITOR.hop_revolutions)


class BaselineDetector:
    """Watches one machine; see `vibration_monitor.detectors.protocol.Detector`."""

    alarm_score = 0.005

    def __init__(self) -> None:
        self._monitor = VibrationMonitor(_MONITOR)
        self._estimator = CrackEstimator(CrackConfig(), _INFLATION)
        self._by_load = _Persistence()
        self._by_reference = _Persistence()

    def fit(self, flights: Iterable[Iterable[WaveformBlock]]) -> None:
        """Learn the shaft's stiffness, runout and misalignment of this machine."""
        self._estimator = CrackEstimator(CrackConfig(baseline=baseline_of(flights)), _INFLATION)

    def push(self, block: WaveformBlock) -> Verdict:
        """Take the next block of the flight under test; return what is known now."""
        for record in self._monitor.push(block):
            window = CrackWindow.of(record.indicators(), _MONITOR.hop_revolutions)
            findings = self._estimator.update(window)
            self._by_load.add(findings.by_load)
            self._by_reference.add(findings.by_reference)
        return self._verdict()

    def _verdict(self) -> Verdict:
        by_load, by_reference = self._by_load.least(), self._by_reference.least()
        if math.isnan(by_load.lowest):
            return SILENT
        level = max(by_reference.lowest, 0.0)
        level *= _LEVEL_SHARE * self.alarm_score / (level + self.alarm_score)
        if level > max(by_load.lowest, 0.0):
            return Verdict(level, f'differs from the reference flights as {_words(by_reference)}')
        return Verdict(by_load.lowest, f'changes with the load as {_words(by_load)}')


class _Persistence:
    """The last estimates in a row."""

    def __init__(self) -> None:
        self._recent: deque[CrackEstimate] = deque(maxlen=PERSISTENCE_WINDOWS)

    def add(self, estimate: CrackEstimate) -> None:
        if not math.isnan(estimate.lowest):
            self._recent.append(estimate)

    def least(self) -> CrackEstimate:
        """Return the estimate that says least, UNKNOWN while there are too few."""
        if len(self._recent) < PERSISTENCE_WINDOWS:
            return UNKNOWN
        return min(self._recent, key=lambda estimate: estimate.lowest)


def _words(estimate: CrackEstimate) -> str:
    return (
        f'a crack of K = {estimate.ratio:.3f} would, at least {estimate.lowest:.3f}, at '
        f'{math.degrees(estimate.angle_rad):.0f} degrees from the mark of angle 0 (equivalent '
        'loads of the disk at 2x and 3x)'
    )


def baseline_of(flights: Iterable[Iterable[WaveformBlock]]) -> CrackBaseline:
    """Return what healthy flights of one machine teach, each a stream of blocks.

    Raises:
        MonitorError: no window of them has all of `crack.PROBES`.

    """
    windows = [window for flight in flights for window in _windows(flight)]
    return learn_baseline(windows, CrackConfig(), _MONITOR.ball_pass_order)


def _windows(flight: Iterable[WaveformBlock]) -> Iterator[CrackWindow]:
    monitor = VibrationMonitor(_MONITOR)
    for block in flight:
        for record in monitor.push(block):
            if record.valid:
                yield CrackWindow.of(record.indicators(), _MONITOR.hop_revolutions)
