# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Classes of other packages: by the name of an entry point, or as `module:Class`."""

import importlib
from importlib.metadata import entry_points
from typing import Any


def plugins(group: str) -> dict[str, str]:
    """Return `module:attribute` of every installed entry point of a group, by its name."""
    return {point.name: point.value for point in entry_points(group=group)}


def load_plugin(target: str) -> Any:
    """Return what `module:attribute` names; raises ImportError or AttributeError."""
    module, _, attribute = target.partition(':')
    made: Any = importlib.import_module(module)
    for part in attribute.split('.'):
        made = getattr(made, part)
    return made
