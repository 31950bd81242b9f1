# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Vibration channels of a waveform: names, units and planes."""

import re
from collections.abc import Iterable, Sequence

from rotor_interfaces.waveform import CHANNEL_COLUMNS

SHOWN_CHANNEL = 'disk_z'
"""Across the load: where a breathing crack shows first."""

_CHANNEL = re.compile(r'(?!load_)\w+_(?P<acceleration>a?)[yz]')


def is_channel(name: str) -> bool:
    """Say whether a column is a vibration channel: it ends in _y, _z (m), _ay or _az (m/s^2)."""
    return _CHANNEL.fullmatch(name) is not None


def channels_of(columns: tuple[str, ...], chosen: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Return the vibration channels among the columns: those of the contract, then others.

    With `chosen`: those in this order, whether the columns hold them or not.
    """
    if chosen:
        return chosen
    known = [name for name in CHANNEL_COLUMNS if name in columns]
    return (*known, *sorted(n for n in columns if is_channel(n) and n not in CHANNEL_COLUMNS))


def is_acceleration(channel: str) -> bool:
    """Say whether a channel is an acceleration (m/s^2); the others are displacements (m)."""
    match = _CHANNEL.fullmatch(channel)
    return match is not None and match['acceleration'] == 'a'


def source_and_kind(name: str) -> tuple[str, str]:
    """Split the name of an indicator, `disk_z/rms`; its source is '' where it is of a window."""
    source, _, kind = name.rpartition('/')
    return source, kind


def shown_channel(names: Iterable[str]) -> str:
    """Return the channel that people are shown: SHOWN_CHANNEL, else the first; '' for none.

    `names` are columns or indicators; what belongs to no channel among them does not count.
    """
    channels = [c for c in (name.partition('/')[0] for name in names) if is_channel(c)]
    return SHOWN_CHANNEL if SHOWN_CHANNEL in channels else next(iter(channels), '')


def planes_of(channels: Sequence[str]) -> tuple[str, ...]:
    """Return the planes measured in both directions, in the order of their y channels."""
    displacements = [name for name in channels if not is_acceleration(name)]
    return tuple(
        name.removesuffix('_y')
        for name in displacements
        if name.endswith('_y') and f'{name.removesuffix("_y")}_z' in displacements
    )


def channel_unit(channel: str) -> str:
    """Return the unit of a vibration channel, 'm' or 'm/s^2'."""
    return 'm/s^2' if is_acceleration(channel) else 'm'
