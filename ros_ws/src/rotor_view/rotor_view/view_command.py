# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The command `rotor-rig view`."""

from pathlib import Path
from typing import Annotated

import typer

from rotor_common.console import warn
from rotor_common.options import RecordingArgument, WaveformOption


def view(
    file: RecordingArgument,
    save: Annotated[Path | None, typer.Option(help='Write a .rrd file instead.')] = None,
    screenshot: Annotated[
        Path | None, typer.Option(help='Write a .png of the view instead, without a screen.')
    ] = None,
    waveform_topic: WaveformOption = None,
) -> None:
    """Show a recording in rerun: plots, orbit, spectra and the rig in 3-D.

    Example: rotor-rig view flight.mcap --screenshot view.png
    """
    from rotor_view import view_recording

    warn(view_recording(file, save=save, screenshot=screenshot, waveform_topic=waveform_topic))
