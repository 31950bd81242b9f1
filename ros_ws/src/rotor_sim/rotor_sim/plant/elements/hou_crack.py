# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The breathing crack of Hou et al. 2016 in a shaft between two bearings, eqs. (3) and (4)."""

import math
from collections.abc import Mapping
from math import sqrt
from typing import Any, Literal

import pydantic

from rotor_common.configuration import quantity
from rotor_sim.plant.arithmetic import cos_sin, half_angle, turned
from rotor_sim.plant.breathing import breathing_polynomial
from rotor_sim.plant.element import TRANSLATIONS, Element
from rotor_sim.plant.parameters import HIGHEST_CRACK, PhaseConvention, ThetaConvention

POLYNOMIAL_TERMS = 20
"""Of the breathing function; its error is below 1e-14."""


def direction(y: float, z: float, cos_psi: float, sin_psi: float, p: Any) -> Any:
    """Return r cos(theta), r sin(theta) and r > 0, with theta = psi - phi; phi = 0 at rest."""
    square = y * y + z * z
    has_moved = square > 0.0
    flip = p.phase_flip if z < 0.0 else 1.0
    is_from_z = p.phase_from_z > 0.0
    along = flip * z if is_from_z else y
    across = flip * y if is_from_z else z
    along = along if has_moved else 1.0
    across = across if has_moved else 0.0
    cosine = cos_psi * along + sin_psi * across
    sine = sin_psi * along - cos_psi * across
    return cosine, sine, sqrt(square if has_moved else 1.0)


def breathing(cosine: float, sine: float, r: float, p: Any, s: Any) -> Any:
    """Return f of eq. (4) where (cosine, sine) are r times those of theta.

    With u = asin(cos(theta)) it is (1 + sin(pi u/(2 alpha)))/2 in |u| <= alpha, and 1 or 0
    outside. For theta in (3pi/2 + alpha, 2pi) `gap` = 0 closes the crack, and a higher
    `limit_beyond` continues the last branch.
    """
    # `place` is sin(u), u itself or tan(u/2): each grows with u
    if s.curve == 'closed form':
        place = cosine / r
    elif s.curve == 'angle':
        place = half_angle(sine, cosine, r)
    else:
        place = cosine / (r + abs(sine))
    is_beyond = sine < 0.0 and place > p.limit
    place = min(max(place, -p.limit), p.limit_beyond if is_beyond else p.limit)
    if s.curve == 'closed form':  # alpha = 30 degrees: sin(3u) = 3 sin(u) - 4 sin(u)^3
        f = (0.5 + 1.5 * place) - (2.0 * place) * (place * place)
    elif s.curve == 'angle':
        _, swing = cos_sin(place * p.rate)
        f = 0.5 + 0.5 * swing
    else:
        # even and odd terms apart, since each product waits for the one before
        square = place * place
        fourth = square * square
        odd, even = 0.0, 0.0
        for k in range(len(p.polynomial) // 2):
            odd = odd * fourth + p.polynomial[2 * k]
            even = even * fourth + p.polynomial[2 * k + 1]
        f = 0.5 + place * (odd * square + even)
    return f * (p.gap if is_beyond else 1.0)


class HouCrack(Element):
    """A crack beside the disk that opens with theta = W t + beta - phi, phi the disk's direction.

    The open crack takes f dk n n' away from the stiffness of either shaft side, n = (cos psi,
    sin psi) with psi the crack's angle, dk = K k. docs/physics.md tells the readings of the paper's
    equations.
    """

    touches = (
        ('disk', TRANSLATIONS),
        ('bearing_1', TRANSLATIONS),
        ('bearing_2', TRANSLATIONS),
    )
    live = ('stiffness_ratio',)

    kind: str = 'hou_crack'
    disk: str
    bearing_1: str
    bearing_2: str
    shaft_stiffness_n_m: float = quantity(
        2.5e7, unit='N/m', ge=1e3, le=1e11, description='stiffness k of the shaft, each side'
    )
    stiffness_ratio: float = quantity(
        unit='1', ge=0.0, le=HIGHEST_CRACK, description='K = dk/k of the open crack'
    )
    angle_rad: float = quantity(
        math.pi / 3,
        unit='rad',
        ge=-2 * math.pi,
        le=2 * math.pi,
        description='beta, angle from +y to the crack at shaft angle 0',
    )
    half_angle_rad: float = quantity(
        math.pi / 6,
        unit='rad',
        ge=0.01,
        le=math.pi / 2,
        description='alpha, half of the crack angle',
    )
    disk_scale: float = quantity(
        1.0, unit='1', gt=0.0, le=10.0, description='factor on dk in the equations of the disk'
    )
    bearing_scale: float = quantity(
        1.0, unit='1', gt=0.0, le=10.0, description='factor on dk in those of the bearings'
    )
    coupling_sign: Literal[-1, 1] = pydantic.Field(
        default=-1, description='sign of k_yz = sign f dk sin(psi) cos(psi)'
    )
    phase_convention: PhaseConvention = pydantic.Field(
        default='atan2_z_y', description='how phi follows from the place of the disk'
    )
    theta_convention: ThetaConvention = pydantic.Field(
        default='continuous', description='how theta is wrapped into the branches of eq. (4)'
    )

    @property
    def _curve(self) -> str:
        if abs(self.half_angle_rad - math.pi / 6.0) < 1e-12:
            return 'closed form'
        return 'angle' if self.theta_convention == 'last_branch' else 'polynomial'

    def coefficients(self) -> Mapping[str, float | tuple[float, ...]]:
        """Return the readings of the equations as numbers."""
        alpha = self.half_angle_rad
        polynomial: tuple[float, ...] = ()
        match self._curve:
            case 'closed form':
                limit, widest = math.sin(alpha), 1.0
            case 'angle':
                limit, widest = alpha, 0.5 * math.pi
            case _:
                limit, widest = math.tan(0.5 * alpha), 1.0
                polynomial = tuple(map(float, breathing_polynomial(alpha, POLYNOMIAL_TERMS)[0]))
        return {
            'lost_at_disk': self.disk_scale * self.shaft_stiffness_n_m,
            'lost_at_bearing': self.bearing_scale * self.shaft_stiffness_n_m,
            'coupling': -float(self.coupling_sign),
            'cos_crack': math.cos(self.angle_rad),
            'sin_crack': math.sin(self.angle_rad),
            'phase_from_z': float(self.phase_convention != 'atan2_z_y'),
            'phase_flip': -1.0 if self.phase_convention == 'arctan_y_over_z' else 1.0,
            'limit': limit,
            'limit_beyond': widest if self.theta_convention == 'last_branch' else limit,
            'rate': 0.5 * math.pi / alpha,
            'gap': float(self.theta_convention != 'gap_open'),
            'edge': math.sin(alpha),
            'flips': float(self.phase_convention == 'arctan_y_over_z'),
            'jumps': float(self.theta_convention != 'continuous'),
            'polynomial': polynomial,
        }

    def structure(self) -> Mapping[str, Any]:
        """Return how the breathing function is computed."""
        return {'curve': self._curve}

    @staticmethod
    def force(x: Any, p: Any, d: Any, s: Any) -> Any:
        """Return what the open crack gives back of the shaft's elastic force."""
        y, z, y1, z1, y2, z2 = x
        cos_psi, sin_psi = turned(d.cos, d.sin, p.cos_crack, p.sin_crack)
        cosine, sine, r = direction(y, z, cos_psi, sin_psi, p)
        f = breathing(cosine, sine, r, p, s)
        turned_psi = sin_psi * p.coupling
        bend_1 = cos_psi * (y - y1) + turned_psi * (z - z1)
        bend_2 = cos_psi * (y - y2) + turned_psi * (z - z2)
        cut = f * p.stiffness_ratio
        lost = cut * (p.lost_at_disk * (bend_1 + bend_2))
        lost_1 = cut * (p.lost_at_bearing * bend_1)
        lost_2 = cut * (p.lost_at_bearing * bend_2)
        return (
            cos_psi * lost,
            turned_psi * lost,
            -cos_psi * lost_1,
            -turned_psi * lost_1,
            -cos_psi * lost_2,
            -turned_psi * lost_2,
        )

    @staticmethod
    def switches(x: Any, p: Any, d: Any) -> Any:
        """Return what is zero where phi flips and where theta passes 3pi/2 + alpha and 2pi."""
        y, z, _, _, _, _ = x
        cos_psi, sin_psi = turned(d.cos, d.sin, p.cos_crack, p.sin_crack)
        is_from_z = p.phase_from_z > 0.0
        along = z if is_from_z else y
        across = y if is_from_z else z
        cosine = cos_psi * along + sin_psi * across
        sine = sin_psi * along - cos_psi * across
        edge = p.edge * p.edge * (y * y + z * z)
        return p.flips * z, p.jumps * sine, p.jumps * (cosine * cosine - edge)
