# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Indicators of a window, one file per family, listed in `registry`.

docs/extending/indicator.md shows how to add one.
"""

from vibration_monitor.indicators.family import OF_SOURCE, Family, Indicator
from vibration_monitor.indicators.registry import EXTRAS, FAMILIES, indicator_names, unit_of
from vibration_monitor.indicators.spectrum import OrderSpectrum
from vibration_monitor.indicators.window import Window

__all__ = [
    'EXTRAS',
    'FAMILIES',
    'OF_SOURCE',
    'Family',
    'Indicator',
    'OrderSpectrum',
    'Window',
    'indicator_names',
    'unit_of',
]
