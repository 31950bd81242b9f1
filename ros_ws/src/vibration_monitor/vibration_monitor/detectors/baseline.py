# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The rig's own detector: the crack estimate, with a baseline of the machine.

It is the live monitor itself, with the extra `crack`: the score is `crack_ratio_low`, on which the
live alarm stands, and which must hold for 160 revolutions.
"""

import math
from collections.abc import Iterable, Iterator, Mapping

from rotor_interfaces.waveform import WaveformBlock
from vibration_monitor.crack_baseline import learn_baseline
from vibration_monitor.crack_model import PROBES, CrackBaseline, CrackConfig, CrackWindow
from vibration_monitor.detectors.protocol import SILENT, Verdict
from vibration_monitor.monitor import IndicatorRecord, VibrationMonitor
from vibration_monitor.monitor_config import MonitorConfig

_LEVEL_SHARE = 0.8
"""The difference from the reference alone never raises the score above this part of the alarm."""

_SILENCE_S = 10.0
"""Without a window (no shaft angle) for this long the verdict is SILENT."""

_MONITOR = MonitorConfig(
    channels=PROBES, orders=(1.0, 2.0, 3.0), extras=('crack',), hop_revolutions=32
)


class BaselineDetector:
    """Watches one machine; see `vibration_monitor.detectors.protocol.Detector`."""

    alarm_score = 0.005

    def __init__(self) -> None:
        self._monitor = VibrationMonitor(_MONITOR)
        self._verdict = SILENT
        self._told_s = math.nan

    def fit(self, flights: Iterable[Iterable[WaveformBlock]]) -> None:
        """Learn stiffness, damping, probe errors, runout and misalignment of this machine."""
        crack = CrackConfig(baseline=baseline_of(flights))
        self._monitor = VibrationMonitor(_MONITOR.model_copy(update={'crack': crack}))

    def push(self, block: WaveformBlock) -> Verdict:
        """Take the next block of the flight under test; return what is known now."""
        end_s = float(block.rows['time'][-1])
        for record in self._monitor.push(block):
            self._verdict = self._judge(record.indicators())
            self._told_s = end_s
        if end_s - self._told_s > _SILENCE_S:
            self._verdict = SILENT
        return self._verdict

    def _judge(self, found: Mapping[str, float]) -> Verdict:
        lowest = found['crack_ratio_low']
        if math.isnan(lowest):
            return SILENT
        level = max(0.0, found['crack_reference_ratio_low'])  # NaN (no baseline) is 0 too
        share = _LEVEL_SHARE * self.alarm_score * level / (level + self.alarm_score)
        if share > max(lowest, 0.0):
            return Verdict(
                share, f'differs from the reference flights as a crack of K > {level:.3f} would'
            )
        return Verdict(
            lowest,
            f'changes with the load as a crack of K = {found["crack_ratio"]:.3f} would, at least '
            f'{lowest:.3f}, at {math.degrees(found["crack_angle"]):.0f} degrees from the mark of '
            'angle 0 (equivalent loads of the disk at 2x and 3x)',
        )


def reference_monitor() -> VibrationMonitor:
    """Return a monitor whose records a baseline is learnt from; each flight needs a new one."""
    return VibrationMonitor(_MONITOR.model_copy(update={'extras': ()}))


def baseline_of(flights: Iterable[Iterable[WaveformBlock]]) -> CrackBaseline:
    """Return the baseline of one machine from healthy flights, each a stream of blocks.

    Raises:
        MonitorError: no window of them has all of `crack_model.PROBES`.

    """
    return baseline_of_records(_records(flight) for flight in flights)


def baseline_of_records(flights: Iterable[Iterable[IndicatorRecord]]) -> CrackBaseline:
    """Return the baseline from flights that are each the records of a `reference_monitor`.

    Raises:
        MonitorError: no window of them has all of `crack_model.PROBES`.

    """
    windows = [
        CrackWindow.of(record.indicators(), _MONITOR.hop_revolutions)
        for flight in flights
        for record in flight
        if record.valid
    ]
    return learn_baseline(windows, _MONITOR.crack, _MONITOR.ball_pass_order)


def _records(flight: Iterable[WaveformBlock]) -> Iterator[IndicatorRecord]:
    monitor = reference_monitor()
    for block in flight:
        yield from monitor.push(block)
