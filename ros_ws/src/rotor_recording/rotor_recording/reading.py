# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Read recordings: intact, unfinished and damaged ones."""

import struct
import weakref
import zlib
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rosbags.serde import SerdeError

from rotor_common.errors import DataError, WireError
from rotor_common.leftovers import OwnFolder
from rotor_common.plain_data import parse_json
from rotor_interfaces import messages, topics
from rotor_interfaces.topics import Topic
from rotor_interfaces.waveform import WaveformBlock, decode
from rotor_recording import bag_folder, seeking
from rotor_recording.errors import RecordingInputError
from rotor_recording.mcap_records import DamageError, unpack_message
from rotor_recording.mcap_walk import Connection

ACTIVE_SUFFIX = '.active'
"""Ends the name of a file that its recorder has not finalised."""

_WAVEFORM = f'/{topics.WAVEFORM.name}'
OTHER_NAME = '; a waveform of another name can be given by --waveform-topic'

CONFIG_RECORD = 'rotor_config'
"""Name of the MCAP metadata record with the run's configuration: JSON text and its CRC-32."""


class RecordedMessage(NamedTuple):
    """One message: `data` as on the wire; `log_time_ns` simulation, `publish_time_ns` wall time."""

    topic: str
    type: str
    data: bytes
    log_time_ns: int
    publish_time_ns: int


class Recording:
    """A recording: the folder of a bag, a `.mcap` or `.db3` file, or a killed recorder's `.active`.

    Messages are streamed; in memory are the structure of the file and the chunks whose times
    overlap. `damage` holds a sentence for each thing that is lost; it is complete after one
    pass over all messages. `waveform_topic` is the full name of the waveform to use where
    several rigs, or another name, were recorded; the other topics are then those of its rig.

    Raises:
        RecordingInputError: nothing there, not a recording, no such topic, or damaged with no
            whole message left.

    """

    def __init__(self, path: str | Path, waveform_topic: str | None = None) -> None:
        self.path = Path(path)
        self._damage: list[str] = []
        self._left_out: dict[str, tuple[int, str]] = {}
        self._files: list[seeking.BagFile] = []
        self._unpacked: Path | None = None
        failures: list[RecordingInputError] = []
        for file in bag_folder.bag_files(self.path, self.note):
            try:
                self._files.append(bag_folder.open_file(file, self._folder, self.note))
            except RecordingInputError as error:
                failures.append(error)
        if not self._files:
            raise failures[0]
        self._damage.extend(str(failure) for failure in failures)
        self._waveform = waveform_topic and '/' + waveform_topic.lstrip('/')
        if self._waveform and self._waveform not in self.topics():
            listed = ', '.join(self.topics()) or 'none'
            raise RecordingInputError(
                f'{self.path} holds no {self._waveform}; its topics are: {listed}'
            )

    def _folder(self) -> Path:
        """Return the folder for unpacked files, which is removed with this object."""
        if self._unpacked is None:
            own = OwnFolder('bag-')
            self._unpacked = own.path
            weakref.finalize(self, own.cleanup)
        return self._unpacked

    @property
    def damage(self) -> list[str]:
        """Sentences that say what is lost, in file order; empty for a whole recording."""
        return [
            *self._damage,
            *(text for file in self._files for text in file.damage),
            *(
                f'{self.path.name}: {what} left out: {count} ({reason})'
                for what, (count, reason) in self._left_out.items()
            ),
        ]

    @property
    def files(self) -> Sequence[seeking.BagFile]:
        """The files of the recording in their order."""
        return self._files

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
            connections = file.connections
            for channel_id, count in file.counts.items():
                counts[connections[channel_id].topic] += count
        return dict(counts)

    def topics(self) -> dict[str, Connection]:
        """Return the topics by full name, in the order of their definition.

        Of a topic with several types or encodings, the one of the contract is returned, or else
        that of the most messages.
        """
        found: dict[str, Counter[Connection]] = {}
        for file in self._files:
            for number, connection in file.connections.items():
                counts = found.setdefault(connection.topic, Counter())
                counts[connection] += file.counts[number]
        return {name: max(counts, key=_preference(counts)) for name, counts in found.items()}

    def find(self, topic: Topic) -> str | None:
        """Return the full name under which a topic of the rig was recorded, in any namespace.

        The topics of one rig are those in the namespace of its waveform.

        Raises:
            RecordingInputError: it was recorded in more than one namespace.

        """
        known = self.topics()
        name = '/' + topic.name.lstrip('/')
        if topic.name.startswith('/') and name in known:
            return name
        waveforms = self._waveforms(known)
        chosen = self._waveform or (waveforms[0] if len(waveforms) == 1 else None)
        if topic == topics.WAVEFORM:
            found = [chosen] if chosen else waveforms
        else:
            found = _of_one_rig(name, known, waveforms, chosen)
        if len(found) > 1:
            remedy = f', such as --waveform-topic {waveforms[0]}' if waveforms else ''
            raise RecordingInputError(
                f'{self.path} holds {topic.name} more than once ({", ".join(found)}); name the '
                f'waveform of one rig by --waveform-topic{remedy}'
            )
        return found[0] if found else None

    def _waveforms(self, known: dict[str, Connection]) -> list[str]:
        """Return the waveforms by name: those with messages of the right type, if there are any."""
        names = [name for name in known if name.endswith(_WAVEFORM)]
        counts = self.message_counts
        usable = [n for n in names if counts.get(n) and known[n].type == topics.WAVEFORM.type]
        return usable or names

    def messages(
        self, topics: Collection[str] | None = None, start_ns: int | None = None
    ) -> Iterator[RecordedMessage]:
        """Yield messages by log time, and in file order where log times are equal.

        Messages that a recorder has compressed are unpacked; those that cannot be unpacked, or do
        not have the type of their topic, are left out and counted.

        Args:
            topics: full names of the topics wanted; None = all.
            start_ns: first log time wanted, ns; None = from the beginning.

        Raises:
            RecordingInputError: not one segment of the recording is whole.

        """
        known = self.topics()
        connections = [file.connections for file in self._files]
        left_out: Counter[str] = Counter()
        wanted, begin_ns = self._channels(topics), -1 if start_ns is None else start_ns
        for number, message in seeking.ordered(self._files, wanted, begin_ns):
            connection = connections[number].get(message.channel_id)
            if connection is None or (topics is not None and connection.topic not in topics):
                continue
            name = connection.topic
            try:
                data = _usable(message.data, connection, known[name])
            except DamageError as damage:
                left_out[name] += 1
                reason = f'the first at log time {message.log_time_ns} ns: {damage}'
                self.leave_out(f'messages of {name}', left_out[name], reason)
                continue
            yield RecordedMessage(name, connection.type, data, *message[1:3])
        if self.damage and all(file.unread >= set(file.segments) for file in self._files):
            raise RecordingInputError(
                f'{self.path} holds no whole message, so there is nothing to read '
                f'({"; ".join(self.damage)})'
            )

    def last_before(self, topics: Collection[str], time_ns: int) -> list[RecordedMessage]:
        """Return the last message of each of these topics before a log time in ns, by log time."""
        known = {name: connection[:3] for name, connection in self.topics().items()}
        names = {
            (number, channel): connection.topic
            for number, file in enumerate(self._files)
            for channel, connection in file.connections.items()
            if connection.topic in topics and connection[:3] == known[connection.topic]
        }
        found = []
        for name, (_, message) in seeking.last_before(self._files, names, time_ns).items():
            try:
                data = unpack_message(message.data) if known[name][2] == 'cdr' else message.data
            except DamageError:
                continue  # counted when all messages are read
            found.append(RecordedMessage(name, known[name][1], data, *message[1:3]))
        return sorted(found, key=lambda message: message.log_time_ns)

    def start_of_replay(
        self, topics: Collection[str] | None, start_ns: int, hole_ns: int
    ) -> tuple[int | None, int]:
        """Return where a replay of these topics begins, see `seeking.start_of_replay`."""
        return seeking.start_of_replay(self._files, self._channels(topics), start_ns, hole_ns)

    def _channels(self, topics: Collection[str] | None) -> list[frozenset[int]]:
        """Return the channels of these topics (None: all) in each file."""
        return [
            frozenset(
                number
                for number, connection in file.connections.items()
                if topics is None or connection.topic in topics
            )
            for file in self._files
        ]

    def config(self) -> dict[str, Any] | None:
        """Return the configuration of the recorded run, None if the recording has none.

        From the metadata of our recorder, else from the last message on `rotor/config`, which
        any other recorder has kept as well; it holds every change made while the run went on.
        """
        # with several rigs, it is not known whose record this is
        files = self._files if len(self._waveforms(self.topics())) < 2 else []
        for file in files:
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

    def leave_out(self, what: str, count: int, reason: str) -> None:
        """Count what a pass over the messages leaves out: `damage` holds one sentence for it.

        Args:
            what: in the plural, such as `blocks of /rotor/waveform`.
            count: how many in this pass so far.
            reason: of this one; the first is kept.

        """
        most, first = self._left_out.get(what, (0, reason))
        self._left_out[what] = (max(most, count), first)


# What rosbags raises, besides its own error, on bytes that are not the message they claim to be.
UNDECODABLE = (SerdeError, ValueError, struct.error, LookupError, OverflowError, MemoryError)


def config_record(text: str) -> dict[str, str]:
    """Return the content of the metadata record with a run's configuration, a JSON text."""
    return {'json': text, 'crc32': f'{zlib.crc32(text.encode()):08x}'}


def waveform_blocks(recording: Recording, start_ns: int | None = None) -> Iterator[WaveformBlock]:
    """Yield the waveform blocks of a recording by log time.

    A block that cannot be decoded is left out and counted in `recording.damage`; the sample
    index shows the gap.

    Raises:
        RecordingInputError: no `rotor/waveform` of the right type and encoding was recorded.

    """
    name = waveform_name(recording)
    left_out = 0
    for message in recording.messages([name], start_ns):
        try:
            yield decode(messages.from_cdr(message.data, message.type))
        except (*UNDECODABLE, WireError) as error:
            left_out += 1
            recording.leave_out(
                f'blocks of {name}',
                left_out,
                f'the first at log time {message.log_time_ns} ns: '
                f'{str(error) or type(error).__name__}',
            )


def waveform_name(recording: Recording) -> str:
    """Return the full name of the waveform's topic.

    Raises:
        RecordingInputError: no `rotor/waveform` of the right type and encoding was recorded.

    """
    name = recording.find(topics.WAVEFORM)
    known = recording.topics()
    if name is None:
        listed = ', '.join(known) or 'none'
        raise RecordingInputError(
            f'{recording.path} holds no {topics.WAVEFORM.name}; its topics are: {listed}'
            f'{OTHER_NAME}'
        )
    require_cdr(recording, known[name])
    if known[name].type != topics.WAVEFORM.type:
        raise RecordingInputError(
            f'{name} in {recording.path} has type {known[name].type!r}; a waveform has '
            f'{topics.WAVEFORM.type}'
        )
    return name


def require_cdr(recording: Recording, connection: Connection) -> None:
    """Raise RecordingInputError unless the messages of a topic are CDR, the encoding of ROS 2."""
    if connection.encoding != 'cdr':
        raise RecordingInputError(
            f'{connection.topic} in {recording.path} is encoded as {connection.encoding!r}; only '
            'cdr, the encoding of ROS 2, can be used'
        )


def _of_one_rig(
    name: str, known: Collection[str], waveforms: Sequence[str], chosen: str | None
) -> list[str]:
    """Return the topics that end in `name`, without those of rigs other than the chosen one."""
    rigs = [waveform.removesuffix(_WAVEFORM) for waveform in waveforms]
    own = max((r for r in rigs if chosen and chosen.startswith(f'{r}/')), key=len, default=None)
    others = {rig for rig in rigs if chosen and rig != own}
    found = [n for n in known if n.endswith(name) and n.removesuffix(name) not in others]
    if own is not None and own + name in found:
        return [own + name]
    return [name] if name in found and len(rigs) < 2 else found


def _preference(counts: Counter[Connection]) -> Callable[[Connection], tuple[bool, int]]:
    """Return the sorting key by which one of a topic's types is preferred."""
    contract = {(f'/{topic.name.lstrip("/")}', topic.type) for topic in topics.TOPICS}

    def preference(known: Connection) -> tuple[bool, int]:
        fits = any(known.topic.endswith(n) and known.type == kind for n, kind in contract)
        return fits and counts[known] > 0, counts[known]

    return preference


def _usable(data: bytes, connection: Connection, known: Connection) -> bytes:
    """Return a message as on the wire; raises DamageError if it has not its topic's type."""
    if (connection.type, connection.encoding) != (known.type, known.encoding):
        raise DamageError(
            f'of {connection.type} as {connection.encoding}, where the topic is {known.type} as '
            f'{known.encoding}'
        )
    return unpack_message(data) if connection.encoding == 'cdr' else data
