# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The table of topics: names, message types and quality of service."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Topic:
    """One topic of the rig; publishers are RELIABLE KEEP_LAST `depth`, latched = TRANSIENT_LOCAL.

    `best_effort` subscribers do not hold the publisher back (a lost tick of it does not matter).
    """

    name: str
    type: str
    depth: int
    latched: bool = False
    best_effort: bool = False


# The latched load must be deep enough for the lead (2 s at 100 Hz by default, at most 10 s).
MANEUVER_LOAD = Topic('maneuver/load', 'geometry_msgs/msg/AccelStamped', 1024, latched=True)
WAVEFORM = Topic('rotor/waveform', 'sensor_msgs/msg/PointCloud2', 256)
TRUTH_WAVEFORM = Topic('rotor/truth_waveform', 'sensor_msgs/msg/PointCloud2', 256)
SHAFT = Topic('rotor/shaft', 'sensor_msgs/msg/JointState', 256)
BEARING_1_IMU = Topic('rotor/bearing_1/imu', 'sensor_msgs/msg/Imu', 4096)
BEARING_2_IMU = Topic('rotor/bearing_2/imu', 'sensor_msgs/msg/Imu', 4096)
TRUTH = Topic('rotor/truth', 'sensor_msgs/msg/JointState', 256, latched=True)
CONFIG = Topic('rotor/config', 'std_msgs/msg/String', 16, latched=True)
PROGRESS = Topic('rig/progress', 'std_msgs/msg/Header', 64, latched=True)
SPECTRUM = Topic('monitor/spectrum', 'sensor_msgs/msg/PointCloud2', 64)
INDICATORS = Topic('monitor/indicators', 'sensor_msgs/msg/JointState', 64)
ALARM = Topic('monitor/alarm', 'diagnostic_msgs/msg/DiagnosticArray', 64)
DIAGNOSTICS = Topic('/diagnostics', 'diagnostic_msgs/msg/DiagnosticArray', 64)
CLOCK = Topic('/clock', 'rosgraph_msgs/msg/Clock', 64, best_effort=True)

TOPICS = (
    MANEUVER_LOAD,
    WAVEFORM,
    TRUTH_WAVEFORM,
    SHAFT,
    BEARING_1_IMU,
    BEARING_2_IMU,
    TRUTH,
    CONFIG,
    PROGRESS,
    SPECTRUM,
    INDICATORS,
    ALARM,
    DIAGNOSTICS,
    CLOCK,
)

ROTOR_FRAME = 'rotor'
"""x along the shaft, forward; y along a positive load (down in the airframe); z = y_body."""
