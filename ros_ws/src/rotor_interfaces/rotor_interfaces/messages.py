# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Message builders for live ROS 2 classes and for offline rosbags dataclasses.

A builder asks its `MessageFactory` for types by name and sets *every* field, since the offline
dataclasses have no defaults. `ROS` needs the message packages, `OFFLINE` needs none.
"""

import array
import functools
import importlib
from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore

from rotor_common.constants import NANOSECONDS

_STALE = 3
"""Level of a DiagnosticStatus."""


class MessageFactory(Protocol):
    """Makes messages and their fields for a builder, with the live or the offline classes."""

    def new(self, type_name: str, **fields: Any) -> Any:
        """Return a message of `type_name` ('package/msg/Type') with all `fields` set."""

    def sequence(self, values: NDArray[Any]) -> Any:
        """Return an unbounded primitive sequence (float64[], uint8[]), one memory copy."""

    def octet(self, value: int) -> Any:
        """Return a value of the `byte` type, such as a diagnostic level."""


class RosFactory:
    """Builds the Python classes of the installed ROS 2 message packages."""

    def new(self, type_name: str, **fields: Any) -> Any:
        """Return a ROS 2 message; see MessageFactory."""
        return _ros_class(type_name)(**fields)

    def sequence(self, values: NDArray[Any]) -> Any:
        """Return array.array: a list or an ndarray there would cost a thousand times more."""
        result = array.array(values.dtype.char)
        result.frombytes(values.tobytes())
        return result

    def octet(self, value: int) -> bytes:
        """Return one byte, as rclpy wants it."""
        return bytes([value])


class OfflineFactory:
    """Builds rosbags dataclasses of the Jazzy type store; no ROS 2 needed."""

    def new(self, type_name: str, **fields: Any) -> Any:
        """Return a rosbags message; see MessageFactory."""
        return typestore().types[type_name](**fields)

    def sequence(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return the array itself."""
        return np.ascontiguousarray(values)

    def octet(self, value: int) -> int:
        """Return the plain integer."""
        return value


ROS: MessageFactory = RosFactory()
OFFLINE: MessageFactory = OfflineFactory()


@functools.cache
def typestore() -> Any:
    """Return the rosbags type store of ROS 2 Jazzy: schema texts, hashes, CDR."""
    return get_typestore(Stores.ROS2_JAZZY)


@functools.cache
def _ros_class(type_name: str) -> Any:
    package, _, name = type_name.split('/')
    return getattr(importlib.import_module(f'{package}.msg'), name)


def ros_class(type_name: str) -> Any:
    """Return the ROS 2 Python class of 'package/msg/Type'."""
    return _ros_class(type_name)


def to_cdr(message: Any) -> bytes:
    """Return the canonical CDR bytes of an offline message: zeroed padding, exact size."""
    return bytes(typestore().serialize_cdr(message, message.__msgtype__))


def from_cdr(data: bytes, type_name: str) -> Any:
    """Return the rosbags message that `data` holds."""
    return typestore().deserialize_cdr(data, type_name)


def stamp(factory: MessageFactory, stamp_ns: int) -> Any:
    """Return builtin_interfaces/Time for nanoseconds since the Unix epoch."""
    seconds, nanoseconds = divmod(stamp_ns, NANOSECONDS)
    return factory.new('builtin_interfaces/msg/Time', sec=seconds, nanosec=nanoseconds)


def header(factory: MessageFactory, stamp_ns: int, frame_id: str) -> Any:
    """Return std_msgs/Header."""
    return factory.new('std_msgs/msg/Header', stamp=stamp(factory, stamp_ns), frame_id=frame_id)


def stamp_ns(message: Any) -> int:
    """Return the nanoseconds of a message with a header, of a Header or of a Clock.

    Nanoseconds of more than a second become the last one of that second: otherwise the stamp could
    not be written again.
    """
    time = message.header.stamp if hasattr(message, 'header') else None
    if time is None:
        time = message.stamp if hasattr(message, 'stamp') else message.clock
    return int(time.sec) * NANOSECONDS + min(int(time.nanosec), NANOSECONDS - 1)


def sample_stamp_ns(epoch_ns: int, sample: int, rate_hz: int) -> int:
    """Return epoch + sample/rate, rounded half up to a whole nanosecond, in integers."""
    return epoch_ns + (2 * sample * NANOSECONDS + rate_hz) // (2 * rate_hz)


def joint_state(
    factory: MessageFactory,
    stamp_ns: int,
    frame_id: str,
    names: list[str],
    position: NDArray[np.float64],
    *,
    velocity: NDArray[np.float64] | None = None,
) -> Any:
    """Return sensor_msgs/JointState: named numbers that every plotter shows without settings."""
    empty = np.empty(0)
    return factory.new(
        'sensor_msgs/msg/JointState',
        header=header(factory, stamp_ns, frame_id),
        name=names,
        position=factory.sequence(np.asarray(position, np.float64)),
        velocity=factory.sequence(empty if velocity is None else velocity),
        effort=factory.sequence(empty),
    )


def load(factory: MessageFactory, stamp_ns: int, load_y: float, load_z: float) -> Any:
    """Return the load message: apparent gravity per unit mass in frame `rotor`, m/s^2."""

    def vector(y: float, z: float) -> Any:
        return factory.new('geometry_msgs/msg/Vector3', x=0.0, y=y, z=z)

    return factory.new(
        'geometry_msgs/msg/AccelStamped',
        header=header(factory, stamp_ns, 'rotor'),
        accel=factory.new(
            'geometry_msgs/msg/Accel',
            linear=vector(float(load_y), float(load_z)),
            angular=vector(0.0, 0.0),
        ),
    )


def imu(
    factory: MessageFactory,
    stamp_ns: int,
    frame_id: str,
    specific_force_m_s2: tuple[float, float, float],
    variance_m2_s4: float,
) -> Any:
    """Return sensor_msgs/Imu with specific force only (REP-145); -1 marks what is not measured."""
    orientation, angular_velocity, not_measured = _unmeasured(factory)  # type: ignore[arg-type]
    x, y, z = specific_force_m_s2
    return factory.new(
        'sensor_msgs/msg/Imu',
        header=header(factory, stamp_ns, frame_id),
        orientation=orientation,
        orientation_covariance=not_measured,
        angular_velocity=angular_velocity,
        angular_velocity_covariance=not_measured,
        linear_acceleration=factory.new('geometry_msgs/msg/Vector3', x=x, y=y, z=z),
        linear_acceleration_covariance=_covariance(variance_m2_s4),
    )


@functools.cache
def _unmeasured(factory: MessageFactory) -> tuple[Any, Any, NDArray[np.float64]]:
    """Return orientation, angular velocity and covariance of what an accelerometer lacks."""
    covariance = np.zeros(9)
    covariance[0] = -1.0
    return (
        factory.new('geometry_msgs/msg/Quaternion', x=0.0, y=0.0, z=0.0, w=1.0),
        factory.new('geometry_msgs/msg/Vector3', x=0.0, y=0.0, z=0.0),
        covariance,
    )


@functools.lru_cache(maxsize=16)
def _covariance(variance_m2_s4: float) -> NDArray[np.float64]:
    return np.diag([variance_m2_s4] * 3).ravel()


def diagnostics(
    factory: MessageFactory,
    stamp_ns: int,
    name: str,
    *,
    level: int,
    text: str,
    values: Mapping[str, Any],
) -> Any:
    """Return diagnostic_msgs/DiagnosticArray with one status; units are in the keys."""
    status = factory.new(
        'diagnostic_msgs/msg/DiagnosticStatus',
        level=factory.octet(level),
        name=name,
        message=text,
        hardware_id='',
        values=[
            factory.new('diagnostic_msgs/msg/KeyValue', key=key, value=str(value))
            for key, value in values.items()
        ],
    )
    return factory.new(
        'diagnostic_msgs/msg/DiagnosticArray',
        header=header(factory, stamp_ns, ''),
        status=[status],
    )


def level_of(status: Any) -> int:
    """Return the level of a DiagnosticStatus, live or offline; an unknown one is 3, stale."""
    level = status.level[0] if isinstance(status.level, bytes) else int(status.level)
    return level if 0 <= level < _STALE else _STALE


def string(factory: MessageFactory, text: str) -> Any:
    """Return std_msgs/String."""
    return factory.new('std_msgs/msg/String', data=text)


def clock(factory: MessageFactory, stamp_ns: int) -> Any:
    """Return rosgraph_msgs/Clock."""
    return factory.new('rosgraph_msgs/msg/Clock', clock=stamp(factory, stamp_ns))
