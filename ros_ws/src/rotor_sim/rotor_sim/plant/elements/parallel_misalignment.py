# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A coupling with a parallel offset: forces at once and twice the speed of the shaft."""

import math
from collections.abc import Mapping
from typing import Any

from rotor_common.configuration import quantity
from rotor_sim.plant.arithmetic import turned
from rotor_sim.plant.element import TRANSLATIONS, Element


def turning_numbers(
    first: float, first_phase_rad: float, second: float, second_phase_rad: float
) -> Mapping[str, float]:
    """Return the numbers p of `once_and_twice`."""
    return {
        'first': first,
        'second': second,
        'cos_1': math.cos(first_phase_rad),
        'sin_1': math.sin(first_phase_rad),
        'cos_2': math.cos(second_phase_rad),
        'sin_2': math.sin(second_phase_rad),
    }


def once_and_twice(p: Any, d: Any) -> Any:
    """Return p.first (cos, sin)(W t + phase 1) + p.second (cos, sin)(2 W t + phase 2)."""
    first_y, first_z = turned(d.cos, d.sin, p.cos_1, p.sin_1)
    c, s = turned(d.cos, d.sin, d.cos, d.sin)
    second_y, second_z = turned(c, s, p.cos_2, p.sin_2)
    return p.first * first_y + p.second * second_y, p.first * first_z + p.second * second_z


class ParallelMisalignment(Element):
    """F = offset (k_1 (cos, sin)(W t + phase_1) + k_2 (cos, sin)(2 W t + phase_2)).

    The coupling pushes its hub in proportion to the offset of the axes; how much of it turns once
    and twice a turn depends on the coupling, so both stiffnesses are given (Gibbons, 5th
    Turbomachinery Symposium, 1976; Xu and Marangoni, J. Sound Vib. 176 (1994) 663). The constant
    part, which only shifts the equilibrium, is left out.
    """

    touches = (('node', TRANSLATIONS),)
    live = ('offset_m',)

    kind: str = 'parallel_misalignment'
    node: str
    offset_m: float = quantity(
        unit='m', ge=0.0, le=0.1, description='distance of the two axes at the coupling'
    )
    stiffness_1x_n_m: float = quantity(
        0.0, unit='N/m', ge=0.0, le=1e12, description='force at once the speed per offset, k_1'
    )
    stiffness_2x_n_m: float = quantity(
        unit='N/m', ge=0.0, le=1e12, description='force at twice the speed per offset, k_2'
    )
    phase_1x_rad: float = quantity(
        0.0, unit='rad', ge=-7.0, le=7.0, description='direction of the first at shaft angle 0'
    )
    phase_2x_rad: float = quantity(
        0.0, unit='rad', ge=-7.0, le=7.0, description='direction of the second at shaft angle 0'
    )

    def coefficients(self) -> Mapping[str, float | tuple[float, ...]]:
        """Return the stiffnesses and the directions at shaft angle 0."""
        return turning_numbers(
            self.stiffness_1x_n_m, self.phase_1x_rad, self.stiffness_2x_n_m, self.phase_2x_rad
        )

    @staticmethod
    def force(p: Any, d: Any) -> Any:
        """Return the force along y and z."""
        y, z = once_and_twice(p, d)
        return p.offset_m * y, p.offset_m * z
