# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Node `viewer`: shows a running rig in rerun without slowing it down.

It is not a registered consumer and takes the waveform best effort: when it cannot keep up, the
view has gaps (and says so), never the rig.
"""

import dataclasses
import functools
import sys
import time
from pathlib import Path
from typing import Any

import rerun as rr

from rotor_interfaces import messages, ros, topics
from rotor_interfaces.ros import Node
from rotor_interfaces.run_topics import RUN_ID, RunTopics
from rotor_interfaces.topics import Topic
from rotor_view import viewer
from rotor_view.rig_view import SHOWN_TOPICS, RigView
from rotor_view.rrd_file import ViewFile
from rotor_view.viewer import Viewer, ViewError

MEMORY_LIMIT = '25%'
"""Beyond this share of the machine's memory the viewer drops its oldest data."""


class ViewerNode(Node):  # type: ignore[misc]
    """Feeds a RigView from the topics; ends when the user closes the window."""

    def __init__(self) -> None:
        super().__init__('viewer')
        self._file = ros.declare(
            self, 'save', '', 'write the view to this new .rrd file; empty: open a window'
        )
        self._blocks_per_s = ros.declare(
            self, 'blocks_per_s', 80, 'waveform blocks shown a second; the rest of it is left out'
        )
        run = RunTopics(self, ros.declare(self, 'run_id', '', RUN_ID))
        if self._file and Path(self._file).exists():
            raise ViewError(f'save = {self._file} exists already; give the name of a new file')
        self._viewer: Viewer | None = None
        if not self._file:
            self._viewer = viewer.window(['--memory-limit', MEMORY_LIMIT])
        self._second = 0
        self._blocks = 0
        self._runs = 0
        self._files: list[ViewFile] = []
        self._view = RigView(self._connect)
        for topic in SHOWN_TOPICS:
            run.subscription(
                dataclasses.replace(topic, best_effort=topic == topics.WAVEFORM),
                functools.partial(self._on_message, topic),
            )

    def _connect(self, stream: rr.RecordingStream) -> None:
        """Connect the stream of another run to the window, or to a file of its own."""
        self._runs += 1
        if self._viewer is not None:
            stream.connect_grpc(self._viewer.url)
            return
        file = Path(self._file)
        if self._runs > 1:
            file = file.with_stem(f'{file.stem}_{self._runs}')
        self._files.append(ViewFile(stream, file))

    def _on_message(self, topic: Topic, message: Any) -> None:
        if not self.is_done() and (topic != topics.WAVEFORM or self._has_time()):
            stamp_ns = 0 if topic == topics.CONFIG else messages.stamp_ns(message)
            self._view.push(topic, stamp_ns, message)
            for file in self._files:
                file.check()

    def _has_time(self) -> bool:
        """Count a block; return False once the budget of this second is spent."""
        second = int(time.monotonic())
        if second != self._second:
            self._second, self._blocks = second, 0
        self._blocks += 1
        return self._blocks <= int(self._blocks_per_s)

    def is_done(self) -> bool:
        """Say whether the user has closed the window."""
        return self._viewer is not None and not self._viewer.is_running()

    def finish(self) -> None:
        """Show what is still held and leave the window to the user."""
        if self.is_done():
            return
        try:
            self._view.flush()
        except ViewError:
            if self._viewer is not None:
                self._viewer.close()  # else rerun waits for it without end
            raise
        for file in self._files:
            file.close()
        if self._viewer is not None:
            self._viewer.leave_open()


def main(args: list[str] | None = None) -> int:
    """Run the node until a signal or until the window is closed; return the exit code."""
    return ros.run(lambda: [ViewerNode()], args)


if __name__ == '__main__':
    sys.exit(main())
