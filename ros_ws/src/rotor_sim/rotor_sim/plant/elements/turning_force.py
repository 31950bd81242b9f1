# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A force that turns with a multiple of the shaft's speed, as from a misaligned coupling."""

import math
from collections.abc import Mapping
from typing import Any

from rotor_common.configuration import quantity
from rotor_sim.plant.arithmetic import turned
from rotor_sim.plant.element import TRANSLATIONS, Element


class TurningForce(Element):
    """F = amplitude (cos, sin)(order x shaft angle + phase) along y, z."""

    touches = (('node', TRANSLATIONS),)
    live = ('amplitude_n',)

    kind: str = 'turning_force'
    node: str
    order: int = quantity(2, unit='1', ge=1, le=2, description='turns of the force per turn')
    amplitude_n: float = quantity(unit='N', ge=0.0, le=1e6, description='size of the force')
    phase_rad: float = quantity(
        0.0, unit='rad', ge=-7.0, le=7.0, description='direction at shaft angle 0, from y to z'
    )

    def coefficients(self) -> Mapping[str, float | tuple[float, ...]]:
        """Return the cosine and sine of the phase."""
        return {'cos': math.cos(self.phase_rad), 'sin': math.sin(self.phase_rad)}

    def structure(self) -> Mapping[str, Any]:
        """Return the order."""
        return {'order': self.order}

    @staticmethod
    def force(p: Any, d: Any, s: Any) -> Any:
        """Return the force along y and z."""
        c, s_ = d.cos, d.sin
        for _ in range(s.order - 1):
            c, s_ = turned(c, s_, d.cos, d.sin)
        force_y, force_z = turned(c, s_, p.cos, p.sin)
        return p.amplitude_n * force_y, p.amplitude_n * force_z
