# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Load user-defined parts, by entry point or as `module:attribute`."""

import importlib
import sys
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any


def names_of(group: str) -> list[str]:
    """Return the names of the installed entry points of a group."""
    return sorted(entry_points(group=group).names)


def target_of(name: str, group: str) -> str | None:
    """Return `module:attribute` of an entry point's name, or of such a text; None for neither."""
    found = {point.name: point.value for point in entry_points(group=group)}
    module, colon, attribute = name.partition(':')
    return found.get(name, name if colon and module and attribute else None)


def load(target: str, what: str, error: type[Exception]) -> Any:
    """Return the object at `module:attribute`; `what` names such a part in errors.

    Raises:
        error: the module cannot be imported, whatever it raises, or lacks the attribute.

    """
    module, _, attribute = target.partition(':')
    try:
        made: Any = importlib.import_module(module)
        for part in attribute.split('.'):
            made = getattr(made, part)
    except Exception as why:  # a user's module raises what it likes
        raise error(f'{what} {target!r} cannot be loaded: {why}') from why
    return made


def load_from_here(target: str, what: str, error: type[Exception]) -> Any:
    """Load as `load` does, also from a file in the current folder, after installed modules."""
    here = str(Path.cwd())
    sys.path.append(here)
    try:
        return load(target, what, error)
    finally:
        sys.path.remove(here)
