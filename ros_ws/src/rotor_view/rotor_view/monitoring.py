# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Indicators of a recording that holds none, computed while it is read."""

from collections.abc import Collection, Iterator
from typing import Any

from rotor_interfaces import topics
from rotor_interfaces.messages import OFFLINE, level_of
from rotor_interfaces.topics import Topic
from rotor_interfaces.waveform import decode
from vibration_monitor.messages import MonitorMessages, Outgoing
from vibration_monitor.monitor import VibrationMonitor
from vibration_monitor.monitor_config import AlarmRule, MonitorConfig


class Monitoring:
    """The monitor over a recorded waveform; yields the messages of the topics `wanted`."""

    def __init__(self, config: MonitorConfig, wanted: Collection[Topic]) -> None:
        self._monitor = VibrationMonitor(config)
        self._wanted = wanted
        self._alarm: tuple[int, str] | None = None

    @property
    def rules(self) -> tuple[AlarmRule, ...]:
        """Rules of its alarm."""
        return self._monitor.config.alarm.rules

    def after_block(self, message: Any) -> Iterator[Outgoing]:
        """Yield the monitor's messages after one waveform message; raises WireError if refused."""
        block = decode(message)
        records = self._monitor.push(block)
        # a new object yields the alarm after every block; only changes of it are passed on
        outgoing = MonitorMessages(OFFLINE).after_block(self._monitor, records, block.stamp_ns)
        for topic, stamp_ns, said in outgoing:
            if topic in self._wanted and (topic != topics.ALARM or self._is_news(said)):
                yield topic, stamp_ns, said

    def _is_news(self, alarm: Any) -> bool:
        known, status = self._alarm, alarm.status[0]
        self._alarm = (level_of(status), status.message)
        return self._alarm != known
