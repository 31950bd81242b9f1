# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Pieces of an MCAP file, each taken apart without trusting a length or a checksum in it.

The record types themselves are those of the `mcap` library (specification: mcap.dev/spec).
"""

import io
import os
import struct
import zlib
from collections import Counter
from collections.abc import Iterator
from typing import BinaryIO, NamedTuple, TypeVar

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)
from mcap.writer import MCAP0_MAGIC

MAX_BYTES = 128 * 2**20
"""No chunk, packed or unpacked, and no other record is read beyond this; usual are 1 to 4 MiB."""

RECORD = struct.Struct('<BQ')  # opcode, length of the content
MESSAGE = struct.Struct('<HIQQ')  # channel, sequence, log time, publish time
CHUNK = struct.Struct('<QQQII')  # start, end, unpacked size, checksum, length of a name
INDEX = struct.Struct('<QQQ')  # of a chunk: start, end, offset
MESSAGE_INDEX_BYTES = RECORD.size + 6  # channel, and length of the list of entries
ENTRY_BYTES = 16  # log time and place of a message in its chunk
_INDEX_HEAD = struct.Struct('<HI')
_ENTRY = struct.Struct('<QQ')
_CHUNK_INDEX = struct.Struct('<QQQQI')  # start, end, offset, length, bytes of a map
_OFFSET = struct.Struct('<HQ')  # channel, place of its message index
_U64 = struct.Struct('<Q')
FOOTER_BYTES = RECORD.size + 20
_PIECE_BYTES = 2**20

RecordType = TypeVar(
    'RecordType', Schema, Channel, ChunkIndex, DataEnd, Footer, Metadata, MetadataIndex, Statistics
)


_PACKED = {b'\x28\xb5\x2f\xfd': 'zstd', b'\x04\x22\x4d\x18': 'lz4'}
"""What compressed data begin with; CDR begins with a zero byte."""


class StoredMessage(NamedTuple):
    """One message as it stands in the file; times in ns."""

    channel_id: int
    log_time_ns: int
    publish_time_ns: int
    data: bytes
    sequence: int = 0


class ChunkPlace(NamedTuple):
    """What the summary says of a chunk: log times in ns, bytes, channels, number of messages."""

    start_ns: int
    end_ns: int
    offset: int
    length: int
    channels: frozenset[int]
    messages: int


class MessageIndices:
    """What the message indices after one chunk say of it."""

    def __init__(self) -> None:
        self.counts: Counter[int] = Counter()
        self.start_ns, self.end_ns = 2**64, -1
        self.is_sound = True

    def take(self, content: bytes) -> None:
        """Take the next one: channel, then log time and place of each message."""
        entries = (len(content) - _INDEX_HEAD.size) // ENTRY_BYTES
        if entries < 1 or len(content) != _INDEX_HEAD.size + entries * ENTRY_BYTES:
            self.is_sound = self.is_sound and len(content) == _INDEX_HEAD.size
            return
        channel_id, _ = _INDEX_HEAD.unpack_from(content)
        times = [time_ns for time_ns, _ in _ENTRY.iter_unpack(content[_INDEX_HEAD.size :])]
        self.is_sound = self.is_sound and channel_id not in self.counts
        self.counts[channel_id] += entries
        self.start_ns = min(self.start_ns, *times)
        self.end_ns = max(self.end_ns, *times)

    def fits(self, start_ns: int, end_ns: int) -> bool:
        """Say whether they agree with the head of the chunk: neither has a checksum."""
        return self.is_sound and (self.start_ns, self.end_ns) == (start_ns, end_ns)


class DamageError(Exception):
    """What is wrong with a piece of the file, as the part of a sentence."""


def parse(record: type[RecordType], content: bytes) -> RecordType | None:
    """Return the record that `content` holds, None if it does not."""
    try:
        parsed: RecordType = record.read(ReadDataStream(io.BytesIO(content)))
    except (McapError, ValueError, struct.error):
        return None
    return parsed


def records(content: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield opcode and content of the records in a piece; raises DamageError where one is cut."""
    position = 0
    while position < len(content):
        if position + RECORD.size > len(content):
            raise DamageError('its last record is cut')
        opcode, length = RECORD.unpack_from(content, position)
        start = position + RECORD.size
        position = start + length
        if position > len(content):
            raise DamageError('one of its records is cut')
        yield opcode, content[start:position]


def chunk_place(content: bytes) -> ChunkPlace:
    """Return what a chunk index says; raises DamageError where it is cut.

    By hand, since an hour has 20 000 of them and a library's object for each takes its time.
    """
    try:
        start_ns, end_ns, offset, length, size = _CHUNK_INDEX.unpack_from(content)
        end = _CHUNK_INDEX.size + size
        channels = [number for number, _ in _OFFSET.iter_unpack(content[_CHUNK_INDEX.size : end])]
        (index_bytes,) = _U64.unpack_from(content, end)
    except struct.error:
        raise DamageError('an index of a chunk is cut') from None
    count = (index_bytes - len(channels) * MESSAGE_INDEX_BYTES) // ENTRY_BYTES
    return ChunkPlace(start_ns, end_ns, offset, length, frozenset(channels), count)


def message(content: bytes) -> StoredMessage:
    """Return the message of a record; raises DamageError if it has no whole head."""
    if len(content) < MESSAGE.size:
        raise DamageError('one of its messages is shorter than a message head')
    channel_id, sequence, log_ns, publish_ns = MESSAGE.unpack_from(content)
    return StoredMessage(channel_id, log_ns, publish_ns, content[MESSAGE.size :], sequence)


def compression_of(content: bytes) -> str:
    """Return the name of the compression that `content` begins with, '' for none that is known."""
    return _PACKED.get(content[:4], '')


def unpack_message(data: bytes) -> bytes:
    """Return the CDR of a message, which some recorders compress one by one.

    Raises:
        DamageError: it cannot be unpacked, or is too large.

    """
    name = compression_of(data)
    if not name:
        return data
    try:
        size = zstandard.frame_content_size(data) if name == 'zstd' else -1
    except zstandard.ZstdError as error:
        raise DamageError(f'it cannot be unpacked ({error})') from None
    return _decompress(name, data, MAX_BYTES if size < 0 else size)


def unpack_chunk(content: bytes) -> tuple[bytes, int]:
    """Return the unpacked records of a chunk and the size that the chunk claims for them.

    Raises:
        DamageError: cut, too large, unknown compression, or a checksum that does not fit.

    """
    if len(content) < CHUNK.size:
        raise DamageError('it is shorter than its own head')
    *_, claimed, checksum, name_length = CHUNK.unpack_from(content)
    packed_at = CHUNK.size + name_length + _U64.size
    if packed_at > len(content):
        raise DamageError('it is shorter than its own head')
    name = content[CHUNK.size : CHUNK.size + name_length].decode(errors='replace')
    (packed_length,) = _U64.unpack_from(content, packed_at - _U64.size)
    if packed_at + packed_length > len(content):
        raise DamageError('it is cut short')
    packed = content[packed_at : packed_at + packed_length]
    unpacked = _decompress(name, packed, min(claimed, MAX_BYTES))
    if checksum and zlib.crc32(unpacked) != checksum:
        raise DamageError('its checksum does not fit')
    return unpacked, claimed


def _decompress(name: str, packed: bytes, claimed: int) -> bytes:
    """Return the content of a chunk, at most `claimed` bytes long."""
    try:
        if name == '':
            unpacked = packed
        elif name == 'lz4':
            unpacked = _unpack_lz4(packed, claimed)
        elif name == 'zstd':
            # the frame's own size would be allocated whatever max_output_size says
            if zstandard.frame_content_size(packed) > MAX_BYTES:
                raise DamageError(f'it would unpack to more than {MAX_BYTES} bytes')
            unpacked = zstandard.ZstdDecompressor().decompress(packed, max_output_size=claimed)
        else:
            raise DamageError(f'its compression is {name[:20]!r}; known are lz4, zstd and none')
    except (RuntimeError, zstandard.ZstdError, MemoryError):
        raise DamageError('it cannot be unpacked') from None
    if len(unpacked) > claimed:
        raise DamageError('it holds more than it claims')
    return unpacked


def _unpack_lz4(packed: bytes, claimed: int) -> bytes:
    unpacker = lz4.frame.LZ4FrameDecompressor()
    # in pieces: max_length is allocated at once, however little comes
    pieces: list[bytes] = [unpacker.decompress(packed, max_length=_PIECE_BYTES)]
    size = len(pieces[0])
    while not unpacker.eof and not unpacker.needs_input and size <= claimed:
        pieces.append(unpacker.decompress(b'', max_length=_PIECE_BYTES))
        size += len(pieces[-1])
    if size > claimed:
        raise DamageError('it holds more than it claims')
    if not unpacker.eof:
        raise DamageError('it is cut short')
    return b''.join(pieces)


def known_places(file: BinaryIO, size: int) -> list[int]:
    """Return where the summary says that chunks, and the summary itself, begin, in file order.

    Only a place to go on from when the records before it are damaged: nothing else is taken
    from there. Empty without a readable summary.
    """
    footer_at = size - FOOTER_BYTES - len(MCAP0_MAGIC)
    if footer_at < 0:
        return []
    file.seek(footer_at)
    content = file.read(FOOTER_BYTES)
    footer = parse(Footer, content[RECORD.size :]) if content[0] == Opcode.FOOTER else None
    if footer is None or not 0 < footer.summary_start < footer_at:
        return []
    summary_start: int = footer.summary_start
    places = {summary_start}
    file.seek(summary_start)
    try:
        for opcode, body in records(file.read(min(footer_at - summary_start, MAX_BYTES))):
            index = parse(ChunkIndex, body) if opcode == Opcode.CHUNK_INDEX else None
            if index is not None and index.chunk_start_offset < summary_start:
                places.add(index.chunk_start_offset)
    except DamageError:
        pass  # the places found so far still help
    return sorted(places)


def checksum(file: BinaryIO, start: int, end: int) -> int:
    """Return the CRC-32 of the bytes from `start` up to `end`."""
    file.seek(start, os.SEEK_SET)
    value = 0
    while start < end:
        piece = file.read(min(_PIECE_BYTES, end - start))
        if not piece:
            break
        value = zlib.crc32(piece, value)
        start += len(piece)
    return value
