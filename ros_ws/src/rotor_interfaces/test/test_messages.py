# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Message builders make equal messages in both worlds; stamps are exact integers."""

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rotor_interfaces import messages
from rotor_interfaces.messages import OFFLINE, ROS, MessageFactory
from rotor_interfaces.topics import TOPICS

BUILDERS: dict[str, Callable[[MessageFactory], Any]] = {
    'sensor_msgs/msg/JointState': lambda f: messages.joint_state(
        f, 5, 'rotor', ['a', 'b'], np.array([1.0, np.nan]), velocity=np.array([2.0])
    ),
    'geometry_msgs/msg/AccelStamped': lambda f: messages.load(f, 10**18 + 7, 29.43, -1.0),
    'sensor_msgs/msg/Imu': lambda f: messages.imu(f, 5, 'bearing_1', (0.0, -9.81, 0.2), 0.04),
    'diagnostic_msgs/msg/DiagnosticArray': lambda f: messages.diagnostics(
        f, 5, 'rig: part', level=2, text='text', values={'age [s]': 1.5}
    ),
    'std_msgs/msg/String': lambda f: messages.string(f, '{"a": 1}'),
    'rosgraph_msgs/msg/Clock': lambda f: messages.clock(f, 1_999_999_999),
    'std_msgs/msg/Header': lambda f: messages.header(f, 3, 'monitor'),
}


@pytest.mark.parametrize('type_name', BUILDERS)
def test_live_and_offline_messages_are_equal(type_name: str) -> None:
    pytest.importorskip('sensor_msgs.msg', reason='needs the ROS 2 message packages')
    from rclpy.serialization import deserialize_message

    offline = messages.to_cdr(BUILDERS[type_name](OFFLINE))
    live = BUILDERS[type_name](ROS)
    again = deserialize_message(offline, messages.ros_class(type_name))
    assert repr(live) == repr(again)  # repr, since NaN is not equal to itself


def test_canonical_bytes_do_not_depend_on_history() -> None:
    first = {name: messages.to_cdr(build(OFFLINE)) for name, build in BUILDERS.items()}
    for name, build in reversed(BUILDERS.items()):
        assert messages.to_cdr(build(OFFLINE)) == first[name]


def test_every_topic_has_a_known_type_and_room_for_a_block() -> None:
    assert len({topic.name for topic in TOPICS}) == len(TOPICS)
    for topic in TOPICS:
        assert topic.type in messages.typestore().types
        assert topic.depth > 0
        assert topic.name.startswith('/') == (topic.name in ('/clock', '/diagnostics'))


@given(
    sample=st.integers(0, 10**12),
    rate_hz=st.integers(1000, 200_000),
    epoch_ns=st.integers(0, 2 * 10**18),
)
def test_sample_stamps_are_rounded_once_and_never_drift(
    sample: int, rate_hz: int, epoch_ns: int
) -> None:
    exact = Fraction(sample * 10**9, rate_hz)
    stamp = messages.sample_stamp_ns(epoch_ns, sample, rate_hz)
    assert abs(stamp - epoch_ns - exact) <= Fraction(1, 2)


def test_stamps_read_back() -> None:
    builds: list[Callable[[], Any]] = [
        lambda: messages.header(OFFLINE, 1_700_000_000_000_000_001, 'x'),
        lambda: messages.clock(OFFLINE, 1_700_000_000_000_000_001),
        lambda: messages.load(OFFLINE, 1_700_000_000_000_000_001, 0.0, 0.0),
    ]
    for build in builds:
        assert messages.stamp_ns(build()) == 1_700_000_000_000_000_001


@pytest.mark.parametrize('factory', [ROS, OFFLINE])
def test_levels_read_back(factory: MessageFactory) -> None:
    if factory is ROS:
        pytest.importorskip('diagnostic_msgs.msg', reason='needs the ROS 2 message packages')
    for level in range(4):
        array = messages.diagnostics(factory, 0, 'n', level=level, text='', values={})
        assert messages.level_of(array.status[0]) == level
