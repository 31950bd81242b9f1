# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The columns of the rig's waveform, in one table, and the vibration channels of any waveform."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

Kind = Literal['clock', 'shaft', 'displacement', 'acceleration', 'load']
_UNITS: dict[str, str] = {'displacement': 'm', 'acceleration': 'm/s^2'}


@dataclass(frozen=True)
class Channel:
    """A column of a waveform: what it holds, where it is measured, and by which sensors."""

    name: str
    unit: str
    kind: Kind
    place: str = ''
    """Name of the place to show; '' for a column without one."""
    direction: str = ''
    noise_group: str = ''
    """Key of its sensors in the configuration; '' if no sensor with noise measures it."""
    dtype: str = '<f4'


def _vibrations(kind: Kind, noise_group: str, places: dict[str, str]) -> tuple[Channel, ...]:
    """Return the y and z channels of each place; `places` maps name prefixes to places."""
    return tuple(
        Channel(f'{start}{direction}', _UNITS[kind], kind, place, direction, noise_group)
        for start, place in places.items()
        for direction in 'yz'
    )


CHANNELS = (
    Channel('time', 's', 'clock', dtype='<f8'),
    Channel('sample', '1', 'clock', dtype='<f8'),
    Channel('angle', 'rad', 'shaft', dtype='<f8'),
    *_vibrations(
        'displacement', 'proximity', {'disk_': 'disk', 'brg1_': 'bearing 1', 'brg2_': 'bearing 2'}
    ),
    *_vibrations('acceleration', 'accelerometers', {'brg1_a': 'bearing 1', 'brg2_a': 'bearing 2'}),
    Channel('keyphasor', 'V', 'shaft', noise_group='keyphasor'),
    Channel('load_y', 'm/s^2', 'load', direction='y', noise_group='load'),
)
"""The columns of the rig, in their order: those of float64 first, y and z of a place together."""

COLUMN_UNITS = {channel.name: channel.unit for channel in CHANNELS}
DISPLACEMENT_COLUMNS = tuple(c.name for c in CHANNELS if c.kind == 'displacement')
ACCELERATION_COLUMNS = tuple(c.name for c in CHANNELS if c.kind == 'acceleration')
CHANNEL_COLUMNS = DISPLACEMENT_COLUMNS + ACCELERATION_COLUMNS
"""The vibration channels."""

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
    """Split the name of an indicator, `disk_z/rms`; one of a window has the source ''."""
    source, _, kind = name.rpartition('/')
    return source, kind


def shown_channel(names: Iterable[str]) -> str:
    """Return the channel to show: SHOWN_CHANNEL, else the first; '' for none.

    `names` are columns or indicators; those that belong to no channel are ignored.
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
    return _UNITS['acceleration' if is_acceleration(channel) else 'displacement']
