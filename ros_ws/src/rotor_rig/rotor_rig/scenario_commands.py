# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Look at scenarios and check your own."""

from typing import Annotated

import typer
from rich.console import Console

from rotor_common.console import folding_table, print_json, warn
from rotor_common.options import JsonOption, ScenarioArgument
from rotor_rig.scenario_model import Scenario, load_scenario, shipped_scenarios

app = typer.Typer(help=__doc__, no_args_is_help=True)


@app.command('list')
def list_scenarios(as_json: JsonOption = False) -> None:
    """List the scenarios that come with the rig.

    Example: rotor-rig scenario list --json
    """
    scenarios = [load_scenario(name) for name in shipped_scenarios()]
    if as_json:
        print_json({plan.name: plan.description for plan in scenarios})
        return
    table = folding_table('name', 'length', 'what it shows', box=None)
    for plan in scenarios:
        table.add_row(plan.name, f'{plan.duration_s:g} s', plan.description)
    Console().print(table)


@app.command('show')
def show_scenario(scenario: ScenarioArgument, as_json: JsonOption = False) -> None:
    """Show a scenario with every value it leaves to the defaults.

    Example: rotor-rig scenario show climb_dive
    """
    plan = load_scenario(scenario)
    if as_json:
        print_json(plan.plain())
    else:
        typer.echo(plan.yaml(), nl=False)


@app.command('check')
def check_scenario(
    file: Annotated[str, typer.Argument(help='YAML file of a scenario.')],
    as_json: JsonOption = False,
) -> None:
    """Check a scenario without running it.

    Example: rotor-rig scenario check mine.yaml
    """
    plan = load_scenario(file)
    if as_json:
        print_json({'scenario': plan.name, 'ok': True, 'warnings': plan.warnings()})
    else:
        warn(plan.warnings())
        typer.echo(f'{plan.name}: good, {plan.duration_s:g} s')


def scenario_to_run(source: str, duration_s: float | None) -> Scenario:
    """Return a scenario, of another length where one is given; print its warnings."""
    plan = load_scenario(source, **({} if duration_s is None else {'duration_s': duration_s}))
    warn(plan.warnings())
    return plan
