# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Look at plants: nodes, elements, statics, modes, critical speeds."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotor_common.console import folding_table, print_json
from rotor_common.options import JsonOption

if TYPE_CHECKING:
    from rotor_sim.plant.campbell import Campbell
    from rotor_sim.plant.compiled_plant import CompiledPlant

app = typer.Typer(help=__doc__, no_args_is_help=True)

_SPEEDS = 61
"""Of the Campbell diagram."""
_LISTED_MODES = 10


@app.command('list')
def list_plants(as_json: JsonOption = False) -> None:
    """List the plants that come with the rig.

    Example: rotor-rig plant list --json
    """
    from rich.console import Console

    from rotor_sim.plant.shipped import plant_named, plant_names

    found = {name: plant_named(name).description for name in plant_names()}
    if as_json:
        print_json(found)
        return
    table = folding_table('name', 'what it is', box=None)
    for name, description in found.items():
        table.add_row(name, description)
    Console().print(table)


@app.command('show')
def show_plant(
    plant: Annotated[str, typer.Argument(help='Name of a shipped plant, or a YAML file.')],
    speed: Annotated[
        float, typer.Option(min=0.0, max=1e5, help='Speed for the natural frequencies, rad/s.')
    ] = 0.0,
    highest_speed: Annotated[
        float, typer.Option(min=1.0, max=1e5, help='End of the Campbell diagram, rad/s.')
    ] = 1500.0,
    picture: Annotated[
        Path | None, typer.Option(help='File to draw rotor and Campbell diagram into: .png, .svg.')
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Show a plant: nodes, elements, deflection in level flight, vibrations, critical speeds.

    The vibrations are small ones about that deflection, with the shaft at angle 0.

    Example: rotor-rig plant show fe_midspan --picture rotor.png
    """
    import numpy as np

    from rotor_common.constants import GRAVITY_M_S2
    from rotor_common.out_path import check_file
    from rotor_common.progress import interruptible
    from rotor_sim.plant.campbell import campbell
    from rotor_sim.plant.compiled_plant import CompiledPlant
    from rotor_sim.plant.shipped import load_plant
    from rotor_sim.plant.statics import static_equilibrium

    if picture is not None:
        check_file(picture, ('.png', '.svg'), option='--picture')
    compiled = CompiledPlant(load_plant(plant))
    load = (GRAVITY_M_S2, 0.0)
    state = static_equilibrium(compiled, load)
    speeds = np.linspace(0.0, highest_speed, _SPEEDS)
    with interruptible('Campbell diagram', None, quiet=as_json, what_is_done='speeds') as advance:
        diagram = campbell(compiled, state, speeds, load, advance)
    facts = _facts(compiled, state, speed, load, diagram)
    name = Path(plant).stem
    if picture is not None:
        _save(compiled, name, diagram, picture)
    if as_json:
        print_json({'plant': name, **facts})
    else:
        _print(compiled, name, facts, speed)


def _facts(
    compiled: 'CompiledPlant', state: Any, speed: float, load: Any, diagram: 'Campbell'
) -> dict[str, Any]:
    """Return what is to be said of a plant as plain data in SI units."""
    from rotor_sim.plant.campbell import whirl_of
    from rotor_sim.plant.compiled_plant import Instant
    from rotor_sim.plant.modes import modes

    plant, assembly = compiled.plant, compiled.assembly
    deflection: dict[str, dict[str, float]] = {}
    moved = assembly.all_displacements(state[: compiled.size])
    for (node, axis), value in zip(plant.coordinates(), moved, strict=True):
        deflection.setdefault(node, {})[axis] = float(value)
    found = modes(compiled, state, Instant(speed_rad_s=speed, load_m_s2=load))
    vibrations = zip(
        found.frequencies_rad_s,
        found.decay_rates_1_s,
        whirl_of(compiled, found.shapes),
        strict=True,
    )
    reduced = assembly.reduced
    return {
        'description': plant.description,
        'nodes': {name: node.model_dump(mode='json') for name, node in plant.nodes.items()},
        'elements': {
            name: element.model_dump(mode='json') | {'name': name}
            for name, element in plant.named_elements()
        },
        'degrees_of_freedom': [f'{node}.{axis}' for node, axis in assembly.coordinates],
        'live_parameters': dict(compiled.live),
        'reduction': None
        if reduced is None
        else {'modes_kept_hz': reduced.kept_hz, 'modes_left_out_hz': reduced.left_out_hz},
        'static_deflection': deflection,
        'natural_frequencies': [
            {
                'frequency_hz': float(frequency) / (2.0 * math.pi),
                'damping_ratio': float(rate / math.hypot(frequency, rate)),
                'whirl': float(whirl),
            }
            for frequency, rate, whirl in vibrations
        ],
        'critical_speeds': [
            {
                'speed_rad_s': each.speed_rad_s,
                'damping_ratio': each.decay_rate_1_s
                / math.hypot(each.speed_rad_s, each.decay_rate_1_s),
                'whirl': each.whirl,
            }
            for each in diagram.critical_speeds
        ],
    }


def _save(compiled: 'CompiledPlant', name: str, diagram: 'Campbell', path: Path) -> None:
    import matplotlib as mpl

    from rotor_rig.plant_picture import plant_figure

    metadata = {'Date': None} if path.suffix == '.svg' else {'Software': None}
    with mpl.rc_context({'svg.hashsalt': 'rotor-rig', 'svg.fonttype': 'none'}):
        plant_figure(compiled.plant, name, diagram).savefig(path, dpi=150, metadata=metadata)


def _print(compiled: 'CompiledPlant', name: str, facts: Mapping[str, Any], speed: float) -> None:
    from rich.console import Console
    from rich.text import Text

    console = Console()

    def line(text: str) -> None:
        console.print(Text(text))

    line(f'{name}: {facts["description"]}' if facts['description'] else name)
    table = folding_table('node', 'x, m', 'mass, kg', 'I_d, I_p, kg m^2', 'deflection y, z, um',
                          title='Nodes, and where they stand in level flight', box=None,
                          title_justify='left')  # fmt: skip
    for node, values in facts['nodes'].items():
        at = facts['static_deflection'][node]
        inertias = (values['diametral_inertia_kg_m2'], values['polar_inertia_kg_m2'])
        table.add_row(
            node,
            f'{values["position_m"]:g}',
            f'{values["mass_kg"]:g}' if values['mass_kg'] else '',
            f'{inertias[0]:g}, {inertias[1]:g}' if any(inertias) else '',
            f'{1e6 * at["y"]:z.2f}, {1e6 * at["z"]:z.2f}',
        )
    console.print(table)
    table = folding_table('element', 'kind', 'on', 'what is not its default', title='Elements',
                          box=None, title_justify='left')  # fmt: skip
    for name_of, element in compiled.plant.named_elements():
        ends = [key for key, _ in element.touches]
        given = element.model_dump(exclude_defaults=True, exclude={'kind', 'name', *ends})
        table.add_row(
            name_of,
            element.kind,
            ', '.join(getattr(element, key) for key in ends),
            ', '.join(
                f'{key} = {value:g}' if isinstance(value, float) else f'{key} = {value}'
                for key, value in given.items()
            ),
        )
    console.print(table)
    line(f'{compiled.size} degrees of freedom: {", ".join(facts["degrees_of_freedom"])}')
    live = ', '.join(f'{key} = {value:g}' for key, value in facts['live_parameters'].items())
    line(f'Live parameters: {live or "none"}')
    if facts['reduction'] is not None:
        left_out = facts['reduction']['modes_left_out_hz']
        line(
            f'Left out: {len(left_out)} modes of the shaft held at what is kept'
            + (f', the slowest at {left_out[0]:.0f} Hz' if left_out else '')
        )
    table = folding_table('Hz', 'damping ratio', 'whirl', box=None, title_justify='left',
                          title=f'Natural frequencies at {speed:g} rad/s')  # fmt: skip
    for mode in facts['natural_frequencies'][:_LISTED_MODES]:
        table.add_row(
            f'{mode["frequency_hz"]:.2f}', f'{mode["damping_ratio"]:z.4f}', _whirl(mode['whirl'])
        )
    console.print(table)
    table = folding_table('rad/s', 'rpm', 'damping ratio', 'whirl', box=None,
                          title='Critical speeds', title_justify='left')  # fmt: skip
    for each in facts['critical_speeds']:
        table.add_row(
            f'{each["speed_rad_s"]:.1f}',
            f'{each["speed_rad_s"] * 30.0 / math.pi:.0f}',
            f'{each["damping_ratio"]:z.4f}',
            _whirl(each['whirl']),
        )
    console.print(table if facts['critical_speeds'] else Text('No critical speed in the range'))


def _whirl(value: float) -> str:
    """Return the sense of a whirl in a word."""
    if abs(value) < 0.05:
        return 'straight'
    return f'{"forward" if value > 0.0 else "backward"} {abs(value):.2f}'
