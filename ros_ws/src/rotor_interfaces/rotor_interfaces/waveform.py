# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The waveform block and its one codec on sensor_msgs/PointCloud2.

A block is a table: one row a sample, named and typed columns, little-endian. Readers go by
column name and accept more, fewer or reordered columns.
"""

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor_common.constants import NANOSECONDS
from rotor_common.errors import WireError
from rotor_interfaces.channels import CHANNELS
from rotor_interfaces.gaps import BlockTime
from rotor_interfaces.messages import ROS, MessageFactory, header, stamp_ns

WAVEFORM_DTYPE = np.dtype([(channel.name, channel.dtype) for channel in CHANNELS])
"""72 bytes a row, packed."""

_DOUBLES = sum(channel.dtype == '<f8' for channel in CHANNELS)
BY_TYPE = np.dtype(
    [('doubles', '<f8', (_DOUBLES,)), ('singles', '<f4', (len(CHANNELS) - _DOUBLES,))]
)
"""The bytes of WAVEFORM_DTYPE as two tables: the columns of float64 come first."""

# sensor_msgs/PointField datatype codes
_DATATYPES = {1: 'i1', 2: 'u1', 3: '<i2', 4: '<u2', 5: '<i4', 6: '<u4', 7: '<f4', 8: '<f8'}
_CODES = {np.dtype(name): code for code, name in _DATATYPES.items()}

MOST_ROWS = 1 << 16
"""Most samples of a block, the same as the rig itself can be configured to send."""
MOST_COLUMNS = 1024
LONGEST_ROW = 1 << 14
"""Bytes of a row: twice what so many columns need."""
LONGEST_NAME = 256
LARGEST_SAMPLE = 1 << 53
"""Up to here a float64 counts every sample."""


@dataclass(frozen=True)
class WaveformBlock:
    """A run of consecutive samples; `rows` is a structured array, `stamp_ns` its first sample's."""

    stamp_ns: int
    rows: NDArray[np.void]
    frame_id: str = 'rotor'

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns, in the order of the message."""
        return self.rows.dtype.names or ()

    @property
    def first_sample(self) -> int:
        """Absolute index of the first sample; raises WireError if the block has none."""
        if 'sample' not in self.columns or not len(self.rows):
            raise WireError('the block has no `sample` column or no rows, so its place is unknown')
        return sample_index(float(self.rows['sample'][0]))

    @property
    def step_s(self) -> float:
        """Time from one sample to the next, s; NaN if the block does not say."""
        if 'time' not in self.columns or len(self.rows) < 2:
            return float('nan')
        times = self.rows['time']
        return (float(times[-1]) - float(times[0])) / (len(times) - 1)

    @property
    def time(self) -> BlockTime:
        """Time of its first sample, by the stamp alone if it has no `time` column."""
        has_times = 'time' in self.columns and len(self.rows)
        start_s = float(self.rows['time'][0]) if has_times else 0.0
        return BlockTime(self.stamp_ns, start_s, self.step_s)


def sample_index(value: float) -> int:
    """Return a value of the `sample` column as an index; raises WireError if it is none."""
    if not value.is_integer() or abs(value) > LARGEST_SAMPLE:
        raise WireError(
            f'sample = {value!r} is not a whole number up to {LARGEST_SAMPLE}; it counts samples'
        )
    return int(value)


def encode(block: WaveformBlock, factory: MessageFactory = ROS) -> Any:
    """Return the PointCloud2 of a block; one memory copy, no per-sample Python.

    Args:
        block: any structured table of float32, float64 or (un)signed integer columns.
        factory: `messages.ROS` for rclpy, `messages.OFFLINE` for files made without ROS.

    Raises:
        WireError: a column type has no PointField code, or is big-endian.

    """
    rows = np.ascontiguousarray(block.rows)
    fields = _point_fields(rows.dtype, factory)  # type: ignore[arg-type]
    floats = [name for name in block.columns if rows.dtype[name].kind == 'f']
    dense = all(bool(np.isfinite(rows[name]).all()) for name in floats)
    return factory.new(
        'sensor_msgs/msg/PointCloud2',
        header=header(factory, block.stamp_ns, block.frame_id),
        height=1,
        width=len(rows),
        fields=list(fields),
        is_bigendian=False,
        point_step=rows.dtype.itemsize,
        row_step=rows.nbytes,
        data=factory.sequence(rows.view(np.uint8).reshape(-1)),
        is_dense=dense,
    )


@functools.lru_cache(maxsize=16)
def _point_fields(dtype: np.dtype[Any], factory: MessageFactory) -> tuple[Any, ...]:
    fields = []
    for name in dtype.names or ():
        column, offset = dtype.fields[name][:2]  # type: ignore[index]
        if column not in _CODES:
            raise WireError(f'column {name!r} has type {column.str}, which PointField cannot carry')
        fields.append(
            factory.new(
                'sensor_msgs/msg/PointField',
                name=name,
                offset=offset,
                datatype=_CODES[column],
                count=1,
            )
        )
    return tuple(fields)


def decode(message: Any) -> WaveformBlock:
    """Return the block of a PointCloud2, live or offline; the rows are a view, not a copy.

    Raises:
        WireError: big-endian, an invalid stamp, inconsistent sizes, unknown types, arrays in a
            column, columns that repeat or overlap the end of a row, or more than MOST_ROWS,
            MOST_COLUMNS, LONGEST_ROW or LONGEST_NAME.

    """
    if message.is_bigendian:
        raise WireError('is_bigendian is true; a waveform block is little-endian')
    if message.header.stamp.nanosec >= NANOSECONDS:
        raise WireError(
            f'the stamp has {message.header.stamp.nanosec} ns beside its seconds; allowed: up to '
            f'{NANOSECONDS - 1}'
        )
    count = int(message.width) * int(message.height)
    step = int(message.point_step)
    if len(message.data) != count * step or step <= 0:
        raise WireError(
            f'data holds {len(message.data)} bytes, but {count} rows of {step} bytes need '
            f'{count * step}'
        )
    _check_size(count, step, len(message.fields))
    # a mapping: a list of names would be searched again for each column
    columns: dict[str, tuple[np.dtype[Any], int]] = {}
    for field in message.fields:
        if not 0 < len(field.name) <= LONGEST_NAME:
            raise WireError(
                f'a column has a name of {len(field.name)} characters; allowed: 1 to {LONGEST_NAME}'
            )
        if field.datatype not in _DATATYPES or field.count != 1:
            raise WireError(
                f'column {field.name!r} has datatype {field.datatype} and count {field.count}; '
                'a column is one number a row (datatype 1 to 8, count 1)'
            )
        dtype = np.dtype(_DATATYPES[field.datatype])
        if field.name in columns:
            raise WireError(f'column {field.name!r} occurs twice in the block')
        if field.offset + dtype.itemsize > step:
            raise WireError(
                f'column {field.name!r} ends at byte {field.offset + dtype.itemsize} of a row '
                f'of {step} bytes'
            )
        columns[field.name] = dtype, int(field.offset)
    layout = np.dtype(
        {
            'names': list(columns),
            'formats': [dtype for dtype, _ in columns.values()],
            'offsets': [offset for _, offset in columns.values()],
            'itemsize': step,
        }
    )
    rows = np.frombuffer(message.data, layout, count)
    return WaveformBlock(stamp_ns(message), rows, message.header.frame_id)


def _check_size(rows: int, row_bytes: int, columns: int) -> None:
    for what, number, most in (
        ('rows', rows, MOST_ROWS),
        ('bytes a row', row_bytes, LONGEST_ROW),
        ('columns', columns, MOST_COLUMNS),
    ):
        if number > most:
            raise WireError(f'the block has {number} {what}; allowed: up to {most}')
