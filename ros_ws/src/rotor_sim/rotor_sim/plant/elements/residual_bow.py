# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A residual bow: a shaft that is bent without load, which turns with it."""

import math
from collections.abc import Mapping
from typing import Any

from rotor_common.configuration import quantity
from rotor_sim.plant.arithmetic import turned
from rotor_sim.plant.element import TRANSLATIONS, Element


class ResidualBow(Element):
    """The elastic force of a spring that is at rest with its node at the bow b, not at 0.

    F = k b (cos, sin)(shaft angle + phase) on the node and -F on the other end, beside the shaft
    segment of the same stiffness k. A Jeffcott rotor with damping is still at the speed
    W = w_n sqrt(b/e) if the bow is opposite the unbalance (Nicholas, Gunter and Allaire, J. Eng.
    Power 98 (1976) 171).
    """

    touches = (('node', TRANSLATIONS), ('other', TRANSLATIONS))
    live = ('bow_m',)

    kind: str = 'residual_bow'
    node: str
    other: str = 'ground'
    stiffness_n_m: float = quantity(
        unit='N/m', ge=0.0, le=1e12, description='stiffness k of the shaft between the ends'
    )
    bow_m: float = quantity(
        unit='m', ge=0.0, le=0.1, description='bow b of the node out of the line of the ends'
    )
    phase_rad: float = quantity(
        0.0, unit='rad', ge=-7.0, le=7.0, description='angle from +y at shaft angle 0, y to z'
    )

    def coefficients(self) -> Mapping[str, float | tuple[float, ...]]:
        """Return the stiffness and the direction at shaft angle 0."""
        return {
            'stiffness': self.stiffness_n_m,
            'cos': math.cos(self.phase_rad),
            'sin': math.sin(self.phase_rad),
        }

    @staticmethod
    def force(p: Any, d: Any) -> Any:
        """Return the force on the node, then on the other."""
        c, s_ = turned(d.cos, d.sin, p.cos, p.sin)
        size = p.stiffness * p.bow_m
        force_y, force_z = size * c, size * s_
        return force_y, force_z, -force_y, -force_z
