# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The alarm: limits on indicators, N of M windows, hysteresis."""

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

from vibration_monitor.indicators.registry import unit_of
from vibration_monitor.monitor_config import AlarmConfig, AlarmRule
from vibration_monitor.persistence import Persistence

CANNOT_JUDGE = 'cannot judge'
"""The text shown for STALE."""


class Level(enum.IntEnum):
    """Levels with the numbers of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3
    """Cannot judge: there is no evidence for a fault, and none for a sound machine."""


@dataclass(frozen=True)
class AlarmState:
    """Level of the alarm and why: one sentence for each rule that is not OK."""

    level: Level
    reasons: tuple[str, ...] = ()

    @classmethod
    def cannot_judge(cls, why: str) -> Self:
        """Return the state STALE, with the reason."""
        return cls(Level.STALE, (f'{CANNOT_JUDGE}: {why}',))


class RuleJudge:
    """Judges the rules of `config` window after window.

    A level is reached when N of the last M windows are at or above its limit, and left when N
    of them are below release_ratio times the limit; a rule is OK once N of them were below WARN.
    A NaN counts neither for nor against, nor does a doubtful value below the limits: it cannot
    vouch for a sound machine. A rule without a value that counts in M windows is STALE, with the
    reason; the level found before returns with the next values. WARN or ERROR of one rule outranks
    STALE of another, STALE outranks OK.
    """

    def __init__(self, config: AlarmConfig) -> None:
        self._rules = [_RuleState(rule, config) for rule in config.rules]
        self.state = AlarmState.cannot_judge('no window is complete yet')

    def update(
        self, indicators: Mapping[str, float], doubts: Mapping[str, str] | None = None
    ) -> AlarmState:
        """Take the indicators of the next window and the doubts about them; return the state."""
        for rule in self._rules:
            if rule.name in indicators:
                rule.update(indicators[rule.name], (doubts or {}).get(rule.name, ''))
            else:
                rule.update(math.nan, 'the stream does not have it')
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
        self._last = Persistence(config.required, config.out_of)
        self._reached = dict.fromkeys(self._limits, False)
        self._vouched = False
        self._doubt = ''

    def update(self, value: float, doubt: str) -> None:
        self._doubt = doubt
        last = self._last
        last.update(math.nan if doubt and value < self._limits[Level.WARN] else value)
        for level, limit in self._limits.items():
            if last.reached >= limit:
                self._reached[level] = True
            elif last.undercut < self._config.release_ratio * limit:
                self._reached[level] = False
        if last.undercut < self._limits[Level.WARN]:
            self._vouched = True
        elif not last.numbers:
            self._vouched = False

    def _found(self) -> Level | None:
        """Return the highest level that has been reached and not left."""
        return max((level for level in self._limits if self._reached[level]), default=None)

    def level(self) -> Level:
        if not self._last.numbers:
            return Level.STALE
        return self._found() or (Level.OK if self._vouched else Level.STALE)

    def reason(self) -> str:
        level = self.level()
        if level is Level.STALE:
            return self._why_stale()
        limit = self._limits[level]
        unit = unit_of(self.name)
        suffix = '' if unit == '1' else f' {unit}'
        last = self._last
        text = f'{self.name} = {last.numbers[-1]:.4g}{suffix}: '
        if last.reached >= limit:
            high = sum(value >= limit for value in last.numbers)
            return text + (
                f'{high} of the last {len(last.values)} windows reach the {level.name} limit '
                f'{limit:g}{suffix}'
            )
        return text + (
            f'{level.name} stays until {self._config.required} of {self._config.out_of} windows '
            f'are below {self._config.release_ratio * limit:.4g}{suffix}'
        )

    def _why_stale(self) -> str:
        last = self._last
        why = self._doubt or f'no valid value in the last {len(last.values)} windows'
        if last.numbers:
            why = f'{len(last.numbers)} of the {self._config.required} windows that it takes'
        text = f'{CANNOT_JUDGE}: {self.name}: {why}'
        found = self._found()
        return f'{text}; {found.name} was found before and is not refuted' if found else text
