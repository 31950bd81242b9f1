# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""One SQLite file of rosbag2, read by rosbags."""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml
from rosbags.rosbag2 import Reader

from vibration_monitor.errors import RecordingInputError
from vibration_monitor.mcap_file import Connection, Segment
from vibration_monitor.mcap_records import StoredMessage

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
        if self.counts.total():
            self.start_ns, self.end_ns = bag.start_time, bag.end_time - 1
            self.segments.append(
                Segment(self.start_ns, self.end_ns, 0, self.path.stat().st_size, is_chunk=False)
            )

    def ordered(self, segment: Segment) -> Iterator[StoredMessage]:
        """Yield all messages by log time; SQLite bags know no other time."""
        try:
            with Reader(self.path) as bag:
                for known, time_ns, data in bag.messages():
                    yield StoredMessage(known.id, time_ns, time_ns, bytes(data))
        except GeneratorExit:
            raise
        except Exception as error:  # noqa: BLE001 - SQLite's own errors, which rosbags lets through
            self.unread.add(segment)
            sentence = f'{self.path.name}: it is damaged, so the rest is left out ({error})'
            if sentence not in self.damage:
                self.damage.append(sentence)


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
