# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The sensors: configuration, presets, IMU; `chain` measures and is slow to import (numba)."""

from rotor_sim.sensors.imu import ImuDecimator, ImuSample
from rotor_sim.sensors.instrument import Instrument
from rotor_sim.sensors.presets import PRESETS
from rotor_sim.sensors.sensor_config import SensorConfig

__all__ = [
    'PRESETS',
    'ImuDecimator',
    'ImuSample',
    'Instrument',
    'SensorConfig',
]
