# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Node `replay`: publishes a recording again, byte for byte, with its own times on /clock."""

import math
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from rotor_common.constants import NANOSECONDS
from rotor_common.exit_code import ExitCode
from rotor_common.leftovers import remove_leftovers
from rotor_interfaces import messages, ros, topics
from rotor_interfaces.messages import ROS
from rotor_interfaces.ros import (
    DurabilityPolicy,
    InvalidTopicNameException,
    Node,
    QoSProfile,
    ReliabilityPolicy,
)
from rotor_recording.errors import RecordingInputError
from rotor_recording.mcap_walk import Connection
from rotor_recording.reading import RecordedMessage, Recording
from rotor_recording.replay import (
    HOLE_S,
    ReplayOptions,
    ReplaySchedule,
    begin_ns,
    is_topic,
    latched_before,
    offer_of,
    selected,
    timed,
)

TICK_S = 0.002
MESSAGES_PER_TICK = 256
"""Few enough that a signal is noticed between two ticks."""

CLOCK_STEP_NS = 10_000_000
"""Messages that follow closer than this share a tick of /clock."""

CLOCK_PERIOD_S = 0.025
"""Where messages are rare, /clock comes this often (wall time), as rosbag2 publishes it."""

LAST_SECOND = 2**31 - 1
"""Largest number of seconds in a ROS time."""

LATE_S = 0.02


class ReplayNode(Node):  # type: ignore[misc]
    """Publishes the messages of a recording by log time.

    `published`, `late` (by more than LATE_S), `latest_s`, `shifts` of the schedule and the
    `holes` of the last pass that were skipped (ns) tell how it went; `unpublished` are the
    topics whose type this machine does not know.
    """

    def __init__(self, recording: Recording, options: ReplayOptions) -> None:
        super().__init__('replay')
        self.published = 0
        self.late = 0
        self.latest_s = 0.0
        self.shifts = 0
        self.holes: list[int] = []
        self.unpublished: list[Connection] = []
        self._recording = recording
        self._options = options
        self._outputs: dict[str, Any] = {}
        self._connections = selected(recording, options.topics)
        for connection in list(self._connections.values()):
            self._offer(connection)
        self._begin_ns = begin_ns(recording, options.start_s, self._outputs.keys())
        self._latched = latched_before(recording, self._connections, self._begin_ns)
        self._clock_output = ros.publisher(self, topics.CLOCK)
        self._created_s = time.monotonic()
        self._schedule: ReplaySchedule | None = None
        self._messages: Iterator[tuple[int, RecordedMessage]] = iter(())
        self._next: tuple[int, RecordedMessage] | None = None
        self._left_out: Counter[str] = Counter()
        self._clock_ns = 0
        self._clock_s = 0.0
        self._ticked_ns = 0
        """Log time of the last message that was published on /clock."""
        self._is_done = False
        ros.timer(self, TICK_S, self._tick)

    def _offer(self, connection: Connection) -> None:
        """Make the publisher of a topic, or leave out a topic that was not asked for by name."""
        try:
            self._outputs[connection.topic] = self._output(connection)
        except RecordingInputError:
            if self._options.topics or len(self._connections) == 1:
                raise
            self.unpublished.append(self._connections.pop(connection.topic))

    def _output(self, connection: Connection) -> Any:
        offer = offer_of(connection)
        reliability = ReliabilityPolicy.RELIABLE if offer.is_reliable else _BEST_EFFORT
        durability = DurabilityPolicy.TRANSIENT_LOCAL if offer.is_latched else _VOLATILE
        profile = QoSProfile(depth=offer.depth, reliability=reliability, durability=durability)
        try:
            kind = messages.ros_class(connection.type)
            return self.create_publisher(kind, connection.topic, profile)
        except (ImportError, AttributeError, TypeError, ValueError):
            raise RecordingInputError(
                f'{connection.topic} has type {connection.type!r}, which is not installed here; '
                'name the topics to replay'
            ) from None
        except InvalidTopicNameException:
            raise RecordingInputError(
                f'{connection.topic} is not a name that ROS 2 allows; name the topics to replay'
            ) from None

    def _tick(self) -> None:
        if self._schedule is None:
            self._start_if_heard()
        else:
            self._publish_due(self._schedule)

    def _start_if_heard(self) -> None:
        waveforms = [o for n, o in self._outputs.items() if is_topic(n, topics.WAVEFORM)]
        awaited = waveforms or self._outputs.values()
        is_heard = any(output.get_subscription_count() for output in awaited)
        waited_s = time.monotonic() - self._created_s
        if is_heard or waited_s >= self._options.wait_for_subscribers_s:
            self._start()

    def _start(self) -> None:
        """Begin a pass: first the last latched messages before its start, then all others."""
        self._clock_ns, self._ticked_ns = -1, -CLOCK_STEP_NS
        self._tick_clock(self._begin_ns, time.monotonic())
        self.holes.clear()
        self._left_out.clear()
        for message in self._latched:
            self._publish(message)
        recorded = self._recording.messages(self._outputs.keys(), self._begin_ns)
        self._messages = timed(recorded, self._begin_ns, self.holes)
        self._next = next(self._messages, None)
        self._clock_s = now_s = time.monotonic()
        self._schedule = ReplaySchedule(rate=self._options.rate, begin_ns=0, now_s=now_s)

    def _publish_due(self, schedule: ReplaySchedule) -> None:
        for _ in range(MESSAGES_PER_TICK):
            if self._next is None:
                self._end_pass()
                return
            at_ns, message = self._next
            now_s = time.monotonic()
            self.shifts += schedule.shift_if_stalled(at_ns, now_s)
            late_s = schedule.late_s(at_ns, now_s)
            if late_s < 0.0:
                if now_s - self._clock_s >= CLOCK_PERIOD_S:
                    ahead_ns = math.ceil(-late_s * self._options.rate * NANOSECONDS)
                    self._publish_clock(message.log_time_ns - ahead_ns, now_s)
                return
            self._tick_clock(message.log_time_ns, now_s)
            if self._publish(message):
                self.published += 1
                self.late += late_s > LATE_S
                self.latest_s = max(self.latest_s, late_s)
            self._next = next(self._messages, None)

    def _publish(self, message: RecordedMessage) -> bool:
        """Publish the bytes of a message, or leave out and count what cannot be CDR."""
        if message.data[:1] == _CDR_BEGIN:
            self._outputs[message.topic].publish(message.data)
            return True
        self._left_out[message.topic] += 1
        self._recording.leave_out(
            f'messages of {message.topic}',
            self._left_out[message.topic],
            f'the first at log time {message.log_time_ns} ns: not CDR, or compressed in a way that '
            'is not known',
        )
        return False

    def _end_pass(self) -> None:
        if self._options.loop and self.published:
            self._start()
        else:
            self._is_done = True

    def _tick_clock(self, log_time_ns: int, now_s: float) -> None:
        """Publish the time of a message, unless it follows another one closely."""
        if log_time_ns - self._ticked_ns >= CLOCK_STEP_NS:
            self._ticked_ns = log_time_ns
            self._publish_clock(log_time_ns, now_s)

    def _publish_clock(self, log_time_ns: int, now_s: float) -> None:
        if log_time_ns > self._clock_ns and log_time_ns // NANOSECONDS <= LAST_SECOND:
            self._clock_ns = log_time_ns
            self._clock_s = now_s
            self._clock_output.publish(messages.clock(ROS, log_time_ns))

    def is_done(self) -> bool:
        """Say whether the last message has been published."""
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

    def unpublished_text(self) -> str:
        """Return a sentence that names the topics which are not published; empty if all are."""
        listed = ', '.join(f'{known.topic} ({known.type})' for known in self.unpublished)
        return f'not published, since type or name cannot be used here: {listed}' if listed else ''

    def holes_text(self) -> str:
        """Return a sentence about the holes that were skipped; empty if there were none."""
        if not self.holes:
            return ''
        return (
            f'skipped stretches of more than {HOLE_S:g} s without a message to publish: '
            f'{len(self.holes)}, the longest {max(self.holes) / NANOSECONDS:.0f} s'
        )


_CDR_BEGIN = b'\0'
"""Every representation of a CDR message begins with it."""

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
        RecordingInputError: a recording that cannot be read.

    """
    options = ReplayOptions(
        rate=rate,
        loop=loop,
        start_s=start_s,
        topics=tuple(topics or ()),
        wait_for_subscribers_s=wait_for_subscribers_s,
    )
    remove_leftovers()
    recording = Recording(path)
    nodes: list[ReplayNode] = []

    def create() -> list[ReplayNode]:
        nodes.append(ReplayNode(recording, options))
        _warn([nodes[0].unpublished_text()])
        return nodes

    code = ros.run(create, has_end=True)
    _warn([*(node.holes_text() for node in nodes), *recording.damage])
    if code in (ExitCode.DONE, ExitCode.INTERRUPTED):
        sys.stdout.write(f'{nodes[0].summary()}\n')
    return code


def _warn(sentences: Sequence[str]) -> None:
    for sentence in filter(None, sentences):
        sys.stderr.write(f'warning: {sentence}\n')
