# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Recover a damaged or unfinished recording, and report what was lost."""

import os
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mcap.writer import CompressionType, Writer

from rotor_common.durable_file import sync_folder
from rotor_common.errors import DataError, WireError
from rotor_common.leftovers import OwnFolder, remove_leftovers
from rotor_common.plain_data import parse_yaml
from rotor_interfaces import topics
from rotor_interfaces.gaps import SampleContinuity
from rotor_recording.bag_folder import METADATA_FILE
from rotor_recording.errors import RecordingError
from rotor_recording.mcap_file import McapFile
from rotor_recording.mcap_records import DamageError, StoredMessage, unpack_message
from rotor_recording.mcap_walk import Connection
from rotor_recording.reading import Recording
from rotor_recording.recording import (
    CHUNK_BYTES,
    BagTopic,
    bag_metadata,
    version,
    yaml_text,
)
from rotor_recording.recording_stream import SampleIndexReader
from rotor_recording.seeking import BagFile


@dataclass
class Samples:
    """The absolute sample index of one waveform: its ends, and what is missing in between."""

    first: int = -1
    last: int = -1
    blocks_without_index: int = 0
    continuity: SampleContinuity = field(default_factory=SampleContinuity)
    _reader: SampleIndexReader = field(default_factory=SampleIndexReader)

    def take(self, data: bytes) -> None:
        """Take the bytes of the next block."""
        try:
            first, count = self._reader.read(unpack_message(data))
            self.continuity.check(first, count, self._reader.time)
        except (WireError, DamageError):
            self.blocks_without_index += 1
            return
        self.first = first if self.first < 0 else self.first
        self.last = first + count - 1

    def as_dict(self) -> dict[str, int]:
        """Return the numbers for --json."""
        return {
            'first_sample': self.first,
            'last_sample': self.last,
            'lost_samples': self.continuity.lost_samples,
            'restarts': self.continuity.restarts,
            'blocks_without_index': self.blocks_without_index,
        }


@dataclass(frozen=True)
class Recovery:
    """Result of a recovery: the bag, its messages by topic, the losses, the samples by waveform.

    `lost_messages` is None where the number is unknown.
    """

    bag: Path
    messages: dict[str, int]
    lost: list[str]
    lost_bytes: int
    lost_chunks: int
    lost_messages: int | None
    samples: dict[str, Samples]

    def as_dict(self) -> dict[str, Any]:
        """Return the result for --json."""
        return {
            'recording': str(self.bag),
            'messages': sum(self.messages.values()),
            'messages_by_topic': self.messages,
            'lost': self.lost,
            'lost_bytes': self.lost_bytes,
            'lost_chunks': self.lost_chunks,
            'lost_messages': self.lost_messages,
            'waveforms': {name: found.as_dict() for name, found in self.samples.items()},
        }


def recovered_name(path: Path) -> Path:
    """Return the default path of a recovered recording: NAME_recovered beside it."""
    path = path.absolute()
    name = path.name if path.is_dir() else path.name.split('.', maxsplit=1)[0]
    return path.with_name(f'{name}_recovered')


def recover(path: Path, out: Path | None = None) -> Recovery:
    """Write the intact messages of a recording as a new bag: one MCAP file and metadata.yaml.

    Messages keep their bytes, times, order in the file and definitions. The bag gets its name only
    when all of it is on the disk.

    Args:
        path: `.mcap.active`, `.mcap` or `.db3`, or the folder of a bag.
        out: folder to make; None: see `recovered_name`.

    Raises:
        RecordingError: there is nothing to recover, the name is taken, or it cannot be written.

    """
    out = (recovered_name(path) if out is None else out).absolute()
    if out.exists():
        raise RecordingError(f'{out} exists, and a recovery never overwrites; give another --out')
    recording = Recording(path)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        remove_leftovers([out.parent])
        with OwnFolder('recover-', out.parent) as place:
            bag = place / 'bag'
            bag.mkdir()
            copy = _Copy(bag / f'{out.name}_0.mcap')
            for number, file in enumerate(recording.files):
                copy.take_file(number, file)
            copy.finish()
            bag.rename(out)
        sync_folder(out.parent)
    except OSError as error:
        raise RecordingError(
            f'{out} cannot be written ({error.strerror}); choose a place with room where you may '
            'write'
        ) from None
    files = recording.files
    known = [file.lost_messages for file in files]
    total = None if None in known else sum(count or 0 for count in known)
    return Recovery(
        bag=out,
        messages=dict(copy.counts),
        lost=[*recording.damage, *copy.notes()],
        lost_bytes=sum(file.lost_bytes for file in files),
        lost_chunks=sum(len(file.unread) for file in files),
        lost_messages=total,
        samples=copy.samples,
    )


class _Copy:
    """The MCAP file that is being written."""

    def __init__(self, path: Path) -> None:
        self.counts: Counter[str] = Counter()
        self.samples: dict[str, Samples] = {}
        self._path = path
        self._file = path.open('xb')
        self._writer = Writer(self._file, CHUNK_BYTES, CompressionType.LZ4)
        self._writer.start('ros2', f'rotor-rig {version()}, recovered')
        self._channels: dict[tuple[Any, ...], int] = {}
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        self._topics: dict[str, tuple[Connection, dict[str, str]]] = {}
        self._start_ns, self._end_ns = 2**64, 0

    def take_file(self, number: int, file: BagFile) -> None:
        """Copy all that can be read of a file."""
        for name, content in file.metadata.items():
            self._writer.add_metadata(name, content)
        for segment in list(file.segments):
            # a SQLite file is one long segment
            stored = file.read(segment) if isinstance(file, McapFile) else file.ordered(segment)
            connections = file.connections
            for message in stored:
                if message.channel_id in connections:
                    self._write(number, file, connections[message.channel_id], message)

    def _write(
        self, number: int, file: BagFile, connection: Connection, message: StoredMessage
    ) -> None:
        key = (number, message.channel_id)
        channel = self._channels.get(key)
        if channel is None:
            channel = self._channels[key] = self._register(file, connection, message.channel_id)
        self._writer.add_message(
            channel, message.log_time_ns, message.data, message.publish_time_ns, message.sequence
        )
        self.counts[connection.topic] += 1
        self._start_ns = min(self._start_ns, message.log_time_ns)
        self._end_ns = max(self._end_ns, message.log_time_ns)
        if connection.topic in self.samples:
            self.samples[connection.topic].take(message.data)

    def _register(self, file: BagFile, connection: Connection, channel_id: int) -> int:
        """Define a channel as it was, once for all files of the bag in which it is the same."""
        schema, metadata = file.definition(channel_id)
        self._topics.setdefault(connection.topic, (connection, metadata))
        if connection.type == topics.WAVEFORM.type and connection.topic.endswith(
            f'/{topics.WAVEFORM.name}'
        ):
            self.samples.setdefault(connection.topic, Samples())
        if schema not in self._schemas:
            has_type = bool(schema[0])
            self._schemas[schema] = self._writer.register_schema(*schema) if has_type else 0
        key = (connection, *sorted(metadata.items()), schema)
        if key not in self._channels:
            self._channels[key] = self._writer.register_channel(
                connection.topic, connection.encoding, self._schemas[schema], metadata
            )
        return self._channels[key]

    def finish(self) -> None:
        """Finalise the file, write metadata.yaml, and sync both to the disk; raises OSError."""
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._file.flush()
        os.fsync(self._file.fileno())
        self._file.close()
        listed = [
            BagTopic(
                name,
                connection.type,
                _profiles(connection.qos_profiles),
                metadata.get('topic_type_hash', ''),
                self.counts[name],
                connection.encoding,
            )
            for name, (connection, metadata) in self._topics.items()
        ]
        start_ns = min(self._start_ns, self._end_ns)
        document = bag_metadata(self._path.name, start_ns, self._end_ns, listed)
        with self._path.with_name(METADATA_FILE).open('x', encoding='utf-8') as file:
            file.write(yaml_text(document))
            file.flush()
            os.fsync(file.fileno())
        sync_folder(self._path.parent)

    def notes(self) -> list[str]:
        """Return a sentence for each waveform of which samples are missing."""
        return [
            f'{name}: {found.continuity.lost_samples} samples are missing between sample '
            f'{found.first} and sample {found.last}'
            for name, found in self.samples.items()
            if found.continuity.lost_samples
        ]


def _profiles(text: str) -> list[dict[str, Any]]:
    """Return QoS profiles as a list; empty where the text holds none."""
    try:
        profiles = parse_yaml(text, foreign=True)
    except DataError:
        return []
    is_list = isinstance(profiles, list) and all(isinstance(one, dict) for one in profiles)
    return profiles if is_list else []
