# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Verify a recording: checksums, counts, types, sample index, stamps."""

import struct
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from mcap.exceptions import McapError
from mcap.records import Chunk, DataEnd
from mcap.stream_reader import StreamReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.base import TypesysError

from rotor_common.errors import DataError
from rotor_common.plain_data import LARGEST_YAML, parse_yaml
from rotor_common.text_file import read_text
from rotor_interfaces import topics
from rotor_interfaces.messages import typestore
from rotor_recording.bag_folder import METADATA_FILE
from rotor_recording.mcap_file import McapFile
from rotor_recording.mcap_records import MAX_BYTES
from rotor_recording.reading import Recording
from rotor_recording.recording_stream import raw_stamp_ns
from rotor_recording.recovery import Samples

State = Literal['good', 'wrong', 'not checked']
_STAMPED = (topics.WAVEFORM, topics.TRUTH_WAVEFORM)
"""Topics on which each message is stamped later than the one before."""


@dataclass(frozen=True)
class Check:
    """One check: its object, its state, and the result in words."""

    what: str
    state: State
    text: str

    def as_dict(self) -> dict[str, str]:
        """Return the check for --json."""
        return asdict(self)


def verify(path: Path) -> list[Check]:
    """Return the checks of a recording: good, wrong or not checked; it is read once.

    Raises:
        RecordingInputError: it cannot be read at all.

    """
    recording = Recording(path)
    content = _Content(recording)
    return [
        *_structure(recording),
        *content.checks(),
        *_types(recording),
        *_metadata(path, content.counts),
    ]


def is_good(checks: list[Check]) -> bool:
    """Say whether nothing is wrong."""
    return all(check.state != 'wrong' for check in checks)


def _structure(recording: Recording) -> Iterator[Check]:
    """Check the structure of the files; their messages must have been read before."""
    damage = recording.damage
    if damage:
        yield Check('structure', 'wrong', '; '.join(damage))
    else:
        yield Check('structure', 'good', 'every record and every chunk is whole')
    for file in recording.files:
        name = file.path.name
        if not isinstance(file, McapFile):
            yield Check(f'checksums of {name}', 'not checked', 'SQLite bags have none')
        elif damage:
            yield Check(f'checksums of {name}', 'not checked', 'the file is damaged, as above')
        else:
            yield _checksums(file)
            yield _summary(file)


def _summary(file: McapFile) -> Check:
    what = f'summary of {file.path.name}'
    if file.is_indexed:
        return Check(what, 'good', 'checksum, counts and index agree with the file')
    return Check(what, 'not checked', 'it has no checksum, or no index of every message')


def _checksums(file: McapFile) -> Check:
    """Check the whole file with the reader of the mcap library."""
    what = f'checksums of {file.path.name}'
    chunks = unchecked = 0
    has_data_sum = False
    try:
        with file.path.open('rb') as stream:
            reader = StreamReader(
                stream, emit_chunks=True, validate_crcs=True, record_size_limit=MAX_BYTES
            )
            for record in reader.records:
                if isinstance(record, Chunk):
                    chunks += 1
                    unchecked += record.uncompressed_crc == 0
                elif isinstance(record, DataEnd):
                    has_data_sum = record.data_section_crc != 0
    except (McapError, ValueError, struct.error, LookupError, OverflowError) as error:
        return Check(what, 'wrong', f'the mcap library stops: {error or type(error).__name__}')
    if unchecked and not has_data_sum:
        return Check(what, 'not checked', f'{unchecked} of {chunks} chunks have none')
    if not chunks and not has_data_sum:
        return Check(what, 'not checked', 'its writer has made none')
    return Check(what, 'good', f'{chunks} chunks' + ', data section' * has_data_sum)


class _Content:
    """All messages of a recording, read once."""

    def __init__(self, recording: Recording) -> None:
        self.counts: Counter[str] = Counter()
        self._announced = recording.message_counts
        known = recording.topics()
        self._samples = {
            name: Samples()
            for name, connection in known.items()
            if _is(name, topics.WAVEFORM) and connection.type == topics.WAVEFORM.type
        }
        stamped = {
            name: topic
            for name, connection in known.items()
            for topic in _STAMPED
            if _is(name, topic) and connection.type == topic.type
        }
        self._falling: Counter[str] = Counter()
        self._stamped = list(stamped)
        newest: dict[str, int] = {}
        restarts: Counter[str] = Counter()
        for message in recording.messages():
            self.counts[message.topic] += 1
            samples = self._samples.get(message.topic)
            if samples is not None:
                samples.take(message.data)
                if samples.continuity.restarts > restarts[message.topic]:
                    restarts[message.topic] += 1
                    newest.clear()  # another run may have begun at any time
            if message.topic in stamped:
                stamp_ns = raw_stamp_ns(stamped[message.topic], message.data)
                self._falling[message.topic] += stamp_ns <= newest.get(message.topic, -1)
                newest[message.topic] = stamp_ns

    def checks(self) -> Iterator[Check]:
        """Yield the checks of counts, sample index and stamps."""
        wrong = [
            f'{name}: {self.counts[name]} of {count}'
            for name, count in self._announced.items()
            if count != self.counts[name]
        ]
        text = f'{self.counts.total()} messages, as many as announced'
        yield Check('messages', 'wrong' if wrong else 'good', '; '.join(wrong) or text)
        for name, found in self._samples.items():
            yield _continuity(name, found)
        if not self._samples:
            text = f'no {topics.WAVEFORM.name} was recorded'
            yield Check('sample index', 'not checked', text)
        for name in self._stamped:
            falling = self._falling[name]
            text = f'{falling} messages are not stamped later than the one before'
            state: State = 'wrong' if falling else 'good'
            yield Check(f'stamps of {name}', state, text if falling else 'each after the other')


def _continuity(name: str, found: Samples) -> Check:
    continuity = found.continuity
    faults = {
        'gaps': continuity.gaps,
        'lost samples': continuity.lost_samples,
        'restarts': continuity.restarts,
        'blocks without a sample index': found.blocks_without_index,
    }
    listed = ', '.join(f'{count} {what}' for what, count in faults.items() if count)
    if listed:
        return Check(f'sample index of {name}', 'wrong', listed)
    if not continuity.blocks:
        return Check(f'sample index of {name}', 'not checked', 'there is no block')
    text = f'samples {found.first} to {found.last}, all there'
    return Check(f'sample index of {name}', 'good', text)


def _types(recording: Recording) -> Iterator[Check]:
    """Compare the text and the hash of each type with those of ROS 2 Jazzy."""
    wrong: list[str] = []
    unknown: set[str] = set()
    good: set[str] = set()
    for file in recording.files:
        for channel_id, connection in file.connections.items():
            (name, encoding, data), metadata = file.definition(channel_id)
            if encoding != 'ros2msg' or not data or not _is_known(name):
                unknown.add(name or connection.topic)
                continue
            expected = typestore().hash_rihs01(name)
            found = {'text': _hash_of(name, data), 'hash': metadata.get('topic_type_hash')}
            faults = [what for what, value in found.items() if value and value != expected]
            if found['text'] is None:
                faults.append('text')
            wrong += [f'the {what} of {name} on {connection.topic}' for what in faults]
            good.add(name)
    if wrong:
        text = f'not that of ROS 2 Jazzy: {", ".join(dict.fromkeys(wrong))}'
        yield Check('types', 'wrong', text)
    elif good:
        yield Check('types', 'good', f'{len(good)} types by text and hash')
    if unknown:
        listed = ', '.join(sorted(unknown))
        yield Check('other types', 'not checked', f'no text, or not known here: {listed}')


def _is_known(name: str) -> bool:
    return name in typestore().fielddefs


def _hash_of(name: str, data: bytes) -> str | None:
    """Return the RIHS01 hash of a type from its full text, None if the text is no definition."""
    try:
        store = get_typestore(Stores.EMPTY)
        store.register(get_types_from_msg(data.decode(), name))
        return store.hash_rihs01(name)
    except (TypesysError, ValueError, LookupError, RecursionError):
        return None


def _metadata(path: Path, counts: Counter[str]) -> Iterator[Check]:
    """Compare the counts of metadata.yaml with the messages."""
    file = (path if path.is_dir() else path.parent) / METADATA_FILE
    if not file.is_file():
        yield Check(METADATA_FILE, 'not checked', 'there is none')
        return
    try:
        information = parse_yaml(read_text(file, LARGEST_YAML), foreign=True)[
            'rosbag2_bagfile_information'
        ]
        if not path.is_dir() and [path.name] != information['relative_file_paths']:
            yield Check(METADATA_FILE, 'not checked', 'it is not of this file alone')
            return
        announced = Counter[str]()
        for topic in information['topics_with_message_count']:
            announced[topic['topic_metadata']['name']] += topic['message_count']
        announced += Counter()
        total = information['message_count']
    except (DataError, TypeError, KeyError, AttributeError) as error:
        yield Check(METADATA_FILE, 'wrong', f'it cannot be used ({error})')
        return
    if announced == counts and total == counts.total():
        yield Check(METADATA_FILE, 'good', f'{total} messages in {len(counts)} topics, as it says')
        return
    names = sorted(n for n in announced.keys() | counts.keys() if announced[n] != counts[n])
    listed = ', '.join(f'{name}: {counts[name]} of {announced[name]}' for name in names)
    text = f'it says {total} messages, there are {counts.total()} ({listed})'
    yield Check(METADATA_FILE, 'wrong', text)


def _is(name: str, topic: Any) -> bool:
    return name.endswith(f'/{topic.name}')
