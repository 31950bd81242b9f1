# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Node `recorder`: every topic of the rig into a bag, as raw bytes."""

import sys
import time
from functools import partial

from rotor_interfaces import messages, ros, topics
from rotor_interfaces.errors import ConfigError
from rotor_interfaces.messages import ROS
from rotor_interfaces.ros import Node
from rotor_interfaces.topics import Topic
from vibration_monitor.recording import FLUSH_PERIOD_S, RecordingWriter
from vibration_monitor.recording_stream import RecordingStream

READY_CHECK_S = 0.05
DIAGNOSE_S = 1.0


class RecorderNode(Node):  # type: ignore[misc]
    """Records all topics of the rig; a finished run is a rosbag2 bag."""

    def __init__(self) -> None:
        super().__init__('recorder')
        path = ros.declare(self, 'path', '', 'folder of the bag, new or empty')
        name = ros.declare(self, 'name', '', 'start of the file name; empty: as the folder')
        expect = ros.declare(
            self, 'expect', [''], 'topics that must have a publisher before the recorder is ready'
        )
        if not path:
            raise ConfigError('path is empty; it must be the folder of the bag, new or empty')
        known = [topic.name for topic in topics.TOPICS]
        for expected in filter(None, expect):
            if expected not in known:
                raise ConfigError(f'expect = {expected!r} is no topic; known: {", ".join(known)}')
        self._writer = RecordingWriter(path, name=name or None)
        self._stream = RecordingStream(self._writer, self.resolve_topic_name)
        self._diagnostics = ros.publisher(self, topics.DIAGNOSTICS)
        self._progress = ros.Progress(self, 'recorder')
        inputs = {
            topic.name: ros.subscription(self, topic, partial(self._on_message, topic), raw=True)
            for topic in topics.TOPICS
        }
        self._expected = [inputs[expected] for expected in filter(None, expect)]
        ros.timer(self, FLUSH_PERIOD_S, self._writer.flush)
        ros.timer(self, DIAGNOSE_S, self._diagnose)
        self._ready_timer = ros.timer(self, READY_CHECK_S, self._report_ready)

    def _on_message(self, topic: Topic, data: bytes) -> None:
        stamp_ns = self._stream.take(topic, data, time.time_ns())
        # here too: a flood of messages must not keep the timer from its turn
        self._writer.flush_if_due()
        if topic is topics.WAVEFORM:
            self._progress.report(stamp_ns)

    def _report_ready(self) -> None:
        # count_publishers would not do: it knows of publishers that do not reach us yet
        if all(expected.get_publisher_count() for expected in self._expected):
            self._ready_timer.cancel()
            self._progress.report(0)

    def _diagnose(self) -> None:
        lost = self._stream.continuity.lost_samples + self._stream.refused_blocks
        self._diagnostics.publish(
            messages.diagnostics(
                ROS,
                self._stream.time_ns,
                'recorder: stream',
                level=1 if lost else 0,
                text='samples or blocks lost' if lost else 'complete',
                values=self._stream.status(),
            )
        )

    def is_done(self) -> bool:
        """Say no: the recorder listens until a signal."""
        return False

    def finish(self) -> None:
        """Report a last time and finalise the recording; raises RecordingError."""
        self._diagnose()
        ros.wait_until_acknowledged([self._diagnostics])
        self._stream.finish()
        self._writer.close()


def main(args: list[str] | None = None) -> int:
    """Run the node until a signal; return the exit code."""
    return ros.run(lambda: [RecorderNode()], args)


if __name__ == '__main__':
    sys.exit(main())
