# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Command-line arguments and options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

RecordingArgument = Annotated[Path, typer.Argument(help='Recording: bag folder or MCAP file.')]
ScenarioArgument = Annotated[
    str, typer.Argument(help='Name of a shipped scenario, a YAML file, or a recording to repeat.')
]
DurationOption = Annotated[
    float | None, typer.Option('--duration', help='Length of the run in s, instead of its own.')
]
WaveformOption = Annotated[
    str | None,
    typer.Option(
        '--waveform-topic',
        help='Full name of the waveform; default: rotor/waveform of the one rig in the recording.',
    ),
]
JsonOption = Annotated[bool, typer.Option('--json', help='Print the result as JSON.')]
