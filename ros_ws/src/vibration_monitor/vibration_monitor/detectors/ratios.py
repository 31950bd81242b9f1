# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Detector (a): fixed textbook limits on the super-harmonics 2x and 3x relative to 1x."""

import math
from collections.abc import Iterable

from rotor_interfaces.waveform import WaveformBlock
from vibration_monitor.detectors.protocol import SILENT, Verdict
from vibration_monitor.monitor import IndicatorRecord, VibrationMonitor
from vibration_monitor.monitor_config import MonitorConfig
from vibration_monitor.persistence import Persistence

LIMITS = {'disk_z/ratio_2_1': 0.3, 'disk_z/ratio_3_1': 0.5}
"""Limits above what a healthy rotor of this kind shows in steady flight (docs/monitor.md)."""
REQUIRED, OUT_OF = 3, 5
"""A level is reached when REQUIRED of the last OUT_OF windows reach it."""


class RatioDetector:
    """A2/A1 and A3/A1 of the disk against fixed limits.

    Score = ratio over its limit, the higher of the two, reached by 3 of the last 5 windows.
    Nothing is learnt from the reference flights.
    """

    alarm_score = 1.0

    def __init__(self) -> None:
        config = MonitorConfig(channels=('disk_z',), extras=(), hop_revolutions=32)
        self._monitor = VibrationMonitor(config)
        self._levels = {indicator: Persistence(REQUIRED, OUT_OF) for indicator in LIMITS}
        self._verdict = SILENT

    def fit(self, flights: Iterable[Iterable[WaveformBlock]]) -> None:
        """Learn nothing: the limits are fixed."""

    def push(self, block: WaveformBlock) -> Verdict:
        """Take the next block; the verdict is that of the last complete window."""
        for record in self._monitor.push(block):
            self._verdict = self._judge(record)
        return self._verdict

    def _judge(self, record: IndicatorRecord) -> Verdict:
        best = SILENT
        for indicator, limit in LIMITS.items():
            score = self._levels[indicator].update(record.value(indicator) / limit)
            if math.isnan(score) or score <= best.score:
                continue
            best = Verdict(score, f'{indicator} reaches {score:.2f} times its limit {limit:g}')
        return best
