# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Indicators over the flight; those of the alarm rules with their limits."""

import math
from collections.abc import Mapping, Sequence

from rotor_interfaces.channels import shown_channel, source_and_kind
from rotor_view import style
from rotor_view.curves import Curves
from rotor_view.style import Series
from rotor_view.units import Units
from vibration_monitor.detection import Level
from vibration_monitor.indicators.registry import find
from vibration_monitor.monitor_config import AlarmRule

_AMPLITUDES = tuple(f'amplitude_order_{order}' for order in (1, 2, 3))


def value_path(indicator: str) -> str:
    """Return the entity of the indicator that a rule judges."""
    return f'{style.RULES}/{indicator}'


def limits_path(indicator: str) -> str:
    """Return the entity of the limits of a rule."""
    return f'{style.LIMITS}/{indicator}'


class Indicators:
    """Draws the indicators of one run, window after window."""

    def __init__(self, curves: Curves) -> None:
        self.channel = ''
        """The channel shown: chosen from the first window, '' before it."""
        self._curves = curves
        self._rules: Sequence[AlarmRule] = ()
        self._units = Units()

    def judge_by(self, rules: Sequence[AlarmRule], units: Units) -> None:
        """Draw these rules with their limits from here on, in these units."""
        if (tuple(rules), units) == (tuple(self._rules), self._units):
            return
        self._rules, self._units = rules, units
        for rule in rules:
            unit, factor = units.of_indicator(rule.indicator)
            suffix = '' if unit == '1' else f' {unit}'
            value = Series(rule.indicator, style.RULE_COLOUR, width=2.5)
            limits = [
                Series(f'{level.name} {limit * factor:.6g}{suffix}', style.LEVEL_COLOURS[level])
                for level, limit in ((Level.WARN, rule.warn), (Level.ERROR, rule.error))
            ]
            self._curves.declare(value_path(rule.indicator), [value])
            self._curves.declare(limits_path(rule.indicator), limits)
            self._add_limits(rule, 0)

    def add(self, offset_ns: int, values: Mapping[str, float]) -> None:
        """Draw one window (SI); a rule's indicator that it lacks is NaN."""
        self.channel = self.channel or shown_channel(values)
        for rule in self._rules:
            value = values.get(rule.indicator, math.nan)
            self._add_scaled(value_path(rule.indicator), offset_ns, {rule.indicator: value})
            self._add_limits(rule, offset_ns)
        amplitudes = {
            f'{self.channel}/{kind}': values[f'{self.channel}/{kind}']
            for kind in _AMPLITUDES
            if f'{self.channel}/{kind}' in values
        }
        if amplitudes:
            self._add_scaled(style.amplitudes(self.channel), offset_ns, amplitudes)
        for path, group in _groups(values).items():
            self._curves.add(path, offset_ns, [*group], [*group.values()])

    def _add_limits(self, rule: AlarmRule, offset_ns: int) -> None:
        factor = self._units.of_indicator(rule.indicator)[1]
        limits = [rule.warn * factor, rule.error * factor]
        self._curves.add(limits_path(rule.indicator), offset_ns, ['warn', 'error'], limits)

    def _add_scaled(self, path: str, offset_ns: int, values: Mapping[str, float]) -> None:
        """Draw values in display units, under the names of their kinds."""
        scaled = [value * self._units.of_indicator(name)[1] for name, value in values.items()]
        kinds = [source_and_kind(name)[1] for name in values]
        self._curves.add(path, offset_ns, kinds, scaled)


def _groups(values: Mapping[str, float]) -> dict[str, dict[str, float]]:
    """Return the indicators by entity: `disk_z/ratio_3_1` goes to disk_z/ratio."""
    groups: dict[str, dict[str, float]] = {}
    for name, value in values.items():
        source, kind = source_and_kind(name)
        known = find(name)
        path = [style.INDICATORS, source, known.curves if known else 'other']
        groups.setdefault('/'.join(filter(None, path)), {})[kind] = value
    return groups
