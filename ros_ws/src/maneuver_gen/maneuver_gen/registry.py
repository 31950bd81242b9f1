# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The registry of maneuvers, and parsing of one from plain data by its key `profile`.

Every file of `maneuver_gen.maneuvers` is shipped. More are found through the entry points of the
group `rotor_rig.maneuvers`, or by `module:Class`.
"""

import difflib
import functools
import importlib
import inspect
import json
import pkgutil
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import pydantic

from maneuver_gen import maneuvers
from maneuver_gen.errors import ManeuverError
from maneuver_gen.maneuver import Maneuver
from rotor_common import plugins
from rotor_common.configuration import ConfigModel, tagged
from rotor_common.errors import DataError
from rotor_common.plain_data import parse_json

GROUP = 'rotor_rig.maneuvers'
"""The group of entry points."""


@functools.cache
def shipped_maneuvers() -> dict[str, type[Maneuver]]:
    """Return the maneuvers that come with the rig by their names."""
    found = {}
    for file in pkgutil.iter_modules(maneuvers.__path__):
        module = importlib.import_module(f'{maneuvers.__name__}.{file.name}')
        for _, made in inspect.getmembers(module, inspect.isclass):
            if issubclass(made, Maneuver) and made.__module__ == module.__name__:
                found[made.model_fields['profile'].default] = made
    return found


def maneuver_names(*, parts: bool = False) -> list[str]:
    """Return the names of all installed maneuvers; `parts`: only those a segment can be."""
    shipped = {n for n, kind in shipped_maneuvers().items() if kind.part_of_sequence or not parts}
    return sorted(shipped | set(plugins.names_of(GROUP)) - shipped_maneuvers().keys())


def find_maneuver(name: Any, *, parts: bool = False) -> type[Maneuver]:
    """Return the class of a maneuver by its name, or by `module:Class`.

    The name of a shipped maneuver always means that one. Raises ManeuverError: no such maneuver,
    it cannot be loaded, it is no maneuver, or (with `parts`) it cannot be part of a sequence.
    """
    found = shipped_maneuvers().get(name) if isinstance(name, str) else None
    if found is None and isinstance(name, str):
        target = plugins.target_of(name, GROUP)
        found = _load(name, target) if target else None
    if found is None or (parts and not found.part_of_sequence):
        names = maneuver_names(parts=parts)
        close = difflib.get_close_matches(str(name), names, n=1)
        hint = f'did you mean {close[0]!r}?' if close else _choose(names)
        raise ManeuverError(f'profile = {name!r} is not known here; {hint}')
    return found


def _load(name: str, target: str) -> type[Maneuver]:
    made = plugins.load_from_here(target, 'profile =', ManeuverError)
    if not isinstance(made, type) or not issubclass(made, Maneuver) or inspect.isabstract(made):
        raise ManeuverError(
            f'profile = {name!r} is no maneuver: {target} must be a class that derives from '
            'maneuver_gen.Maneuver and has load_factors'
        )
    return made


def _choose(names: list[str]) -> str:
    return f'choose one of {", ".join(names)}'


def _read(value: Any, info: pydantic.ValidationInfo, *, parts: bool) -> Any:
    """Return the maneuver that plain data name; its errors keep their key path."""
    if isinstance(value, ConfigModel):
        return value
    if not isinstance(value, Mapping) or 'profile' not in value:
        wrong = 'profile is missing' if isinstance(value, Mapping) else (
            'a maneuver is a mapping with the key profile'
        )  # fmt: skip
        raise ManeuverError(f'{wrong}; {_choose(maneuver_names(parts=parts))}')
    adapter = tagged(find_maneuver(value['profile'], parts=parts))
    if info.mode == 'json':  # where arrays are valid tuples
        return adapter.validate_json(json.dumps(value))
    return adapter.validate_python(value)


ManeuverConfig = Annotated[
    pydantic.SerializeAsAny[Maneuver],
    pydantic.BeforeValidator(functools.partial(_read, parts=False)),
]
"""Type of a model's field that holds a maneuver."""

PartOfSequence = Annotated[
    pydantic.SerializeAsAny[Maneuver],
    pydantic.BeforeValidator(functools.partial(_read, parts=True)),
]


class _Root(ConfigModel):
    maneuver: ManeuverConfig


def parse_maneuver(data: Mapping[str, Any] | str) -> Maneuver:
    """Return the maneuver of plain data (YAML, JSON) or of a JSON text.

    Raises ConfigError for wrong content and ManeuverError for a text that is not JSON.
    """
    if isinstance(data, str):
        try:
            data = parse_json(data)
        except DataError as error:
            raise ManeuverError(f'the maneuver is not valid JSON: {error}') from None
    return _Root.from_mapping({'maneuver': data}).maneuver


def resolve_paths(data: Any, folder: Path) -> Any:
    """Return plain data of a maneuver with files relative to `folder` made absolute.

    Wrong data pass through unchanged: `parse_maneuver` says what is wrong with them.
    """
    try:
        return find_maneuver(data['profile']).resolve_paths(data, folder)
    except (ManeuverError, KeyError, TypeError, IndexError):
        return data
