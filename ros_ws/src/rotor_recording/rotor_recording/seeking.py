# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Seek in a recording by its indices: order, start, and latched messages before it."""

import heapq
import itertools
from collections.abc import Iterator, Mapping, Sequence

from rotor_recording.db3_file import Db3File
from rotor_recording.mcap_file import McapFile
from rotor_recording.mcap_records import StoredMessage
from rotor_recording.mcap_walk import Segment

BagFile = McapFile | Db3File
Channels = Sequence[frozenset[int]]
"""The channels that are wanted of each file."""

_Head = tuple[int, int, int, int, StoredMessage, Iterator[tuple[int, StoredMessage]]]
"""Next message of an open segment: log time, file, offset, index, message, those after it."""


def ordered(
    files: Sequence[BagFile], wanted: Channels, begin_ns: int
) -> Iterator[tuple[int, StoredMessage]]:
    """Yield (number of the file, message) by log time, from `begin_ns` on.

    Only segments that overlap in time are in memory. A segment is skipped if an index with a
    checksum says that it has none of the wanted channels; other channels may still be yielded.
    """
    segments: list[tuple[int, int, int, Segment]] = sorted(
        (segment.start_ns, number, segment.offset, segment)
        for number, file in enumerate(files)
        for segment in file.segments
        if segment.end_ns >= begin_ns and not (file.is_indexed and _lacks(segment, wanted[number]))
    )
    waiting: list[_Head] = []
    for start, number, offset, segment in segments:
        while waiting and waiting[0][:3] < (start, number, offset):
            yield _popped(waiting)
        messages = files[number].ordered(segment, begin_ns)
        rest = enumerate(message for message in messages if message.log_time_ns >= begin_ns)
        _push(waiting, number, offset, rest)
    while waiting:
        yield _popped(waiting)


def last_before(
    files: Sequence[BagFile], topics: Mapping[tuple[int, int], str], time_ns: int
) -> dict[str, tuple[int, StoredMessage]]:
    """Return the last message of each topic before `time_ns`, with the number of its file.

    Args:
        files: of the recording.
        topics: names by number of the file and channel.
        time_ns: log time, ns.

    """
    found: dict[str, tuple[int, StoredMessage]] = {}
    places: dict[str, tuple[int, int, int]] = {}
    segments = sorted(
        (
            (min(segment.end_ns, time_ns - 1), number, segment)
            for number, file in enumerate(files)
            for segment in file.segments
            if segment.start_ns < time_ns
        ),
        key=lambda item: item[:2],
        reverse=True,
    )
    for latest_ns, number, segment in segments:
        file = files[number]
        sought = {
            channel
            for (file_number, channel), name in topics.items()
            if file_number == number
            and (name not in found or found[name][1].log_time_ns <= latest_ns)
        }
        if not sought or _lacks(segment, sought):
            continue
        for message in file.last_before(segment, sought, time_ns):
            name = topics[number, message.channel_id]
            place = (message.log_time_ns, number, segment.offset)
            if name not in found or place >= places[name]:
                found[name], places[name] = (number, message), place
    return found


def start_of_replay(
    files: Sequence[BagFile], wanted: Channels, start_ns: int, hole_ns: int
) -> tuple[int | None, int]:
    """Return the log time that lies `start_ns` after the first message, and the length so far.

    The log time is None where the recording is shorter than that; the length in ns is then that
    of the whole. Stretches without a message of the wanted channels longer than `hole_ns` do
    not count.
    """
    timeline = _Timeline(files, wanted, hole_ns)
    while timeline.length_ns < start_ns:
        if not timeline.advance():
            return None, max(timeline.length_ns, 0)
    return timeline.begin_ns + start_ns, timeline.length_ns


class _Timeline:
    """Time of a replay without holes, found segment by segment.

    The first and last time of a segment are known; it is read only if they leave open whether
    there is a hole.
    """

    def __init__(self, files: Sequence[BagFile], wanted: Channels, hole_ns: int) -> None:
        self._files = files
        self._wanted = wanted
        self._hole_ns = hole_ns
        self._order = itertools.count()  # tells equal times apart
        # first and last possible time; the segment, None if messages have these times
        self._coming: list[tuple[int, int, int, int, Segment | None]] = [
            (segment.start_ns, segment.end_ns, next(self._order), number, segment)
            for number, file in enumerate(files)
            for segment in file.segments
            if not _lacks(segment, wanted[number])
        ]
        heapq.heapify(self._coming)
        self._passed: list[tuple[int, int, Segment]] = []  # unread; last possible time comes first
        self._first_ns: int | None = None
        self._reached_ns = 0  # a message has this time, or a later one in a skipped segment
        self._holes_ns = 0

    @property
    def begin_ns(self) -> int:
        """Log time that the first message would have without the holes so far."""
        return (self._first_ns or 0) + self._holes_ns

    @property
    def length_ns(self) -> int:
        """Time up to the last message known to exist, without holes; -1 before the first."""
        return -1 if self._first_ns is None else self._reached_ns - self.begin_ns

    def advance(self) -> bool:
        """Take the next segment or run of messages; return False at the end."""
        if not self._coming and not self._look_back():
            return False
        if not self._coming:
            return True
        low, high, order, number, segment = heapq.heappop(self._coming)
        if segment is not None:
            self._take(low, high, number, segment)
            return True
        if self._first_ns is None:
            self._first_ns = self._reached_ns = low
        if low - self._reached_ns > self._hole_ns:
            if self._look_back():
                heapq.heappush(self._coming, (low, high, order, number, None))
                return True
            self._holes_ns += low - self._reached_ns
        self._reached_ns = max(self._reached_ns, high)
        return True

    def _take(self, low: int, high: int, number: int, segment: Segment) -> None:
        """Skip a segment if the exact times of its messages cannot matter."""
        is_known = self._first_ns is not None and high - low <= self._hole_ns
        if is_known and high - self._reached_ns <= self._hole_ns:
            self._passed.append((high, number, segment))
            self._reached_ns = max(self._reached_ns, low)
        else:
            self._read(number, segment)

    def _look_back(self) -> bool:
        """Read skipped segments that may hold a later message; return whether there were any."""
        later = [item for item in self._passed if item[0] > self._reached_ns]
        self._passed.clear()
        for _, number, segment in later:
            self._read(number, segment)
        return bool(later)

    def _read(self, number: int, segment: Segment) -> None:
        times = self._files[number].times(segment, self._wanted[number], self._hole_ns)
        for low, high in _runs(times, self._hole_ns):
            heapq.heappush(self._coming, (low, high, next(self._order), number, None))


def _runs(times: Sequence[int], hole_ns: int) -> Iterator[tuple[int, int]]:
    """Yield first and last of the sorted times between which no step is longer than `hole_ns`."""
    low = high = None
    for time_ns in times:
        if low is None or high is None:
            low = time_ns
        elif time_ns - high > hole_ns:
            yield low, high
            low = time_ns
        high = time_ns
    if low is not None and high is not None:
        yield low, high


def _lacks(segment: Segment, wanted: frozenset[int] | set[int]) -> bool:
    return segment.channels is not None and segment.channels.isdisjoint(wanted)


def _push(
    waiting: list[_Head], number: int, offset: int, rest: Iterator[tuple[int, StoredMessage]]
) -> None:
    """Queue the next message of a segment."""
    for index, message in rest:
        heapq.heappush(waiting, (message.log_time_ns, number, offset, index, message, rest))
        return


def _popped(waiting: list[_Head]) -> tuple[int, StoredMessage]:
    _, number, offset, _, message, rest = heapq.heappop(waiting)
    _push(waiting, number, offset, rest)
    return number, message
