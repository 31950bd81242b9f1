# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The registry of elements, and reading of one from plain data by its key `kind`."""

import difflib
import functools
import importlib
import inspect
import json
import pkgutil
from collections.abc import Mapping
from typing import Annotated, Any

import pydantic

from rotor_common import plugins
from rotor_common.configuration import tagged
from rotor_sim.errors import PlantError
from rotor_sim.plant import elements
from rotor_sim.plant.element import Element

GROUP = 'rotor_rig.elements'
"""The group of entry points."""


@functools.cache
def shipped_elements() -> dict[str, type[Element]]:
    """Return the elements that come with the rig by their kinds."""
    found = {}
    for file in pkgutil.iter_modules(elements.__path__):
        module = importlib.import_module(f'{elements.__name__}.{file.name}')
        for _, made in inspect.getmembers(module, inspect.isclass):
            if issubclass(made, Element) and made.__module__ == module.__name__:
                found[made.model_fields['kind'].default] = made
    return found


def element_kinds() -> list[str]:
    """Return the kinds of all installed elements."""
    return sorted(shipped_elements().keys() | set(plugins.names_of(GROUP)))


def find_element(kind: str) -> type[Element]:
    """Return the class of an element by its kind, or by `module:Class`.

    The kind of a shipped element always means that one. Raises PlantError for a kind that is not
    known, cannot be loaded or is no element.
    """
    if kind in shipped_elements():
        return shipped_elements()[kind]
    target = plugins.target_of(kind, GROUP)
    if target is None:
        kinds = element_kinds()
        close = difflib.get_close_matches(kind, kinds, n=1)
        hint = f'did you mean {close[0]!r}?' if close else f'choose one of {", ".join(kinds)}'
        raise PlantError(f'kind = {kind!r} is not known; {hint}')
    made = plugins.load_from_here(target, 'kind =', PlantError)
    if not isinstance(made, type) or not issubclass(made, Element):
        raise PlantError(
            f'kind = {kind!r} is no element: {target} must be a class that derives from '
            'rotor_sim.plant.Element'
        )
    return made


def _read(value: Any, info: pydantic.ValidationInfo) -> Any:
    """Return plain data as the element that they name; its errors keep their place."""
    if isinstance(value, Element):
        return value
    if not isinstance(value, Mapping) or not isinstance(value.get('kind'), str):
        raise PlantError(
            f'an element is a mapping with the key kind; choose one of {", ".join(element_kinds())}'
        )
    adapter = tagged(find_element(value['kind']))
    if info.mode == 'json':  # whose arrays serve as tuples
        return adapter.validate_json(json.dumps(value))
    return adapter.validate_python(value)


AnyElement = Annotated[pydantic.SerializeAsAny[Element], pydantic.BeforeValidator(_read)]
"""An element in a model: an instance, or a mapping with its kind."""
