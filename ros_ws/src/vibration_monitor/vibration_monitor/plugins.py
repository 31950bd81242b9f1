# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Parts that users add: found by entry point or as `module:attribute`, loaded when named."""

import importlib
from importlib.metadata import entry_points
from typing import Any

from vibration_monitor.errors import MonitorError


def names_of(group: str) -> list[str]:
    """Return the names of the entry points of a group."""
    return sorted(entry_points(group=group).names)


def target_of(name: str, group: str) -> str | None:
    """Return `module:attribute` of an entry point's name, or of such a text; None for neither."""
    found = {point.name: point.value for point in entry_points(group=group)}
    module, colon, attribute = name.partition(':')
    return found.get(name, name if colon and module and attribute else None)


def load(target: str, what: str) -> Any:
    """Return the object at `module:attribute`; `what` is what people call such a part.

    Raises:
        MonitorError: the module cannot be imported, or lacks the attribute.

    """
    module, _, attribute = target.partition(':')
    try:
        made: Any = importlib.import_module(module)
        for part in attribute.split('.'):
            made = getattr(made, part)
    except (ImportError, AttributeError) as error:
        raise MonitorError(f'{what} {target!r} cannot be loaded: {error}') from None
    return made
