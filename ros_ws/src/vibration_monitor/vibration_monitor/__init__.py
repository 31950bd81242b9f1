# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Orders, indicators and alarm of a rotor from its waveform; needs no ROS except for the node.

The names are loaded when first used (PEP 562): the recorder needs none of the monitor's scipy.
"""

from typing import TYPE_CHECKING

from rotor_common.lazy_names import lazy_names

if TYPE_CHECKING:
    from vibration_monitor.detection import AlarmState, Level, RuleJudge
    from vibration_monitor.errors import MonitorError
    from vibration_monitor.indicators import OrderSpectrum
    from vibration_monitor.monitor import IndicatorRecord, VibrationMonitor
    from vibration_monitor.monitor_config import AlarmConfig, AlarmRule, MonitorConfig

__all__ = [
    'AlarmConfig',
    'AlarmRule',
    'AlarmState',
    'IndicatorRecord',
    'Level',
    'MonitorConfig',
    'MonitorError',
    'OrderSpectrum',
    'RuleJudge',
    'VibrationMonitor',
]

__getattr__ = lazy_names(
    __name__,
    {
        'AlarmConfig': 'vibration_monitor.monitor_config',
        'AlarmRule': 'vibration_monitor.monitor_config',
        'AlarmState': 'vibration_monitor.detection',
        'IndicatorRecord': 'vibration_monitor.monitor',
        'Level': 'vibration_monitor.detection',
        'MonitorConfig': 'vibration_monitor.monitor_config',
        'MonitorError': 'vibration_monitor.errors',
        'OrderSpectrum': 'vibration_monitor.indicators',
        'RuleJudge': 'vibration_monitor.detection',
        'VibrationMonitor': 'vibration_monitor.monitor',
    },
)
