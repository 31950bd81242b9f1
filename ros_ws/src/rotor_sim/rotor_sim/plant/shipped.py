# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The plants that come with the rig, and those of a user's files."""

from importlib.resources import files
from pathlib import Path

from rotor_common.errors import DataError
from rotor_common.plain_data import LARGEST_YAML, parse_yaml
from rotor_common.text_file import read_text
from rotor_sim.errors import PlantError
from rotor_sim.plant.hou2016 import hou2016
from rotor_sim.plant.parameters import RotorParameters
from rotor_sim.plant.plant import Plant

_HOU2016 = 'hou2016'
_FOLDER = files('rotor_sim') / 'plant' / 'plants'


def plant_names() -> list[str]:
    """Return the names of the plants that come with the rig."""
    named = (entry.name for entry in _FOLDER.iterdir())
    return sorted([_HOU2016, *(name[:-5] for name in named if name.endswith('.yaml'))])


def plant_named(name: str) -> Plant:
    """Return a plant that comes with the rig; raises PlantError for an unknown name.

    `hou2016` is the rotor of the paper with the default parameters of `RotorParameters`.
    """
    if name == _HOU2016:
        paper = 'The rotor of Hou et al. 2016: one disk, two ball bearings, a breathing crack.'
        return hou2016(RotorParameters()).model_copy(update={'description': paper})
    if name not in plant_names():
        raise PlantError(f'plant {name!r} is neither a file nor one of {", ".join(plant_names())}')
    return _parsed((_FOLDER / f'{name}.yaml').read_text('utf-8'), name)


def load_plant(path: str | Path) -> Plant:
    """Return the plant of a YAML file, or by its name one that comes with the rig.

    Raises:
        PlantError: not found, not readable, not YAML; a plant that cannot be.
        ConfigError: a key, type or value that is not allowed.

    """
    if str(path) in plant_names() or not Path(path).is_file():
        return plant_named(str(path))
    try:
        return _parsed(read_text(Path(path), LARGEST_YAML), str(path))
    except DataError as error:
        raise PlantError(f'plant {error}') from None


def _parsed(text: str, source: str) -> Plant:
    try:
        data = parse_yaml(text)
    except DataError as error:
        raise PlantError(f'plant {source}: {error}') from None
    if not isinstance(data, dict):
        raise PlantError(f'plant {source} must be a mapping with the keys nodes and elements')
    return Plant.from_mapping(data)
