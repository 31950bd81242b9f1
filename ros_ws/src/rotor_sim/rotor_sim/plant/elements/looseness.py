# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Looseness: a support that holds less beyond a gap on one side, as with a loose bolt."""

import math
from collections.abc import Mapping
from typing import Any

from rotor_common.configuration import quantity
from rotor_sim.plant.element import TRANSLATIONS, Element


class Looseness(Element):
    """Takes stiffness away from a spring on one side: bilinear, with a continuous force.

    With u = n . x the displacement along n and k the spring's stiffness there, it gives back
    s k (u - gap) along n where u > gap: beyond the gap the spring has (1 - s) k left. The spring
    itself is a `support` or a shaft segment. Free vibration with gap 0 has the frequency
    2 w1 w2/(w1 + w2) (Shaw and Holmes, J. Sound Vib. 90 (1983) 129).
    """

    touches = (('node', TRANSLATIONS), ('base', TRANSLATIONS))
    live = ('lost_share',)

    kind: str = 'looseness'
    node: str
    base: str = 'ground'
    stiffness_n_m: float = quantity(
        unit='N/m', ge=0.0, le=1e12, description='stiffness k of the spring that comes loose'
    )
    lost_share: float = quantity(
        unit='1', ge=0.0, le=1.0, description='share s of k that is lost beyond the gap'
    )
    gap_m: float = quantity(
        0.0, unit='m', ge=-0.1, le=0.1, description='displacement along n from which it is lost'
    )
    angle_rad: float = quantity(
        math.pi,
        unit='rad',
        ge=-7.0,
        le=7.0,
        description='direction n of the loose side from +y, y to z; pi: against a positive load',
    )

    def coefficients(self) -> Mapping[str, float | tuple[float, ...]]:
        """Return the spring, the gap and the direction."""
        return {
            'stiffness': self.stiffness_n_m,
            'gap': self.gap_m,
            'cos': math.cos(self.angle_rad),
            'sin': math.sin(self.angle_rad),
        }

    @staticmethod
    def force(x: Any, p: Any) -> Any:
        """Return the force on the node, then on the base."""
        along = (x[0] - x[2]) * p.cos + (x[1] - x[3]) * p.sin
        lost = p.lost_share * p.stiffness * max(along - p.gap, 0.0)
        force_y, force_z = lost * p.cos, lost * p.sin
        return force_y, force_z, -force_y, -force_z
