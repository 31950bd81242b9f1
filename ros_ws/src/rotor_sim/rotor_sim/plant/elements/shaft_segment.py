# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A massless shaft between two nodes: a spring in y and z, with damping of three kinds."""

from collections.abc import Mapping
from typing import Any

from rotor_common.configuration import quantity
from rotor_sim.plant.element import TRANSLATIONS, Element


class ShaftSegment(Element):
    """Isotropic spring between two nodes; damping outside of the shaft and turning with it.

    The damping is (c + c_W W) q' + c_i (q' - W J q) with q the difference of the nodes' places and
    J q = (-z, y): the constant c, the part c_W in proportion to the speed W (Hou et al. 2016,
    c = 2 xi m W) and the internal damping c_i, which makes the rotor unstable above
    W = w_n (1 + c/c_i) (Genta, Dynamics of Rotating Systems, 2005, section 4.5).
    """

    touches = (('node', TRANSLATIONS), ('other', TRANSLATIONS))

    kind: str = 'shaft_segment'
    node: str
    other: str = 'ground'
    stiffness_n_m: float = quantity(unit='N/m', ge=1e-3, le=1e12, description='stiffness')
    damping_n_s_m: float = quantity(
        0.0, unit='N s/m', ge=0.0, le=1e9, description='constant damping'
    )
    damping_per_speed_n_s2_m: float = quantity(
        0.0, unit='N s^2/m', ge=0.0, le=1e6, description='damping in proportion to the speed'
    )
    internal_damping_n_s_m: float = quantity(
        0.0, unit='N s/m', ge=0.0, le=1e9, description='damping that turns with the shaft'
    )

    def structure(self) -> Mapping[str, Any]:
        """Return which kinds of damping there are."""
        return {
            'is_damped': self.damping_n_s_m > 0.0,
            'has_internal': self.internal_damping_n_s_m > 0.0,
        }

    @staticmethod
    def force(x: Any, v: Any, p: Any, d: Any, s: Any) -> Any:
        """Return the force on the node, then on the other."""
        bend_y, bend_z = x[0] - x[2], x[1] - x[3]
        rate_y, rate_z = v[0] - v[2], v[1] - v[3]
        damping = p.damping_per_speed_n_s2_m * d.speed_rad_s
        if s.is_damped:
            damping += p.damping_n_s_m
        force_y = p.stiffness_n_m * bend_y + damping * rate_y
        force_z = p.stiffness_n_m * bend_z + damping * rate_z
        if s.has_internal:
            force_y += p.internal_damping_n_s_m * (rate_y + d.speed_rad_s * bend_z)
            force_z += p.internal_damping_n_s_m * (rate_z - d.speed_rad_s * bend_y)
        return -force_y, -force_z, force_y, force_z
