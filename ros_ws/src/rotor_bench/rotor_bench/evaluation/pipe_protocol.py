# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The byte protocol between the evaluation and a detector process, over a stream socket.

To the detector: a head (stamp in ns, number of rows) and the rows of a block; 0 rows end a flight,
and a stamp of -1 then ends the stream. Before a flight under test comes the fitted detector, its
length first. Back: a head (kind, score, length) and that many bytes. Replies are not trusted:
their size is bounded and their texts are cleaned.
"""

import socket
import struct
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from rotor_common.errors import WireError
from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock

_BLOCK_HEAD = struct.Struct('<qI')
REPLY_HEAD = struct.Struct('<BdI')

VERDICT, DONE, FAILED, WALLS, MADE, LEARNT = range(6)
"""Kinds of reply: verdict on a block; end; failure; restrictions of the process; alarm score of
the detector; fitted detector."""

END_OF_FLIGHT, END_OF_STREAM = 0, -1
"""Stamps of heads without rows."""

LONGEST_TEXT = 500
LARGEST_LEARNT = 64 << 20
"""Bytes that a fit may hand on to the flights."""
_LARGEST = {
    **dict.fromkeys((VERDICT, DONE, FAILED, MADE), 4 * LONGEST_TEXT),
    WALLS: 1 << 16,
    LEARNT: LARGEST_LEARNT,
}
_LEARNT_HEAD = struct.Struct('<Q')


class Reply(NamedTuple):
    """A reply: a score, and evidence, a reason, or the fitted detector in `data`."""

    kind: int
    score: float
    data: bytes

    @property
    def text(self) -> str:
        """The data as one line of text, fit for a terminal."""
        return one_line(self.data.decode('utf-8', 'replace'))


def one_line(text: str) -> str:
    """Return at most LONGEST_TEXT characters of a text on one line, all of them visible.

    Control characters, marks that turn the direction of writing, and others that cannot be seen
    become U+FFFD.
    """
    words = ' '.join(text[: 2 * LONGEST_TEXT].split())[:LONGEST_TEXT]
    return ''.join(c if c.isprintable() else '\N{REPLACEMENT CHARACTER}' for c in words)


def send_block(connection: socket.socket, block: WaveformBlock) -> None:
    """Send a block whose rows have WAVEFORM_DTYPE and are contiguous."""
    head = _BLOCK_HEAD.pack(block.stamp_ns, len(block.rows))
    connection.sendall(head)
    connection.sendall(block.rows.view(np.uint8).data)


def send_end(connection: socket.socket, stamp: int) -> None:
    """Send the end of a flight or of the stream."""
    connection.sendall(_BLOCK_HEAD.pack(stamp, 0))


def receive_block(connection: socket.socket) -> WaveformBlock | int:
    """Return the next block, or END_OF_FLIGHT or END_OF_STREAM; a closed socket ends the stream."""
    head = _receive(connection, _BLOCK_HEAD.size)
    if not head:
        return END_OF_STREAM
    stamp_ns, count = _BLOCK_HEAD.unpack(head)
    if not count:
        return int(stamp_ns)
    data = _receive(connection, count * WAVEFORM_DTYPE.itemsize)
    if not data:
        return END_OF_STREAM
    return WaveformBlock(stamp_ns, np.frombuffer(data, WAVEFORM_DTYPE))


def _receive(connection: socket.socket, size: int) -> bytearray:
    """Return `size` bytes, or none if the other side is gone."""
    data = bytearray(size)
    view = memoryview(data)
    have = 0
    while have < size:
        got = connection.recv_into(view[have:], 0, socket.MSG_WAITALL)
        if not got:
            return bytearray()
        have += got
    return data


def send_learnt(connection: socket.socket, learnt: bytes) -> None:
    """Send the fitted detector, before the first block of a flight under test."""
    connection.sendall(_LEARNT_HEAD.pack(len(learnt)))
    connection.sendall(learnt)


def receive_learnt(connection: socket.socket) -> bytearray:
    """Return the fitted detector; raises ConnectionError if the other side is gone."""
    head = _receive(connection, _LEARNT_HEAD.size)
    learnt = _receive(connection, _LEARNT_HEAD.unpack(head)[0]) if head else head
    if not learnt:
        raise ConnectionResetError
    return learnt


def send_reply(connection: socket.socket, kind: int, score: float, text: str) -> None:
    """Send a reply; a long text is cut."""
    send_data(connection, kind, score, text[:LONGEST_TEXT].encode('utf-8', 'replace'))


def send_data(connection: socket.socket, kind: int, score: float, data: bytes) -> None:
    """Send a reply with bytes."""
    connection.sendall(REPLY_HEAD.pack(kind, score, len(data)) + data)


def take_replies(data: bytearray) -> Iterator[Reply]:
    """Take the complete replies off the front of `data` and yield them.

    Raises:
        WireError: an unknown kind, or more bytes than its kind may have.

    """
    while len(data) >= REPLY_HEAD.size:
        kind, score, length = REPLY_HEAD.unpack_from(data)
        if length > _LARGEST.get(kind, -1):
            raise WireError(f'a reply of kind {kind} with {length} bytes')
        end = REPLY_HEAD.size + length
        if len(data) < end:
            return
        reply = Reply(kind, score, bytes(data[REPLY_HEAD.size : end]))
        del data[:end]
        yield reply
