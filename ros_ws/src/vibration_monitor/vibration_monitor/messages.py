# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Messages about one window, live or offline."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from rotor_common.constants import NANOSECONDS
from rotor_interfaces import messages, topics
from rotor_interfaces.messages import MessageFactory
from rotor_interfaces.topics import ROTOR_FRAME, Topic
from rotor_interfaces.waveform import WaveformBlock, encode
from vibration_monitor.detection import AlarmState
from vibration_monitor.indicators import OrderSpectrum
from vibration_monitor.monitor import IndicatorRecord, VibrationMonitor

Outgoing = tuple[Topic, int, Any]
"""Topic, stamp in ns, message."""


class MonitorMessages:
    """Turns the monitor's results into messages; the alarm is sent on change and at 1 Hz."""

    def __init__(self, factory: MessageFactory) -> None:
        self._factory = factory
        self._alarm: AlarmState | None = None
        self._alarm_second = -1

    def after_block(
        self, monitor: VibrationMonitor, records: Sequence[IndicatorRecord], stamp_ns: int
    ) -> Iterator[Outgoing]:
        """Yield the messages of one block: its windows, and the alarm where it is due.

        `stamp_ns` is the block's: the 1 Hz is counted in the time of the data.
        """
        for record in records:
            yield from self._window(record)
            if self._alarm is None or record.alarm.level is not self._alarm.level:
                yield self._alarm_message(record.stamp_ns, record.alarm)
        second = stamp_ns // NANOSECONDS
        alarm = monitor.alarm
        if second != self._alarm_second or (self._alarm and alarm.level is not self._alarm.level):
            self._alarm_second = second
            yield self._alarm_message(stamp_ns, alarm)

    def of_silence(self, stamp_ns: int, text: str) -> Outgoing:
        """Return the alarm for a source that has fallen silent: STALE."""
        return self._alarm_message(stamp_ns, AlarmState.cannot_judge(text))

    def _window(self, record: IndicatorRecord) -> Iterator[Outgoing]:
        stamp = record.stamp_ns
        yield (
            topics.INDICATORS,
            stamp,
            messages.joint_state(
                self._factory, stamp, ROTOR_FRAME, list(record.names), record.values
            ),
        )
        if record.spectrum is not None:
            table = spectrum_table(record.spectrum, stamp)
            yield topics.SPECTRUM, stamp, encode(table, self._factory)

    def _alarm_message(self, stamp_ns: int, alarm: AlarmState) -> Outgoing:
        self._alarm = alarm
        return (
            topics.ALARM,
            stamp_ns,
            messages.diagnostics(
                self._factory,
                stamp_ns,
                'vibration_monitor: crack',
                level=int(alarm.level),
                text='; '.join(alarm.reasons) or alarm.level.name,
                values={},
            ),
        )


def spectrum_table(spectrum: OrderSpectrum, stamp_ns: int) -> WaveformBlock:
    """Return the order spectrum as a table: order, frequency (Hz), one amplitude a channel."""
    rows = np.zeros(
        len(spectrum.orders),
        [('order', '<f4'), ('frequency', '<f4')] + [(name, '<f4') for name in spectrum.amplitudes],
    )
    rows['order'] = spectrum.orders
    rows['frequency'] = spectrum.frequency_hz
    for name, amplitude in spectrum.amplitudes.items():
        rows[name] = amplitude
    return WaveformBlock(stamp_ns, rows, ROTOR_FRAME)
