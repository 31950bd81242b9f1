# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A radial ball bearing: Hertzian contacts of balls that turn with the cage, eq. (2)."""

import math
from collections.abc import Mapping
from typing import Any, Self

import numpy as np
import pydantic

from rotor_common.configuration import quantity
from rotor_sim.errors import PlantError
from rotor_sim.plant.arithmetic import power_1_5, turned
from rotor_sim.plant.element import TRANSLATIONS, Element

_HALF_ROOT = math.sqrt(0.5)


def pressed(q: float, clearance: float, is_pair: bool) -> float:
    """Return the press of a ball at q; of a pair, less that of the ball opposite.

    Of a pair with clearance never are both pressed, so one number tells both.
    """
    if is_pair:
        return q - min(max(q, -clearance), clearance)
    return q - min(q, clearance)


class BallBearing(Element):
    """Force of the balls on the journal and, opposite, on the housing (Hou et al. 2016, eq. 2).

    A ball at the angle a is pressed by y cos(a) + z sin(a) - clearance, and carries
    K_b pressed^1.5. The cage rolls at r_i/(r_i + r_o) of the shaft's speed. A negative clearance
    is a preload: then a ball carries wherever the journal is.
    """

    touches = (('node', TRANSLATIONS), ('housing', TRANSLATIONS))

    kind: str = 'ball_bearing'
    node: str
    housing: str = 'ground'
    ball_count: int = quantity(8, unit='1', ge=3, le=64, description='balls N_b')
    contact_stiffness_n_m15: float = quantity(
        1.334e10, unit='N/m^1.5', ge=0.0, le=1e13, description='Hertzian stiffness K_b of a ball'
    )
    clearance_m: float = quantity(
        0.0, unit='m', ge=-1e-4, le=1e-4, description='radial clearance; negative: preload'
    )
    inner_radius_m: float = quantity(
        0.0401, unit='m', ge=1e-3, le=10.0, description='radius r_i of the inner race'
    )
    outer_radius_m: float = quantity(
        0.0639, unit='m', ge=1e-3, le=10.0, description='radius r_o of the outer race'
    )

    @pydantic.model_validator(mode='after')
    def _check(self) -> Self:
        if self.outer_radius_m <= self.inner_radius_m:
            raise PlantError(
                f'outer_radius_m = {self.outer_radius_m:g} m is not above inner_radius_m = '
                f'{self.inner_radius_m:g} m; the balls need room between the races'
            )
        return self

    @property
    def _directions(self) -> int:
        """Pairs of opposite balls, or balls where there are no pairs."""
        return self.ball_count // 2 if self._is_paired else self.ball_count

    @property
    def _is_paired(self) -> bool:
        return self.ball_count % 2 == 0 and self.clearance_m >= 0.0

    def rotations(self) -> Mapping[str, float]:
        """Return the cage: pure rolling on an outer race at rest."""
        return {'cage': self.inner_radius_m / (self.inner_radius_m + self.outer_radius_m)}

    def coefficients(self) -> Mapping[str, float | tuple[float, ...]]:
        """Return stiffness, clearance and the directions of the balls in the frame of the cage."""
        angles = 2.0 * np.pi * np.arange(self._directions) / self.ball_count
        return {
            'stiffness': self.contact_stiffness_n_m15,
            'clearance': self.clearance_m,
            'cosines': tuple(map(float, np.cos(angles))),
            'sines': tuple(map(float, np.sin(angles))),
        }

    def structure(self) -> Mapping[str, Any]:
        """Return how the balls stand to each other."""
        return {
            'is_paired': self._is_paired,
            'directions': self._directions,
            'is_eight': self._is_paired and self.ball_count == 8,
        }

    @staticmethod
    def force(x: Any, p: Any, d: Any, s: Any) -> Any:
        """Return the sum of the contacts on the journal, then on the housing."""
        y, z, housing_y, housing_z = x
        # in the frame of the cage the balls stand still
        q, r = turned(y - housing_y, z - housing_z, d.cos_cage, -d.sin_cage)
        if s.is_eight:  # at 0, 45, 90 and 135 degrees: no direction is needed
            f0 = power_1_5(pressed(q, p.clearance, s.is_paired))
            f1 = power_1_5(pressed(_HALF_ROOT * (q + r), p.clearance, s.is_paired))
            f2 = power_1_5(pressed(r, p.clearance, s.is_paired))
            f3 = power_1_5(pressed(_HALF_ROOT * (r - q), p.clearance, s.is_paired))
            along = f0 + _HALF_ROOT * (f1 - f3)
            across = f2 + _HALF_ROOT * (f1 + f3)
        else:
            along, across = 0.0, 0.0
            for j in range(s.directions):
                where = q * p.cosines[j] + r * p.sines[j]
                f = power_1_5(pressed(where, p.clearance, s.is_paired))
                along += f * p.cosines[j]
                across += f * p.sines[j]
        force_y, force_z = turned(along, across, d.cos_cage, d.sin_cage)
        force_y *= p.stiffness
        force_z *= p.stiffness
        return -force_y, -force_z, force_y, force_z
