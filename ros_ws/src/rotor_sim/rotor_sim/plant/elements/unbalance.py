# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""An unbalance: a centre of mass beside the axis, which turns with the shaft."""

import math
from collections.abc import Mapping
from typing import Any

from rotor_common.configuration import quantity
from rotor_sim.plant.arithmetic import turned
from rotor_sim.plant.element import TRANSLATIONS, Element


class Unbalance(Element):
    """Mass times eccentricity at an angle from the heavy spot's reference, angle 0 = +y.

    F = U (W^2 (cos, sin) + W' (sin, -cos)) of the shaft angle plus the phase.
    """

    touches = (('node', TRANSLATIONS),)
    live = ('unbalance_kg_m',)

    kind: str = 'unbalance'
    node: str
    unbalance_kg_m: float = quantity(
        unit='kg m', ge=0.0, le=100.0, description='mass times eccentricity'
    )
    phase_rad: float = quantity(
        0.0, unit='rad', ge=-7.0, le=7.0, description='angle from +y at shaft angle 0, y to z'
    )

    def coefficients(self) -> Mapping[str, float | tuple[float, ...]]:
        """Return the cosine and sine of the phase."""
        return {'cos': math.cos(self.phase_rad), 'sin': math.sin(self.phase_rad)}

    def structure(self) -> Mapping[str, Any]:
        """Return whether the phase has to be added."""
        return {'is_turned': self.phase_rad != 0.0}

    @staticmethod
    def force(p: Any, d: Any, s: Any) -> Any:
        """Return the centrifugal force, and that of an accelerating shaft."""
        c, s_ = d.cos, d.sin
        if s.is_turned:
            c, s_ = turned(c, s_, p.cos, p.sin)
        square = d.speed_rad_s * d.speed_rad_s
        slope = d.acceleration_rad_s2
        u = p.unbalance_kg_m
        return u * (square * c + slope * s_), u * (square * s_ - slope * c)
