# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The sensors: configuration, presets, IMU; `chain` measures and is slow to import (numba)."""

from rotor_sim.sensors.config import SensorConfig
from rotor_sim.sensors.imu import ImuDecimator, ImuSample
from rotor_sim.sensors.presets import PRESETS

__all__ = [
    'PRESETS',
    'ImuDecimator',
    'ImuSample',
    'SensorConfig',
]
