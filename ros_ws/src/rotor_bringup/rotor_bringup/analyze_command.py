# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The command `rotor-rig analyze`."""

from contextlib import nullcontext
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from rotor_common.console import folding_table, print_json, warn
from rotor_common.options import JsonOption, RecordingArgument, WaveformOption


def analyze(
    file: RecordingArgument,
    out: Annotated[
        Path | None,
        typer.Option(help='Write every window: .json or .csv by the ending, or an added format.'),
    ] = None,
    waveform_topic: WaveformOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run the monitor over a recording: the same indicators as live.

    Example: rotor-rig analyze flight.mcap --out windows.csv
    """
    from rotor_bringup.analysis import analyze_recording, windows_file

    with nullcontext() if out is None else windows_file(out) as on_window:
        analysis = analyze_recording(file, waveform_topic, on_window)
    warn(analysis.damage)
    if as_json:
        print_json(analysis.summary())
        return
    if analysis.samples is None:
        title = f'{analysis.state.windows} windows'
        table = folding_table('indicator', 'median', 'largest', title=title)
        for name, median, largest in analysis.highlights:
            table.add_row(name, f'{median:.4g}', f'{largest:.4g}')
        Console().print(table)
    else:
        Console().print(analysis.samples.table())
        Console().print(f'no window: {analysis.samples.reason}', soft_wrap=True, highlight=False)
    Console().print(f'monitor: {analysis.state.conclusion()}', soft_wrap=True, highlight=False)
    if analysis.lost_samples:
        Console().print(f'lost: {analysis.lost_samples} samples, by the sample index')
