# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""One SQLite file of rosbag2, read by rosbags."""

import contextlib
import sqlite3
from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import yaml
from rosbags.rosbag2 import Reader

from rotor_interfaces.messages import typestore
from vibration_monitor.errors import RecordingInputError
from vibration_monitor.mcap_records import StoredMessage
from vibration_monitor.mcap_walk import Connection, Segment

MAGIC = b'SQLite format 3\0'


class Db3File:
    """A `.db3` file, offered as McapFile offers an `.mcap` file; its one segment is streamed.

    Raises:
        RecordingInputError: not readable, or not a bag.

    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.damage: list[str] = []
        self.connections: dict[int, Connection] = {}
        self.metadata: dict[str, dict[str, str]] = {}
        self.counts: Counter[int] = Counter()
        self.segments: list[Segment] = []
        self.unread: set[Segment] = set()
        self.is_indexed = False
        self.lost_bytes = 0
        self.lost_messages: int | None = 0
        self._definitions: dict[int, tuple[str, str]] = {}
        self.start_ns: int | None = None
        self.end_ns: int | None = None
        try:
            with Reader(path) as bag:
                self._survey(bag)
        except Exception as error:  # noqa: BLE001 - rosbags and SQLite raise many kinds here
            raise RecordingInputError(
                f'{path} cannot be read as a SQLite bag of rosbag2 ({error})'
            ) from None
        journal = path.with_name(f'{path.name}-wal')
        if journal.is_file() and journal.stat().st_size:
            self.damage.append(
                f'{path.name}: its recorder was killed, and what still stands in {journal.name} is '
                'left out'
            )

    def _survey(self, bag: Any) -> None:
        for known in bag.connections:
            self.connections[known.id] = Connection(
                known.topic, known.msgtype, known.ext.serialization_format, _qos_text(known)
            )
            self.counts[known.id] = known.msgcount
            self._definitions[known.id] = _definition(known)
        if self.counts.total():
            self.start_ns, self.end_ns = bag.start_time, bag.end_time - 1
            self.segments.append(
                Segment(self.start_ns, self.end_ns, 0, self.path.stat().st_size, is_chunk=False)
            )

    def definition(self, channel_id: int) -> tuple[tuple[str, str, bytes], dict[str, str]]:
        """Return name, encoding and text of a topic's type, and what MCAP keeps of a channel."""
        connection = self.connections[channel_id]
        text, type_hash = self._definitions[channel_id]
        metadata = {'offered_qos_profiles': connection.qos_profiles, 'topic_type_hash': type_hash}
        return (connection.type, 'ros2msg', text.encode()), metadata

    def ordered(self, segment: Segment, begin_ns: int = -1) -> Iterator[StoredMessage]:
        """Yield the messages from `begin_ns` on by log time; SQLite bags know no other time."""
        try:
            with Reader(self.path) as bag:
                for known, time_ns, data in bag.messages(start=begin_ns if begin_ns > 0 else None):
                    yield StoredMessage(known.id, time_ns, time_ns, bytes(data))
        except GeneratorExit:
            raise
        except Exception as error:  # noqa: BLE001 - SQLite's own errors, which rosbags lets through
            self._give_up(segment, error)

    def times(self, segment: Segment, channels: Collection[int]) -> list[int]:
        """Return the sorted log times of the messages on these channels, in ns."""
        found: list[int] = []
        for channel in channels:
            query = 'SELECT timestamp FROM messages WHERE topic_id = ?'
            found += [time_ns for (time_ns,) in self._rows(segment, query, channel)]
        return sorted(found)

    def last_before(
        self, segment: Segment, channels: Collection[int], time_ns: int
    ) -> list[StoredMessage]:
        """Return the last message on each of these channels before `time_ns`, by log time."""
        found = []
        for channel in channels:
            query = (
                'SELECT timestamp, data FROM messages WHERE topic_id = ? AND timestamp < ? '
                'ORDER BY timestamp DESC, id DESC LIMIT 1'
            )
            for at_ns, data in self._rows(segment, query, channel, time_ns):
                found.append(StoredMessage(channel, at_ns, at_ns, bytes(data)))
        return sorted(found, key=lambda message: message.log_time_ns)

    def _rows(self, segment: Segment, query: str, *values: int) -> list[tuple[Any, ...]]:
        """Return what SQLite answers; rosbags reads forwards only."""
        try:
            with contextlib.closing(
                sqlite3.connect(f'{self.path.resolve().as_uri()}?immutable=1', uri=True)
            ) as bag:
                return bag.execute(query, values).fetchall()
        except sqlite3.Error as error:
            self._give_up(segment, error)
            return []

    def _give_up(self, segment: Segment, error: Exception) -> None:
        self.unread.add(segment)
        self.lost_messages = None
        sentence = f'{self.path.name}: it is damaged, so the rest is left out ({error})'
        if sentence not in self.damage:
            self.damage.append(sentence)


def _definition(known: Any) -> tuple[str, str]:
    """Return text and hash of a type: of the bag, else of the contract, else empty."""
    text, type_hash = str(known.msgdef.data), str(known.digest)
    try:
        text = text or typestore().generate_msgdef(known.msgtype, ros_version=2)[0]
        type_hash = type_hash or typestore().hash_rihs01(known.msgtype)
    except (KeyError, ValueError):
        pass
    return text, type_hash


def _qos_text(known: Any) -> str:
    """Return the QoS profiles of a topic as rosbag2 writes them into MCAP files."""
    return yaml.safe_dump(
        [
            {
                'depth': qos.depth,
                'reliability': qos.reliability.name.lower(),
                'durability': qos.durability.name.lower(),
            }
            for qos in known.ext.offered_qos_profiles
        ]
    )
