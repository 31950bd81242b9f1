# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Fixtures of the rotor's tests."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rotor_sim import RotorParameters, _kernels
from rotor_sim.parameters import GRAVITY_M_S2

Array = NDArray[np.float64]
Revolutions = Callable[..., tuple[Array, Array]]

# the start of physics.md, section 4, in units of the length scale
START = np.array([4.0, 0.1, 1.3, 0.0, 1.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])


def _scale(parameters: RotorParameters, speed_rad_s: float) -> Array:
    length = parameters.length_scale_m
    return np.repeat([length, length * speed_rad_s], 6)


def _revolutions(
    parameters: RotorParameters,
    speed_rad_s: float,
    load_factor: float,
    *,
    steps: int,
    revolutions: int,
    samples: int = 1,
    start: Array = START,
) -> tuple[Array, Array]:
    """Integrate whole revolutions with the kernel at constant speed and load, all dimensionless.

    Returns displacements at `samples` per revolution (n, 6) and the state (12,) at the end.
    """
    coefficients, balls = _kernels.pack(parameters)
    scale = _scale(parameters, speed_rad_s)
    state = start * scale
    index = np.arange(revolutions * samples)
    turns, part = np.divmod(index, samples)
    angle = 2.0 * np.pi * part / samples
    ratio = parameters.cage_ratio
    cage = ((ratio * turns) % 1.0) * 2.0 * np.pi + ratio * angle
    out = np.empty((len(index), _kernels.OUTPUTS))
    zeros = np.zeros(len(index))
    load = np.tile([[load_factor * GRAVITY_M_S2, 0.0]], (len(index) + 2, 1))
    _kernels.integrate(
        coefficients,
        balls,
        state,
        out,
        1,
        2.0 * np.pi / speed_rad_s / samples,
        steps // samples,
        0,
        angle,
        cage,
        np.full(len(index), float(speed_rad_s)),
        zeros,
        np.full(len(index), parameters.crack_stiffness_ratio),
        zeros,
        load,
        0,
        1,
    )
    return out[:, :6] / parameters.length_scale_m, state / scale


@pytest.fixture
def section_4_start() -> Array:
    return START.copy()


@pytest.fixture
def run_revolutions() -> Revolutions:
    return _revolutions


@pytest.fixture
def constant_grid() -> Callable[..., Any]:
    from rotor_sim import LoadGrid

    def make(load_factor: float, seconds: float) -> LoadGrid:
        points = round(seconds * 100) + 2
        return LoadGrid.from_points(np.tile([[load_factor * GRAVITY_M_S2, 0.0]], (points, 1)))

    return make
