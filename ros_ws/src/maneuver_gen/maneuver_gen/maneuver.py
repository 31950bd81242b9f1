# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The base class of maneuvers: parameters with units and ranges, and load factors.

A load factor is apparent gravity (g - a) in units of 9.81 m/s^2: the normal one pushes the rotor
to +y (down in the airframe; level flight is 1), the lateral one to +z (to the left wing).
"""

import abc
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pydantic

from maneuver_gen.curves import FloatArray
from maneuver_gen.errors import ManeuverError
from rotor_common.configuration import ConfigModel, quantity

LOAD_FACTOR_RANGE = (-3.0, 12.0)
LATERAL_LOAD_FACTOR_RANGE = (-3.0, 3.0)
LONGEST_S = 86400.0
_ROUND_OFF = 1e-9
"""Rounding error by which a limit may be exceeded."""


def load_factor_field(default: Any = ..., *, description: str) -> Any:
    """Return a field for a normal load factor, -3 to 12."""
    low, high = LOAD_FACTOR_RANGE
    return quantity(default, unit='1', description=description, ge=low, le=high)


def lateral_load_factor_field(description: str) -> Any:
    """Return a field for a lateral load factor, -3 to 3, by default 0."""
    low, high = LATERAL_LOAD_FACTOR_RANGE
    return quantity(0.0, unit='1', description=description, ge=low, le=high)


def time_field(default: Any = ..., *, description: str, ge: float = 0.0) -> Any:
    """Return a field for a time or a duration, s, up to a day."""
    return quantity(default, unit='s', description=description, ge=ge, le=LONGEST_S)


class Maneuver(ConfigModel, abc.ABC):
    """Base of every maneuver: a subclass is its parameters and `load_factors`."""

    profile: str
    """Name of the maneuver in a scenario; each subclass has its own as default."""
    part_of_sequence: ClassVar[bool] = True
    """Whether a segment of a sequence can be this maneuver."""

    @pydantic.field_validator('profile')
    @classmethod
    def _names_this_class(cls, profile: str) -> str:
        name, target = cls.model_fields['profile'].default, cls.target()
        if profile not in (name, target):
            raise ManeuverError(
                f'{profile!r} leads to {target}, whose name is {name!r}; write {target!r}, or '
                'register it under its name'
            )
        return profile

    @classmethod
    def target(cls) -> str:
        """Return `module:Class` of this class."""
        return f'{cls.__module__}:{cls.__qualname__}'

    @abc.abstractmethod
    def load_factors(self, times_s: FloatArray) -> FloatArray:
        """Return load factors at times from the maneuver's start, s.

        Shape (n,): normal alone; or (n, 2): normal, lateral. Each value depends on its own time
        only, bit for bit, whatever its position in the array: use `curves.sin` and `curves.cos`
        instead of NumPy's. The maneuver has no end: `times_s` may be as late as a run needs.
        """

    def sample(self, times_s: FloatArray) -> FloatArray:
        """Return (n, 2) load factors; raises ManeuverError for a wrong shape or range."""
        factors = np.asarray(self.load_factors(times_s), dtype=np.float64)
        if factors.shape == times_s.shape:
            factors = np.column_stack((factors, np.zeros_like(times_s)))
        if factors.shape != (len(times_s), 2):
            raise ManeuverError(
                f'the maneuver {self.profile} gives load factors of shape {factors.shape} for '
                f'{len(times_s)} times; it must be ({len(times_s)},) or ({len(times_s)}, 2)'
            )
        ranges = ('', LOAD_FACTOR_RANGE), ('lateral ', LATERAL_LOAD_FACTOR_RANGE)
        for column, (kind, (low, high)) in zip(factors.T, ranges, strict=True):
            wrong = ~((column >= low - _ROUND_OFF) & (column <= high + _ROUND_OFF))  # NaN too
            if wrong.any():
                first = int(np.argmax(wrong))
                raise ManeuverError(
                    f'the maneuver {self.profile} gives a {kind}load factor of '
                    f'{column[first]:.4g} at {times_s[first]:g} s; allowed: {low:g} to {high:g}'
                )
        return factors

    def check_duration(self, duration_s: float) -> None:
        """Raise ManeuverError unless the maneuver can be flown for `duration_s`, s."""

    def flight_path_angle(self, times_s: FloatArray) -> FloatArray:
        """Return the flight-path angle, rad, shape (n,), positive climbing; NaN: it has none."""
        return np.full_like(times_s, math.nan)

    @classmethod
    def resolve_paths(cls, data: Mapping[str, Any], folder: Path) -> Mapping[str, Any]:  # noqa: ARG003
        """Return plain data, not validated yet, with files relative to `folder` made absolute."""
        return data


def check_range(least: float, most: float, remedy: str) -> None:
    """Raise ManeuverError if the normal load factor can leave its range."""
    low, high = LOAD_FACTOR_RANGE
    if least < low - _ROUND_OFF or most > high + _ROUND_OFF:
        raise ManeuverError(
            f'the load factor could run from {least:.4g} to {most:.4g}; allowed: {low:g} to '
            f'{high:g}, so {remedy}'
        )
