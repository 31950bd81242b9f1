# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The bytes between the evaluation and the process of a detector, on a stream socket.

There: a head (stamp in ns, number of rows) and the rows of a block; 0 rows end a flight, and
a stamp of -1 then ends the stream. Back: a head (kind, score, length of a text) and the text.
"""

import socket
import struct
from typing import NamedTuple

import numpy as np

from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock

_BLOCK_HEAD = struct.Struct('<qI')
REPLY_HEAD = struct.Struct('<BdI')

VERDICT, DONE, FAILED = range(3)
"""Kinds of reply: one for each block, one at the end, or the reason why there are no more."""

END_OF_FLIGHT, END_OF_STREAM = 0, -1
"""Stamps of heads without rows."""

LONGEST_TEXT = 500


class Reply(NamedTuple):
    """What came back: score and evidence, or a reason in `text`."""

    kind: int
    score: float
    text: str


def send_block(connection: socket.socket, block: WaveformBlock) -> None:
    """Send a block whose rows have WAVEFORM_DTYPE and lie in one piece."""
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
    """Return `size` bytes, none where the other side is gone."""
    data = bytearray(size)
    view = memoryview(data)
    have = 0
    while have < size:
        got = connection.recv_into(view[have:], 0, socket.MSG_WAITALL)
        if not got:
            return bytearray()
        have += got
    return data


def send_reply(connection: socket.socket, kind: int, score: float, text: str) -> None:
    """Send a reply; a long text is cut."""
    data = text[:LONGEST_TEXT].encode('utf-8', 'replace')
    connection.sendall(REPLY_HEAD.pack(kind, score, len(data)) + data)


def take_replies(data: bytearray) -> list[Reply]:
    """Take the complete replies off the front of `data` and return them."""
    replies = []
    at = 0
    while len(data) >= at + REPLY_HEAD.size:
        kind, score, length = REPLY_HEAD.unpack_from(data, at)
        end = at + REPLY_HEAD.size + length
        if len(data) < end:
            break
        text = data[at + REPLY_HEAD.size : end].decode('utf-8', 'replace')
        replies.append(Reply(kind, score, text))
        at = end
    del data[:at]
    return replies
