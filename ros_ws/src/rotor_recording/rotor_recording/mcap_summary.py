# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The summary of a finalised MCAP file, if its checksum and the heads of the chunks bear it out."""

from dataclasses import dataclass, field
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.records import Channel, Footer, Metadata, MetadataIndex, Schema, Statistics
from mcap.writer import MCAP0_MAGIC

from rotor_recording.mcap_records import (
    FOOTER_BYTES,
    INDEX,
    MAX_BYTES,
    RECORD,
    ChunkPlace,
    DamageError,
    checksum,
    chunk_place,
    parse,
    records,
)

_TAIL_BYTES = FOOTER_BYTES + len(MCAP0_MAGIC)


@dataclass
class Summary:
    """What a file holds, without a look at its messages; `metadata` by name, the last counts."""

    statistics: Statistics
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[ChunkPlace] = field(default_factory=list)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)


def read_summary(file: BinaryIO, size: int) -> Summary | None:
    """Return the summary of a file of `size` bytes, None where it has to be walked through.

    Every message must stand in a chunk, and every chunk in the index: what the summary says of
    itself has a checksum, the head of each chunk must agree, and the counts must add up.
    """
    try:
        return _summary(file, size)
    except DamageError:
        return None


def _summary(file: BinaryIO, size: int) -> Summary:
    if size < 2 * _TAIL_BYTES:
        raise DamageError('it is too short')
    footer_at = size - _TAIL_BYTES
    file.seek(footer_at)
    tail = file.read(_TAIL_BYTES)
    footer = parse(Footer, tail[RECORD.size : FOOTER_BYTES])
    _require(
        tail[0] == Opcode.FOOTER
        and tail.endswith(MCAP0_MAGIC)
        and footer is not None
        and footer.summary_crc != 0
        and 0 < footer.summary_start < footer_at
        and footer_at - footer.summary_start <= MAX_BYTES
    )
    assert footer is not None  # noqa: S101 - for mypy: required above
    start = footer.summary_start
    _require(checksum(file, start, footer_at + FOOTER_BYTES - 4) == footer.summary_crc)
    file.seek(start)
    found: dict[int, list[bytes]] = {}
    for opcode, content in records(file.read(footer_at - start)):
        found.setdefault(opcode, []).append(content)
    _require(len(found.get(Opcode.STATISTICS, [])) == 1)
    statistics = parse(Statistics, found[Opcode.STATISTICS][0])
    _require(statistics is not None)
    assert statistics is not None  # noqa: S101 - for mypy: required above
    summary = Summary(statistics)
    for content in found.get(Opcode.SCHEMA, []):
        schema = parse(Schema, content)
        if schema is not None:
            summary.schemas[schema.id] = schema
    for content in found.get(Opcode.CHANNEL, []):
        channel = parse(Channel, content)
        if channel is not None:
            summary.channels[channel.id] = channel
    summary.chunks = [chunk_place(c) for c in found.get(Opcode.CHUNK_INDEX, [])]
    _require_complete(summary)
    for place in summary.chunks:
        _require(place.offset + place.length <= start)
        file.seek(place.offset)
        head = file.read(RECORD.size + INDEX.size)
        _require(
            head[: RECORD.size] == RECORD.pack(Opcode.CHUNK, place.length - RECORD.size)
            and INDEX.unpack(head[RECORD.size :])[:2] == (place.start_ns, place.end_ns)
        )
    for content in found.get(Opcode.METADATA_INDEX, []):
        _take_metadata(file, content, summary)
    _require(len(found.get(Opcode.METADATA_INDEX, [])) == statistics.metadata_count)
    return summary


def _require_complete(summary: Summary) -> None:
    statistics = summary.statistics
    counts = statistics.channel_message_counts
    _require(
        bool(summary.chunks)
        and statistics.chunk_count == len(summary.chunks)
        and statistics.channel_count == len(summary.channels)
        and statistics.schema_count == len(summary.schemas)
        and counts.keys() <= summary.channels.keys()
        and statistics.message_count == sum(counts.values())
        and statistics.message_count == sum(place.messages for place in summary.chunks)
        and all(place.channels <= summary.channels.keys() for place in summary.chunks)
        and all(place.length > RECORD.size for place in summary.chunks)
    )
    summary.chunks.sort(key=lambda place: place.offset)


def _take_metadata(file: BinaryIO, content: bytes, summary: Summary) -> None:
    index = parse(MetadataIndex, content)
    _require(index is not None and RECORD.size < index.length <= MAX_BYTES)
    assert index is not None  # noqa: S101 - for mypy: required above
    file.seek(index.offset)
    record = file.read(index.length)
    _require(record[: RECORD.size] == RECORD.pack(Opcode.METADATA, index.length - RECORD.size))
    metadata = parse(Metadata, record[RECORD.size :])
    _require(metadata is not None)
    assert metadata is not None  # noqa: S101 - for mypy: required above
    summary.metadata[metadata.name] = metadata.metadata


def _require(is_so: bool) -> None:
    if not is_so:
        raise DamageError('the summary does not hold')
