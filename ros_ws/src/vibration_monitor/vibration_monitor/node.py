# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Node `vibration_monitor`: a thin adapter around `VibrationMonitor.push`."""

import math
import sys
import time
from typing import Any

from rotor_common.constants import NANOSECONDS
from rotor_common.errors import WireError
from rotor_interfaces import messages, ros, topics
from rotor_interfaces.gaps import FirstSource
from rotor_interfaces.messages import ROS
from rotor_interfaces.ros import Node
from rotor_interfaces.run_topics import RUN_ID, Progress, RunTopics
from rotor_interfaces.waveform import decode
from vibration_monitor.detection import Level
from vibration_monitor.messages import MonitorMessages
from vibration_monitor.monitor import VibrationMonitor
from vibration_monitor.monitor_config import MonitorConfig

READY_CHECK_S = 0.05
SILENCE_S = 5.0
"""A source that stays silent for this long, after its first block, is reported."""


class MonitorNode(Node):  # type: ignore[misc]
    """Turns `rotor/waveform` into spectra, indicators and the crack alarm."""

    def __init__(self) -> None:
        super().__init__('vibration_monitor')
        text = ros.declare(
            self, 'config', '', 'monitor section of a scenario as JSON; empty: the defaults'
        )
        self._listeners = ros.declare(
            self, 'listeners', 0, 'subscribers that must match each output before time 0'
        )
        run = RunTopics(self, ros.declare(self, 'run_id', '', RUN_ID))
        config = ros.declare_model(self, MonitorConfig.from_json(text or '{}'))
        self._monitor = VibrationMonitor(config)
        self._monitor.prepare()
        self._messages = MonitorMessages(ROS)
        self._refused_blocks = 0
        self._diagnostic_second = -1
        self._publishers_of = {
            topic: run.publisher(topic)
            for topic in (topics.SPECTRUM, topics.INDICATORS, topics.ALARM, topics.DIAGNOSTICS)
        }
        self._run = run
        self._progress = Progress(run, 'vibration_monitor')
        self._source = run.subscription(topics.WAVEFORM, self._on_waveform)
        self._first_source = FirstSource()
        self._last_block_s = math.inf
        self._last_stamp_ns = 0
        ros.timer(self, SILENCE_S / 2, self._watch_source)
        self._ready_timer = ros.timer(self, READY_CHECK_S, self._report_ready)

    def _report_ready(self) -> None:
        """Report ready once the source and every expected listener have matched."""
        # not count_publishers: it includes publishers that do not reach us yet
        heard = self._source.get_publisher_count() > 0
        listened = all(
            publisher.get_subscription_count() >= self._listeners
            for publisher in self._publishers_of.values()
        )
        if heard and listened:
            self._ready_timer.cancel()
            self._progress.report(0)

    def _on_waveform(self, message: Any) -> None:
        stamp_ns = messages.stamp_ns(message)
        try:
            block = decode(message)
            # a run has one simulator, and each of its blocks follows the one before
            is_alone = not self._run.run_id and self._source.get_publisher_count() <= 1
            first, count = block.first_sample, len(block.rows)
            if not self._first_source.accepts(first, count, block.time, is_alone=is_alone):
                return
            records = self._monitor.push(block)
        except WireError as error:
            self._refused_blocks += 1
            self.get_logger().error(f'rotor/waveform refused: {error}', throttle_duration_sec=1.0)
            records = []
        self._last_block_s = time.monotonic()
        self._last_stamp_ns = stamp_ns
        for topic, _, outgoing in self._messages.after_block(self._monitor, records, stamp_ns):
            self._publishers_of[topic].publish(outgoing)
        self._diagnose(stamp_ns)
        self._progress.report(stamp_ns)

    def _watch_source(self) -> None:
        """Report a source that has fallen silent: without a block there is no other report."""
        silence_s = time.monotonic() - self._last_block_s
        if silence_s > SILENCE_S:
            text = f'no block for {silence_s:.0f} s'
            self._publish_diagnostics(Level.STALE, text)
            topic, _, alarm = self._messages.of_silence(self._last_stamp_ns, text)
            self._publishers_of[topic].publish(alarm)

    def _diagnose(self, stamp_ns: int) -> None:
        """Publish /diagnostics once a second of data."""
        second = stamp_ns // NANOSECONDS
        if second == self._diagnostic_second:
            return
        self._diagnostic_second = second
        self._report_stream()

    def _report_stream(self) -> None:
        lost = self._refused_blocks + int(self._monitor.status()['lost samples [1]'])
        if self._first_source.other_blocks:
            self._publish_diagnostics(Level.WARN, 'another source publishes rotor/waveform')
        elif lost:
            self._publish_diagnostics(Level.WARN, 'samples or blocks lost')
        else:
            self._publish_diagnostics(Level.OK, 'complete')

    def _publish_diagnostics(self, level: Level, text: str) -> None:
        self._publishers_of[topics.DIAGNOSTICS].publish(
            messages.diagnostics(
                ROS,
                self._last_stamp_ns,
                'vibration_monitor: stream',
                level=level,
                text=text,
                values={
                    **self._monitor.status(),
                    'refused blocks [1]': self._refused_blocks,
                    'blocks of another source [1]': self._first_source.other_blocks,
                },
            )
        )

    def is_done(self) -> bool:
        """Say no: the monitor listens until a signal."""
        return False

    def finish(self) -> None:
        """Report a last time and wait until what was published has been acknowledged."""
        if self._last_stamp_ns or not self._run.run_id:  # else the run has not begun
            self._report_stream()
        self._run.wait_until_acknowledged()


def main(args: list[str] | None = None) -> int:
    """Run the node until a signal; return the exit code."""
    return ros.run(lambda: [MonitorNode()], args)


if __name__ == '__main__':
    sys.exit(main())
