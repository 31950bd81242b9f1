# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The command `rotor-rig import`."""

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from rotor_common.console import print_json, say
from rotor_common.options import JsonOption
from rotor_recording.errors import ImportFileError


def import_recording(
    file: Annotated[Path, typer.Argument(help='Recording: .mat, or delimited text.')],
    *,
    out: Annotated[Path, typer.Option(help='MCAP file to write; must not exist.')],
    channel: Annotated[
        list[str] | None,
        typer.Option(
            metavar='NAME=COLUMN',
            help='What a column is, such as brg1_ay=1; COLUMN is a number from 1 or a name, '
            'in a .mat file the path of a variable such as data.gs or x[:,2].',
        ),
    ] = None,
    unit: Annotated[
        list[str] | None,
        typer.Option(
            metavar='[NAME=]UNIT',
            help='Unit of the columns, or of one: m/s^2, mm/s^2, g, m, mm, um, in, mil, or '
            "the size of the file's unit in m/s^2 or m.",
        ),
    ] = None,
    rate_hz: Annotated[float | None, typer.Option(help='Sample rate, a whole number.')] = None,
    time: Annotated[
        str | None, typer.Option(help='Column of the time in s, instead of --rate-hz.')
    ] = None,
    speed_hz: Annotated[
        float | None, typer.Option(help='Constant shaft speed in revolutions a second.')
    ] = None,
    tacho: Annotated[
        str | None, typer.Option(help='Column of the tachometer, pulses or a sine.')
    ] = None,
    pulses_per_revolution: Annotated[
        int, typer.Option(help='Pulses, or periods of the sine, in a revolution.')
    ] = 1,
    decimal: Annotated[
        Literal['point', 'comma'] | None,
        typer.Option(help='Decimal sign of a text, where it can be read in two ways.'),
    ] = None,
    first_line: Annotated[
        int | None, typer.Option(help='Line of a text with the first sample, from 1.')
    ] = None,
    source: Annotated[
        str, typer.Option(help='Where the file is from, its authors and licence.')
    ] = '',
    as_json: JsonOption = False,
) -> None:
    """Convert a recording of a real machine to a recording of the rig.

    Example: rotor-rig import run.csv --channel brg1_ay=2 --unit g --rate-hz 12000 --out run.mcap
    """
    from rotor_recording.importing.convert import ImportPlan, check_out, convert, write

    check_out(out)
    plan = ImportPlan(
        path=file,
        channels=_pairs('--channel', channel or []),
        units=_pairs('--unit', [text if '=' in text else f'={text}' for text in unit or []]),
        rate_hz=rate_hz,
        time=time,
        speed_hz=speed_hz,
        tacho=tacho,
        pulses_per_revolution=pulses_per_revolution,
        source=source,
        decimal=decimal,
        first_line=first_line,
    )
    imported = convert(plan)
    write(imported, out)
    found = imported.config['import']
    if as_json:
        print_json({'recording': str(out), **found, 'warnings': list(imported.warnings)})
        return
    for sentence in imported.warnings:
        say(f'warning: {sentence}', 'yellow')
    say(
        f'recording: {out}\n{found["samples"]} samples at {found["rate_hz"]} Hz of '
        f'{", ".join(found["channels"])}; shaft: {_speed_text(found["shaft"])}'
        f'{_layout_text(found["layout"])}'
    )


def _pairs(option: str, texts: list[str]) -> dict[str, str]:
    """Return NAME=VALUE as a mapping."""
    pairs: dict[str, str] = {}
    for text in texts:
        name, equals, value = text.partition('=')
        if not equals or not value:
            raise ImportFileError(f'{option} {text} is not NAME=VALUE')
        if name in pairs:
            raise ImportFileError(f'{option} gives {name or "a unit for all"} twice')
        pairs[name] = value
    return pairs


def _speed_text(shaft: dict[str, Any]) -> str:
    if 'slowest_hz' not in shaft:
        return 'not known'
    return f'{shaft["slowest_hz"]:.4g} to {shaft["fastest_hz"]:.4g} Hz ({shaft["from"]})'


def _layout_text(layout: dict[str, Any]) -> str:
    if not layout:
        return ''
    one = layout['delimiter'] == 'none'
    cells = 'one column' if one else f'cells divided by {layout["delimiter"]}'
    return (
        f'\nread: lines {layout["first_line"]} to {layout["last_line"]}, '
        f'{cells}, decimal {layout["decimal"]}; left out: '
        f'{layout["lines_left_out_above"]} lines above, {layout["lines_left_out_below"]} below'
    )
