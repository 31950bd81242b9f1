# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Fixtures that the tests of rotor_sim and rotor_dynamics share."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rotor_common.constants import GRAVITY_M_S2
from rotor_sim import RotorParameters
from rotor_sim.plant.compiled_plant import CompiledPlant
from rotor_sim.plant.hou2016 import RECORDS, hou2016

Array = NDArray[np.float64]
Revolutions = Callable[..., tuple[Array, Array]]

# the start of physics.md, section 4, in units of the length scale
START = np.array([4.0, 0.1, 1.3, 0.0, 1.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])

# physics.md, section 4: variant, changes, rad/s, G | mean Y | amplitudes of Z at orders 1, 2, 2.5,
# 3, 4 | Poincare Y and Z: lowest, highest, printed decimals | largest exponent per unit tau
TABLE: list[Any] = [
    (
        *('derived', {}, 263, 3),
        *(4.413, (0.150, 0.112, 0, 0.105, 0.056)),
        *((4.458, 4.480, 3), (0.05, 0.23, 2), -0.010),
    ),
    (
        *('derived', {}, 352, 3),
        *(4.395, (0.225, 0.171, 0, 2.872, 0.028)),
        *((4.11, 4.41, 2), (1.73, 2.24, 2), -0.0115),
    ),
    (
        *('derived', {}, 542, 3),
        *(4.388, (0.574, 1.472, 0, 0.034, 0.025)),
        *((4.73, 4.81, 2), (-1.21, -0.86, 2), -0.010),
    ),
    (
        *('derived', {'crack_stiffness_ratio': 0.0}, 352, 3),
        *(4.325, (0.196, 0.001, 0, 0.012, 0)),
        *((4.407, 4.589, 3), (-0.45, 0.44, 2), -0.0093),
    ),
    (
        *('derived', {'clearance_m': 5e-6}, 352, 3),
        *(5.355, (0.284, 0.183, 0, 0.210, 0.001)),
        *((4.91, 5.45, 2), (0.13, 0.33, 2), -0.0063),
    ),
    (
        *('derived', {}, 800, 0),
        *(0.0, (2.570, 0, 0, 0, 0)),
        *((2.565, 2.569, 3), (0.12, 0.14, 2), -0.0104),
    ),
    (
        *('natural', {}, 263, 3),
        *(4.385, (0.168, 0.095, 0, 0.071, 1.749)),
        *((4.634, 4.719, 3), (-1.65, -1.57, 2), -0.0114),
    ),
    (
        *('figure', {}, 352, 3),
        *(4.210, (0.199, 0.366, 0, 3.935, 0.020)),
        *((3.60, 3.85, 2), (-0.90, -0.64, 2), -0.012),
    ),
    (
        *('figure', {}, 431, 3),
        *(4.160, (0.180, 0.546, 4.165, 0.398, 0.063)),
        *((4.32, 4.76, 2), (-3.63, 2.81, 2), -0.010),
    ),
]


def _scale(parameters: RotorParameters, speed_rad_s: float) -> Array:
    length = parameters.length_scale_m
    return np.repeat([length, length * speed_rad_s], 6)


def with_live_columns(plant: CompiledPlant, drive: Array) -> Array:
    """Return a drive of the engine from one of angle, cage, speed, crack and their increments."""
    columns = [drive[:, :4]]
    for name, value in plant.live.items():
        constant = np.tile([value, 0.0], (len(drive), 1))
        columns.append(drive[:, 4:6] if name == 'crack.stiffness_ratio' else constant)
    return np.concatenate(columns, axis=1)


def _integrated(
    parameters: RotorParameters,
    state: Array,
    drive: Array,
    *,
    rate_hz: int,
    sample_s: float,
    substeps: int,
    grid: Array,
    load_rate_hz: int,
    first_sample: int = 0,
    forcing: tuple[float, float] = (0.0, 0.0),
) -> tuple[Array, Array]:
    """Run the kernel with one lane; return the rows (n, 16) and the state (12,) after them."""
    plant = CompiledPlant(hou2016(parameters, *forcing), RECORDS)
    out = np.empty((1, len(drive), 6 + len(RECORDS)))
    states = np.array([state])
    plant.module.stream(
        (0,),
        plant.alike(states),
        np.array([plant.coefficients]),
        np.array([plant.ratios]),
        states,
        out,
        rate_hz,
        sample_s,
        substeps,
        first_sample,
        np.array([with_live_columns(plant, drive)]),
        np.array([grid]),
        0,
        load_rate_hz,
    )
    return out[0], states[0]


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
    scale = _scale(parameters, speed_rad_s)
    state = start * scale
    index = np.arange(revolutions * samples)
    turns, part = np.divmod(index, samples)
    angle = 2.0 * np.pi * part / samples
    ratio = parameters.cage_ratio
    cage = ((ratio * turns) % 1.0) * 2.0 * np.pi + ratio * angle
    drive = np.zeros((len(index), 6))
    drive[:, 0], drive[:, 1], drive[:, 2] = angle, cage, speed_rad_s
    drive[:, 4] = parameters.crack_stiffness_ratio
    out, state = _integrated(
        parameters,
        state,
        drive,
        rate_hz=1,
        sample_s=2.0 * np.pi / speed_rad_s / samples,
        substeps=steps // samples,
        grid=np.tile([[load_factor * GRAVITY_M_S2, 0.0]], (len(index) + 2, 1)),
        load_rate_hz=1,
    )
    return out[:, :6] / parameters.length_scale_m, state / scale


@pytest.fixture
def section_4_start() -> Array:
    return START.copy()


@pytest.fixture(params=TABLE, ids=lambda c: f'{c[0]}-{c[2]}-{c[3]}g-{"".join(c[1])}')
def reference(request: pytest.FixtureRequest) -> Any:
    """One row of TABLE; the test runs for each."""
    return request.param


@pytest.fixture
def reference_table() -> list[Any]:
    return TABLE


@pytest.fixture
def run_revolutions() -> Revolutions:
    return _revolutions


@pytest.fixture(scope='session')
def integrated() -> Callable[..., tuple[Array, Array]]:
    return _integrated


@pytest.fixture
def constant_grid() -> Callable[..., Any]:
    from rotor_sim import LoadGrid

    def make(load_factor: float, seconds: float) -> LoadGrid:
        points = round(seconds * 100) + 2
        return LoadGrid.from_points(np.tile([[load_factor * GRAVITY_M_S2, 0.0]], (points, 1)))

    return make
