# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The schedule of a replay: what is published and when; needs no ROS."""

import math
from collections.abc import Collection, Iterable, Iterator
from typing import Any, NamedTuple

import pydantic

from rotor_common.configuration import ConfigModel, quantity
from rotor_common.constants import NANOSECONDS
from rotor_common.errors import DataError
from rotor_common.plain_data import parse_yaml
from rotor_interfaces import topics
from rotor_recording.errors import RecordingInputError
from rotor_recording.mcap_walk import Connection
from rotor_recording.reading import RecordedMessage, Recording, require_cdr

MAX_BACKLOG_S = 1.0
"""A replay that is later than this (recorded seconds) shifts its schedule instead of rushing.

A burst of more blocks than the queues of the subscribers hold would be lost.
"""

DEFAULT_DEPTH = 256
"""Queue of a topic whose recorder did not know the publisher's (depth 0)."""

HOLE_S = 10.0
"""A stretch longer than this (recorded seconds) without a message to publish is skipped."""

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
        """Play time `begin_ns` at the monotonic time `now_s`, `rate` times as fast."""
        self._rate = rate
        self._begin_ns = begin_ns
        self._started_s = now_s

    def late_s(self, time_ns: int, now_s: float) -> float:
        """Return how late `time_ns` is played now, in s of wall time; negative if it is early."""
        ahead_s = (time_ns - self._begin_ns) / (NANOSECONDS * self._rate)
        return now_s - self._started_s - ahead_s

    def shift_if_stalled(self, time_ns: int, now_s: float) -> bool:
        """Make `time_ns` due now if the replay is more than MAX_BACKLOG_S behind."""
        late_s = self.late_s(time_ns, now_s)
        if late_s * self._rate <= MAX_BACKLOG_S:
            return False
        self._started_s += late_s
        return True


def timed(
    messages: Iterable[RecordedMessage], begin_ns: int | None = None, holes: list[int] | None = None
) -> Iterator[tuple[int, RecordedMessage]]:
    """Yield (time in the replay in ns, message): its log time without the beginning and holes.

    Args:
        messages: by log time.
        begin_ns: log time at which the replay begins; None: at the first message.
        holes: receives the length of each hole (HOLE_S) that is skipped, in ns.

    """
    at_ns = 0
    for message in messages:
        step_ns = 0 if begin_ns is None else message.log_time_ns - begin_ns
        begin_ns = message.log_time_ns
        if step_ns > HOLE_S * NANOSECONDS:
            if holes is not None:
                holes.append(step_ns)
            step_ns = 0
        at_ns += step_ns
        yield at_ns, message


def begin_ns(recording: Recording, start_s: float, names: Collection[str] | None = None) -> int:
    """Return the log time at which a replay of the topics `names` (None: all) begins, in ns.

    That is `start_s` after the first message of these topics, holes not counted.

    Raises:
        RecordingInputError: there is no message of these topics, or none so late.

    """
    start_ns = math.floor(start_s * NANOSECONDS)
    hole_ns = math.floor(HOLE_S * NANOSECONDS)
    begin_ns, length_ns = recording.start_of_replay(names, start_ns, hole_ns)
    if begin_ns is not None:
        return begin_ns
    if not any(
        count for name, count in recording.message_counts.items() if names is None or name in names
    ):
        raise RecordingInputError(
            f'{recording.path} holds no message'
            + (f' of {", ".join(names)}' if names else '')
            + ', so there is nothing to replay'
        )
    raise RecordingInputError(
        f'start_s = {start_s:g} is after the end of {recording.path}, which is '
        f'{length_ns / NANOSECONDS:.3f} s long'
    )


def selected(recording: Recording, names: tuple[str, ...]) -> dict[str, Connection]:
    """Return the topics to publish by full name.

    All but /clock, which the replay makes itself, rig/progress, which would report consumers that
    do not run, and /diagnostics, unless named. Topics that are not CDR are left out,
    with a sentence in `recording.damage`, unless named.

    Raises:
        RecordingInputError: a name that was not recorded or is never replayed; an encoding other
            than CDR; nothing left to publish.

    """
    known = recording.topics()
    if names:
        chosen = {name: known[name] for name in _named(names, recording, known)}
    else:
        chosen = {
            name: connection
            for name, connection in known.items()
            if not any(is_topic(name, topic) for topic in _NOT_BY_DEFAULT)
        }
        usable = {name for name, connection in chosen.items() if connection.encoding == 'cdr'}
        for name in chosen.keys() - usable if usable else ():
            recording.note(f'{name} is not published: its encoding is {known[name].encoding!r}')
        chosen = {n: connection for n, connection in chosen.items() if n in usable or not usable}
    for connection in chosen.values():
        require_cdr(recording, connection)
    if known and not chosen:
        raise RecordingInputError(
            f'{recording.path} holds nothing that is replayed unless named; its topics are: '
            f'{", ".join(known)}'
        )
    return chosen


def _named(
    names: tuple[str, ...], recording: Recording, known: dict[str, Connection]
) -> Iterator[str]:
    """Yield the full names of topics; raises for one that cannot be replayed."""
    for name in ('/' + name.lstrip('/') for name in names):
        if name not in known:
            listed = ', '.join(known)
            raise RecordingInputError(f'{recording.path} holds no {name}; its topics are: {listed}')
        if any(is_topic(name, topic) for topic in _NEVER):
            raise RecordingInputError(f'{name} is never replayed; name other topics')
        yield name


def latched_before(
    recording: Recording, connections: dict[str, Connection], start_ns: int
) -> list[RecordedMessage]:
    """Return the last message before `start_ns` of every latched topic, by log time."""
    latched = {name for name, known in connections.items() if offer_of(known).is_latched}
    return recording.last_before(latched, start_ns) if latched else []


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


def is_topic(name: str, topic: topics.Topic) -> bool:
    """Say whether a full name is that of a topic of the rig, in any namespace."""
    return name == topic.name or name.endswith('/' + topic.name)
