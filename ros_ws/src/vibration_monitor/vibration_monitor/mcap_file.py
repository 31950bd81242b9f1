# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""One MCAP file: what is whole, where it stands, and what is lost.

Lengths are checked against the file before anything is read, and chunks against their checksum,
so that a damaged file costs neither memory nor time, and never gives a wrong message.
"""

import os
from bisect import bisect_right
from collections import Counter, defaultdict, deque
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

from mcap.opcode import Opcode
from mcap.records import Channel, DataEnd, Footer, Metadata, Schema, Statistics
from mcap.writer import MCAP0_MAGIC

from vibration_monitor import mcap_records
from vibration_monitor.errors import RecordingInputError
from vibration_monitor.mcap_records import (
    CHUNK,
    FOOTER_BYTES,
    INDEX,
    MAX_BYTES,
    MESSAGE,
    RECORD,
    DamageError,
    MessageIndices,
    RecordType,
    StoredMessage,
)
from vibration_monitor.mcap_summary import read_summary

RUN_BYTES = 2**20
"""Messages outside of chunks are read in runs of about this size."""


class Segment(NamedTuple):
    """A chunk, or a run of messages outside of chunks; the times are log times in ns.

    `channels` are those of its messages, None where only reading it would tell.
    """

    start_ns: int
    end_ns: int
    offset: int
    length: int
    is_chunk: bool
    channels: frozenset[int] | None = None


class Connection(NamedTuple):
    """A topic of a recording: full name, type, message encoding, QoS profiles as YAML text."""

    topic: str
    type: str
    encoding: str
    qos_profiles: str


class McapFile:
    """An MCAP file, finalised or not; only its structure is held in memory.

    `damage` holds one sentence for each thing lost; it can grow while segments are read.
    `counts` (messages by channel), `start_ns` and `end_ns` come from the summary of a whole
    file, else from the indices of the messages or the messages themselves. `is_indexed` says that
    a checksum vouches for the `channels` of all segments. `lost_bytes`, and `lost_messages` (None:
    nobody knows), are what was left out so far.

    Raises:
        RecordingInputError: not readable, not MCAP, or damaged with no whole message left.

    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.damage: list[str] = []
        self.segments: list[Segment] = []
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.metadata: dict[str, dict[str, str]] = {}
        self.counts: Counter[int] = Counter()
        self.start_ns: int | None = None
        self.end_ns: int | None = None
        self.unread: set[Segment] = set()
        self.is_indexed = False
        self.lost_bytes = 0
        self.lost_messages: int | None = 0
        self._indexed: defaultdict[int, MessageIndices] = defaultdict(MessageIndices)
        self._counted: Counter[int] = Counter()
        self._defined: set[int] = set()
        self._times: dict[int, tuple[int, int]] = {}
        self._loose = 0
        self._is_data_sound = False
        self._is_data_over = False
        self._statistics: Statistics | None = None
        self._finalised = False
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
        """What is known of each channel."""
        return {number: self._connection(channel) for number, channel in self.channels.items()}

    def _connection(self, channel: Channel) -> Connection:
        schema = self.schemas.get(channel.schema_id)
        return Connection(
            channel.topic,
            schema.name if schema else '',
            channel.message_encoding,
            channel.metadata.get('offered_qos_profiles', ''),
        )

    def definition(self, channel_id: int) -> tuple[tuple[str, str, bytes], dict[str, str]]:
        """Return name, encoding and data of a channel's schema, and the channel's metadata."""
        channel = self.channels[channel_id]
        schema = self.schemas.get(channel.schema_id)
        known = (schema.name, schema.encoding, schema.data) if schema else ('', '', b'')
        return known, channel.metadata

    def ordered(self, segment: Segment, begin_ns: int = -1) -> Iterator[StoredMessage]:  # noqa: ARG002
        """Yield the messages of a segment by log time, and in file order where it is equal.

        `begin_ns` is for the caller to hold to: a segment is read as a whole.
        """
        messages = deque(sorted(self.read(segment), key=lambda message: message.log_time_ns))
        while messages:
            yield messages.popleft()

    def times(self, segment: Segment, channels: Collection[int]) -> list[int]:
        """Return the sorted log times of a segment's messages on these channels, in ns."""
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
        """Return the messages of a segment in file order; empty, with a sentence, if damaged."""
        if segment in self.unread:
            return []
        try:
            return self._read(segment)
        except DamageError as damage:
            self.unread.add(segment)
            kind = 'chunk' if segment.is_chunk else 'run of messages'
            self.lost_bytes += segment.length
            count = self._counted[segment.offset] or 'uncounted'
            if self.lost_messages is not None and count != 'uncounted':
                self.lost_messages += int(count)
            else:
                self.lost_messages = None
            self._note(
                f'the {kind} at byte {segment.offset} is damaged ({damage}), so its {count} '
                'messages are left out'
            )
            return []

    def _read(self, segment: Segment) -> list[StoredMessage]:
        if segment.length > MAX_BYTES:
            raise DamageError(f'it is larger than {MAX_BYTES} bytes')
        with self.path.open('rb') as file:
            file.seek(segment.offset)
            content = file.read(segment.length)
        if segment.is_chunk:
            content, claimed = mcap_records.unpack_chunk(content)
            if len(content) != claimed:
                self._note(
                    f'the chunk at byte {segment.offset} claims {claimed} bytes and holds '
                    f'{len(content)}, all of which were read'
                )
        messages: list[StoredMessage] = []
        for opcode, body in mcap_records.records(content):
            if opcode == Opcode.MESSAGE:
                messages.append(mcap_records.message(body))
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._defined.update(self._define(opcode, body))
            elif opcode == Opcode.CHUNK and segment.is_chunk:
                raise DamageError('it holds another chunk, which MCAP forbids')
        return messages

    def _note(self, text: str) -> None:
        sentence = f'{self.path.name}: {text}'
        if sentence not in self.damage:
            self.damage.append(sentence)

    def _open(self, file: BinaryIO) -> None:
        """Take the structure from the summary, else from the records themselves."""
        size = file.seek(0, os.SEEK_END)
        file.seek(0)
        is_mcap = file.read(len(MCAP0_MAGIC)) == MCAP0_MAGIC
        summary = read_summary(file, size) if is_mcap else None
        if summary is None:
            self._walk(file, size, is_mcap=is_mcap)
            self._drop_loose_messages()
            if not self._take_statistics():
                self._survey()
            return
        self.is_indexed = True
        self.schemas, self.channels = summary.schemas, summary.channels
        self.metadata = summary.metadata
        for place in summary.chunks:
            offset, length = place.offset + RECORD.size, place.length - RECORD.size
            self._counted[offset] = place.messages
            times = place.start_ns, place.end_ns
            self.segments.append(Segment(*times, offset, length, True, place.channels))
        self._adopt(summary.statistics)

    # The walk from record to record, once, when the file is opened

    def _walk(self, file: BinaryIO, size: int, *, is_mcap: bool) -> None:
        if not is_mcap:
            kind = 'is empty' if size == 0 else 'is not an MCAP file (its first bytes differ)'
            raise RecordingInputError(
                f'{self.path} {kind}; give a .mcap file or the folder of a bag'
            )
        position = len(MCAP0_MAGIC)
        while not self._finalised:
            file.seek(position)
            head = file.read(RECORD.size)
            opcode, length = RECORD.unpack(head) if len(head) == RECORD.size else (0, 0)
            end = position + RECORD.size + length
            if opcode and end <= size:
                self._take(file, opcode, position, length)
                position = end
                continue
            places = mcap_records.known_places(file, size)
            later = bisect_right(places, position)
            if later == len(places):
                broken = size - position
                self.lost_bytes += broken
                self.lost_messages = None
                self._note(
                    f'it was not finalised, or is cut, at byte {position}'
                    + (f'; the {broken} bytes of a broken record there are left out' * bool(broken))
                )
                return
            self._note(f'bytes {position} to {places[later]} are damaged and left out')
            self.lost_bytes += places[later] - position
            self.lost_messages = None
            position = places[later]
            self._is_data_over = position == places[-1]  # where the summary begins
        self._check_end(file, position, size)

    def _take(self, file: BinaryIO, opcode: int, position: int, length: int) -> None:
        """Note one record, whose content is the next `length` bytes of the file."""
        if self._is_data_over and opcode in (Opcode.CHUNK, Opcode.MESSAGE):
            self._note(f'the record at byte {position} does not belong there, ignored')
        elif opcode == Opcode.CHUNK:
            head = file.read(min(length, CHUNK.size))
            start_ns, end_ns = CHUNK.unpack(head)[:2] if len(head) == CHUNK.size else (0, 0)
            self._times[position] = (start_ns, end_ns)
            self.segments.append(
                Segment(start_ns, end_ns, position + RECORD.size, length, is_chunk=True)
            )
        elif opcode == Opcode.MESSAGE:
            self._take_message(file, position, length)
        elif opcode == Opcode.MESSAGE_INDEX:
            if self.segments and length <= MAX_BYTES:
                offset = self.segments[-1].offset
                self._indexed[offset].take(file.read(length))
                self._counted[offset] = self._indexed[offset].counts.total()
        elif length > MAX_BYTES:
            self._note(f'the record at byte {position} is too large ({length} bytes), ignored')
        else:
            self._take_small(file, opcode, position, length)

    def _take_small(self, file: BinaryIO, opcode: int, position: int, length: int) -> None:
        """Read one of the records that describe the file."""
        if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            self._define(opcode, file.read(length))
        elif opcode == Opcode.CHUNK_INDEX:
            self._check_times(file.read(length))
        elif opcode == Opcode.METADATA:
            metadata = self._parse(Metadata, file.read(length))
            if metadata is not None:
                self.metadata[metadata.name] = metadata.metadata
        elif opcode == Opcode.STATISTICS:
            self._statistics = self._parse(Statistics, file.read(length))
        elif opcode == Opcode.DATA_END:
            self._is_data_over = True
            self._check_data(file, self._parse(DataEnd, file.read(length)), position)
        elif opcode == Opcode.FOOTER:
            self._finalised = True
            self._check_summary(file, self._parse(Footer, file.read(length)), position)

    def _check_times(self, content: bytes) -> None:
        """Compare the times in the head of a chunk, which has no checksum, with the index."""
        if len(content) >= INDEX.size and self._times:
            start_ns, end_ns, offset = INDEX.unpack_from(content)
            if self._times.get(offset, (start_ns, end_ns)) != (start_ns, end_ns):
                self._note(f'the chunk at byte {offset} and its index disagree about its times')

    def _take_message(self, file: BinaryIO, position: int, length: int) -> None:
        self._loose += 1
        head = file.read(min(length, MESSAGE.size))
        log_time = MESSAGE.unpack(head)[2] if len(head) == MESSAGE.size else 0
        end = position + RECORD.size + length
        last = self.segments[-1] if self.segments else None
        if last is None or last.is_chunk or end - last.offset > RUN_BYTES:
            self.segments.append(Segment(log_time, log_time, position, end - position, False))
        else:
            start_ns, end_ns = min(last.start_ns, log_time), max(last.end_ns, log_time)
            self.segments[-1] = Segment(start_ns, end_ns, last.offset, end - last.offset, False)

    def _define(self, opcode: int, content: bytes) -> list[int]:
        """Take a definition; return the channel that is now known."""
        if opcode == Opcode.SCHEMA:
            schema = self._parse(Schema, content)
            if schema is not None:
                self.schemas[schema.id] = schema
            return []
        channel = self._parse(Channel, content)
        if channel is None:
            return []
        self.channels[channel.id] = channel
        return [channel.id]

    def _parse(self, record: type[RecordType], content: bytes) -> RecordType | None:
        parsed = mcap_records.parse(record, content)
        if parsed is None:
            self._note(f'a {record.__name__} record is damaged and ignored')
        return parsed

    def _check_end(self, file: BinaryIO, position: int, size: int) -> None:
        file.seek(position)
        extra = size - position - len(MCAP0_MAGIC)
        if file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
            self._note('the mark at the very end is missing, everything before it is whole')
        elif extra:
            self._note(f'{extra} bytes after the end of the recording are ignored')

    def _check_data(self, file: BinaryIO, data_end: DataEnd | None, position: int) -> None:
        # Chunks have their own checksum, so only messages outside of chunks need this one.
        if data_end is None or not data_end.data_section_crc:
            return
        if not self._loose:
            return
        self._is_data_sound = mcap_records.checksum(file, 0, position) == data_end.data_section_crc
        if not self._is_data_sound:
            self._note(
                'the checksum of the data section does not fit, so messages outside of chunks '
                'may be damaged'
            )

    def _drop_loose_messages(self) -> None:
        """Believe messages between chunks only if a checksum vouches for them.

        Writers use chunks for all messages or for none; beside chunks, a message is most likely
        another record with a damaged opcode.
        """
        chunks = [segment for segment in self.segments if segment.is_chunk]
        if chunks and self._loose and not self._is_data_sound:
            self._note(
                f'{self._loose} messages between the chunks are left out, since no checksum '
                'vouches for them'
            )
            self.segments = chunks
            self._loose = 0

    def _check_summary(self, file: BinaryIO, footer: Footer | None, position: int) -> None:
        if footer is None or not footer.summary_crc:
            return
        start = footer.summary_start or position
        # the sum covers the footer up to itself
        end = position + FOOTER_BYTES - 4
        if start > position or mcap_records.checksum(file, start, end) != footer.summary_crc:
            self._statistics = None
            self._note('the summary is damaged, so the messages themselves were counted')

    # What is in the file

    def _take_statistics(self) -> bool:
        """Adopt the counts of the summary if the file is whole and it names every channel."""
        known = self._statistics
        if known is None or self.damage or known.channel_count != len(self.channels):
            return False
        if sum(known.channel_message_counts.values()) != known.message_count:
            return False
        # a chunk or message that the walk passed by: its opcode or a length before it is damaged
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
        """Count without a summary, reading what is not indexed or may define a channel.

        Only a definition in a chunk has a checksum.
        """
        ranges: dict[int, tuple[int, int]] = {}
        for number, segment in enumerate(self.segments):
            indexed = self._indexed[segment.offset]
            if (
                segment.is_chunk
                and indexed.fits(segment.start_ns, segment.end_ns)
                and indexed.counts.keys() <= self._defined
            ):
                counts = indexed.counts
                self.segments[number] = segment._replace(channels=frozenset(counts))
                extent = segment.start_ns, segment.end_ns
            else:
                messages = self.read(segment)
                counts = Counter(message.channel_id for message in messages)
                times = [message.log_time_ns for message in messages]
                extent = min(times, default=2**64), max(times, default=-1)
                if messages:
                    self.segments[number] = segment._replace(
                        start_ns=extent[0], end_ns=extent[1], channels=frozenset(counts)
                    )
            for channel_id in counts:
                low, high = ranges.get(channel_id, extent)
                ranges[channel_id] = min(low, extent[0]), max(high, extent[1])
            self.counts.update(counts)
        self._indexed.clear()
        # only now is every definition known
        unknown = {i: self.counts.pop(i) for i in ranges if i not in self.channels}
        self.start_ns = min((ranges[i][0] for i in self.counts), default=None)
        self.end_ns = max((ranges[i][1] for i in self.counts), default=None)
        for channel_id, count in sorted(unknown.items()):
            self._note(
                f'{count} messages of channel {channel_id} are left out, since what defines the '
                'channel is missing or damaged'
            )
        announced = self._statistics.message_count if self._statistics else 0
        if announced > self.counts.total():
            self._note(
                f'{self.counts.total()} of the {announced} messages that its summary announces '
                'could be read'
            )
