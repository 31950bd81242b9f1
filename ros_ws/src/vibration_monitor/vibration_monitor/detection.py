# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""From indicators to an alarm: limits, agreement of N of M windows, hysteresis."""

import enum
import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

from vibration_monitor.config import AlarmConfig, AlarmRule
from vibration_monitor.names import indicator_unit


class Level(enum.IntEnum):
    """Levels with the numbers of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True)
class AlarmState:
    """Level of the alarm and why: one sentence for each rule that is not OK."""

    level: Level
    reasons: tuple[str, ...] = ()

    @classmethod
    def unknown(cls) -> Self:
        """Return the state before any window."""
        return cls(Level.STALE, ('no window has been judged yet',))


class RuleJudge:
    """Judges the rules of `config` window after window.

    A level is reached when N of the last M windows are at or above its limit, and left when N
    of them are below release_ratio times the limit. A NaN speaks neither for nor against; a rule
    without any number in M windows is STALE, and what it had found comes back with the numbers.
    WARN or ERROR of one rule goes before STALE of another, STALE before OK.
    """

    def __init__(self, config: AlarmConfig) -> None:
        self._rules = [_RuleState(rule, config) for rule in config.rules]
        self.state = AlarmState.unknown()

    def update(self, indicators: Mapping[str, float]) -> AlarmState:
        """Take the indicators of the next window (a missing one is NaN); return the state."""
        for rule in self._rules:
            rule.update(indicators.get(rule.name, math.nan))
        levels = [rule.level() for rule in self._rules]
        found = [level for level in levels if level is not Level.STALE]
        worst = max(found, default=Level.STALE)
        if worst is Level.OK and Level.STALE in levels:
            worst = Level.STALE
        reasons = (rule.reason() for rule in self._rules if rule.level() is not Level.OK)
        self.state = AlarmState(worst, tuple(reasons))
        return self.state


class _RuleState:
    """What the last M windows say about one rule."""

    def __init__(self, rule: AlarmRule, config: AlarmConfig) -> None:
        self.name = rule.indicator
        self._limits = {Level.WARN: rule.warn, Level.ERROR: rule.error}
        self._config = config
        self._values: deque[float] = deque(maxlen=config.out_of)
        self._reached = dict.fromkeys(self._limits, False)

    def update(self, value: float) -> None:
        self._values.append(value)
        for level, limit in self._limits.items():
            if self._count_high(limit) >= self._config.required:
                self._reached[level] = True
            elif self._count_low(limit) >= self._config.required:
                self._reached[level] = False

    def _count_high(self, limit: float) -> int:
        return sum(value >= limit for value in self._values)

    def _count_low(self, limit: float) -> int:
        return sum(value < self._config.release_ratio * limit for value in self._values)

    def level(self) -> Level:
        if all(math.isnan(value) for value in self._values):
            return Level.STALE
        return max((level for level in self._limits if self._reached[level]), default=Level.OK)

    def reason(self) -> str:
        level = self.level()
        windows = len(self._values)
        if level is Level.STALE:
            return f'{self.name} has no valid value in the last {windows} windows'
        limit = self._limits[level]
        unit = indicator_unit(self.name)
        suffix = '' if unit == '1' else f' {unit}'
        last = [value for value in self._values if not math.isnan(value)][-1]
        text = f'{self.name} = {last:.4g}{suffix}: '
        high = self._count_high(limit)
        if high >= self._config.required:
            return text + (
                f'{high} of the last {windows} windows reach the {level.name} limit '
                f'{limit:g}{suffix}'
            )
        return text + (
            f'{level.name} stays until {self._config.required} of {self._config.out_of} windows '
            f'are below {self._config.release_ratio * limit:.4g}{suffix}'
        )
