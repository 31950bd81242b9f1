# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Component-mode synthesis of Craig and Bampton: fewer coordinates for the linear part of a plant.

R. R. Craig and M. C. C. Bampton, Coupling of substructures for dynamic analyses, AIAA Journal 6
(1968) 1313. The displacements are x = T (x_kept, amplitudes): what the kept degrees of freedom do
statically to the rest, and modes of the rest while the kept ones are held.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pydantic
from numpy.typing import NDArray

from rotor_common.configuration import ConfigModel, quantity
from rotor_sim.errors import PlantError

Array = NDArray[np.float64]

ACCURACY = 1e-3
"""Of the natural frequencies of the shaft without supports; with stiff ones the error is smaller,
since a shaft that is held at the kept degrees of freedom has its own modes exactly."""
_RIGID = 1e-3
"""Of the highest frequency: what is slower is no vibration but a shaft that nothing holds."""


class Reduction(ConfigModel):
    """What is kept of a plant: what forces touch, disks that tilt, named nodes, and slow modes."""

    highest_hz: float = quantity(
        unit='Hz',
        gt=0.0,
        le=1e6,
        description='natural frequencies below this are right to 1e-3 or better',
    )
    keep: tuple[str, ...] = pydantic.Field(
        default=(), strict=False, description='nodes kept with all their degrees of freedom'
    )


@dataclass(frozen=True)
class Reduced:
    """The coordinates that are left: the kept degrees of freedom, then amplitudes of modes.

    `kept` are indices of degrees of freedom; `transformation` T (all, left) gives all of them; the
    frequencies are those of modes with the kept degrees of freedom held, Hz, slowest first. An
    amplitude is the largest displacement of its mode in m, or tilt in rad where it only tilts.
    """

    kept: tuple[int, ...]
    transformation: Array
    kept_hz: tuple[float, ...]
    left_out_hz: tuple[float, ...]


def reduce(
    mass: Array,
    stiffness: Array,
    kept: Sequence[int],
    translations: NDArray[np.bool_],
    highest_hz: float,
) -> Reduced:
    """Return the coordinates of a reduced plant; matrices (n, n) in SI.

    The modes are all those up to `highest_hz`, and those above it that it takes for the natural
    frequencies of the shaft without its supports to be right to ACCURACY below it.
    `translations` (n,) tells displacements from tilts.

    Raises PlantError where what is kept does not hold the rest.
    """
    inner = np.setdiff1d(np.arange(len(mass)), kept)
    static, modes, rad_s = _static_and_modes(mass, stiffness, kept, inner, translations)
    highest = 2.0 * math.pi * highest_hz
    exact = _frequencies(mass, stiffness)
    rigid = int(np.sum(exact <= _RIGID * highest))
    exact = exact[rigid : int(np.sum(exact < highest))]
    for count in range(int(np.sum(rad_s <= highest)), len(rad_s) + 1):
        to_all = np.zeros((len(mass), len(kept) + count))
        to_all[kept, np.arange(len(kept))] = 1.0
        to_all[inner, : len(kept)] = static
        to_all[inner, len(kept) :] = modes[:, :count]
        found = _frequencies(to_all.T @ mass @ to_all, to_all.T @ stiffness @ to_all)
        found = found[rigid : rigid + len(exact)]
        if len(found) == len(exact) and np.all(np.abs(found - exact) <= ACCURACY * exact):
            break
    hertz = tuple(float(each) for each in rad_s / (2.0 * math.pi))
    return Reduced(tuple(map(int, kept)), to_all, hertz[:count], hertz[count:])


def _frequencies(mass: Array, stiffness: Array) -> Array:
    """Return the natural frequencies, rad/s, slowest first."""
    from scipy.linalg import eigh  # noqa: PLC0415 - slow to import

    squares = eigh(stiffness, mass, eigvals_only=True)
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)))


def _static_and_modes(
    mass: Array,
    stiffness: Array,
    kept: Sequence[int],
    inner: NDArray[np.intp],
    translations: NDArray[np.bool_],
) -> tuple[Array, Array, Array]:
    """Return the inner displacements by unit kept ones, those of the modes, and their frequencies.

    What nothing couples, as the two bending planes of a shaft, is computed apart: their
    coefficients are exact zeros then, and modes of one frequency do not mix.
    """
    from scipy.linalg import cho_factor, cho_solve, eigh  # noqa: PLC0415 - slow to import
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415 - slow to import

    block = np.ix_(inner, inner)
    count, parts = connected_components((mass[block] != 0.0) | (stiffness[block] != 0.0))
    static, modes = np.zeros((len(inner), len(kept))), np.zeros((len(inner), len(inner)))
    rad_s = np.zeros(len(inner))
    done = 0
    for part in range(count):
        places = np.flatnonzero(parts == part)
        own = np.ix_(inner[places], inner[places])
        squares, shapes = eigh(stiffness[own], mass[own])
        if not squares[0] > 1e-10 * squares[-1]:
            raise PlantError(
                'reduction: what is kept does not hold the rest of the shaft; name in '
                'reduction.keep the nodes at its bearings'
            )
        toward = stiffness[np.ix_(inner[places], kept)]
        reached = np.flatnonzero(toward.any(axis=0))
        static[np.ix_(places, reached)] = -cho_solve(cho_factor(stiffness[own]), toward[:, reached])
        columns = np.arange(done, done + len(places))
        modes[np.ix_(places, columns)] = _scaled(shapes, translations[inner[places]])
        rad_s[columns] = np.sqrt(squares)
        done += len(places)
    order = np.argsort(rad_s, kind='stable')
    return static, modes[:, order], rad_s[order]


def _scaled(shapes: Array, translations: NDArray[np.bool_]) -> Array:
    """Return modes (n, m) whose largest displacement is 1; the first of those nearly as large."""
    sizes = np.abs(shapes[translations] if translations.any() else shapes)
    first = np.argmax(sizes >= (1.0 - 1e-6) * sizes.max(axis=0), axis=0)
    rows = np.flatnonzero(translations)[first] if translations.any() else first
    return shapes / shapes[rows, np.arange(shapes.shape[1])]
