# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Node `replay`: publishes a recording again, byte for byte, with its own times as /clock."""

import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from rotor_interfaces import messages, ros, topics
from rotor_interfaces.exit_code import ExitCode
from rotor_interfaces.messages import ROS
from rotor_interfaces.ros import DurabilityPolicy, Node, QoSProfile, ReliabilityPolicy
from vibration_monitor.errors import RecordingError
from vibration_monitor.reading import Connection, RecordedMessage, Recording
from vibration_monitor.replay import (
    ReplayOptions,
    ReplaySchedule,
    begin_ns,
    latched_before,
    offer_of,
    selected,
)

TICK_S = 0.002
MESSAGES_PER_TICK = 256
"""Few enough that a signal is noticed between two ticks."""

CLOCK_STEP_NS = 10_000_000
LATE_S = 0.02


class ReplayNode(Node):  # type: ignore[misc]
    """Publishes the messages of a recording by log time.

    `published`, `late` (by more than LATE_S), `latest_s` and `shifts` of the schedule tell how
    it went.
    """

    def __init__(self, recording: Recording, options: ReplayOptions) -> None:
        super().__init__('replay')
        self.published = 0
        self.late = 0
        self.latest_s = 0.0
        self.shifts = 0
        self._recording = recording
        self._options = options
        self._begin_ns = begin_ns(recording, options.start_s)
        self._connections = selected(recording, options.topics)
        self._latched = latched_before(recording, self._connections, self._begin_ns)
        self._outputs = {name: self._output(known) for name, known in self._connections.items()}
        self._clock_output = ros.publisher(self, topics.CLOCK)
        self._created_s = time.monotonic()
        self._schedule: ReplaySchedule | None = None
        self._messages: Iterator[RecordedMessage] = iter(())
        self._next: RecordedMessage | None = None
        self._clock_ns = 0
        self._is_done = False
        ros.timer(self, TICK_S, self._tick)

    def _output(self, connection: Connection) -> Any:
        try:
            kind = messages.ros_class(connection.type)
        except (ImportError, AttributeError, ValueError):
            raise RecordingError(
                f'{connection.topic} has type {connection.type!r}, which is not installed here; '
                'name the topics to replay'
            ) from None
        offer = offer_of(connection)
        reliability = ReliabilityPolicy.RELIABLE if offer.is_reliable else _BEST_EFFORT
        durability = DurabilityPolicy.TRANSIENT_LOCAL if offer.is_latched else _VOLATILE
        profile = QoSProfile(depth=offer.depth, reliability=reliability, durability=durability)
        return self.create_publisher(kind, connection.topic, profile)

    def _tick(self) -> None:
        if self._schedule is None:
            self._start_if_heard()
        else:
            self._publish_due(self._schedule)

    def _start_if_heard(self) -> None:
        waveform = self._recording.find(topics.WAVEFORM)
        awaited = [self._outputs[waveform]] if waveform in self._outputs else self._outputs.values()
        is_heard = any(output.get_subscription_count() for output in awaited)
        waited_s = time.monotonic() - self._created_s
        if is_heard or waited_s >= self._options.wait_for_subscribers_s:
            self._start()

    def _start(self) -> None:
        """Begin a pass: first what a late subscriber would know, then the messages."""
        self._clock_ns = 0
        self._publish_clock(self._begin_ns)
        for message in self._latched:
            self._outputs[message.topic].publish(message.data)
        self._messages = self._recording.messages(set(self._outputs), self._begin_ns)
        self._next = next(self._messages, None)
        self._schedule = ReplaySchedule(
            rate=self._options.rate, begin_ns=self._begin_ns, now_s=time.monotonic()
        )

    def _publish_due(self, schedule: ReplaySchedule) -> None:
        for _ in range(MESSAGES_PER_TICK):
            message = self._next
            if message is None:
                self._end_pass()
                return
            now_s = time.monotonic()
            self.shifts += schedule.shift_if_stalled(message.log_time_ns, now_s)
            late_s = schedule.late_s(message.log_time_ns, now_s)
            if late_s < 0.0:
                return
            self._publish_clock(message.log_time_ns)
            self._outputs[message.topic].publish(message.data)
            self.published += 1
            self.late += late_s > LATE_S
            self.latest_s = max(self.latest_s, late_s)
            self._next = next(self._messages, None)

    def _end_pass(self) -> None:
        if self._options.loop and self.published:
            self._start()
        else:
            self._is_done = True

    def _publish_clock(self, log_time_ns: int) -> None:
        if log_time_ns - self._clock_ns >= CLOCK_STEP_NS:
            self._clock_ns = log_time_ns
            self._clock_output.publish(messages.clock(ROS, log_time_ns))

    def is_done(self) -> bool:
        """Say whether the last message is out."""
        return self._is_done

    def finish(self) -> None:
        """Wait until what was published has been acknowledged."""
        ros.wait_until_acknowledged(self._outputs.values())

    def summary(self) -> str:
        """Return one line for the user."""
        text = f'{self.published} messages published'
        if self.late:
            text += f', {self.late} later than {LATE_S * 1e3:g} ms (at most '
            text += f'{self.latest_s * 1e3:.0f} ms)'
        if self.shifts:
            text += f', schedule shifted {self.shifts} times since this machine could not follow'
        return text


_BEST_EFFORT = ReliabilityPolicy.BEST_EFFORT
_VOLATILE = DurabilityPolicy.VOLATILE


def replay(
    path: str | Path,
    *,
    rate: float = 1.0,
    loop: bool = False,
    start_s: float = 0.0,
    topics: Sequence[str] | None = None,
    wait_for_subscribers_s: float = 3.0,
) -> int:
    """Replay a recording until its end or a signal, and return the exit code.

    Args:
        path: folder of a bag or MCAP file.
        rate: multiple of real time, above 0.
        loop: start again at the end.
        start_s: how much of the beginning to skip, s.
        topics: names of the topics to publish; None or none: all but /diagnostics.
        wait_for_subscribers_s: how long to wait for a first subscriber, s.

    Raises:
        ConfigError: an option out of range.
        RecordingError: a recording that cannot be read.

    """
    options = ReplayOptions(
        rate=rate,
        loop=loop,
        start_s=start_s,
        topics=tuple(topics or ()),
        wait_for_subscribers_s=wait_for_subscribers_s,
    )
    recording = Recording(path)
    nodes: list[ReplayNode] = []

    def create() -> list[ReplayNode]:
        nodes.append(ReplayNode(recording, options))
        return nodes

    code = ros.run(create, has_end=True)
    for sentence in recording.damage:
        sys.stderr.write(f'warning: {sentence}\n')
    if code in (ExitCode.DONE, ExitCode.INTERRUPTED):
        sys.stdout.write(f'{nodes[0].summary()}\n')
    return code
