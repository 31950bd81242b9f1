# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Configuration of the monitor."""

import difflib
import math
from collections.abc import Mapping
from typing import Annotated, Any, Self

import pydantic

from rotor_common.configuration import ConfigModel, quantity
from rotor_common.errors import ConfigError
from rotor_interfaces.channels import is_channel, source_and_kind
from vibration_monitor.crack_model import CrackConfig
from vibration_monitor.errors import MonitorError
from vibration_monitor.indicators.registry import (
    EXTRAS,
    GROUP,
    chosen,
    family_of,
    is_loaded,
    kinds,
)
from vibration_monitor.spectrum import MAIN_LOBE_BINS

MAX_WINDOW_REVOLUTIONS = 512
MAX_CHANNELS = 64


def _check_extra(extra: str) -> str:
    try:
        family_of(extra)
    except MonitorError as error:
        raise MonitorError(f'{extra!r} is not allowed; {error}') from None
    return extra


Extra = Annotated[str, pydantic.AfterValidator(_check_extra)]
"""Name of a family of indicators, see `indicators.registry`."""

_ORDER_RANGE = (0.25, 50.0)


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
        default=(AlarmRule(indicator='crack_ratio_low', warn=0.005, error=0.02),),
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

    channels: tuple[str, ...] = pydantic.Field(
        default=(),
        max_length=MAX_CHANNELS,
        description='channels to use, such as disk_z; empty: all that the waveform has',
    )
    extras: tuple[Extra, ...] = pydantic.Field(
        default=('spectrum', 'statistics', 'whirl', 'orbit', 'crack'),
        description='what to compute beside the amplitudes, phases and ratios of the orders',
    )
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
        8 * 0.0401 / (0.0401 + 0.0639),
        unit='1',
        ge=_ORDER_RANGE[0],
        le=_ORDER_RANGE[1],
        description='ball passes of a bearing in one revolution, N_b r_i / (r_i + r_o)',
    )
    ball_count: int = quantity(8, unit='1', ge=3, le=100, description='balls of a bearing')
    envelope_band_hz: tuple[float, float] = pydantic.Field(
        default=(1000.0, 4000.0),
        description='band of the acceleration whose envelope is looked at, in Hz',
    )
    critical_speed_rad_s: float | None = quantity(
        None,
        unit='rad/s',
        gt=0.0,
        le=1e5,
        description='critical speed whose parts 1/2, 1/3, 1/4 the extra `passage` watches',
    )
    trend_windows: int = quantity(
        40, unit='1', ge=6, le=1000, description='windows that the extra `trend` looks back'
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
    crack: CrackConfig = pydantic.Field(
        default=CrackConfig(), description='what the extra `crack` must know of the rotor'
    )
    alarm: AlarmConfig = pydantic.Field(
        default=AlarmConfig(),
        description='limits, agreement of windows and hysteresis of the alarm',
    )

    @classmethod
    def of_run(cls, config: Mapping[str, Any] | None) -> Self:
        """Return the settings of a run from its `rotor/config`; the defaults where it has none.

        Raises:
            ConfigError: this version refuses the settings, or they name a module of indicators
                that is not loaded: a recording does not choose what is imported.

        """
        scenario = (config or {}).get('scenario')
        monitor = scenario.get('monitor') if isinstance(scenario, Mapping) else None
        extras = monitor.get('extras') if isinstance(monitor, Mapping) else None
        for extra in extras if isinstance(extras, list) else []:
            if isinstance(extra, str) and ':' in extra and not is_loaded(extra):
                raise ConfigError(
                    f'monitor.extras = {extra!r} names a module, and what a recording names is '
                    f'not imported; install it under a name (entry points of {GROUP})'
                )
        return cls.from_mapping({} if monitor is None else monitor, 'monitor')

    @pydantic.field_validator('channels')
    @classmethod
    def _check_channels(cls, channels: tuple[str, ...]) -> tuple[str, ...]:
        for name in channels:
            if not is_channel(name):
                raise ValueError(f'{name!r} {_NO_CHANNEL}')
        _check_unique(channels)
        return channels

    @pydantic.field_validator('extras')
    @classmethod
    def _check_extras(cls, extras: tuple[Extra, ...]) -> tuple[Extra, ...]:
        _check_unique(extras)
        return extras

    @pydantic.field_validator('envelope_band_hz')
    @classmethod
    def _check_band(cls, band_hz: tuple[float, float]) -> tuple[float, float]:
        low, high = band_hz
        if not 0 < low < high:
            raise ValueError(f'{low:g} to {high:g} Hz is no band; it must rise from above 0')
        return band_hz

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
            raise ValueError('the orders must rise and none may be given twice')
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
        for family in chosen(self.extras):
            if refusal := family.refusal(self):
                raise ValueError(refusal)
        for order in self.orders:
            self._check_separation(order)
        if 'alarm' in self.model_fields_set or 'crack' in self.extras:
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
        source, kind = source_and_kind(name)
        known = kinds(source, self.orders, self.extras)
        every = kinds(source, self.orders, EXTRAS)
        if kind in known:
            needed = [source] if is_channel(source) else [f'{source}_y', f'{source}_z']
            missing = [channel for channel in needed if channel not in self.channels]
            if not self.channels or not source or not missing:
                return
            why = f'channels does not hold {missing[0]!r}'
        elif source and not is_channel(source) and kind not in every:
            why = f'{source!r} {_NO_CHANNEL}'
        elif kind in every:
            extra = next(e for e in EXTRAS if kind in kinds(source, self.orders, (e,)))
            why = f'add {extra!r} to extras'
        else:
            close = difflib.get_close_matches(kind, known, n=1)
            why = f'did you mean {close[0]!r}?' if close else f'allowed: {", ".join(known)}'
        raise ValueError(f'alarm.rules names an unknown indicator {name!r}; {why}')


_NO_CHANNEL = 'is no channel name (it must end in _y, _z, _ay or _az)'


def _check_unique(names: tuple[str, ...]) -> None:
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise ValueError(f'{repeated[0]!r} is given more than once')
