# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""What a replay publishes, and when: the part that needs no ROS."""

import math
from typing import Any, NamedTuple

import pydantic

from rotor_interfaces import topics
from rotor_interfaces.config import ConfigModel, quantity
from rotor_interfaces.errors import DataError
from rotor_interfaces.messages import NANOSECONDS
from rotor_interfaces.plain_data import parse_yaml
from vibration_monitor.errors import RecordingError
from vibration_monitor.reading import Connection, RecordedMessage, Recording, require_cdr

MAX_BACKLOG_S = 1.0
"""A replay that is later than this (recorded seconds) shifts its schedule instead of rushing.

A burst of more blocks than the queues of the subscribers hold would be lost.
"""

DEFAULT_DEPTH = 256
"""Queue of a topic whose recorder did not know the publisher's (depth 0)."""

_NEVER = (topics.CLOCK, topics.PROGRESS)
_NOT_BY_DEFAULT = (*_NEVER, topics.DIAGNOSTICS)


class ReplayOptions(ConfigModel):
    """How a recording is replayed."""

    rate: float = quantity(1.0, unit='1', description='multiple of real time', gt=0, le=1000)
    loop: bool = pydantic.Field(False, description='start again at the end')
    start_s: float = quantity(0.0, unit='s', description='how much of the beginning to skip', ge=0)
    topics: tuple[str, ...] = pydantic.Field((), description='topics to publish; none: all')
    wait_for_subscribers_s: float = quantity(
        3.0, unit='s', description='how long to wait for a first subscriber', ge=0, le=3600
    )


class Offer(NamedTuple):
    """The quality of service with which a topic is published again."""

    depth: int
    is_reliable: bool
    is_latched: bool


class ReplaySchedule:
    """Says when each message is due: an absolute schedule, so that no delay adds up."""

    def __init__(self, *, rate: float, begin_ns: int, now_s: float) -> None:
        """Play log time `begin_ns` at the monotonic time `now_s`, `rate` times as fast."""
        self._rate = rate
        self._begin_ns = begin_ns
        self._started_s = now_s

    def late_s(self, log_time_ns: int, now_s: float) -> float:
        """Return how much later than due it is, in s of wall time; negative before."""
        ahead_s = (log_time_ns - self._begin_ns) / (NANOSECONDS * self._rate)
        return now_s - self._started_s - ahead_s

    def shift_if_stalled(self, log_time_ns: int, now_s: float) -> bool:
        """Make `log_time_ns` due now if the replay is more than MAX_BACKLOG_S behind."""
        late_s = self.late_s(log_time_ns, now_s)
        if late_s * self._rate <= MAX_BACKLOG_S:
            return False
        self._started_s += late_s
        return True


def begin_ns(recording: Recording, start_s: float) -> int:
    """Return the log time at which a replay begins, in ns.

    Raises:
        RecordingError: the recording is empty or ends before.

    """
    if recording.start_ns is None or recording.end_ns is None:
        raise RecordingError(f'{recording.path} holds no message, so there is nothing to replay')
    length_s = (recording.end_ns - recording.start_ns) / NANOSECONDS
    if start_s > length_s:
        raise RecordingError(
            f'start_s = {start_s:g} is after the end of {recording.path}, which is '
            f'{length_s:.3f} s long'
        )
    return recording.start_ns + math.floor(start_s * NANOSECONDS)


def selected(recording: Recording, names: tuple[str, ...]) -> dict[str, Connection]:
    """Return the topics to publish by full name.

    All but /clock, which the replay makes itself, rig/progress, which would speak for consumers
    that are not there, and /diagnostics, unless named.

    Raises:
        RecordingError: a name that was not recorded or is never replayed; an encoding other
            than CDR.

    """
    known = recording.topics()
    wanted = ['/' + name.lstrip('/') for name in names]
    for name in wanted:
        if name not in known:
            listed = ', '.join(known)
            raise RecordingError(f'{recording.path} holds no {name}; its topics are: {listed}')
        if any(_is(name, topic) for topic in _NEVER):
            raise RecordingError(f'{name} is never replayed; name other topics')
    if not wanted:
        wanted = [n for n in known if not any(_is(n, topic) for topic in _NOT_BY_DEFAULT)]
    chosen = {name: known[name] for name in wanted}
    for connection in chosen.values():
        require_cdr(recording, connection)
    return chosen


def latched_before(
    recording: Recording, connections: dict[str, Connection], start_ns: int
) -> list[RecordedMessage]:
    """Return the last message before `start_ns` of every latched topic, by log time."""
    latched = {name for name, known in connections.items() if offer_of(known).is_latched}
    last: dict[str, RecordedMessage] = {}
    for message in recording.messages(latched):
        if message.log_time_ns >= start_ns:
            break
        last[message.topic] = message
    return sorted(last.values(), key=lambda message: message.log_time_ns)


def offer_of(connection: Connection) -> Offer:
    """Return the recorded quality of service; reliable and volatile where none was recorded.

    rosbag2 wrote numbers up to version 8 (rmw_qos_*_policy_t) and names since.
    """
    try:
        profiles = parse_yaml(connection.qos_profiles, foreign=True)
    except DataError:
        profiles = None
    first: Any = profiles[0] if isinstance(profiles, list) and profiles else {}
    if not isinstance(first, dict):
        first = {}
    depth = first.get('depth')
    return Offer(
        depth=depth if isinstance(depth, int) and 0 < depth < 2**31 else DEFAULT_DEPTH,
        is_reliable=first.get('reliability') not in (2, 'best_effort'),
        is_latched=first.get('durability') in (1, 'transient_local'),
    )


def _is(name: str, topic: topics.Topic) -> bool:
    return name == topic.name or name.endswith('/' + topic.name)
