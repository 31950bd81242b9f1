# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Orders, indicators and alarm of a rotor from its waveform; the pure part needs no ROS.

The names are loaded when first used (PEP 562): the recorder needs none of the monitor's scipy.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vibration_monitor.config import AlarmConfig, AlarmRule, MonitorConfig
    from vibration_monitor.detection import AlarmState, Level, RuleJudge
    from vibration_monitor.errors import MonitorError, RecordingError
    from vibration_monitor.indicators import OrderSpectrum
    from vibration_monitor.monitor import IndicatorRecord, VibrationMonitor

_MODULE_OF = {
    'AlarmConfig': 'config',
    'AlarmRule': 'config',
    'AlarmState': 'detection',
    'IndicatorRecord': 'monitor',
    'Level': 'detection',
    'MonitorConfig': 'config',
    'MonitorError': 'errors',
    'OrderSpectrum': 'indicators',
    'RecordingError': 'errors',
    'RuleJudge': 'detection',
    'VibrationMonitor': 'monitor',
}

__all__ = [
    'AlarmConfig',
    'AlarmRule',
    'AlarmState',
    'IndicatorRecord',
    'Level',
    'MonitorConfig',
    'MonitorError',
    'OrderSpectrum',
    'RecordingError',
    'RuleJudge',
    'VibrationMonitor',
]


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    return getattr(importlib.import_module(f'{__name__}.{_MODULE_OF[name]}'), name)
