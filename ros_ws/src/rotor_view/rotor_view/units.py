# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Display units of the view; an unknown unit stays unknown."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

from rotor_common.units import people_unit
from rotor_interfaces.channels import channel_unit, source_and_kind
from vibration_monitor.indicators import OF_SOURCE, registry

UNKNOWN = 'unit unknown'
"""Shown for a column whose unit the import did not know."""

_REFERENCES = {'m': (1e-9, '1 nm'), 'm/s^2': (1e-3, '1 mm/s^2'), UNKNOWN: (1e-3, '0.001')}


@dataclass(frozen=True)
class Units:
    """Units of one run; `unknown` are the channels whose unit is not known."""

    unknown: frozenset[str] = frozenset()

    @classmethod
    def from_config(cls, config: Mapping[str, Any]) -> Self:
        """Return the units that a `rotor/config` document states (`column_units`)."""
        told = config.get('column_units')
        if not isinstance(told, Mapping):
            return cls()
        return cls(frozenset(name for name, unit in told.items() if unit == 'unknown'))

    def of_channel(self, channel: str) -> tuple[str, float]:
        """Return the unit in which a channel is drawn, and the factor from SI to it."""
        if channel in self.unknown:
            return UNKNOWN, 1.0
        return people_unit(channel_unit(channel))

    def of_indicator(self, indicator: str) -> tuple[str, float]:
        """Return the unit in which an indicator is drawn, and the factor from SI to it."""
        known = registry.find(indicator)
        channel, _ = source_and_kind(indicator)
        if known is None or (known.unit == OF_SOURCE and channel in self.unknown):
            return UNKNOWN, 1.0
        return people_unit(registry.unit_of(indicator))

    def reference(self, channel: str) -> tuple[float, str]:
        """Return what 0 dB is: the amplitude in SI, and in words."""
        return _REFERENCES[UNKNOWN if channel in self.unknown else channel_unit(channel)]

    def decibels(self, channel: str) -> str:
        """Return the unit of the spectra of a channel."""
        words = f'dB re {self.reference(channel)[1]}'
        return f'{words}, {UNKNOWN}' if channel in self.unknown else words
