# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""`rotor-rig recover` and `rotor-rig verify`: damaged recordings made whole, whole ones checked."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from rotor_interfaces.exit_code import ExitCode

_COLOURS = {'good': 'green', 'wrong': 'red', 'not checked': 'yellow'}


def add_commands(
    app: typer.Typer, console: Console, print_json: Callable[[dict[str, Any]], None]
) -> None:
    """Register the commands; people read on `console`, programs what `print_json` prints."""

    @app.command()
    def recover(
        file: Annotated[
            Path, typer.Argument(help='Recording: .mcap.active, .mcap, .db3 or bag folder.')
        ],
        out: Annotated[
            Path | None,
            typer.Option(help='New bag folder; default: beside FILE, as NAME_recovered.'),
        ] = None,
        as_json: Annotated[bool, typer.Option('--json', help='Print the result as JSON.')] = False,
    ) -> None:
        """Make a whole bag of what is whole in a damaged or unfinished recording.

        Example: rotor-rig recover recordings/flight/flight_0.mcap.active
        """
        from vibration_monitor.recovery import recover as recover_recording  # noqa: PLC0415 - slow

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
            console.print(line, soft_wrap=True, highlight=False, markup=False)

    @app.command()
    def verify(
        file: Annotated[Path, typer.Argument(help='Recording: bag folder or file of one.')],
        as_json: Annotated[bool, typer.Option('--json', help='Print the result as JSON.')] = False,
    ) -> None:
        """Check a recording: checksums, counts, types, sample index, stamps, metadata.yaml.

        Exit code 1 if something is wrong. Example: rotor-rig verify recordings/flight
        """
        from vibration_monitor import verification  # noqa: PLC0415 - slow

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
