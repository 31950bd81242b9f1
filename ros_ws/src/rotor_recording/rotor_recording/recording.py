# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Write recordings: self-describing MCAP files that survive a killed process."""

import contextlib
import importlib.metadata
import json
import os
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, NoReturn, Self

import yaml
from mcap.writer import CompressionType, Writer

from rotor_common.durable_file import sync_folder, write_whole
from rotor_interfaces.messages import typestore
from rotor_interfaces.topics import Topic
from rotor_recording.bag_folder import METADATA_FILE
from rotor_recording.errors import RecordingError
from rotor_recording.reading import ACTIVE_SUFFIX, CONFIG_RECORD, config_record

FLUSH_PERIOD_S = 0.2
"""A killed recorder may lose 0.25 s; the difference is left for the flush itself."""

CHUNK_BYTES = 2**20
_FOREVER = {'sec': 9223372036, 'nsec': 854775807}  # how ROS 2 writes an infinite duration


class RecordingWriter:
    """Writes one recording: a folder that is a rosbag2 bag, or a single MCAP file.

    Until `close` the file name ends in `.active`. The bytes depend only on what is written and
    between which messages it is flushed, not on a clock.

    Args:
        path: the folder, new or empty; or the file, which must not exist.
        name: start of the file name in the folder, by default the folder's own.
        config: the run's configuration, kept as metadata; JSON-compatible.
        is_bag: False for one MCAP file without a folder of its own, see `single_file`.
        compress: whether chunks are compressed (LZ4): waveforms get smaller by a fifth, and
            writing takes twice as long.

    Raises:
        RecordingError: the place is taken, or the system refuses to write there.

    """

    def __init__(
        self,
        path: str | Path,
        *,
        name: str | None = None,
        config: Mapping[str, Any] | None = None,
        is_bag: bool = True,
        compress: bool = True,
    ) -> None:
        self.path = Path(path)
        if is_bag:
            _make_folder(self.path)
            self.path /= f'{name or self.path.resolve().name}_0.mcap'
        else:
            _require_free(self.path)
        self.flush_max_s = 0.0
        self._is_bag = is_bag
        self._active = self.path.with_name(self.path.name + ACTIVE_SUFFIX)
        self._channels: dict[Topic, int] = {}
        self._schemas: dict[str, int] = {}
        self._counts: Counter[Topic] = Counter()
        self._bytes = 0
        self._start_ns: int | None = None
        self._end_ns = 0
        self._flushed_s = time.monotonic()
        self._is_open = True
        self._disk = ThreadPoolExecutor(1, 'disk')
        self._sync: Future[float] | None = None
        try:
            self._file: BinaryIO = self._active.open('xb')
        except OSError as error:
            _refuse(self._active, error)
        compression = CompressionType.LZ4 if compress else CompressionType.NONE
        self._writer = Writer(self._file, CHUNK_BYTES, compression)
        self._writer.start('ros2', f'rotor-rig {version()}')
        if config is not None:
            self.add_config(json.dumps(config))

    @classmethod
    def single_file(
        cls,
        path: str | Path,
        *,
        config: Mapping[str, Any] | None = None,
        compress: bool = True,
    ) -> Self:
        """Start a recording that is one MCAP file, without a folder of its own."""
        return cls(path, config=config, is_bag=False, compress=compress)

    @property
    def messages(self) -> int:
        """Number of messages written."""
        return self._counts.total()

    @property
    def message_bytes(self) -> int:
        """Bytes of the messages written, before compression."""
        return self._bytes

    def add_config(self, text: str) -> None:
        """Keep the run's configuration, a JSON text, as metadata; the last one counts."""
        try:
            self._writer.add_metadata(CONFIG_RECORD, config_record(text))
        except OSError as error:
            self._fail(error)

    def write(self, topic: Topic, data: bytes, log_time_ns: int, publish_time_ns: int) -> None:
        """Write one message.

        Args:
            topic: its name is completed with a leading slash.
            data: CDR bytes as on the wire.
            log_time_ns: simulation time, ns since the Unix epoch.
            publish_time_ns: wall time, ns; offline the same as `log_time_ns`.

        Raises:
            RecordingError: the system refuses to write (disk full, ...); what was written
                before stays readable.

        """
        channel_id = self._channels.get(topic)
        if channel_id is None:
            channel_id = self._channels[topic] = self._register(topic)
        try:
            self._writer.add_message(channel_id, log_time_ns, data, publish_time_ns)
        except OSError as error:
            self._fail(error)
        self._counts[topic] += 1
        self._bytes += len(data)
        if self._start_ns is None or log_time_ns < self._start_ns:
            self._start_ns = log_time_ns
        self._end_ns = max(self._end_ns, log_time_ns)

    def _register(self, topic: Topic) -> int:
        schema_id = self._schemas.get(topic.type)
        if schema_id is None:
            text, _ = typestore().generate_msgdef(topic.type, ros_version=2)
            schema_id = self._writer.register_schema(topic.type, 'ros2msg', text.encode())
            self._schemas[topic.type] = schema_id
        return self._writer.register_channel(
            _full_name(topic),
            'cdr',
            schema_id,
            {
                # rosbags yields no message of a bag whose two QoS texts differ
                'offered_qos_profiles': yaml_text(qos_profiles(topic)).strip(),
                'topic_type_hash': typestore().hash_rihs01(topic.type),
            },
        )

    def flush(self) -> None:
        """Hand everything written so far to the system, and start to sync it to the disk.

        A killed process loses nothing of it from here on; the sync has its own thread, since it
        can take long. Raises RecordingError, also for an earlier flush.
        """
        if not self._is_open:
            return
        self._flushed_s = time.monotonic()
        try:
            self._writer.flush()  # type: ignore[no-untyped-call]
            if self._sync is None or self._sync.done():
                self._await_sync()
                self._sync = self._disk.submit(self._bring_to_disk, self._flushed_s)
        except OSError as error:
            self._fail(error)

    def _bring_to_disk(self, started_s: float) -> float:
        os.fsync(self._file.fileno())
        return time.monotonic() - started_s

    def _await_sync(self) -> None:
        if self._sync is not None:
            self.flush_max_s = max(self.flush_max_s, self._sync.result())

    def flush_if_due(self) -> None:
        """Flush if the last flush is FLUSH_PERIOD_S ago; raises RecordingError."""
        if time.monotonic() - self._flushed_s >= FLUSH_PERIOD_S:
            self.flush()

    def close(self) -> None:
        """Finalise: index and summary, the name without `.active`, metadata.yaml; once is enough.

        Raises:
            RecordingError: the system refuses; the `.active` file stays and can be read.

        """
        if not self._is_open:
            return
        try:
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._file.flush()
            self._await_sync()
            os.fsync(self._file.fileno())
            self._disk.shutdown()
            self._file.close()
            self._active.rename(self.path)
            if self._is_bag:
                text = yaml_text(self._bag_metadata())
                write_whole(self.path.with_name(METADATA_FILE), text.encode())
            sync_folder(self.path.parent)
        except OSError as error:
            self._fail(error)
        self._is_open = False

    def discard(self) -> None:
        """Remove the recording, and its folder if it is then empty; raises RecordingError."""
        if not self._is_open:
            return
        self._is_open = False
        self._disk.shutdown()
        try:
            self._file.close()
            self._active.unlink()
            if self._is_bag and not any(self.path.parent.iterdir()):
                self.path.parent.rmdir()
        except OSError as error:
            _refuse(self._active, error)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        """Finalise also after an error of the caller: what was written is whole."""
        self.close()

    def _fail(self, error: OSError) -> NoReturn:
        """Close the file as it is, so that nothing is written after the failed write."""
        self._is_open = False
        self._disk.shutdown()
        with contextlib.suppress(OSError):  # its buffer cannot be written either
            self._file.close()
        raise RecordingError(
            f'{self._active} cannot be written ({error.strerror}); the recording ends here and '
            'what is in the file can be read'
        ) from None

    def _bag_metadata(self) -> dict[str, Any]:
        listed = [
            BagTopic(
                _full_name(topic),
                topic.type,
                qos_profiles(topic),
                typestore().hash_rihs01(topic.type),
                count,
            )
            for topic, count in self._counts.items()
        ]
        return bag_metadata(self.path.name, self._start_ns or 0, self._end_ns, listed)


class BagTopic(NamedTuple):
    """A topic of a bag: full name, type, QoS profiles, hash of the type, number of messages."""

    name: str
    type: str
    qos_profiles: list[dict[str, Any]]
    type_hash: str
    messages: int
    encoding: str = 'cdr'


def bag_metadata(
    file_name: str, start_ns: int, end_ns: int, listed: Sequence[BagTopic]
) -> dict[str, Any]:
    """Return metadata.yaml of rosbag2, version 9, for a bag of one file; log times in ns."""
    extent = {
        'duration': {'nanoseconds': end_ns - start_ns},
        'starting_time': {'nanoseconds_since_epoch': start_ns},
        'message_count': sum(topic.messages for topic in listed),
    }
    return {
        'rosbag2_bagfile_information': {
            'version': 9,
            'storage_identifier': 'mcap',
            **extent,
            'topics_with_message_count': [
                {
                    'topic_metadata': {
                        'name': topic.name,
                        'type': topic.type,
                        'serialization_format': topic.encoding,
                        'offered_qos_profiles': topic.qos_profiles,
                        'type_description_hash': topic.type_hash,
                    },
                    'message_count': topic.messages,
                }
                for topic in listed
            ],
            'compression_format': '',
            'compression_mode': '',
            'relative_file_paths': [file_name],
            'files': [{'path': file_name, **extent}],
            'custom_data': None,
            'ros_distro': 'jazzy',
        }
    }


def qos_profiles(topic: Topic) -> list[dict[str, Any]]:
    """Return what the publishers of a topic offer, as rosbag2 version 9 writes it."""
    return [
        {
            'history': 'keep_last',
            'depth': topic.depth,
            'reliability': 'reliable',
            'durability': 'transient_local' if topic.latched else 'volatile',
            'deadline': _FOREVER,
            'lifespan': _FOREVER,
            'liveliness': 'automatic',
            'liveliness_lease_duration': _FOREVER,
            'avoid_ros_namespace_conventions': False,
        }
    ]


class _PlainDumper(yaml.SafeDumper):
    """Writes repeated values out: rosbag2's reader need not know YAML anchors."""

    def ignore_aliases(self, data: Any) -> bool:  # noqa: ARG002
        return True


def yaml_text(document: Any) -> str:
    """Return a document as YAML without anchors."""
    return yaml.dump(document, Dumper=_PlainDumper, sort_keys=False)


def _full_name(topic: Topic) -> str:
    return '/' + topic.name.lstrip('/')


def _make_folder(path: Path) -> None:
    try:
        path.mkdir(parents=True, exist_ok=True)
        taken = any(path.iterdir())
    except OSError as error:
        _refuse(path, error)
    if taken:
        raise RecordingError(
            f'the folder {path} is not empty, and a recording never overwrites; give a new '
            'folder or remove this one'
        )


def _require_free(path: Path) -> None:
    for taken in (path, path.with_name(path.name + ACTIVE_SUFFIX)):
        if taken.exists():
            raise RecordingError(
                f'{taken} exists, and a recording never overwrites; give a new name or remove it'
            )


def _refuse(path: Path, error: OSError) -> NoReturn:
    raise RecordingError(
        f'{path} cannot be written ({error.strerror}); choose a place where you may write'
    ) from None


def version() -> str:
    """Return the version of this package."""
    try:
        return importlib.metadata.version('rotor_recording')
    except importlib.metadata.PackageNotFoundError:
        return 'not installed'
