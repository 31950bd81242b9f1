# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Hostile waveform blocks, and everything of the rig that takes blocks."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
from numpy.random import Generator
from numpy.typing import NDArray

from rotor_common.constants import NANOSECONDS
from rotor_common.errors import WireError
from rotor_interfaces import topics
from rotor_interfaces.channels import CHANNEL_COLUMNS
from rotor_interfaces.messages import OFFLINE, from_cdr, stamp, stamp_ns, to_cdr
from rotor_interfaces.topics import Topic
from rotor_interfaces.waveform import LARGEST_SAMPLE, WAVEFORM_DTYPE, WaveformBlock, decode, encode
from rotor_recording.reading import UNDECODABLE
from rotor_recording.recording_stream import RecordingStream
from rotor_view.rig_view import RigView
from vibration_monitor.messages import MonitorMessages
from vibration_monitor.monitor import MAX_INVALID_RECORDS, VibrationMonitor
from vibration_monitor.monitor_config import MonitorConfig

RATE_HZ = 10_240
ROWS = 512
SPEED_RAD_S = 6000.0
EPOCH_NS = 1_700_000_000_000_000_000
RUN_LENGTH = 100
"""Inputs that go to one monitor, recorder or view, before the next takes its place."""

NUMBERS = (
    0.0, -0.0, 1.0, -1.0, 0.5, 255.0, 1e-320, 1e-45, 1e-6, 1e6, 1e9, 1e15, 2.0**53, 1e17, 3.4e38,
    1e300, -1e300, np.inf, -np.inf, np.nan,
)  # fmt: skip
INTEGERS = (0, 1, 2, 3, 7, 8, 255, 256, 65_535, 2**31 - 1, 2**31, 2**32 - 1)
NAMES = (
    '', 'sample', 'time', 'angle', 'disk_y', 'disk_z', 'a\0b', '\x1b[31m', 'ü_y', '/', '..',
    'x' * 300, 'new\nline_z', '_y', '#_ay',
)  # fmt: skip
TYPES = ('i1', 'u1', '<i2', '<u2', '<i4', '<u4', '<f4', '<f8')


def sane_rows(first: int, count: int = ROWS) -> NDArray[np.void]:
    """Return rows of a shaft that turns steadily."""
    rows = np.zeros(count, WAVEFORM_DTYPE)
    rows['sample'] = first + np.arange(count)
    rows['time'] = np.arange(count) / RATE_HZ
    rows['angle'] = SPEED_RAD_S / RATE_HZ * rows['sample']
    for number, name in enumerate(CHANNEL_COLUMNS):
        rows[name] = 1e-5 * np.cos(rows['angle'] * (1 + number % 3))
    rows['keyphasor'] = (rows['angle'] % (2 * np.pi)) < 0.7
    rows['load_y'] = 9.81
    return rows


def sane_block(first: int) -> WaveformBlock:
    """Return a block of those rows, stamped as the rig stamps it."""
    return WaveformBlock(EPOCH_NS + first * NANOSECONDS // RATE_HZ, sane_rows(first))


def pattern(rng: Generator, count: int) -> NDArray[np.float64]:
    """Return a column that no sensor sends."""
    a, b = (float(x) for x in rng.choice(NUMBERS, 2))
    with np.errstate(all='ignore'):
        kinds: tuple[NDArray[Any], ...] = (
            np.full(count, a),
            np.arange(count) * a,
            b + np.arange(count) * a,
            np.where(np.arange(count) % int(rng.integers(2, 5)), a, b),
            rng.standard_normal(count) * a,
            rng.choice(NUMBERS, count),
            rng.integers(0, 2**63, count, dtype=np.int64).view(np.float64),
        )
        found: NDArray[np.float64] = kinds[rng.integers(len(kinds))]
    return found


def hostile_rows(rng: Generator, first: int) -> NDArray[np.void]:
    """Return rows of which columns lack, have another type, or hold what they should not."""
    count = int(rng.choice([0, 1, 2, 3, 17, ROWS, ROWS, ROWS, 4096]))
    rows = sane_rows(first, count)
    for _ in range(rng.integers(0, 4)):
        name = str(rng.choice(rows.dtype.names or ('none',)))
        if name not in (rows.dtype.names or ()) or not count:
            continue
        kind = rng.integers(6)
        if kind < 2:
            rows[name] = pattern(rng, count)
        elif kind == 2:
            values = np.array(NUMBERS).astype(rows.dtype[name])
            rows[name][rng.integers(count)] = rng.choice(values)
        elif kind == 3:
            kept = [n for n in rows.dtype.names or () if n != name]
            rows = np.ascontiguousarray(rows[kept]) if kept else rows
        elif kind == 4:
            columns = {n: rows.dtype[n] for n in rows.dtype.names or ()}
            columns[name] = np.dtype(str(rng.choice(TYPES)))
            with np.errstate(all='ignore'):
                rows = rows.astype(np.dtype([*columns.items()]))
        else:
            start = int(rng.integers(count))
            rows[name][start:] = rows[name][start:] * rng.choice([-1.0, 0.0, 2.0, 1e3])
    return rows


def hostile_message(rng: Generator, first: int) -> Any:
    """Return a PointCloud2 that lies about its rows, its columns or its time."""
    rows = hostile_rows(rng, first)
    message = encode(WaveformBlock(sane_block(first).stamp_ns, rows), OFFLINE)
    # the codec shares its fields between messages
    message.fields = [_renamed(field, field.name) for field in message.fields]
    if len(rows) == 0 and rng.integers(2):
        message.point_step = int(rng.choice(INTEGERS))
    for _ in range(rng.integers(0, 3)):
        _spoil(rng, message)
    return message


def _spoil(rng: Generator, message: Any) -> None:
    fields = message.fields
    kind = rng.integers(9)
    if kind == 0:
        name = str(rng.choice(['width', 'height', 'point_step', 'row_step']))
        setattr(message, name, int(rng.choice(INTEGERS)))
    elif kind == 1:
        message.data = message.data[: rng.integers(len(message.data) + 1)]
    elif kind == 2:
        message.is_bigendian = bool(rng.integers(2))
    elif kind == 3:
        seconds = int(rng.choice([-(2**31), -1, 0, 1, 2**31 - 1]))
        message.header.stamp.sec = seconds
        message.header.stamp.nanosec = int(rng.choice(INTEGERS))
    elif kind == 4:
        message.header.stamp = stamp(OFFLINE, int(rng.integers(2**31 * NANOSECONDS)))
    elif kind == 5 and rng.integers(5) == 0:
        new = OFFLINE.new('sensor_msgs/msg/PointField', name='', offset=0, datatype=7, count=1)
        names = (f'c{number}_y' for number in range(int(rng.choice([3, 70, 1030]))))
        message.fields = [*fields, *(_renamed(new, name) for name in names)]
    elif fields:
        field = fields[rng.integers(len(fields))]
        if kind == 6:
            field.name = str(rng.choice(NAMES))
        elif kind == 7:
            field.offset = int(rng.choice(INTEGERS))
        else:
            field.datatype = int(rng.integers(0, 10))
            field.count = int(rng.choice([0, 1, 1, 1, 2, 2**32 - 1]))


def _renamed(field: Any, name: str) -> Any:
    return OFFLINE.new(
        'sensor_msgs/msg/PointField',
        name=name,
        offset=field.offset,
        datatype=field.datatype,
        count=field.count,
    )


def hostile_bytes(rng: Generator, first: int) -> bytes:
    """Return such a message on the wire, at times with bytes that changed on the way."""
    data = bytearray(to_cdr(hostile_message(rng, first)))
    if rng.integers(5) == 0:
        for _ in range(rng.integers(1, 8)):
            data[rng.integers(min(len(data), 400))] = rng.integers(256)
    return bytes(data)


def _hold(promise: bool, otherwise: str) -> None:
    if not promise:
        raise AssertionError(otherwise)


class NullWriter:
    """A writer that keeps nothing."""

    messages = message_bytes = 0
    flush_max_s = 0.0

    def write(self, topic: Topic, data: bytes, log_time_ns: int, publish_time_ns: int) -> None:
        """Take a message."""

    def add_config(self, text: str) -> None:
        """Take a configuration."""


class Blocks:
    """Recorder and two monitors; each hostile block is followed by one that must be taken."""

    def __init__(self) -> None:
        self._configs = (
            MonitorConfig(),
            MonitorConfig(
                extras=(
                    'spectrum', 'statistics', 'whirl', 'average', 'orbit', 'envelope', 'passage',
                    'trend', 'crack',
                ),
                critical_speed_rad_s=12_000.0,
            ),
        )  # fmt: skip
        for config in self._configs:
            VibrationMonitor(config).prepare()

    def start(self) -> None:
        """Take fresh consumers."""
        self._sample = 0
        self._stream = RecordingStream(NullWriter())  # type: ignore[arg-type]
        self._monitors = [(VibrationMonitor(c), MonitorMessages(OFFLINE)) for c in self._configs]

    def feed(self, rng: Generator) -> None:
        """Take one hostile block, then a sane one."""
        self._take(hostile_bytes(rng, self._sample))
        self._sample += ROWS
        sane = sane_block(self._sample)
        self._take(to_cdr(encode(sane, OFFLINE)))
        self._sample += ROWS
        taken = [int(monitor.status()['blocks [1]']) for monitor, _ in self._monitors]
        for monitor, _ in self._monitors:
            monitor.push(sane_block(self._sample))
        for (monitor, _), count in zip(self._monitors, taken, strict=True):
            _hold(monitor.status()['blocks [1]'] == count + 1, 'a sane block was not taken')
        self._sample += ROWS

    def _take(self, data: bytes) -> None:
        self._stream.take(topics.WAVEFORM, data, EPOCH_NS)
        self._stream.status()
        for monitor, outgoing in self._monitors:
            try:
                message = from_cdr(data, topics.WAVEFORM.type)
            except UNDECODABLE:
                return
            time_ns = stamp_ns(message)
            try:
                block = decode(message)
                records = monitor.push(block)
                most = MAX_INVALID_RECORDS + len(block.rows)
                _hold(len(records) <= most, 'a flood of records')
            except WireError:
                records = []
            for _, _, said in outgoing.after_block(monitor, records, max(time_ns, 0)):
                to_cdr(said)
            numbers = [n for n in monitor.status().values() if isinstance(n, int)]
            _hold(max(numbers) < LARGEST_SAMPLE * 4 * RUN_LENGTH, 'a count out of all proportion')


class Views:
    """The view of a running rig."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix='rotor-rig-fuzz-')

    def start(self) -> None:
        """Take a fresh view."""
        self._sample = 0
        self._view = RigView(self._connect)

    def _connect(self, stream: rr.RecordingStream) -> None:
        stream.save(Path(self._folder.name) / 'view.rrd')

    def feed(self, rng: Generator) -> None:
        """Show one hostile block, then a sane one."""
        for data in (
            hostile_bytes(rng, self._sample),
            to_cdr(encode(sane_block(self._sample + ROWS), OFFLINE)),
        ):
            try:
                message = from_cdr(data, topics.WAVEFORM.type)
            except UNDECODABLE:
                continue
            self._view.push(topics.WAVEFORM, stamp_ns(message), message)
            self._view.push(topics.SPECTRUM, stamp_ns(message), message)
        self._sample += 2 * ROWS
