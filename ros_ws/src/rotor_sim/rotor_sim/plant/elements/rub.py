# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A rub: the shaft touches a ring or a sector beyond a gap, with Coulomb friction."""

import math
from collections.abc import Mapping
from math import sqrt
from typing import Any

from rotor_common.configuration import quantity
from rotor_sim.plant.element import TRANSLATIONS, Element


class Rub(Element):
    """Radial spring beyond a gap and Coulomb friction against the sliding of the surface.

    With r the distance of the node from the centre of the ring, N = k (r - gap) where r > gap.
    The friction is mu N against u = R W + v_t, the velocity of the surface in the direction of
    turning (R shaft radius, v_t tangential velocity of the node): on a fast shaft it pushes
    backward. Below the slip velocity u_s it is mu N u/u_s, so the force has no jump in u. A sector
    ends sharply. The torque on the drive is left out, since the speed is given. Source: Muszynska,
    Rotordynamics, 2005, ch. 5; Jiang and Ulbrich, Nonlinear Dynamics 24 (2001) 269.
    """

    touches = (('node', TRANSLATIONS), ('stator', TRANSLATIONS))
    live = ('stiffness_n_m',)

    kind: str = 'rub'
    node: str
    stator: str = 'ground'
    stiffness_n_m: float = quantity(
        unit='N/m', ge=0.0, le=1e12, description='stiffness k of the contact; 0: no contact'
    )
    gap_m: float = quantity(unit='m', ge=1e-9, le=1.0, description='radial gap of a centred node')
    friction_coefficient: float = quantity(
        0.0, unit='1', ge=0.0, le=2.0, description='Coulomb friction mu'
    )
    shaft_radius_m: float = quantity(
        0.0, unit='m', ge=0.0, le=10.0, description='radius R of the surface that rubs'
    )
    slip_velocity_m_s: float = quantity(
        1e-3, unit='m/s', ge=1e-9, le=10.0, description='sliding u_s from which friction is full'
    )
    centre_y_m: float = quantity(
        0.0, unit='m', ge=-1.0, le=1.0, description='place of the ring on the stator along y'
    )
    centre_z_m: float = quantity(
        0.0, unit='m', ge=-1.0, le=1.0, description='place of the ring on the stator along z'
    )
    sector_angle_rad: float = quantity(
        0.0, unit='rad', ge=-7.0, le=7.0, description='middle of the sector from +y, y to z'
    )
    sector_half_width_rad: float = quantity(
        math.pi,
        unit='rad',
        ge=0.01,
        le=math.pi,
        description='half of the angle of the sector; pi: the whole ring',
    )

    def coefficients(self) -> Mapping[str, float | tuple[float, ...]]:
        """Return the ring, the friction and the sector as a direction and its edge."""
        return {
            'stiffness_n_m': self.stiffness_n_m,
            'gap': self.gap_m,
            'friction': self.friction_coefficient,
            'radius': self.shaft_radius_m,
            'slip': self.slip_velocity_m_s,
            'centre_y': self.centre_y_m,
            'centre_z': self.centre_z_m,
            'sector_y': math.cos(self.sector_angle_rad),
            'sector_z': math.sin(self.sector_angle_rad),
            'edge': math.cos(self.sector_half_width_rad),
        }

    def structure(self) -> Mapping[str, Any]:
        """Return whether the ring is whole, and whether there is friction."""
        return {
            'is_whole': self.sector_half_width_rad == math.pi,
            'has_friction': self.friction_coefficient > 0.0,
        }

    def labels(self) -> Mapping[str, float]:
        """Return the gap and the friction."""
        return {'gap_m': self.gap_m, 'friction_coefficient': self.friction_coefficient}

    @staticmethod
    def force(x: Any, v: Any, p: Any, d: Any, s: Any) -> Any:
        """Return the force on the node, then on the stator."""
        y, z = x[0] - x[2] - p.centre_y, x[1] - x[3] - p.centre_z
        r = sqrt(y * y + z * z)
        normal = p.stiffness_n_m * max(r - p.gap, 0.0)
        if not s.is_whole:
            normal = normal if p.sector_y * y + p.sector_z * z >= p.edge * r else 0.0
        # no division by 0: in contact r is above the gap
        reach = max(r, p.gap)
        n_y, n_z = y / reach, z / reach
        force_y, force_z = normal * n_y, normal * n_z
        if s.has_friction:
            slide = p.radius * d.speed_rad_s + n_y * (v[1] - v[3]) - n_z * (v[0] - v[2])
            drag = p.friction * normal * min(max(slide / p.slip, -1.0), 1.0)
            force_y -= drag * n_z
            force_z += drag * n_y
        return -force_y, -force_z, force_y, force_z

    @staticmethod
    def switches(x: Any, p: Any, s: Any) -> Any:
        """Return what is zero on the edges of a sector, where the contact force jumps."""
        if s.is_whole:
            return ()
        y, z = x[0] - x[2] - p.centre_y, x[1] - x[3] - p.centre_z
        return p.sector_y * y + p.sector_z * z - p.edge * sqrt(y * y + z * z)
