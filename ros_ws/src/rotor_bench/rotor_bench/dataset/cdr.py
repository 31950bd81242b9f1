# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Serialized messages made from a template: only the numbers that differ are replaced.

The general way (a message object, then its CDR bytes) costs more than integrating the rotor does.
The tests compare both ways, byte for byte.
"""

import struct
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor_common.constants import NANOSECONDS
from rotor_interfaces import messages
from rotor_interfaces.messages import OFFLINE
from rotor_interfaces.topics import ROTOR_FRAME
from rotor_interfaces.waveform import BY_TYPE, WaveformBlock, encode

_STAMP_AT = 4
"""The header comes first in every message, after the four bytes of the CDR encapsulation."""


_MARK = 0xA5
"""A byte that occurs nowhere else in a message; four or eight of it are a finite number."""


class WaveformBytes:
    """CDR bytes of `rotor/waveform`, for blocks of WAVEFORM_DTYPE."""

    def __init__(self) -> None:
        self._ends: dict[int, tuple[bytearray, bytes, bytes]] = {}

    def __call__(self, stamp_ns: int, rows: NDArray[np.void]) -> bytes:
        """Return the bytes of one block."""
        head, dense, gaps = self._frame(rows)
        struct.pack_into('<iI', head, _STAMP_AT, *divmod(stamp_ns, NANOSECONDS))
        numbers = rows.view(BY_TYPE)
        finite = np.isfinite(numbers['doubles']).all() and np.isfinite(numbers['singles']).all()
        return b''.join((head, rows.data, dense if finite else gaps))

    def _frame(self, rows: NDArray[np.void]) -> tuple[bytearray, bytes, bytes]:
        """Return the bytes before the rows of a block, and after them without and with gaps."""
        count = len(rows)
        if count not in self._ends:
            full = np.empty_like(rows)
            full.view(np.uint8)[:] = _MARK
            gap = full.copy()
            gap['angle'] = np.nan
            whole, holed = (
                messages.to_cdr(encode(WaveformBlock(0, block, ROTOR_FRAME), OFFLINE))
                for block in (full, gap)
            )
            start = whole.index(full.tobytes())
            end = start + full.nbytes
            self._ends[count] = bytearray(whole[:start]), whole[end:], holed[end:]
        return self._ends[count]


class JointStateBytes:
    """CDR bytes of a sensor_msgs/JointState with fixed names."""

    def __init__(self, names: Sequence[str], *, velocity: bool = False) -> None:
        marks = 1e300 * np.arange(1.0, len(names) + 1.0)
        message = messages.joint_state(
            OFFLINE, 0, ROTOR_FRAME, list(names), marks, velocity=-marks if velocity else None
        )
        self._bytes = bytearray(messages.to_cdr(message))
        self._positions = self._bytes.index(marks.tobytes())
        self._velocities = self._bytes.index((-marks).tobytes()) if velocity else 0

    def __call__(
        self, stamp_ns: int, position: Sequence[float], velocity: Sequence[float] = ()
    ) -> bytes:
        """Return the bytes of one message."""
        struct.pack_into('<iI', self._bytes, _STAMP_AT, *divmod(stamp_ns, NANOSECONDS))
        struct.pack_into(f'<{len(position)}d', self._bytes, self._positions, *position)
        if velocity:
            struct.pack_into(f'<{len(velocity)}d', self._bytes, self._velocities, *velocity)
        return bytes(self._bytes)


def load_bytes(stamps_ns: Sequence[int], points: NDArray[np.float64]) -> Iterator[bytes]:
    """Yield the CDR bytes of `maneuver/load` for loads (n, 2) in m/s^2."""
    mark_y, mark_z = 1e300, 2e300
    template = messages.to_cdr(messages.load(OFFLINE, 0, mark_y, mark_z))
    place = {
        'y': template.index(struct.pack('<d', mark_y)),
        'z': template.index(struct.pack('<d', mark_z)),
    }
    layout: Any = np.dtype(
        {
            'names': ['sec', 'nanosec', 'y', 'z'],
            'formats': ['<i4', '<u4', '<f8', '<f8'],
            'offsets': [_STAMP_AT, _STAMP_AT + 4, place['y'], place['z']],
            'itemsize': len(template),
        }
    )
    buffer = bytearray(template * len(points))
    rows = np.frombuffer(buffer, layout)
    rows['sec'], rows['nanosec'] = np.divmod(np.array(stamps_ns, np.int64), NANOSECONDS)
    rows['y'], rows['z'] = points[:, 0], points[:, 1]
    for k in range(len(points)):
        yield bytes(buffer[k * len(template) : (k + 1) * len(template)])
