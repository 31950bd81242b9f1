# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A support: springs and dampers along y and z, as of a housing on its pedestal."""

from collections.abc import Mapping

import numpy as np

from rotor_common.configuration import quantity
from rotor_sim.plant.element import TRANSLATIONS, Element, Matrices


class Support(Element):
    """Springs k_y, k_z, k_yz and dampers c_y, c_z between a node and the ground or another.

    Unequal springs split a critical speed in two and make a backward whirl between them (Genta,
    Dynamics of Rotating Systems, 2005, section 3.5).
    """

    touches = (('node', TRANSLATIONS), ('base', TRANSLATIONS))

    kind: str = 'support'
    node: str
    base: str = 'ground'
    stiffness_y_n_m: float = quantity(
        unit='N/m', ge=0.0, le=1e12, description='stiffness k_y along y'
    )
    stiffness_z_n_m: float = quantity(
        unit='N/m', ge=0.0, le=1e12, description='stiffness k_z along z'
    )
    stiffness_yz_n_m: float = quantity(
        0.0, unit='N/m', ge=-1e12, le=1e12, description='symmetric coupling k_yz of y and z'
    )
    damping_y_n_s_m: float = quantity(
        0.0, unit='N s/m', ge=0.0, le=1e9, description='damping c_y along y'
    )
    damping_z_n_s_m: float = quantity(
        0.0, unit='N s/m', ge=0.0, le=1e9, description='damping c_z along z'
    )

    def matrices(self, positions_m: Mapping[str, float]) -> Matrices:  # noqa: ARG002
        """Return stiffness and damping; (4, 4), the node's y, z, then the base's."""
        stiffness = np.array(
            [
                [self.stiffness_y_n_m, self.stiffness_yz_n_m],
                [self.stiffness_yz_n_m, self.stiffness_z_n_m],
            ]
        )
        damping = np.diag([self.damping_y_n_s_m, self.damping_z_n_s_m])
        ends = np.array([[1.0, -1.0], [-1.0, 1.0]])
        return Matrices(stiffness=np.kron(ends, stiffness), damping=np.kron(ends, damping))
