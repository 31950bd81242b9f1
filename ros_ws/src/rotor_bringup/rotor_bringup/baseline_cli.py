# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The command `rotor-rig baseline`: what healthy recordings teach the crack estimate."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer
import yaml

from rotor_bringup.console import printable


def add_command(app: typer.Typer, print_json: Callable[[dict[str, Any]], None]) -> None:
    """Register the command; programs read what `print_json` prints."""

    @app.command()
    def baseline(
        files: Annotated[
            list[Path], typer.Argument(help='Healthy recordings of one machine, loads differing.')
        ],
        waveform_topic: Annotated[
            str | None,
            typer.Option(help='Full name of the waveform; default: rotor/waveform of the one rig.'),
        ] = None,
        as_json: Annotated[bool, typer.Option('--json', help='Print the result as JSON.')] = False,
    ) -> None:
        """Learn a machine's baseline for the crack estimate, as a part of a scenario."""
        from rotor_bringup.pipeline import analyze  # noqa: PLC0415 - slow
        from vibration_monitor.detectors.baseline import (  # noqa: PLC0415
            baseline_of_records,
            reference_monitor,
        )
        from vibration_monitor.reading import Recording  # noqa: PLC0415

        recordings = [Recording(file, waveform_topic) for file in files]
        try:
            learnt = baseline_of_records(
                analyze(recording, reference_monitor()) for recording in recordings
            )
        finally:  # what was left out may be why there is no baseline
            for recording in recordings:
                for sentence in recording.damage:
                    typer.echo(f'warning: {printable(sentence)}', err=True)
        part = {'monitor': {'crack': {'baseline': learnt.model_dump(mode='json')}}}
        if as_json:
            print_json(part)
        else:
            typer.echo(yaml.safe_dump(part, sort_keys=False), nl=False)
