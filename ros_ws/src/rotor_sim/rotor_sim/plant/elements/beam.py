# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A shaft of round section between two nodes: the Timoshenko beam of Nelson 1980."""

import math
from collections.abc import Mapping
from typing import Any, Self

import numpy as np
import pydantic
from numpy.typing import NDArray

from rotor_common.configuration import quantity
from rotor_sim.errors import PlantError
from rotor_sim.plant.element import ALL_AXES, Element, Matrices

Array = NDArray[np.float64]

# A rotation is right-handed about its axis: a shaft along x has the slopes dy/dx = theta_z and
# dz/dx = -theta_y. So each bending plane has these ends of the degrees of freedom
# (y, z, theta_y, theta_z) of the first node, then of the second, and these signs of the slopes.
_PLANE_Y, _SIGNS_Y = np.array([0, 3, 4, 7]), np.array([1.0, 1.0, 1.0, 1.0])
_PLANE_Z, _SIGNS_Z = np.array([1, 2, 5, 6]), np.array([1.0, -1.0, 1.0, -1.0])


class Beam(Element):
    """Timoshenko beam from a node to the next: shear, rotary and gyroscopic inertia.

    Displacement and slope are those of a beam loaded at its ends, so its statics is exact; mass
    and gyroscopic matrix are consistent with them (Nelson, J. Mech. Des. 102 (1980) 793). Shear
    coefficient: Cowper, J. Appl. Mech. 33 (1966) 335. The damping is
    a K q' + b K (q' - W J q), a outside of the shaft and b turning with it, J as in
    `ShaftSegment`. The length is the difference of the nodes' position_m.
    """

    touches = (('node', ALL_AXES), ('other', ALL_AXES))

    kind: str = 'beam'
    node: str
    other: str
    outer_diameter_m: float = quantity(unit='m', gt=0.0, le=10.0, description='outer diameter')
    inner_diameter_m: float = quantity(
        0.0, unit='m', ge=0.0, le=10.0, description='diameter of the bore'
    )
    density_kg_m3: float = quantity(
        7850.0, unit='kg/m^3', gt=0.0, le=3e4, description='density; the default is that of steel'
    )
    elastic_modulus_pa: float = quantity(
        2.1e11, unit='Pa', ge=1e6, le=1e13, description="Young's modulus E"
    )
    poisson_ratio: float = quantity(
        0.3, unit='1', ge=0.0, le=0.5, description='ratio nu; the shear modulus is E/(2 + 2 nu)'
    )
    damping_s: float = quantity(
        0.0, unit='s', ge=0.0, le=1.0, description='damping a in proportion to the stiffness'
    )
    internal_damping_s: float = quantity(
        0.0, unit='s', ge=0.0, le=1.0, description='the part b of it that turns with the shaft'
    )

    @pydantic.model_validator(mode='after')
    def _check(self) -> Self:
        if self.inner_diameter_m >= self.outer_diameter_m:
            raise PlantError(
                f'inner_diameter_m = {self.inner_diameter_m:g} m is not below outer_diameter_m = '
                f'{self.outer_diameter_m:g} m; the shaft needs a wall'
            )
        return self

    @property
    def area_m2(self) -> float:
        """Area of the section."""
        return 0.25 * math.pi * (self.outer_diameter_m**2 - self.inner_diameter_m**2)

    @property
    def second_moment_m4(self) -> float:
        """Second moment of area I of the section about a diameter."""
        return math.pi / 64.0 * (self.outer_diameter_m**4 - self.inner_diameter_m**4)

    @property
    def shear_stiffness_n(self) -> float:
        """Shear force for a shear angle of 1: coefficient x shear modulus x area."""
        nu, m = self.poisson_ratio, self.inner_diameter_m / self.outer_diameter_m
        square = (1.0 + m * m) ** 2
        coefficient = 6.0 * (1.0 + nu) * square
        coefficient /= (7.0 + 6.0 * nu) * square + (20.0 + 12.0 * nu) * m * m
        return coefficient * self.elastic_modulus_pa / (2.0 + 2.0 * nu) * self.area_m2

    def length_m(self, positions_m: Mapping[str, float]) -> float:
        """Return the distance of the nodes, m; raises PlantError unless the second is further."""
        for key, node in (('node', self.node), ('other', self.other)):
            if node not in positions_m:
                raise PlantError(f'{key} = {node!r}: a beam lies between two nodes of the plant')
        length = positions_m[self.other] - positions_m[self.node]
        if not length > 0.0:
            raise PlantError(
                f'a beam from {self.node!r} at position_m = {positions_m[self.node]:g} m to '
                f'{self.other!r} at {positions_m[self.other]:g} m has no length; it goes from a '
                'node to one further along the shaft'
            )
        return length

    def matrices(self, positions_m: Mapping[str, float]) -> Matrices:
        """Return the matrices by Gauss's rule, which is exact for these polynomials."""
        length = self.length_m(positions_m)
        bending = self.elastic_modulus_pa * self.second_moment_m4
        shear = self.shear_stiffness_n
        ratio = 12.0 * bending / (shear * length**2)
        mass_per_m = self.density_kg_m3 * self.area_m2
        inertia_per_m = self.density_kg_m3 * self.second_moment_m4
        mass, gyroscopic, stiffness = np.zeros((3, 8, 8))
        places, weights = np.polynomial.legendre.leggauss(4)
        for place, weight in zip(0.5 * (1.0 + places), 0.5 * length * weights, strict=True):
            shift, slope, shear_angle, curvature = _shapes(float(place), length, ratio)
            tilts = []
            for plane, signs in ((_PLANE_Y, _SIGNS_Y), (_PLANE_Z, _SIGNS_Z)):
                own = np.ix_(plane, plane)
                turn = np.outer(signs, signs) * weight
                mass[own] += turn * mass_per_m * np.outer(shift, shift)
                mass[own] += turn * inertia_per_m * np.outer(slope, slope)
                stiffness[own] += turn * bending * np.outer(curvature, curvature)
                stiffness[own] += turn * shear * np.outer(shear_angle, shear_angle)
                tilt = np.zeros(8)
                tilt[plane] = signs * slope
                tilts.append(tilt)
            theta_z, theta_y = tilts[0], -tilts[1]
            # the moments I_p W (theta_z', -theta_y') about y and z, as of a disk
            around = np.outer(theta_y, theta_z) - np.outer(theta_z, theta_y)
            gyroscopic += 2.0 * inertia_per_m * weight * around
        damping = self.damping_s + self.internal_damping_s
        return Matrices(
            mass=mass,
            stiffness=stiffness,
            damping_per_speed=gyroscopic,
            damping=damping * stiffness if damping else None,
            stiffness_per_speed=(
                -self.internal_damping_s * stiffness @ _QUARTER_TURN
                if self.internal_damping_s
                else None
            ),
        )

    def coefficients(self) -> Mapping[str, float | tuple[float, ...]]:
        """Return none: the beam has no force of its own."""
        return {}


_QUARTER_TURN = np.kron(np.eye(4), [[0.0, -1.0], [1.0, 0.0]])
"""J, which turns displacements and tilts by a right angle from y to z."""


def _shapes(place: float, length: float, ratio: float) -> Any:
    """Return displacement, slope, shear angle and curvature at `place` (0 to 1) of a plane.

    Each is for unit displacement and slope at the first end, then at the second.
    """
    x = place
    scale = 1.0 / (1.0 + ratio)
    shift = scale * np.array(
        [
            1.0 - 3.0 * x**2 + 2.0 * x**3 + ratio * (1.0 - x),
            length * (x - 2.0 * x**2 + x**3 + 0.5 * ratio * (x - x**2)),
            3.0 * x**2 - 2.0 * x**3 + ratio * x,
            length * (-(x**2) + x**3 - 0.5 * ratio * (x - x**2)),
        ]
    )
    slope = scale * np.array(
        [
            6.0 / length * (x**2 - x),
            1.0 - 4.0 * x + 3.0 * x**2 + ratio * (1.0 - x),
            6.0 / length * (x - x**2),
            -2.0 * x + 3.0 * x**2 + ratio * x,
        ]
    )
    shear_angle = scale * ratio * np.array([-1.0 / length, -0.5, 1.0 / length, -0.5])
    curvature = scale * np.array(
        [
            6.0 / length**2 * (2.0 * x - 1.0),
            (-4.0 + 6.0 * x - ratio) / length,
            6.0 / length**2 * (1.0 - 2.0 * x),
            (-2.0 + 6.0 * x + ratio) / length,
        ]
    )
    return shift, slope, shear_angle, curvature
