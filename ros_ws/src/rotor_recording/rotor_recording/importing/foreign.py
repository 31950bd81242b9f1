# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The common form of foreign files: columns of numbers and metadata."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Column = NDArray[np.float64]

NAMES_SHOWN = 12


@dataclass(frozen=True)
class Stated:
    """What a file of a known layout says about itself; options of the command override it."""

    channels: Mapping[str, str] = field(default_factory=dict)
    unit: str | None = None
    rate_hz: float | None = None
    speed_hz: float | None = None


class ForeignFile(Protocol):
    """A file whose columns can be read by name."""

    format: str
    stated: Stated
    facts: Mapping[str, str | float]
    """Scalars and texts of the file, which are stored in the configuration."""
    layout: Mapping[str, str | int]
    """How the file was read, stored in the configuration: delimiter, first and last line."""
    warnings: tuple[str, ...]
    """Sentences about what was left out."""

    def column(self, key: str) -> Column:
        """Return a column (samples,); raises ImportFileError if there is none of that name."""


def listed(names: list[str]) -> str:
    """Return the first names as a list in a sentence."""
    more = f' and {len(names) - NAMES_SHOWN} more' if len(names) > NAMES_SHOWN else ''
    return ', '.join(names[:NAMES_SHOWN]) + more
