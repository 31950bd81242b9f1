# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Scan an MCAP file record by record: its structure, and where it is damaged."""

import struct
from bisect import bisect_right
from collections import Counter, defaultdict
from pathlib import Path
from typing import BinaryIO, NamedTuple

from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, DataEnd, Footer, Metadata, Schema, Statistics
from mcap.writer import MCAP0_MAGIC

from rotor_recording.mcap_records import (
    DESCRIBING,
    FOOTER_BYTES,
    MAX_BYTES,
    MESSAGE,
    RECORD,
    DamageError,
    Description,
    MessageIndices,
    checksum,
    parse,
    records,
    summary_of,
)

_TIMES = struct.Struct('<QQ')  # first and last log time, at the head of a chunk

RUN_BYTES = 2**20
"""Messages outside of chunks are read in runs of about this size."""


class Segment(NamedTuple):
    """A chunk, or a run of messages outside of chunks; the times are log times in ns.

    `channels` are those of its messages, None if they are unknown until it is read.
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


class McapWalk:
    """Structure of a file as found by a scan; `McapFile` interprets it.

    The heads of records are read without the library, which would read every chunk of a killed
    recording when it is opened, and cannot go on after damage.
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

    def _note(self, text: str) -> None:
        sentence = f'{self.path.name}: {text}'
        if sentence not in self.damage:
            self.damage.append(sentence)

    def _walk(self, file: BinaryIO, size: int) -> None:
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
            places = _known_places(file, size)
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
        """Take one record, whose content is the next `length` bytes of the file."""
        if self._is_data_over and opcode in (Opcode.CHUNK, Opcode.MESSAGE):
            self._note(f'the record at byte {position} does not belong there, ignored')
        elif opcode == Opcode.CHUNK:
            head = file.read(min(length, _TIMES.size))
            start_ns, end_ns = _TIMES.unpack(head) if len(head) == _TIMES.size else (0, 0)
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
        elif opcode in DESCRIBING:
            self._is_data_over |= opcode == Opcode.DATA_END
            self._finalised = opcode == Opcode.FOOTER
            self._take_description(file, self._described(opcode, file.read(length)), position)

    def _described(self, opcode: int, content: bytes) -> Description | None:
        """Return a parsed record that describes the file; store a definition."""
        record = parse(opcode, content)
        if record is None:
            self._note(f'a {DESCRIBING[opcode].__name__} record is damaged and ignored')
        elif isinstance(record, Schema):
            self.schemas[record.id] = record
        elif isinstance(record, Channel):
            self.channels[record.id] = record
        return record

    def _take_description(self, file: BinaryIO, record: Description | None, position: int) -> None:
        match record:
            case ChunkIndex(chunk_start_offset=offset):
                times = record.message_start_time, record.message_end_time
                # those in the head of a chunk have no checksum
                if self._times.get(offset, times) != times:
                    self._note(f'the chunk at byte {offset} and its index disagree about its times')
            case Metadata():
                self.metadata[record.name] = record.metadata
            case Statistics():
                self._statistics = record
            case DataEnd():
                self._check_data(file, record, position)
            case Footer():
                self._check_summary(file, record, position)

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

    def _check_end(self, file: BinaryIO, position: int, size: int) -> None:
        file.seek(position)
        extra = size - position - len(MCAP0_MAGIC)
        if file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
            self._note('the mark at the very end is missing, everything before it is whole')
        elif extra:
            self._note(f'{extra} bytes after the end of the recording are ignored')

    def _check_data(self, file: BinaryIO, data_end: DataEnd, position: int) -> None:
        # Chunks have their own checksum, so only messages outside of chunks need this one.
        if not data_end.data_section_crc or not self._loose:
            return
        self._is_data_sound = checksum(file, 0, position) == data_end.data_section_crc
        if not self._is_data_sound:
            self._note(
                'the checksum of the data section does not fit, so messages outside of chunks '
                'may be damaged'
            )

    def _drop_loose_messages(self) -> None:
        """Keep messages between chunks only if a checksum covers them.

        Writers use chunks for all messages or for none; between chunks, a message is most likely
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

    def _check_summary(self, file: BinaryIO, footer: Footer, position: int) -> None:
        if not footer.summary_crc:
            return
        start = footer.summary_start or position
        # the sum covers the footer up to itself
        end = position + FOOTER_BYTES - 4
        if start > position or checksum(file, start, end) != footer.summary_crc:
            self._statistics = None
            self._note('the summary is damaged, so the messages themselves were counted')


def _known_places(file: BinaryIO, size: int) -> list[int]:
    """Return the offsets of the summary and of the chunks that it lists, in file order.

    The scan resumes there after damaged records; nothing else is taken from the list. Empty
    without a readable summary.
    """
    footer, content = summary_of(file, size) or (None, b'')
    if footer is None:
        return []
    places = {footer.summary_start}
    try:
        for opcode, body in records(content):
            index = parse(opcode, body)
            if isinstance(index, ChunkIndex) and index.chunk_start_offset < footer.summary_start:
                places.add(index.chunk_start_offset)
    except DamageError:
        pass  # the offsets found so far still help
    return sorted(places)
