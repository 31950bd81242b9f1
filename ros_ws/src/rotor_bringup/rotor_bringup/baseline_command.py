# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The command `rotor-rig baseline`: learns a baseline from healthy recordings."""

from pathlib import Path
from typing import Annotated

import typer
import yaml

from rotor_common.console import print_json, printable
from rotor_common.options import JsonOption


def baseline(
    files: Annotated[
        list[Path], typer.Argument(help='Healthy recordings of one machine, loads differing.')
    ],
    waveform_topic: Annotated[
        str | None,
        typer.Option(help='Full name of the waveform; default: rotor/waveform of the one rig.'),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Learn a machine's baseline for the crack estimate, as a part of a scenario.

    Example: rotor-rig baseline healthy_1.mcap healthy_2.mcap
    """
    from rotor_recording.reading import Recording
    from rotor_rig.pipeline import analyze
    from vibration_monitor.detectors.baseline import (
        baseline_of_records,
        reference_monitor,
    )

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
