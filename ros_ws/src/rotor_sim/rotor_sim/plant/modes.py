# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Small vibrations of a plant about a state: eigenvalues over speed, the Campbell diagram."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotor_sim.plant.compiled_plant import CompiledPlant, Instant

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Modes:
    """Modes of one speed, slowest first.

    `frequencies_rad_s` (m,): damped natural frequencies; `decay_rates_1_s` (m,): positive where
    the mode decays; `shapes` (m, n): complex displacements of the degrees of freedom, largest 1.
    """

    frequencies_rad_s: Array
    decay_rates_1_s: Array
    shapes: NDArray[np.complex128]


def modes(plant: CompiledPlant, state: Array, at: Instant) -> Modes:
    """Return the vibrations of the plant linearised about a state (2n,); see `Modes`.

    The stiffness and damping are the derived tangent there: a Hertzian contact has that of its
    load. Only pairs of complex eigenvalues count; a mode without restoring force has none, nor has
    one damped to 0.995 of the critical damping or more.
    """
    n = plant.size
    system = np.zeros((2 * n, 2 * n))
    system[:n, n:] = np.eye(n)
    system[n:] = plant.jacobian(state, at)
    values, vectors = np.linalg.eig(system)
    sizes = np.abs(values)
    kept = np.flatnonzero(values.imag > np.maximum(1e-9 * np.max(sizes), 0.1 * sizes))
    kept = kept[np.argsort(values[kept].imag)]
    shapes = vectors[:n, kept].T
    largest = np.take_along_axis(shapes, np.argmax(np.abs(shapes), axis=1)[:, np.newaxis], axis=1)
    return Modes(values[kept].imag, -values[kept].real, shapes / largest)
