# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Assemble a recording from the raw messages of the rig, decoding only a few bytes."""

import math
import struct
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from rotor_common.constants import NANOSECONDS
from rotor_common.errors import WireError
from rotor_interfaces import messages, topics
from rotor_interfaces.gaps import UNTIMED, BlockTime, FirstSource, SampleContinuity
from rotor_interfaces.topics import Topic
from rotor_interfaces.waveform import decode, sample_index
from rotor_recording.reading import UNDECODABLE
from rotor_recording.recording import RecordingWriter

_STAMP_AT = 4  # after the encapsulation header of CDR
_STAMP_END = 12

PASSIVE = (topics.MANEUVER_LOAD, topics.PROGRESS, topics.CLOCK, topics.DIAGNOSTICS, topics.CONFIG)
"""Topics that do not set the simulation time."""
NEAR_NS = 30 * NANOSECONDS
"""The load runs ahead by 10 s at most, a queue of blocks lags by less than 10 s."""
MOST_WAITING = 4096


def raw_stamp_ns(topic: Topic, data: bytes) -> int:
    """Return the stamp in ns with which the CDR bytes of a message begin, 0 without one.

    Every type of the contract but String begins with a header, a Header or a Time. A stamp
    before 1970 counts as none.
    """
    if topic.type == topics.CONFIG.type or len(data) < _STAMP_END:
        return 0
    is_little_endian = data[1] & 1
    layout = '<iI' if is_little_endian else '>iI'
    seconds, nanoseconds = struct.unpack_from(layout, data, _STAMP_AT)
    return max(int(seconds) * NANOSECONDS + min(int(nanoseconds), NANOSECONDS - 1), 0)


class SampleIndexReader:
    """Reads the absolute sample index out of raw waveform blocks.

    Blocks of one source differ only in stamp and rows, so the first one is decoded and the
    others are read at the same offset as long as the bytes between stamp and rows agree.
    """

    def __init__(self) -> None:
        self._between = b''
        self._length = -1  # none yet
        self._rows_at = 0
        self._count = 0
        self._sample_at = 0
        self._times_at: tuple[int, int] | None = None  # first and last
        self.time = UNTIMED
        """Of the block that was read last, see WaveformBlock."""

    def read(self, data: bytes) -> tuple[int, int]:
        """Return the index of the first sample and the number of samples.

        Raises:
            WireError: not a waveform block with a `sample` column of whole numbers.

        """
        is_known = len(data) == self._length and data[_STAMP_END : self._rows_at] == self._between
        if is_known:
            (first,) = struct.unpack_from('<d', data, self._sample_at)
            self.time = self._time_of(data)
            return sample_index(first), self._count
        return self._decode(data)

    def _decode(self, data: bytes) -> tuple[int, int]:
        try:
            message = messages.from_cdr(data, topics.WAVEFORM.type)
            block = decode(message)
        except UNDECODABLE as error:
            raise WireError(f'the bytes are not a PointCloud2 ({error})') from None
        first = block.first_sample
        dtype, offset = dict(block.rows.dtype.fields or {})['sample'][:2]
        rows_at = _rows_at(data, len(message.data))
        times = dict(block.rows.dtype.fields or {}).get('time')
        if dtype == '<f8' and rows_at and (times is None or times[0] == '<f8'):
            self._between = data[_STAMP_END:rows_at]
            self._length = len(data)
            self._rows_at = rows_at
            self._sample_at = rows_at + offset
            self._count = len(block.rows)
            last = (self._count - 1) * block.rows.dtype.itemsize
            self._times_at = times and (rows_at + times[1], rows_at + times[1] + last)
        self.time = block.time
        return first, len(block.rows)

    def _time_of(self, data: bytes) -> BlockTime:
        stamp_ns = raw_stamp_ns(topics.WAVEFORM, data)
        if self._times_at is None:
            return BlockTime(stamp_ns, 0.0, math.nan)
        start_s, end_s = (struct.unpack_from('<d', data, at)[0] for at in self._times_at)
        step_s = (end_s - start_s) / (self._count - 1) if self._count > 1 else math.nan
        return BlockTime(stamp_ns, start_s, step_s)


def _rows_at(data: bytes, row_bytes: int) -> int:
    """Return the offset of the rows of a PointCloud2, 0 if it is not certain.

    The message ends with the rows, one byte (is_dense), and up to 3 bytes with which DDS fills
    the last 4; the length of the rows comes before them.
    """
    for filled in range(4):
        rows_at = len(data) - filled - 1 - row_bytes
        if struct.unpack_from('<I', data, rows_at - 4)[0] == row_bytes:
            return rows_at
    return 0


class RecordingStream:
    """Gives every message its log time, counts what is missing, and writes.

    Log time is simulation time: the message's own stamp or, where it has none, the newest
    simulation time seen; such messages wait until there is one. The messages of the rotor and the
    monitor set this time; the load, which is published ahead, and topics on which any node may
    publish do not (PASSIVE). On these a stamp far from the simulation time is ignored, and on
    /diagnostics every stamp.
    """

    def __init__(
        self, writer: RecordingWriter, full_name: Callable[[str], str] = '/{}'.format
    ) -> None:
        """Write to `writer`; `full_name` resolves the name of a topic, as a node does."""
        self.continuity = SampleContinuity()
        self.refused_blocks = 0
        self.left_out = 0
        self.time_ns = 0
        self._first_source = FirstSource()
        self._writer = writer
        self._index = SampleIndexReader()
        self._waiting: list[tuple[Topic, bytes, int]] = []
        self._config = b''
        self._stored = {t: replace(t, name=full_name(t.name)) for t in topics.TOPICS}

    def take(
        self, topic: Topic, data: bytes, publish_time_ns: int, *, is_alone: bool = True
    ) -> int:
        """Write one message of `topics.TOPICS`; return its stamp in ns, 0 without one.

        Args:
            topic: on which it came.
            data: its CDR bytes.
            publish_time_ns: wall time, ns.
            is_alone: whether this topic has one source; of several, blocks and configuration
                of the first are taken, the others are counted and left out (returns 0).

        Raises:
            RecordingError: the system refuses to write.

        """
        stamp_ns = raw_stamp_ns(topic, data)
        if topic is topics.WAVEFORM:
            if not self._check(data, is_alone=is_alone):
                return 0
        elif topic is topics.CONFIG and not self._keep_config(data, is_alone=is_alone):
            return 0
        if stamp_ns and topic not in PASSIVE:
            self.time_ns = max(self.time_ns, stamp_ns)
            if self._waiting:
                self._release()
        if self.time_ns:
            self._write(topic, data, publish_time_ns)
        elif len(self._waiting) < MOST_WAITING:
            self._waiting.append((topic, data, publish_time_ns))
        else:
            self.left_out += 1
        return stamp_ns

    def finish(self) -> None:
        """Write the messages that still wait for a simulation time, with their wall time."""
        self._release()

    def status(self) -> dict[str, Any]:
        """Return the counters for /diagnostics; units stand in the keys."""
        return {
            'blocks [1]': self.continuity.blocks,
            'lost samples [1]': self.continuity.lost_samples,
            'refused blocks [1]': self.refused_blocks,
            'blocks of another source [1]': self._first_source.other_blocks,
            'messages left out [1]': self.left_out,
            'messages [1]': self._writer.messages,
            'bytes [B]': self._writer.message_bytes,
            'longest flush [ms]': f'{self._writer.flush_max_s * 1e3:.1f}',
        }

    def fault(self) -> str:
        """Return in a few words what is wrong with the stream, '' where nothing is."""
        if self._first_source.other_blocks:
            return 'another source publishes rotor/waveform'
        lost = self.continuity.lost_samples + self.refused_blocks + self.left_out
        return 'samples or blocks lost' if lost else ''

    def _write(self, topic: Topic, data: bytes, publish_time_ns: int) -> None:
        """Write a message with its log time; before there is a simulation time, with wall time."""
        stamp_ns = raw_stamp_ns(topic, data)
        log_time_ns = self.time_ns or publish_time_ns
        if topic not in PASSIVE:
            log_time_ns = stamp_ns or log_time_ns
        elif topic is not topics.DIAGNOSTICS and abs(stamp_ns - log_time_ns) < NEAR_NS:
            log_time_ns = stamp_ns
        self._writer.write(self._stored[topic], data, log_time_ns, publish_time_ns)

    def _release(self) -> None:
        waiting, self._waiting = self._waiting, []
        for topic, data, publish_time_ns in waiting:
            self._write(topic, data, publish_time_ns)

    def _check(self, data: bytes, *, is_alone: bool) -> bool:
        """Take the sample index of a block; return False if it comes from another source."""
        try:
            first, count = self._index.read(data)
            time = self._index.time
            is_ours = self._first_source.accepts(first, count, time, is_alone=is_alone)
            if is_ours:
                self.continuity.check(first, count, time)
        except WireError:
            # the only source's block is recorded as it came; the monitor reports what is wrong
            self.refused_blocks += 1
            return is_alone
        return is_ours

    def _keep_config(self, data: bytes, *, is_alone: bool) -> bool:
        """Keep the current configuration; return False for that of another source."""
        if data == self._config:
            return True
        if self._config and not is_alone:
            self.left_out += 1
            return False
        self._config = data
        try:
            text = str(messages.from_cdr(data, topics.CONFIG.type).data)
        except UNDECODABLE:
            return True  # it is recorded as it came
        self._writer.add_config(text)
        return True
