# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""What an element of a rotor is: parameters, the nodes it touches, one force, its labels."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
import pydantic
from numpy.typing import NDArray

from rotor_common.configuration import ConfigModel

Array = NDArray[np.float64]
Axis = Literal['y', 'z', 'theta_y', 'theta_z', 'amplitude']
"""Of a degree of freedom: displacement, tilt, or that of a mode of a reduced plant."""

TRANSLATIONS: tuple[Axis, ...] = ('y', 'z')
ALL_AXES: tuple[Axis, ...] = ('y', 'z', 'theta_y', 'theta_z')

AMPLITUDE: Axis = 'amplitude'

GROUND = 'ground'
"""The node that never moves, relative to the airframe."""


@dataclass(frozen=True)
class Matrices:
    """What a linear element adds to the equation of motion, on the degrees of freedom it touches.

    M q'' + (C + C_speed W) q' + (K + K_speed W) q = f, with W the shaft's speed in
    rad/s. All are (n, n) in SI; None is zero for every value of the parameters.
    """

    mass: Array | None = None
    damping: Array | None = None
    damping_per_speed: Array | None = None
    stiffness: Array | None = None
    stiffness_per_speed: Array | None = None


class Element(ConfigModel):
    """Base of all elements. A subclass sets `touches` and gives `matrices`, `force` or both.

    `force` is a static function in the subset of `force_source`. Of the arguments x, v, p, d, s it
    takes those that it needs: displacements x and velocities v of the degrees of freedom in the
    order of `touches` (m, m/s, rad, rad/s; frame `rotor`), the numbers p of `coefficients`, the
    drive d and the structure s. It returns the force on each degree of freedom (N, N m). The drive
    holds cos and sin of the shaft angle, speed_rad_s, acceleration_rad_s2, load_y_m_s2, load_z_m_s2
    and cos_NAME, sin_NAME of each of `rotations`.

    `switches` takes the same arguments. It returns functions whose zeros are the surfaces across
    which the force jumps, for the tangents of analyses (saltation). An element whose force is
    continuous has none.
    """

    touches: ClassVar[tuple[tuple[str, tuple[Axis, ...]], ...]]
    """Fields that name a node, each with the axes that the element touches there."""
    live: ClassVar[tuple[str, ...]] = ()
    """Fields that may change during a run; they can be used in `force` alone."""
    force: ClassVar[Any] = None
    switches: ClassVar[Any] = None

    kind: str
    """Name of the element in a plant; each subclass has its own as default."""
    name: str = pydantic.Field(
        default='',
        pattern=r'^([a-z][a-z0-9_]*)?$',
        description='name of the element, unique in the plant; unset: its kind and a number',
    )

    def matrices(self, positions_m: Mapping[str, float]) -> Matrices:  # noqa: ARG002
        """Return the linear part; the default is none. `positions_m` are those of the nodes.

        Raises PlantError for positions that the element cannot have.
        """
        return Matrices()

    def coefficients(self) -> Mapping[str, float | tuple[float, ...]]:
        """Return the numbers that `force` reads as p.name; the default is every number field."""
        return {
            name: float(value)
            for name, value in self
            if isinstance(value, int | float) and not isinstance(value, bool)
        }

    def structure(self) -> Mapping[str, Any]:
        """Return what decides the statements of `force`, read as s.name; compiled in."""
        return {}

    def rotations(self) -> Mapping[str, float]:
        """Return what turns with the shaft at another speed: name and ratio to the shaft's."""
        return {}

    def labels(self) -> Mapping[str, float]:
        """Return the truth that a recording states about this element; live fields come anyway."""
        return {}
