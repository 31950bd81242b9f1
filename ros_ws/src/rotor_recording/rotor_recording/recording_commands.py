# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The commands `rotor-rig replay`, `recover` and `verify`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from rotor_common.console import print_json, say
from rotor_common.exit_code import ExitCode
from rotor_common.options import JsonOption, RecordingArgument

_COLOURS = {'good': 'green', 'wrong': 'red', 'not checked': 'yellow'}


def replay(
    file: RecordingArgument,
    rate: Annotated[float, typer.Option(help='Multiple of real time, above 0.')] = 1.0,
    loop: Annotated[bool, typer.Option('--loop', help='Start again at the end.')] = False,
    start: Annotated[float, typer.Option(help='Skip this many s.')] = 0.0,
    topic: Annotated[
        list[str] | None, typer.Option(help='Only this topic; may be given several times.')
    ] = None,
) -> None:
    """Publish a recording again, with its own times as /clock.

    Example: rotor-rig replay flight.mcap --rate 4
    """
    from rotor_recording.replay_node import replay as replay_recording

    code = replay_recording(file, rate=rate, loop=loop, start_s=start, topics=topic)
    raise typer.Exit(code)


def recover(
    file: Annotated[
        Path, typer.Argument(help='Recording: .mcap.active, .mcap, .db3 or bag folder.')
    ],
    out: Annotated[
        Path | None,
        typer.Option(help='New bag folder; default: beside FILE, as NAME_recovered.'),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Make a whole bag from the intact messages of a damaged or unfinished recording.

    Example: rotor-rig recover recordings/flight/flight_0.mcap.active
    """
    from rotor_recording.recovery import recover as recover_recording

    found = recover_recording(file, out)
    if as_json:
        print_json(found.as_dict())
        return
    lines = [f'recording: {found.bag}', f'kept:      {sum(found.messages.values())} messages']
    for name, samples in found.samples.items():
        lines.append(
            f'           {name}: samples {samples.first} to {samples.last}, '
            f'{samples.continuity.lost_samples} missing in between'
        )
    if found.lost:
        count = 'unknown' if found.lost_messages is None else f'{found.lost_messages}'
        place = f'{found.lost_bytes} bytes, {found.lost_chunks} chunks'
        lines.append(f'lost:      {place}, messages: {count}')
    lines += [f'           {sentence}' for sentence in found.lost]
    for line in lines if found.lost else [*lines, 'lost:      nothing']:
        say(line)


def verify(
    file: Annotated[Path, typer.Argument(help='Recording: bag folder or file of one.')],
    as_json: JsonOption = False,
) -> None:
    """Check a recording: checksums, counts, types, sample index, stamps, metadata.yaml.

    Exit code 1 if something is wrong.

    Example: rotor-rig verify recordings/flight
    """
    from rotor_recording import verification

    checks = verification.verify(file)
    good = verification.is_good(checks)
    if as_json:
        print_json(
            {
                'recording': str(file),
                'ok': good,
                'checks': [check.as_dict() for check in checks],
            }
        )
    else:
        table = Table('what', 'how', 'found')
        for check in checks:
            style = _COLOURS[check.state]
            table.add_row(check.what, f'[{style}]{check.state}[/]', check.text)
        Console().print(table)
    if not good:
        raise typer.Exit(ExitCode.CHECK_FAILED)
