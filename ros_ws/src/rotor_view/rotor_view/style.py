# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Names, units, colours and entity paths of everything that the view shows."""

from collections.abc import Sequence
from dataclasses import dataclass

from rotor_interfaces.channels import CHANNELS, is_acceleration, is_channel

APPLICATION_ID = 'cracked_rotor_rig'
TIMELINE = 'flight_time'
"""Seconds since sample 0 of the run."""

EXAGGERATION = 1000.0
"""Displacements in the 3-D rig are drawn this many times larger than they are."""

Colour = tuple[int, int, int]

AMBER: Colour = (255, 200, 60)
BLUE: Colour = (90, 170, 255)
DIM_BLUE: Colour = (60, 95, 150)
GREEN: Colour = (60, 170, 90)
GREY: Colour = (140, 145, 155)
MAGENTA: Colour = (235, 90, 190)
ORANGE: Colour = (255, 140, 60)
PALE: Colour = (200, 205, 215)
RED: Colour = (225, 60, 60)
STEEL: Colour = (150, 160, 175)
TEAL: Colour = (60, 200, 190)
VIOLET: Colour = (160, 130, 255)
LIME: Colour = (165, 210, 70)


@dataclass(frozen=True)
class Series:
    """Name and style of a curve; hidden ones are only in the legend. Width in ui points."""

    name: str
    colour: Colour
    width: float = 1.5
    shown: bool = True


LOAD = 'load/maneuver'
LOAD_SENSOR = 'load/airframe_sensor'
SPEED = 'shaft/speed'
TRUTH = 'truth/others'
CRACK_NAME = 'crack_stiffness_ratio'
CRACK_TRUTH = f'truth/{CRACK_NAME}'
WAVEFORM = 'waveform'
DISPLACEMENT = f'{WAVEFORM}/disk'
ACCELERATION = f'{WAVEFORM}/brg1_acceleration'
INDICATORS = 'indicators'
WINDOW_SPEED = f'{INDICATORS}/speed'
AMPLITUDES = 'amplitudes'
RULES = 'alarm_rules'
LIMITS = 'alarm_limits'
BY_WINDOW = (f'{INDICATORS}/', f'{AMPLITUDES}/', f'{RULES}/')
"""Entities with one number a window: each number has a marker."""

SPECTRUM = 'spectrum'
SPECTROGRAM = 'spectrogram'
ALARM_LEVEL = 'alarm/level'
ALARM_SENTENCE = 'alarm/sentence'
LOG = 'log'
ORBIT = 'orbit'
RIG = 'rig'

SERIES: dict[str, tuple[Series, ...]] = {
    LOAD: (
        Series('load factor', AMBER),
        Series('lateral load factor', GREY, shown=False),
    ),
    LOAD_SENSOR: (Series('airframe sensor', DIM_BLUE, width=4.0),),
    SPEED: (Series('speed', LIME),),
    WINDOW_SPEED: (Series('mean speed of a window', LIME),),
    CRACK_TRUTH: (Series('crack stiffness ratio K', RED),),
}
"""Curves whose number is fixed."""

_COLOURS = {
    ('disk', 'y'): BLUE,
    ('disk', 'z'): ORANGE,
    ('bearing 1', 'y'): TEAL,
    ('bearing 1', 'z'): MAGENTA,
    ('bearing 2', 'y'): GREEN,
    ('bearing 2', 'z'): VIOLET,
}

BY_NAME: dict[str, Series] = {
    **{
        channel.name: Series(
            f'{channel.place} {channel.direction}', _COLOURS[channel.place, channel.direction]
        )
        for channel in CHANNELS
        if channel.place
    },
    'ratio_2_1': Series('A2/A1', TEAL),
    'ratio_3_1': Series('A3/A1', MAGENTA),
    'ratio_4_1': Series('A4/A1', VIOLET),
    'ratio_2.5_1': Series('A2.5/A1', LIME),
    'amplitude_order_1': Series('1x', TEAL),
    'amplitude_order_2': Series('2x', MAGENTA),
    'amplitude_order_3': Series('3x', VIOLET),
}
"""Curves that depend on what the messages carry, by column or indicator name."""

PALETTE = (BLUE, ORANGE, TEAL, MAGENTA, LIME, VIOLET, AMBER, GREEN, RED, GREY)
"""For names that are not declared."""

RULE_COLOUR = BLUE
SPECTRUM_COLOUR = ORANGE
ORBIT_COLOUR = ORANGE
ORBIT_MARK_COLOUR = PALE
CRACK_COLOUR = RED
LOAD_COLOUR = AMBER

LEVELS = ('OK', 'WARN', 'ERROR', 'STALE')
LEVEL_COLOURS = (GREEN, (235, 170, 40), RED, GREY)


def channel_name(channel: str) -> str:
    """Return the displayed name of a channel, `disk z`; undeclared ones keep their column name."""
    return BY_NAME[channel].name if channel in BY_NAME else channel


def channel_groups(columns: Sequence[str]) -> dict[str, list[str]]:
    """Return the channels by entity: `disk`, `brg1`, `brg1_acceleration` and so on."""
    groups: dict[str, list[str]] = {}
    for name in filter(is_channel, columns):
        point = name.rpartition('_')[0]
        path = f'{WAVEFORM}/{point}' + ('_acceleration' if is_acceleration(name) else '')
        groups.setdefault(path, []).append(name)
    return groups


def ratios(channel: str) -> str:
    """Return the entity of the amplitudes of a channel over that at 1x."""
    return f'{INDICATORS}/{channel}/ratio'


def amplitudes(channel: str) -> str:
    """Return the entity of the amplitudes of a channel in its display unit."""
    return f'{AMPLITUDES}/{channel}'


def series_of(path: str, names: list[str]) -> list[Series]:
    """Return how the curves of an entity are drawn; undeclared ones take the palette."""
    declared = SERIES.get(path, ())
    return [
        declared[index]
        if index < len(declared)
        else BY_NAME.get(name, Series(name, PALETTE[index % len(PALETTE)]))
        for index, name in enumerate(names)
    ]
