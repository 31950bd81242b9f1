# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A coupling with an angle between its axes: moments at once and twice the shaft's speed."""

from collections.abc import Mapping
from typing import Any

from rotor_common.configuration import quantity
from rotor_sim.plant.element import Element
from rotor_sim.plant.elements.parallel_misalignment import once_and_twice, turning_numbers


class AngularMisalignment(Element):
    """M = angle (k_1 (cos, sin)(W t + phase_1) + k_2 (cos, sin)(2 W t + phase_2)) about y, z.

    The coupling bends its shaft in proportion to the angle between the axes. Its node tilts, so it
    has a moment of inertia or lies on a beam. Sources as of `parallel_misalignment`; the constant
    part is left out.
    """

    touches = (('node', ('theta_y', 'theta_z')),)
    live = ('misalignment_rad',)

    kind: str = 'angular_misalignment'
    node: str
    misalignment_rad: float = quantity(
        unit='rad', ge=0.0, le=0.2, description='angle between the two axes'
    )
    stiffness_1x_n_m_rad: float = quantity(
        0.0, unit='N m/rad', ge=0.0, le=1e12, description='moment at once the speed per angle, k_1'
    )
    stiffness_2x_n_m_rad: float = quantity(
        unit='N m/rad', ge=0.0, le=1e12, description='moment at twice the speed per angle, k_2'
    )
    phase_1x_rad: float = quantity(
        0.0, unit='rad', ge=-7.0, le=7.0, description='axis of the first at shaft angle 0, from +y'
    )
    phase_2x_rad: float = quantity(
        0.0, unit='rad', ge=-7.0, le=7.0, description='axis of the second at shaft angle 0, from +y'
    )

    def coefficients(self) -> Mapping[str, float | tuple[float, ...]]:
        """Return the stiffnesses and the axes at shaft angle 0."""
        return turning_numbers(
            self.stiffness_1x_n_m_rad,
            self.phase_1x_rad,
            self.stiffness_2x_n_m_rad,
            self.phase_2x_rad,
        )

    @staticmethod
    def force(p: Any, d: Any) -> Any:
        """Return the moment about y and z."""
        y, z = once_and_twice(p, d)
        return p.misalignment_rad * y, p.misalignment_rad * z
