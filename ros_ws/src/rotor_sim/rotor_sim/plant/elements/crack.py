# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A transverse crack in a massless shaft between two nodes, with opening laws by name."""

import math
from collections.abc import Mapping
from math import sqrt
from typing import Any, Literal

import pydantic

from rotor_common.configuration import quantity
from rotor_sim.plant.arithmetic import turned
from rotor_sim.plant.element import TRANSLATIONS, Element


class Crack(Element):
    """Takes f K k n n' away from the stiffness k of a shaft segment, n turning with the shaft.

    n = (cos psi, sin psi) with psi the shaft angle plus the crack's. With bend b = node - other
    and u = n . b, the crack is open for u > 0 if the node is on the side that bends outward, as a
    disk between two bearings. The force along n is f K k u on the node and the opposite on the
    other, with f by the law:

    - `gasch`, a hinge: 1 for u > 0, else 0 (Gasch, J. Sound Vib. 160 (1993) 313)
    - `mayes`: (1 + u/|b|)/2, the cosine of the angle between crack and bend (Mayes and Davies,
      J. Vib. Acoust. 106 (1984) 139)
    - `open`: 1, a notch

    The force is continuous in all three. Stiffness across n stays whole.
    """

    touches = (('node', TRANSLATIONS), ('other', TRANSLATIONS))
    live = ('stiffness_ratio',)

    kind: str = 'crack'
    node: str
    other: str = 'ground'
    law: Literal['gasch', 'mayes', 'open'] = pydantic.Field(
        default='gasch', description='how the crack opens'
    )
    stiffness_n_m: float = quantity(
        unit='N/m', ge=0.0, le=1e12, description='stiffness k of the shaft segment'
    )
    stiffness_ratio: float = quantity(
        unit='1', ge=0.0, le=0.95, description='K = dk/k, what the open crack takes of k along n'
    )
    angle_rad: float = quantity(
        0.0, unit='rad', ge=-7.0, le=7.0, description='angle from +y to the crack at shaft angle 0'
    )

    def coefficients(self) -> Mapping[str, float | tuple[float, ...]]:
        """Return the stiffness and the direction of the crack at shaft angle 0."""
        return {
            'stiffness': self.stiffness_n_m,
            'cos': math.cos(self.angle_rad),
            'sin': math.sin(self.angle_rad),
        }

    def structure(self) -> Mapping[str, Any]:
        """Return the law."""
        return {'law': self.law}

    def labels(self) -> Mapping[str, float]:
        """Return the angle of the crack."""
        return {'angle_rad': self.angle_rad}

    @staticmethod
    def force(x: Any, p: Any, d: Any, s: Any) -> Any:
        """Return what the open crack gives back of the elastic force, on the node and the other."""
        bend_y, bend_z = x[0] - x[2], x[1] - x[3]
        n_y, n_z = turned(d.cos, d.sin, p.cos, p.sin)
        u = n_y * bend_y + n_z * bend_z
        if s.law == 'gasch':
            opened = max(u, 0.0)
        elif s.law == 'mayes':
            square = bend_y * bend_y + bend_z * bend_z
            has_bent = square > 0.0
            bend = sqrt(square if has_bent else 1.0)
            opened = (0.5 + 0.5 * (u / bend)) * u
        else:
            opened = u
        lost = p.stiffness_ratio * p.stiffness * opened
        force_y, force_z = lost * n_y, lost * n_z
        return force_y, force_z, -force_y, -force_z
