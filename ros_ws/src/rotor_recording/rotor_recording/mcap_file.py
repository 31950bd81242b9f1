# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Read one MCAP file: which parts are intact, where they are, and what is lost.

Lengths are checked against the file before anything is read, and chunks against their checksum,
so that a damaged file costs neither memory nor time, and never gives a wrong message.
"""

import os
from collections import Counter, deque
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.records import Channel, Statistics
from mcap.writer import MCAP0_MAGIC

from rotor_recording.errors import RecordingInputError
from rotor_recording.mcap_records import (
    MAX_BYTES,
    DamageError,
    StoredMessage,
    message,
    records,
    unpack_chunk,
)
from rotor_recording.mcap_summary import read_summary
from rotor_recording.mcap_walk import Connection, McapWalk, Segment


class McapFile(McapWalk):
    """An MCAP file, finalised or not; only its structure is held in memory.

    `damage` holds one sentence for each thing lost; it can grow while segments are read.
    `counts` (messages by channel), `start_ns` and `end_ns` come from the summary of a whole
    file, else from the indices of the messages or the messages themselves. `is_indexed` says that
    a checksum covers the `channels` of all segments. `lost_bytes` and `lost_messages` (None:
    unknown) count what was left out so far.

    Raises:
        RecordingInputError: not readable, not MCAP, or damaged with no whole message left.

    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        try:
            with path.open('rb') as file:
                self._open(file)
        except OSError as error:
            raise RecordingInputError(
                f'{path} cannot be read ({error.strerror}); check the path and its permissions'
            ) from None
        if self.damage and not self.counts:
            raise RecordingInputError(
                f'{path} holds no whole message, so there is nothing to read '
                f'({"; ".join(self.damage)})'
            )

    @property
    def connections(self) -> dict[int, Connection]:
        """Topic, type, encoding and QoS of each channel."""
        return {
            number: Connection(
                channel.topic,
                self.definition(number)[0][0],
                channel.message_encoding,
                channel.metadata.get('offered_qos_profiles', ''),
            )
            for number, channel in self.channels.items()
        }

    def definition(self, channel_id: int) -> tuple[tuple[str, str, bytes], dict[str, str]]:
        """Return name, encoding and data of a channel's schema, and the channel's metadata."""
        channel = self.channels[channel_id]
        schema = self.schemas.get(channel.schema_id)
        known = (schema.name, schema.encoding, schema.data) if schema else ('', '', b'')
        return known, channel.metadata

    def ordered(self, segment: Segment, begin_ns: int = -1) -> Iterator[StoredMessage]:  # noqa: ARG002
        """Yield the messages of a segment by log time, and in file order where it is equal.

        `begin_ns` has no effect, so the caller must filter: a segment is read as a whole.
        """
        messages = deque(sorted(self.read(segment), key=lambda message: message.log_time_ns))
        while messages:
            yield messages.popleft()

    def times(self, segment: Segment, channels: Collection[int], hole_ns: int) -> list[int]:  # noqa: ARG002 - a segment is read whole
        """Return sorted log times of a segment's messages on these channels, in ns.

        All are returned, so both ends of every gap longer than `hole_ns` are among them.
        """
        return sorted(m.log_time_ns for m in self.read(segment) if m.channel_id in channels)

    def last_before(
        self, segment: Segment, channels: Collection[int], time_ns: int
    ) -> list[StoredMessage]:
        """Return the messages of a segment on these channels before `time_ns`, by log time."""
        return [
            message
            for message in self.ordered(segment)
            if message.channel_id in channels and message.log_time_ns < time_ns
        ]

    def read(self, segment: Segment) -> list[StoredMessage]:
        """Return the messages of a segment in file order; empty, and noted, if it is damaged."""
        if segment in self.unread:
            return []
        try:
            return self._read(segment)
        except DamageError as damage:
            self.unread.add(segment)
            kind = 'chunk' if segment.is_chunk else 'run of messages'
            self.lost_bytes += segment.length
            count = self._counted[segment.offset]
            is_known = self.lost_messages is not None and count
            self.lost_messages = (self.lost_messages or 0) + count if is_known else None
            self._note(
                f'the {kind} at byte {segment.offset} is damaged ({damage}), so its '
                f'{count or "uncounted"} messages are left out'
            )
            return []

    def _read(self, segment: Segment) -> list[StoredMessage]:
        if segment.length > MAX_BYTES:
            raise DamageError(f'it is larger than {MAX_BYTES} bytes')
        with self.path.open('rb') as file:
            file.seek(segment.offset)
            content = file.read(segment.length)
        if segment.is_chunk:
            content, claimed = unpack_chunk(content)
            if len(content) != claimed:
                self._note(
                    f'the chunk at byte {segment.offset} claims {claimed} bytes and holds '
                    f'{len(content)}, all of which were read'
                )
        messages: list[StoredMessage] = []
        for opcode, body in records(content):
            if opcode == Opcode.MESSAGE:
                messages.append(message(body))
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                record = self._described(opcode, body)
                if isinstance(record, Channel):
                    self._defined.add(record.id)
            elif opcode == Opcode.CHUNK and segment.is_chunk:
                raise DamageError('it holds another chunk, which MCAP forbids')
        return messages

    def _open(self, file: BinaryIO) -> None:
        """Take the structure from the summary, else from the records themselves."""
        size = file.seek(0, os.SEEK_END)
        file.seek(0)
        if file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
            kind = 'is not an MCAP file (its first bytes differ)' if size else 'is empty'
            raise RecordingInputError(
                f'{self.path} {kind}; give a .mcap file or the folder of a bag'
            )
        summary = read_summary(file, size)
        if summary is None or summary.statistics is None:
            self._walk(file, size)
            self._drop_loose_messages()
            if not self._take_statistics():
                self._survey()
            return
        self.is_indexed = True
        self.schemas, self.channels = summary.schemas, summary.channels
        self.metadata, self.segments = summary.metadata, summary.chunks
        self._counted.update(summary.counted)
        self._adopt(summary.statistics)

    # What is in the file

    def _take_statistics(self) -> bool:
        """Adopt the counts of the summary if the file is whole and it names every channel."""
        known = self._statistics
        if known is None or self.damage or known.channel_count != len(self.channels):
            return False
        if sum(known.channel_message_counts.values()) != known.message_count:
            return False
        # the walk missed a chunk or message: its opcode or a length before it is damaged
        chunks = sum(segment.is_chunk for segment in self.segments)
        if known.chunk_count != chunks or (self._loose and self._loose != known.message_count):
            return False
        self._adopt(known)
        return True

    def _adopt(self, known: Statistics) -> None:
        self.counts.update(known.channel_message_counts)
        if known.message_count:
            self.start_ns, self.end_ns = known.message_start_time, known.message_end_time

    def _survey(self) -> None:
        """Count without a summary; read segments that have no index or may define a channel.

        Only a definition in a chunk has a checksum.
        """
        ranges: dict[int, tuple[int, int]] = {}
        for number, segment in enumerate(self.segments):
            indexed = self._indexed[segment.offset]
            counts = indexed.counts
            if not (
                segment.is_chunk
                and indexed.fits(segment.start_ns, segment.end_ns)
                and counts.keys() <= self._defined
            ):
                messages = self.read(segment)
                counts = Counter(message.channel_id for message in messages)
                times = [message.log_time_ns for message in messages] or segment[:2]
                segment = segment._replace(start_ns=min(times), end_ns=max(times))  # noqa: PLW2901
            if counts:
                self.segments[number] = segment._replace(channels=frozenset(counts))
            for channel_id in counts:
                low, high = ranges.get(channel_id, segment[:2])
                ranges[channel_id] = min(low, segment.start_ns), max(high, segment.end_ns)
            self.counts.update(counts)
        self._indexed.clear()
        # only now is every definition known
        unknown = {i: self.counts.pop(i) for i in ranges if i not in self.channels}
        self.start_ns = min((ranges[i][0] for i in self.counts), default=None)
        self.end_ns = max((ranges[i][1] for i in self.counts), default=None)
        for channel_id, count in sorted(unknown.items()):
            self._note(
                f'{count} messages of channel {channel_id} are left out, since the definition of '
                'the channel is missing or damaged'
            )
        announced = self._statistics.message_count if self._statistics else 0
        if announced > self.counts.total():
            self._note(
                f'{self.counts.total()} of the {announced} messages that its summary announces '
                'could be read'
            )
