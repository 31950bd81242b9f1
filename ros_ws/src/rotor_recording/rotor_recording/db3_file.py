# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Read one SQLite file of rosbag2, without trusting the types of its cells."""

import contextlib
import sqlite3
from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path

from rosbags.typesys.base import TypesysError

from rotor_interfaces.messages import typestore
from rotor_recording.errors import RecordingInputError
from rotor_recording.mcap_records import MAX_BYTES, StoredMessage
from rotor_recording.mcap_walk import Connection, Segment

MAGIC = b'SQLite format 3\0'

_WHOLE = "typeof(timestamp) = 'integer' AND timestamp >= 0 AND typeof(data) = 'blob'"
"""Condition for a valid row: SQLite keeps a cell of any type in any column."""

# fixed text: nothing in it comes from the file
_BROKEN = f'SELECT count(*) FROM messages WHERE NOT ({_WHOLE})'  # noqa: S608
_EXTENTS = 'SELECT topic_id, count(*), min(timestamp), max(timestamp) FROM messages'


class Db3File:
    """A `.db3` file with the interface of McapFile; its one segment is streamed.

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
        self._definitions: dict[int, tuple[str, str, str]] = {}
        self._extents: dict[int, tuple[int, int]] = {}
        """First and last log time of each topic, ns."""
        try:
            with self._opened() as bag:
                self._read_topics(bag)
                self._survey(bag)
        except (sqlite3.Error, OSError, MemoryError) as error:
            raise RecordingInputError(
                f'{path} cannot be read as a SQLite bag of rosbag2 ({error})'
            ) from None
        self.start_ns = min((first for first, _ in self._extents.values()), default=None)
        self.end_ns = max((last for _, last in self._extents.values()), default=None)
        if self.start_ns is not None and self.end_ns is not None:
            self.segments.append(
                Segment(self.start_ns, self.end_ns, 0, path.stat().st_size, is_chunk=False)
            )
        journal = path.with_name(f'{path.name}-wal')
        if journal.is_file() and journal.stat().st_size:
            self.damage.append(
                f'{path.name}: its recorder was killed, and what is still in {journal.name} is '
                'left out'
            )

    @contextlib.contextmanager
    def _opened(self) -> Iterator[sqlite3.Connection]:
        """Open the file read-only; nothing but its tables is trusted."""
        uri = f'{self.path.resolve().as_uri()}?immutable=1'
        with contextlib.closing(sqlite3.connect(uri, uri=True)) as bag:
            bag.text_factory = _text
            bag.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MAX_BYTES)
            try:
                bag.execute('PRAGMA trusted_schema = OFF')
                yield bag
            except UnicodeDecodeError:  # in SQLite's own error message
                raise sqlite3.DatabaseError('its list of tables is damaged') from None

    def _read_topics(self, bag: sqlite3.Connection) -> None:
        """Take the topics and, where the bag has them, the definitions of their types."""
        tables = {
            name: [row[1] for row in bag.execute(f'PRAGMA table_info({name})')]
            for name in ('topics', 'messages', 'message_definitions')
            if bag.execute(
                "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = ?", (name,)
            ).fetchone()
        }
        if not {'topics', 'messages'} <= tables.keys():
            raise sqlite3.DatabaseError('it lacks the table of topics or that of messages')
        types: dict[str, tuple[str, str]] = {}
        if 'message_definitions' in tables:
            query = 'SELECT topic_type, encoding, encoded_message_definition FROM'
            for row in bag.execute(f'{query} message_definitions ORDER BY id DESC'):
                if all(isinstance(cell, str) for cell in row):
                    types[row[0]] = row[1:]
        # older bags have fewer columns
        columns = tables['topics']
        extra = [
            name if name in columns else "''"
            for name in ('offered_qos_profiles', 'type_description_hash')
        ]
        left_out = 0
        query = f'SELECT id, name, type, serialization_format, {", ".join(extra)} FROM topics'  # noqa: S608
        for number, *cells in bag.execute(f'{query} ORDER BY id'):
            name, kind, encoding, qos, type_hash = (
                cell if isinstance(cell, str) else '' for cell in cells
            )
            if not isinstance(number, int) or not name:
                left_out += 1
                continue
            self.connections[number] = Connection(name, kind, encoding, qos)
            self.counts[number] = 0
            self._definitions[number] = _definition(kind, type_hash, types)
        if left_out:
            self._leave_out(f'{left_out} topics have no number or no name and are left out')

    def _survey(self, bag: sqlite3.Connection) -> None:
        """Count the messages of each topic, and the rows that are no messages."""
        homeless = 0
        (broken,) = bag.execute(_BROKEN).fetchone()
        # the condition makes SQLite sort all data by topic, so it is used only where needed
        condition = f'WHERE {_WHOLE}' if broken else ''
        for topic, count, *extent in bag.execute(f'{_EXTENTS} {condition} GROUP BY topic_id'):
            if topic in self.connections:
                self.counts[topic] = count
                self._extents[topic] = extent[0], extent[1]
            else:
                homeless += count
        if broken:
            self._leave_out(
                f'{broken} rows are left out, since their time is no whole number from 0 on or '
                'their data are no bytes'
            )
        if homeless:
            self._leave_out(f'{homeless} messages of topics that it does not name are left out')
        if self.lost_messages is not None:
            self.lost_messages += broken + homeless

    def definition(self, channel_id: int) -> tuple[tuple[str, str, bytes], dict[str, str]]:
        """Return name, encoding and text of a topic's type, and the metadata of an MCAP channel."""
        connection = self.connections[channel_id]
        encoding, text, type_hash = self._definitions[channel_id]
        metadata = {'offered_qos_profiles': connection.qos_profiles, 'topic_type_hash': type_hash}
        return (connection.type, encoding, text.encode()), metadata

    def ordered(self, segment: Segment, begin_ns: int = -1) -> Iterator[StoredMessage]:
        """Yield the messages from `begin_ns` on by log time; SQLite bags know no other time."""
        query = (
            f'SELECT topic_id, timestamp, data FROM messages WHERE timestamp >= ? AND {_WHOLE} '  # noqa: S608
            'ORDER BY timestamp, id'
        )
        try:
            with self._opened() as bag:
                for topic, time_ns, data in bag.execute(query, (max(begin_ns, 0),)):
                    if topic in self.connections:
                        yield StoredMessage(topic, time_ns, time_ns, data)
        except (sqlite3.Error, MemoryError) as error:
            self._give_up(segment, error)

    def times(self, segment: Segment, channels: Collection[int], hole_ns: int) -> list[int]:
        """Return sorted log times of messages on these channels, in ns, by the index of times.

        Not all are returned, but both ends of every gap longer than `hole_ns` are among them: a
        time is followed by the last one within `hole_ns` after it, or else by the next one.
        """
        wanted = f'topic_id IN ({", ".join(str(int(n)) for n in channels)}) AND {_WHOLE}'
        found: list[int] = []
        reached = -1
        try:
            with self._opened() as bag:
                index = _index_of_times(bag)
                select = f'SELECT timestamp FROM messages {index} WHERE {wanted}'  # noqa: S608
                if not index:
                    return [time_ns for (time_ns,) in bag.execute(f'{select} ORDER BY timestamp')]
                later = f'{select} AND timestamp > ? ORDER BY timestamp LIMIT 1'
                within = f'{select} AND timestamp > ? AND timestamp <= ? ORDER BY timestamp DESC'
                while True:
                    row = (
                        found
                        and bag.execute(
                            f'{within} LIMIT 1', (reached, reached + hole_ns)
                        ).fetchone()
                    )
                    row = row or bag.execute(later, (reached,)).fetchone()
                    if not row:
                        return found
                    reached = row[0]
                    found.append(reached)
        except (sqlite3.Error, MemoryError, OverflowError) as error:
            self._give_up(segment, error)
            return found

    def last_before(
        self, segment: Segment, channels: Collection[int], time_ns: int
    ) -> list[StoredMessage]:
        """Return the last message on each of these channels before `time_ns`, by log time."""
        query = (
            f'SELECT timestamp, data FROM messages WHERE topic_id = ? AND {_WHOLE} '  # noqa: S608
            'AND timestamp >= ? AND timestamp <= ? ORDER BY timestamp DESC, id DESC LIMIT 1'
        )
        found = []
        try:
            with self._opened() as bag:
                for channel in channels & self._extents.keys():
                    # a latched topic has few messages: its first and last time narrow the search
                    first_ns, last_ns = self._extents[channel]
                    limits = (last_ns if last_ns < time_ns else first_ns, min(last_ns, time_ns - 1))
                    for at_ns, data in bag.execute(query, (channel, *limits)):
                        found.append(StoredMessage(channel, at_ns, at_ns, data))
        except (sqlite3.Error, MemoryError) as error:
            self._give_up(segment, error)
        return sorted(found, key=lambda message: message.log_time_ns)

    def _leave_out(self, text: str) -> None:
        self.damage.append(f'{self.path.name}: {text}')

    def _give_up(self, segment: Segment, error: Exception) -> None:
        self.unread.add(segment)
        self.lost_messages = None
        sentence = f'{self.path.name}: it is damaged, so the rest is left out ({error})'
        if sentence not in self.damage:
            self.damage.append(sentence)


def _index_of_times(bag: sqlite3.Connection) -> str:
    """Return the SQL clause that uses the index of all times, '' if the bag has none."""
    for _, name, _, _, is_partial in bag.execute('PRAGMA index_list(messages)'):
        quoted = '"' + name.replace('"', '""') + '"'
        columns = bag.execute(f'PRAGMA index_info({quoted})').fetchall()
        if not is_partial and columns and columns[0][2] == 'timestamp':
            return f'INDEXED BY {quoted}'
    return ''


def _text(content: bytes) -> str:
    return content.decode('utf-8', 'replace')


def _definition(
    kind: str, type_hash: str, types: dict[str, tuple[str, str]]
) -> tuple[str, str, str]:
    """Return encoding, text and hash of a type: from the bag, else the contract, else empty."""
    encoding, text = types.get(kind, ('ros2msg', ''))
    with contextlib.suppress(KeyError, ValueError, TypesysError):
        if not text:
            encoding, text = 'ros2msg', typestore().generate_msgdef(kind, ros_version=2)[0]
        type_hash = type_hash or typestore().hash_rihs01(kind)
    return encoding, text, type_hash
