# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The waveform codec: round trips in both worlds, foreign layouts, and what it refuses."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from rotor_common.errors import WireError
from rotor_interfaces import messages
from rotor_interfaces.channels import COLUMN_UNITS
from rotor_interfaces.messages import OFFLINE, from_cdr, to_cdr
from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock, decode, encode

POINT_CLOUD = 'sensor_msgs/msg/PointCloud2'


def block(rows: NDArray[np.void]) -> WaveformBlock:
    return WaveformBlock(1_700_000_000_123_456_789, rows)


def rows_of(count: int) -> NDArray[np.void]:
    rows = np.zeros(count, WAVEFORM_DTYPE)
    rows['sample'] = np.arange(count)
    return rows


def test_row_layout_is_the_contract() -> None:
    assert WAVEFORM_DTYPE.itemsize == 72
    assert WAVEFORM_DTYPE.names == tuple(COLUMN_UNITS)
    assert [WAVEFORM_DTYPE[name].str for name in ('time', 'sample', 'angle')] == ['<f8'] * 3


@given(
    rows=hnp.arrays(
        WAVEFORM_DTYPE,
        st.integers(0, 70),
        elements=st.tuples(
            *[st.floats(width=64)] * 3, *[st.floats(width=32)] * (len(COLUMN_UNITS) - 3)
        ),
    ),
    stamp_ns=st.integers(0, 2**31 * 10**9 - 1),
)
def test_round_trip_keeps_every_bit(rows: NDArray[np.void], stamp_ns: int) -> None:
    message = encode(WaveformBlock(stamp_ns, rows), OFFLINE)
    back = decode(from_cdr(to_cdr(message), POINT_CLOUD))
    assert back.rows.tobytes() == rows.tobytes()
    assert back.stamp_ns == stamp_ns
    floats = np.concatenate([rows[name].astype(np.float64) for name in WAVEFORM_DTYPE.names or ()])
    assert message.is_dense == bool(np.isfinite(floats).all())


def test_live_and_offline_messages_carry_the_same_bytes() -> None:
    pytest.importorskip('sensor_msgs.msg', reason='needs the ROS 2 message packages')
    from rclpy.serialization import deserialize_message

    rows = rows_of(256)
    rows['disk_y'] = np.linspace(-1e-5, 1e-5, 256)
    live = encode(block(rows))
    offline = encode(block(rows), OFFLINE)
    again = deserialize_message(to_cdr(offline), messages.ros_class(POINT_CLOUD))
    assert live == again


@given(order=st.permutations(WAVEFORM_DTYPE.names or ()), keep=st.integers(1, 15))
def test_readers_go_by_name_in_any_order_and_subset(order: list[str], keep: int) -> None:
    rows = rows_of(5)
    rows['disk_z'] = [1, 2, 3, 4, 5]
    names = order[:keep]
    foreign = np.zeros(5, [(name, WAVEFORM_DTYPE[name]) for name in names] + [('extra', '<i4')])
    for name in names:
        foreign[name] = rows[name]
    back = decode(encode(block(foreign), OFFLINE))
    assert set(back.columns) == {*names, 'extra'}
    for name in names:
        np.testing.assert_array_equal(back.rows[name], rows[name])


def test_padding_between_columns_is_accepted() -> None:
    layout = np.dtype(
        {'names': ['sample', 'disk_y'], 'formats': ['<f8', '<f4'], 'offsets': [8, 24],
         'itemsize': 32}
    )  # fmt: skip
    rows = np.zeros(3, layout)
    rows['sample'] = [7, 8, 9]
    assert decode(encode(block(rows), OFFLINE)).first_sample == 7


def good() -> Any:
    return encode(block(rows_of(4)), OFFLINE)


@pytest.mark.parametrize(
    ('change', 'sentence'),
    [
        ({'is_bigendian': True}, 'little-endian'),
        ({'width': 5}, 'need 360'),
        ({'data': np.zeros(10, np.uint8)}, '10 bytes'),
        ({'point_step': 0, 'data': np.zeros(0, np.uint8)}, '0 bytes'),
        ({'point_step': 36, 'width': 8}, 'of a row of 36 bytes'),
    ],
)
def test_inconsistent_messages_are_refused(change: dict[str, Any], sentence: str) -> None:
    with pytest.raises(WireError, match=sentence):
        decode(dataclasses.replace(good(), **change))


@pytest.mark.parametrize(
    ('change', 'sentence'),
    [
        ({'datatype': 9}, 'datatype 9'),
        ({'count': 3}, 'count 3'),
        ({'name': 'sample'}, 'twice'),
    ],
)
def test_columns_that_are_not_one_number_a_row_are_refused(
    change: dict[str, Any], sentence: str
) -> None:
    message = good()
    fields = [dataclasses.replace(message.fields[0], **change), *message.fields[1:]]
    with pytest.raises(WireError, match=sentence):
        decode(dataclasses.replace(message, fields=fields))


def test_a_column_type_without_code_is_refused() -> None:
    with pytest.raises(WireError, match="'flag'"):
        encode(block(np.zeros(2, [('flag', '?')])), OFFLINE)
    with pytest.raises(WireError, match="'y'"):
        encode(block(np.zeros(2, [('y', '>f4')])), OFFLINE)


def test_the_place_of_a_block_must_be_known() -> None:
    with pytest.raises(WireError, match='unknown'):
        _ = block(np.zeros(2, [('disk_y', '<f4')])).first_sample
    rows = rows_of(2)
    rows['sample'] += 0.5
    with pytest.raises(WireError, match='whole number'):
        _ = block(rows).first_sample
