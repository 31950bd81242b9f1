# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Names and units of the indicators."""

from collections.abc import Sequence

from rotor_interfaces.channels import channel_unit, is_acceleration

WINDOW_INDICATORS = ('speed_rad_s', 'load_factor', 'load_factor_range')
"""Indicators of a whole window; all others belong to a channel or a plane: `disk_z/rms`."""

CRACK_INDICATORS = (
    'crack_ratio',
    'crack_ratio_low',
    'crack_angle',
    'crack_reference_ratio_low',
)
"""Indicators of the whole window that the extra `crack` adds, see `crack.CrackFindings`."""

EXTRAS = (
    'spectrum', 'statistics', 'whirl', 'average', 'orbit', 'envelope', 'passage', 'trend', 'crack'
)  # fmt: skip
"""What can be computed beside the vectors and their ratios; docs/indicators.md explains each."""

RATIO_ORDERS = (2.0, 3.0, 4.0, 2.5)
"""Orders whose amplitude is published relative to 1x."""

PASSAGE_ORDERS = (2.0, 3.0, 4.0)
"""Orders n whose passage through critical speed / n is watched."""

TREND_ORDERS = (1.0, 2.0, 3.0)
"""Orders whose dependence on the load factor is published."""

ENVELOPE_LINES = ('cage', 'ball_pass_outer', 'ball_pass_inner')
"""Lines of a rolling bearing that are looked for in the envelope of an acceleration."""


def window_indicators(extras: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the indicators of a whole window, in fixed order."""
    return WINDOW_INDICATORS + (CRACK_INDICATORS if 'crack' in extras else ())


def channel_indicators(
    channel: str, orders: Sequence[float], extras: Sequence[str]
) -> tuple[str, ...]:
    """Return the names of the indicators of one channel, without the channel, in fixed order."""
    tracked = [f'order_{order:g}' for order in orders] + ['ball_pass']
    names = [f'{what}_{order}' for order in tracked for what in ('amplitude', 'phase')]
    names += [f'ratio_{order:g}_1' for order in RATIO_ORDERS if order in orders]
    names += ['ratio_denominator', 'mean']
    if 'statistics' in extras:
        names += ['rms', 'crest_factor', 'kurtosis']
    if 'envelope' in extras and is_acceleration(channel):
        names += [
            f'envelope_{what}_{line}' for line in ENVELOPE_LINES for what in ('line', 'prominence')
        ]
    if 'average' in extras:
        names += ['synchronous_rms', 'residual_rms']
    if 'passage' in extras:
        names += [
            f'passage_{what}_order_{order:g}'
            for order in PASSAGE_ORDERS
            if order in orders
            for what in ('amplitude', 'speed')
        ]
    if 'trend' in extras:
        names += [
            f'load_{what}_order_{order:g}'
            for order in TREND_ORDERS
            if order in orders
            for what in ('slope', 'slope_error')
        ]
    return tuple(names)


def plane_indicators(orders: Sequence[float], extras: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the indicators of one plane, without the plane, in fixed order."""
    names = []
    if 'whirl' in extras:
        names += [f'{what}_order_{order:g}' for order in orders for what in ('forward', 'backward')]
    if 'orbit' in extras:
        names += ['orbit_turns', 'orbit_crossings', 'orbit_axis_ratio']
    return tuple(names)


def indicator_unit(name: str) -> str:
    """Return the unit of an indicator, '1' for a pure number."""
    channel, _, kind = name.rpartition('/')
    if kind == 'speed_rad_s' or kind.startswith('passage_speed'):
        return 'rad/s'
    if kind.startswith('phase') or kind == 'crack_angle':
        return 'rad'
    if kind.startswith(_WITH_UNIT_OF_CHANNEL) or kind in _EXACT:
        return channel_unit(channel)
    return '1'


_WITH_UNIT_OF_CHANNEL = (
    'amplitude',
    'forward',
    'backward',
    'envelope_line',
    'passage_amplitude',
    'load_slope',
)
_EXACT = ('mean', 'rms', 'ratio_denominator', 'synchronous_rms', 'residual_rms')
