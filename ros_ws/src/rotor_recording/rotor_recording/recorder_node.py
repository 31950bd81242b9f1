# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Node `recorder`: writes every topic of the rig into a bag, as raw bytes."""

import sys
import time
from functools import partial
from typing import Any

from rotor_common.errors import ConfigError
from rotor_interfaces import messages, ros, topics
from rotor_interfaces.messages import ROS
from rotor_interfaces.ros import Node
from rotor_interfaces.run_topics import RUN_ID, Progress, RunTopics
from rotor_interfaces.topics import Topic
from rotor_recording.recording import FLUSH_PERIOD_S, RecordingWriter
from rotor_recording.recording_stream import RecordingStream

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
        self._run = RunTopics(self, ros.declare(self, 'run_id', '', RUN_ID))
        if not path:
            raise ConfigError('path is empty; it must be the folder of the bag, new or empty')
        known = [topic.name for topic in topics.TOPICS]
        for expected in filter(None, expect):
            if expected not in known:
                raise ConfigError(f'expect = {expected!r} is no topic; known: {", ".join(known)}')
        self._writer = RecordingWriter(path, name=name or None)
        self._stream = RecordingStream(self._writer, self.resolve_topic_name)
        self._diagnostics = self._run.publisher(topics.DIAGNOSTICS)
        self._progress = Progress(self._run, 'recorder')
        self._inputs = {topic: self._input(topic) for topic in topics.TOPICS}
        self._expected = [
            subscription for topic, subscription in self._inputs.items() if topic.name in expect
        ]
        ros.timer(self, FLUSH_PERIOD_S, self._writer.flush)
        ros.timer(self, DIAGNOSE_S, self._diagnose)
        self._ready_timer = ros.timer(self, READY_CHECK_S, self._report_ready)

    def _input(self, topic: Topic) -> Any:
        callback = partial(self._on_message, topic)
        if topic is topics.DIAGNOSTICS:  # here the health of other nodes belongs to the recording
            return ros.subscription(self, topic, callback, raw=True)
        return self._run.subscription(topic, callback, raw=True)

    def _on_message(self, topic: Topic, data: bytes) -> None:
        # a run has one simulator, and each of its blocks follows the one before
        is_of_run = topic is topics.WAVEFORM and bool(self._run.run_id)
        is_alone = not is_of_run and self._inputs[topic].get_publisher_count() <= 1
        stamp_ns = self._stream.take(topic, data, time.time_ns(), is_alone=is_alone)
        # here too: a flood of messages could keep the timer from firing
        self._writer.flush_if_due()
        if topic is topics.WAVEFORM and stamp_ns:
            self._progress.report(stamp_ns)

    def _report_ready(self) -> None:
        # not count_publishers: it includes publishers that do not reach us yet
        if all(expected.get_publisher_count() for expected in self._expected):
            self._ready_timer.cancel()
            self._progress.report(0)

    def _diagnose(self) -> None:
        text = self._stream.fault()
        status = messages.diagnostics(
            ROS,
            self._stream.time_ns,
            'recorder: stream',
            level=1 if text else 0,
            text=text or 'complete',
            values=self._stream.status(),
        )
        self._diagnostics.publish(status, inside=not self._has_begun())

    def _has_begun(self) -> bool:
        """Say whether the run has begun; a recorder outside a run records everything."""
        return bool(self._stream.time_ns) or not self._run.run_id

    def is_done(self) -> bool:
        """Say no: the recorder listens until a signal."""
        return False

    def finish(self) -> None:
        """Report a last time and finalise the recording; raises RecordingError.

        The recording of a run that never began is removed.
        """
        if not self._has_begun():
            self._writer.discard()
            return
        self._diagnose()
        self._run.wait_until_acknowledged()
        self._stream.finish()
        self._writer.close()


def main(args: list[str] | None = None) -> int:
    """Run the node until a signal; return the exit code."""
    return ros.run(lambda: [RecorderNode()], args)


if __name__ == '__main__':
    sys.exit(main())
