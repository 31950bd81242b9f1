# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The summary of a finalised MCAP file, checked against its checksum and the chunk heads."""

import struct
from dataclasses import dataclass, field
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, Metadata, MetadataIndex, Schema, Statistics
from mcap.writer import MCAP0_MAGIC

from rotor_recording.mcap_records import (
    ENTRY,
    MESSAGE_INDEX,
    RECORD,
    DamageError,
    checksum,
    parse,
    records,
    summary_of,
)
from rotor_recording.mcap_walk import Segment

_CHUNK_HEAD = struct.Struct('<BQQQ')  # opcode, length of the content, first and last log time


@dataclass
class Summary:
    """Structure of a file without its messages: chunks in file order, metadata by name.

    `counted` maps the offset of a chunk to its number of messages.
    """

    statistics: Statistics | None = None
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[Segment] = field(default_factory=list)
    counted: dict[int, int] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)


def read_summary(file: BinaryIO, size: int) -> Summary | None:
    """Return the summary of a file of `size` bytes, None where the file must be scanned instead.

    Every message must be in a chunk, and every chunk in the index: the checksum of the summary
    must fit, the head of each chunk must agree with it, and the counts must add up.
    """
    footer, content = summary_of(file, size) or (None, b'')
    if footer is None or not footer.summary_crc:
        return None
    start, sum_at = footer.summary_start, size - len(MCAP0_MAGIC) - 4
    if checksum(file, start, sum_at) != footer.summary_crc or file.read()[4:] != MCAP0_MAGIC:
        return None
    try:
        summary = _taken(file, content, start)
    except DamageError:
        return None
    return summary if _is_complete(summary) else None


def _taken(file: BinaryIO, content: bytes, start: int) -> Summary:
    """Take the records of the summary, which begins at `start`, and the metadata they name."""
    summary = Summary()
    metadata_count = 0
    for opcode, body in records(content):
        match record := parse(opcode, body):
            case Statistics():
                summary.statistics = record
            case Schema():
                summary.schemas[record.id] = record
            case Channel():
                summary.channels[record.id] = record
            case ChunkIndex():
                _take_chunk(file, record, start, summary)
            case MetadataIndex():
                _require(RECORD.size < record.length <= start - record.offset)
                file.seek(record.offset)
                head, length = file.read(RECORD.size), record.length - RECORD.size
                metadata = parse(Opcode.METADATA, file.read(length))
                _require(head == RECORD.pack(Opcode.METADATA, length))
                if not isinstance(metadata, Metadata):
                    raise DamageError('the summary names metadata that are not there')
                summary.metadata[metadata.name] = metadata.metadata
                metadata_count += 1
    statistics = summary.statistics
    _require(statistics is not None and metadata_count == statistics.metadata_count)
    return summary


def _take_chunk(file: BinaryIO, index: ChunkIndex, start: int, summary: Summary) -> None:
    offset, length = index.chunk_start_offset + RECORD.size, index.chunk_length - RECORD.size
    _require(length > 0 and offset + length <= start)
    times = index.message_start_time, index.message_end_time
    file.seek(index.chunk_start_offset)
    _require(file.read(_CHUNK_HEAD.size) == _CHUNK_HEAD.pack(Opcode.CHUNK, length, *times))
    channels = frozenset(index.message_index_offsets)
    heads = len(channels) * (RECORD.size + MESSAGE_INDEX.size)
    summary.counted[offset] = (index.message_index_length - heads) // ENTRY.size
    summary.chunks.append(Segment(*times, offset, length, True, channels))


def _is_complete(summary: Summary) -> bool:
    statistics, chunks, channels = summary.statistics, summary.chunks, summary.channels.keys()
    if statistics is None:
        return False
    counts = statistics.channel_message_counts
    chunks.sort(key=lambda chunk: chunk.offset)
    return (
        0 < len(chunks) == statistics.chunk_count
        and len(channels) == statistics.channel_count
        and len(summary.schemas) == statistics.schema_count
        and counts.keys() <= channels
        and statistics.message_count == sum(counts.values()) == sum(summary.counted.values())
        and all(chunk.channels <= channels for chunk in chunks if chunk.channels)
    )


def _require(is_so: bool) -> None:
    if not is_so:
        raise DamageError('the summary contradicts the file')
