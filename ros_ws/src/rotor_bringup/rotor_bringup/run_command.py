# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The command `rotor-rig run`."""

import math
import shlex
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from rotor_common.console import console, print_json, say, warn
from rotor_common.errors import ConfigError, ProcessError
from rotor_common.exit_code import ExitCode
from rotor_common.options import DurationOption, JsonOption, ScenarioArgument
from rotor_common.out_path import make_folder
from rotor_interfaces import dds
from rotor_rig.scenario_commands import scenario_to_run
from rotor_rig.scenario_model import DEFAULT_SCENARIO


def run(
    scenario: ScenarioArgument = DEFAULT_SCENARIO,
    *,
    duration: DurationOption = None,
    rate: Annotated[
        float, typer.Option(help='Multiple of real time; 0 = fastest without losses.')
    ] = 1.0,
    record: Annotated[
        Path, typer.Option(help='Folder in which the recording gets a folder of its own.')
    ] = Path('recordings'),
    namespace: Annotated[
        str, typer.Option(help='ROS namespace of all topics, so that several rigs can fly.')
    ] = '',
    composed: Annotated[bool, typer.Option('--composed', help='All nodes in one process.')] = False,
    view: Annotated[bool, typer.Option('--view', help='Show the run live in rerun.')] = False,
    as_json: JsonOption = False,
) -> None:
    """Run a scenario live over DDS and record it; exit code 1 if anything was lost.

    Example: rotor-rig run climb_dive --duration 5 --view
    """
    dds.require_loadable()
    from rotor_bringup.live import run_live

    plan = scenario_to_run(scenario, duration)
    if not (math.isfinite(rate) and 0.0 <= rate <= 1000.0):
        raise ConfigError(f'--rate {rate:g} is out of range; allowed: 0 to 1000')
    if view:
        from rotor_view.viewer import require_screen

        require_screen()
    folder = _new_bag_folder(record, plan.name)
    try:
        result = run_live(
            plan,
            rate=rate,
            folder=folder,
            namespace=namespace,
            composed=composed,
            view=view,
            console=console,
            quiet=as_json,
        )
    except ProcessError:
        _say_where(folder)
        raise
    if as_json:
        print_json(
            {
                'scenario': plan.name,
                'recording': str(result.recording),
                'interrupted': result.interrupted,
                'failures': result.failures,
                'warnings': result.warnings,
                **result.state.as_dict(),
            }
        )
    else:
        _say_where(folder)
        say(f'monitor:   {result.state.conclusion()}')
        if losses := result.state.losses():
            say(f'lost:      {losses}', 'bold red')
        if folder.exists():
            _say_what_next(folder)
    warn(result.warnings)
    if result.failures:
        raise ProcessError('; '.join(result.failures))
    if result.interrupted:
        raise typer.Exit(ExitCode.INTERRUPTED)
    if result.state.losses():
        raise typer.Exit(ExitCode.CHECK_FAILED)


def _new_bag_folder(parent: Path, name: str) -> Path:
    """Return a folder name that does not exist yet; the recorder makes the folder.

    Raises ConfigError where nothing can be written into `parent`.
    """
    make_folder(parent, '--record')
    stem = f'{name}-{datetime.now(UTC):%Y%m%d-%H%M%S}'
    candidates = [parent / stem, *(parent / f'{stem}-{number}' for number in range(2, 100))]
    return next(folder for folder in candidates if not folder.exists()).absolute()


def _say_where(folder: Path) -> None:
    """Name the recording, if the run has made one."""
    if folder.exists():
        say(f'recording: {_as_typed(folder)}')


def _say_what_next(folder: Path) -> None:
    """Print the two commands to view and replay a recording, as they can be typed here."""
    program, recording = _as_typed(Path(sys.argv[0])), _as_typed(folder)
    for what, verb in (('view it:  ', 'view'), ('replay it:', 'replay')):
        say(f'{what} {program} {verb} {recording}')


def _as_typed(path: Path) -> str:
    """Return a path as a person here would type it."""
    short = path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path
    return shlex.quote(str(short))
