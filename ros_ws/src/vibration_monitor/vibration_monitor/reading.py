# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Reading recordings: whole ones, those of a killed recorder, and damaged ones."""

import heapq
import re
import struct
import zlib
from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from rosbags.serde import SerdeError

from rotor_interfaces import messages, topics
from rotor_interfaces.errors import DataError, WireError
from rotor_interfaces.plain_data import LARGEST_YAML, parse_json, parse_yaml
from rotor_interfaces.text_file import read_text
from rotor_interfaces.topics import Topic
from rotor_interfaces.waveform import WaveformBlock, decode
from vibration_monitor.errors import RecordingError
from vibration_monitor.mcap_file import McapFile, Segment
from vibration_monitor.mcap_records import StoredMessage

ACTIVE_SUFFIX = '.active'
"""Ends the name of a file that its recorder has not finalised."""

METADATA_FILE = 'metadata.yaml'
CONFIG_RECORD = 'rotor_config'
"""Name of the MCAP metadata record with the run's configuration: JSON text and its CRC-32."""


class Connection(NamedTuple):
    """A topic of a recording: full name, type, message encoding, QoS profiles as YAML text."""

    topic: str
    type: str
    encoding: str
    qos_profiles: str


class RecordedMessage(NamedTuple):
    """One message: `data` as on the wire; `log_time_ns` simulation, `publish_time_ns` wall time."""

    topic: str
    type: str
    data: bytes
    log_time_ns: int
    publish_time_ns: int


class Recording:
    """A recording: the folder of a bag, a `.mcap` file, or the `.mcap.active` of a killed recorder.

    Messages are streamed; in memory are the structure of the file and the chunks whose times
    overlap. `damage` holds a sentence for each thing that is lost; it is complete after one
    pass over all messages.

    Raises:
        RecordingError: nothing there, not a recording, or damaged with no whole message left.

    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._damage: list[str] = []
        self._files: list[McapFile] = []
        failures: list[RecordingError] = []
        for file in self._file_paths():
            try:
                self._files.append(McapFile(file))
            except RecordingError as error:
                failures.append(error)
        if not self._files:
            raise failures[0]
        self._damage.extend(str(failure) for failure in failures)

    @property
    def damage(self) -> list[str]:
        """Sentences that say what is lost, in file order; empty for a whole recording."""
        return [*self._damage, *(text for file in self._files for text in file.damage)]

    @property
    def start_ns(self) -> int | None:
        """Log time of the earliest message in ns, None without messages."""
        return min((f.start_ns for f in self._files if f.start_ns is not None), default=None)

    @property
    def end_ns(self) -> int | None:
        """Log time of the latest message in ns, None without messages."""
        return max((f.end_ns for f in self._files if f.end_ns is not None), default=None)

    @property
    def message_counts(self) -> dict[str, int]:
        """Number of messages by full topic name."""
        counts: Counter[str] = Counter()
        for file in self._files:
            for channel_id, count in file.counts.items():
                counts[file.channels[channel_id].topic] += count
        return dict(counts)

    def topics(self) -> dict[str, Connection]:
        """Return the topics by full name, in the order of their definition."""
        found: dict[str, Connection] = {}
        for file in self._files:
            for channel_id in file.channels:
                connection = _connection(file, channel_id)
                found.setdefault(connection.topic, connection)
        return found

    def find(self, topic: Topic) -> str | None:
        """Return the full name under which a topic of the rig was recorded, in any namespace.

        Raises:
            RecordingError: it was recorded in more than one namespace.

        """
        name = '/' + topic.name.lstrip('/')
        known = self.topics()
        if name in known:
            return name
        found = [other for other in known if other.endswith(name)]
        if len(found) > 1:
            raise RecordingError(
                f'{self.path} holds {topic.name} more than once ({", ".join(found)}); record one '
                'rig at a time'
            )
        return found[0] if found else None

    def messages(
        self, topics: Collection[str] | None = None, start_ns: int | None = None
    ) -> Iterator[RecordedMessage]:
        """Yield messages by log time, and in file order where log times are equal.

        Args:
            topics: full names of the topics wanted; None = all.
            start_ns: first log time wanted, ns; None = from the beginning.

        Raises:
            RecordingError: not one segment of the recording is whole.

        """
        connections = [
            {channel_id: _connection(file, channel_id) for channel_id in file.channels}
            for file in self._files
        ]
        for number, message in self._ordered(start_ns):
            connection = connections[number].get(message.channel_id)
            if connection is None or (topics is not None and connection.topic not in topics):
                continue
            yield RecordedMessage(
                connection.topic,
                connection.type,
                message.data,
                message.log_time_ns,
                message.publish_time_ns,
            )
        if self.damage and all(file.unread >= set(file.segments) for file in self._files):
            raise RecordingError(
                f'{self.path} holds no whole message, so there is nothing to read '
                f'({"; ".join(self.damage)})'
            )

    def _ordered(self, start_ns: int | None) -> Iterator[tuple[int, StoredMessage]]:
        """Yield (number of the file, message), holding only the segments that overlap in time."""
        begin = -1 if start_ns is None else start_ns
        wanted: list[tuple[int, int, int, Segment]] = sorted(
            (segment.start_ns, number, segment.offset, segment)
            for number, file in enumerate(self._files)
            for segment in file.segments
            if segment.end_ns >= begin
        )
        waiting: list[tuple[int, int, int, int, StoredMessage]] = []
        for start, number, offset, segment in wanted:
            while waiting and waiting[0][0] < start:
                yield _popped(waiting)
            for index, message in enumerate(self._files[number].read(segment)):
                if message.log_time_ns >= begin:
                    heapq.heappush(waiting, (message.log_time_ns, number, offset, index, message))
        while waiting:
            yield _popped(waiting)

    def config(self) -> dict[str, Any] | None:
        """Return the configuration of the recorded run, None if the recording has none.

        From the metadata of our recorder, else from the last message on `rotor/config`, which
        any other recorder has kept as well; it holds every change made while the run went on.
        """
        for file in self._files:
            record = file.metadata.get(CONFIG_RECORD)
            if record is None:
                continue
            if record == config_record(record.get('json', '')):
                return self._parsed_config(record['json'])
            self.note('the checksum of its run configuration does not fit')
        name = self.find(topics.CONFIG)
        text = None
        if name is not None and self.topics()[name].type == topics.CONFIG.type:
            for message in self.messages([name]):
                try:
                    text = str(messages.from_cdr(message.data, message.type).data)
                except UNDECODABLE:
                    text = ''
        return None if text is None else self._parsed_config(text)

    def _parsed_config(self, text: str) -> dict[str, Any] | None:
        try:
            config = parse_json(text)
        except DataError:
            config = None
        if isinstance(config, dict):
            return config
        self.note('its run configuration is not a JSON mapping and is ignored')
        return None

    def note(self, text: str) -> None:
        """Add a sentence to `damage`, once."""
        sentence = f'{self.path.name}: {text}'
        if sentence not in self._damage:
            self._damage.append(sentence)

    def _file_paths(self) -> list[Path]:
        """Return the MCAP files of the recording in their order."""
        try:
            if not self.path.is_dir():
                return [self.path]
            found = [p for p in self.path.iterdir() if re.search(r'\.mcap(\.active)?$', p.name)]
        except OSError as error:
            raise RecordingError(f'{self.path} cannot be read ({error.strerror})') from None
        found.sort(key=_natural)
        listed = self._listed()
        if listed is not None:
            missing = [name for name in listed if not (self.path / name).is_file()]
            for name in missing:
                self.note(f'{name} of {METADATA_FILE} is missing, so its messages are left out')
            found = [self.path / name for name in listed if name not in missing]
        if not found:
            raise RecordingError(
                f'{self.path} holds no .mcap file; give the folder of a bag with MCAP storage'
            )
        return found

    def _listed(self) -> list[str] | None:
        """Return the file names in metadata.yaml, None without a usable one."""
        path = self.path / METADATA_FILE
        if not path.is_file():
            return None
        try:
            document = parse_yaml(read_text(path, LARGEST_YAML), foreign=True)
            names = document['rosbag2_bagfile_information']['relative_file_paths']
            # only the name: an older rosbag2 wrote the folder too, and nothing outside is read
            return [Path(str(name)).name for name in names]
        except (DataError, TypeError, KeyError):
            self.note(f'{METADATA_FILE} is damaged, so all .mcap files of the folder are read')
            return None


# What rosbags raises, besides its own error, on bytes that are not the message they claim to be.
UNDECODABLE = (SerdeError, ValueError, struct.error, LookupError, OverflowError, MemoryError)


def config_record(text: str) -> dict[str, str]:
    """Return the content of the metadata record with a run's configuration, a JSON text."""
    return {'json': text, 'crc32': f'{zlib.crc32(text.encode()):08x}'}


def waveform_blocks(recording: Recording, start_ns: int | None = None) -> Iterator[WaveformBlock]:
    """Yield the waveform blocks of a recording by log time.

    A block that cannot be decoded is left out with a sentence in `recording.damage`; the sample
    index shows the gap.

    Raises:
        RecordingError: no `rotor/waveform` of the right type and encoding was recorded.

    """
    name = recording.find(topics.WAVEFORM)
    known = recording.topics()
    if name is None:
        listed = ', '.join(known) or 'none'
        raise RecordingError(
            f'{recording.path} holds no {topics.WAVEFORM.name}; its topics are: {listed}'
        )
    require_cdr(recording, known[name])
    if known[name].type != topics.WAVEFORM.type:
        raise RecordingError(
            f'{name} in {recording.path} has type {known[name].type!r}; a waveform has '
            f'{topics.WAVEFORM.type}'
        )
    for message in recording.messages([name], start_ns):
        try:
            yield decode(messages.from_cdr(message.data, message.type))
        except (*UNDECODABLE, WireError) as error:
            recording.note(
                f'the block of {name} at log time {message.log_time_ns} ns is left out '
                f'({error or type(error).__name__})'
            )


def require_cdr(recording: Recording, connection: Connection) -> None:
    """Raise RecordingError unless the messages of a topic are CDR, the encoding of ROS 2."""
    if connection.encoding != 'cdr':
        raise RecordingError(
            f'{connection.topic} in {recording.path} is encoded as {connection.encoding!r}; only '
            'cdr, the encoding of ROS 2, can be used'
        )


def _popped(waiting: list[tuple[int, int, int, int, StoredMessage]]) -> tuple[int, StoredMessage]:
    _, number, _, _, message = heapq.heappop(waiting)
    return number, message


def _natural(path: Path) -> list[Any]:
    """Return a sorting key that puts run_10 after run_9."""
    return [int(part) if part.isdigit() else part for part in re.split(r'(\d+)', path.name)]


def _connection(file: McapFile, channel_id: int) -> Connection:
    channel = file.channels[channel_id]
    schema = file.schemas.get(channel.schema_id)
    return Connection(
        channel.topic,
        schema.name if schema else '',
        channel.message_encoding,
        channel.metadata.get('offered_qos_profiles', ''),
    )
