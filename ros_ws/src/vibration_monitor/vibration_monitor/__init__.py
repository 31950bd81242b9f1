# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Orders, indicators and alarm of a rotor from its waveform; the pure part needs no ROS."""

from vibration_monitor.config import AlarmConfig, AlarmRule, MonitorConfig
from vibration_monitor.detection import AlarmState, Detector, Level
from vibration_monitor.errors import MonitorError, RecordingError
from vibration_monitor.indicators import OrderSpectrum
from vibration_monitor.monitor import IndicatorRecord, VibrationMonitor

__all__ = [
    'AlarmConfig',
    'AlarmRule',
    'AlarmState',
    'Detector',
    'IndicatorRecord',
    'Level',
    'MonitorConfig',
    'MonitorError',
    'OrderSpectrum',
    'RecordingError',
    'VibrationMonitor',
]
