# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Settings of the monitor, and the names of its indicators."""

import difflib
import math
import re
from typing import Self

import pydantic

from rotor_interfaces.config import ConfigModel, quantity

WINDOW_INDICATORS = ('speed_rad_s', 'load_factor', 'load_factor_range')
"""Indicators of a whole window; all others belong to a channel: `disk_z/rms`."""

RATIO_ORDERS = (2.0, 3.0, 4.0, 2.5)
"""Orders whose amplitude is published relative to 1x."""

MAIN_LOBE_BINS = 4
"""Half width of the main lobe of the 4-term Blackman-Harris window."""

MAX_WINDOW_REVOLUTIONS = 512

_CHANNEL = re.compile(r'(?!load_)\w+_(?P<acceleration>a?)[yz]')
_ORDER_RANGE = (0.25, 50.0)


def is_channel(name: str) -> bool:
    """Say whether a column is a vibration channel: it ends in _y, _z (m), _ay or _az (m/s^2)."""
    return _CHANNEL.fullmatch(name) is not None


def is_acceleration(channel: str) -> bool:
    """Say whether a channel is an acceleration (m/s^2); the others are displacements (m)."""
    match = _CHANNEL.fullmatch(channel)
    return match is not None and match['acceleration'] == 'a'


def channel_indicators(orders: tuple[float, ...]) -> tuple[str, ...]:
    """Return the names of the indicators of one channel, without the channel, in fixed order."""
    tracked = [f'order_{order:g}' for order in orders] + ['ball_pass']
    names = [f'{what}_{order}' for order in tracked for what in ('amplitude', 'phase')]
    names += [f'ratio_{order:g}_1' for order in RATIO_ORDERS if order in orders]
    return (*names, 'ratio_denominator', 'rms', 'crest_factor', 'kurtosis')


def indicator_unit(name: str) -> str:
    """Return the unit of an indicator, '1' for a pure number."""
    if name == 'speed_rad_s':
        return 'rad/s'
    channel, _, kind = name.rpartition('/')
    if kind.startswith('phase'):
        return 'rad'
    if kind.startswith('amplitude') or kind in ('rms', 'ratio_denominator'):
        return 'm/s^2' if is_acceleration(channel) else 'm'
    return '1'


class AlarmRule(ConfigModel):
    """Two limits on one indicator; at or above a limit a window speaks for that level."""

    indicator: str = pydantic.Field(description='name of the indicator, such as disk_z/ratio_3_1')
    warn: float = quantity(unit='as indicator', gt=0.0, description='limit of level WARN')
    error: float = quantity(
        unit='as indicator', gt=0.0, description='limit of level ERROR, not below `warn`'
    )

    @pydantic.model_validator(mode='after')
    def _check(self) -> Self:
        if self.error < self.warn:
            raise ValueError(
                f'error = {self.error:g} is below warn = {self.warn:g} for {self.indicator}; '
                'allowed: warn or more'
            )
        return self


class AlarmConfig(ConfigModel):
    """When windows become an alarm: limits, N of M windows, hysteresis."""

    rules: tuple[AlarmRule, ...] = pydantic.Field(
        default=(
            AlarmRule(indicator='disk_z/ratio_2_1', warn=0.3, error=0.6),
            AlarmRule(indicator='disk_z/ratio_3_1', warn=0.5, error=2.0),
        ),
        description='limits, one rule an indicator; the worst rule gives the level',
    )
    required: int = quantity(
        3, unit='1', ge=1, le=100, description='windows (N) that must agree to change a level'
    )
    out_of: int = quantity(
        5, unit='1', ge=1, le=100, description='last windows (M) that are looked at'
    )
    release_ratio: float = quantity(
        0.8, unit='1', gt=0.0, le=1.0, description='a level ends below this part of its limit'
    )

    @pydantic.model_validator(mode='after')
    def _check(self) -> Self:
        if self.required > self.out_of:
            raise ValueError(
                f'required = {self.required} is more than out_of = {self.out_of}; '
                f'allowed: 1 to {self.out_of}'
            )
        if not self.rules:
            raise ValueError('rules is empty, so the alarm could never speak; give one or more')
        names = [rule.indicator for rule in self.rules]
        repeated = sorted({name for name in names if names.count(name) > 1})
        if repeated:
            raise ValueError(
                f'rules holds {repeated[0]} more than once; allowed: one rule an indicator'
            )
        return self


class MonitorConfig(ConfigModel):
    """What the monitor computes in each window, and when it raises an alarm."""

    window_revolutions: int = quantity(
        64,
        unit='1',
        ge=64,
        le=MAX_WINDOW_REVOLUTIONS,
        description='whole shaft revolutions in a window',
    )
    hop_revolutions: int = quantity(
        16,
        unit='1',
        ge=1,
        le=MAX_WINDOW_REVOLUTIONS,
        description='revolutions from one window to the next',
    )
    orders: tuple[float, ...] = pydantic.Field(
        default=(0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0),
        description='orders with amplitude and phase, rising, 0.25 to 50, 1 among them',
    )
    ball_pass_order: float = quantity(
        8 * 40.1 / (40.1 + 63.9),
        unit='1',
        ge=_ORDER_RANGE[0],
        le=_ORDER_RANGE[1],
        description='ball passes of a bearing in one revolution, N_b r_i / (r_i + r_o)',
    )
    displacement_floor_m: float = quantity(
        1e-7, unit='m', gt=0.0, le=1e-3, description='least denominator of displacement ratios'
    )
    acceleration_floor_m_s2: float = quantity(
        1e-2, unit='m/s^2', gt=0.0, le=1e3, description='least denominator of acceleration ratios'
    )
    spectrum_max_order: float = quantity(
        10.0, unit='1', ge=1.0, le=_ORDER_RANGE[1], description='highest order of the spectrum'
    )
    alarm: AlarmConfig = pydantic.Field(
        default=AlarmConfig(),
        description='limits, agreement of windows and hysteresis of the alarm',
    )

    @pydantic.field_validator('orders')
    @classmethod
    def _check_orders(cls, orders: tuple[float, ...]) -> tuple[float, ...]:
        low, high = _ORDER_RANGE
        for order in orders:
            if not low <= order <= high:
                raise ValueError(f'{order:g} is out of range; allowed: {low:g} to {high:g}')
            if float(f'{order:g}') != order:
                raise ValueError(f'{order!r} has more than 6 digits, too many for a name')
        if list(orders) != sorted(set(orders)):
            raise ValueError('the orders must rise and none may stand twice')
        if 1.0 not in orders:
            raise ValueError('1 is missing; the ratios are relative to the amplitude at order 1')
        return orders

    @pydantic.model_validator(mode='after')
    def _check(self) -> Self:
        if self.hop_revolutions > self.window_revolutions:
            raise ValueError(
                f'hop_revolutions = {self.hop_revolutions} would leave revolutions unseen; '
                f'allowed: 1 to window_revolutions = {self.window_revolutions}'
            )
        for order in self.orders:
            self._check_separation(order)
        for rule in self.alarm.rules:
            self._check_indicator(rule.indicator)
        return self

    def _check_separation(self, order: float) -> None:
        distance = abs(order - self.ball_pass_order)
        if distance * self.window_revolutions >= MAIN_LOBE_BINS:
            return
        needed = math.ceil(MAIN_LOBE_BINS / distance) if distance else math.inf
        remedy = (
            f'use window_revolutions = {needed:g} or more'
            if needed <= MAX_WINDOW_REVOLUTIONS
            else f'take {order:g} out of orders'
        )
        raise ValueError(
            f'ball_pass_order = {self.ball_pass_order:g} cannot be told from order {order:g} in '
            f'{self.window_revolutions} revolutions; {remedy}'
        )

    def _check_indicator(self, name: str) -> None:
        channel, _, kind = name.rpartition('/')
        known = channel_indicators(self.orders) if channel else WINDOW_INDICATORS
        if kind in known and (not channel or is_channel(channel)):
            return
        if channel and not is_channel(channel):
            why = f'{channel!r} is no channel name (it must end in _y, _z, _ay or _az)'
        else:
            close = difflib.get_close_matches(kind, known, n=1)
            why = f'did you mean {close[0]!r}?' if close else f'allowed: {", ".join(known)}'
        raise ValueError(f'alarm.rules names an unknown indicator {name!r}; {why}')
