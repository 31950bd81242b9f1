# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The command `rotor-rig simulate`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.progress import Progress, SpinnerColumn, TimeRemainingColumn

from rotor_common.console import print_json, say
from rotor_common.options import DurationOption, JsonOption, ScenarioArgument
from rotor_common.out_path import check_file
from rotor_common.progress import progress_bar
from rotor_rig.scenario_commands import scenario_to_run
from rotor_rig.scenario_model import DEFAULT_SCENARIO


def simulate(
    scenario: ScenarioArgument = DEFAULT_SCENARIO,
    out: Annotated[Path, typer.Option(help='MCAP file to write.')] = ...,  # type: ignore[assignment]
    duration: DurationOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make the recording of a scenario offline, without ROS.

    Example: rotor-rig simulate climb_dive --out flight.mcap
    """
    from rotor_bringup.display import RunState
    from rotor_rig.pipeline import record

    check_file(
        out,
        ['.mcap'],
        'for CSV, `rotor-rig analyze RECORDING --out FILE.csv` writes its indicators',
    )
    plan = scenario_to_run(scenario, duration)
    state = RunState(plan.duration_s)
    columns = SpinnerColumn(), *Progress.get_default_columns()[:-1], TimeRemainingColumn()
    with progress_bar(*columns, quiet=as_json) as progress:
        task = progress.add_task(plan.name, total=plan.duration_s)
        for step in record(plan, out):
            simulated_s = (step.block.first_sample + len(step.block.rows)) / plan.rate_hz
            state.advance(simulated_s)
            for window in step.records:
                state.take_record(window, (window.stamp_ns - plan.epoch_ns) * 1e-9)
            progress.update(task, completed=simulated_s)
    if as_json:
        print_json({'scenario': plan.name, 'recording': str(out), **state.as_dict()})
    else:
        say(f'recording: {out}')
        say(f'monitor:   {state.conclusion()}')
