# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The compiled model against the reference values of three variants.

Source: reference table of docs/physics.md, dimensionless, N = 256 steps a revolution, start
(Y, Z, Y1, Z1, Y2, Z2) = (4, 0.1, 1.3, 0, 1.3, 0) at rest, 1500 + 300 revolutions, computed by a
program of its own. Tolerances: the table prints three decimals of amplitudes and means (5e-4, and
twice that where it prints two of a range's four); all responses are forced ones with a negative
exponent, so a difference in rounding dies out and only the printed digits limit the comparison.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rotor_sim import RotorParameters

Array = NDArray[np.float64]
Revolutions = Callable[..., tuple[Array, Array]]

ORDERS = (1.0, 2.0, 2.5, 3.0, 4.0)
PRINTED = 5e-4
SAMPLES = 64

# variant, changes, rad/s, G | mean Y | amplitudes of Z at ORDERS | Poincare Y, Z and decimals
TABLE = [
    (
        'derived',
        {},
        263,
        3,
        4.413,
        (0.150, 0.112, 0, 0.105, 0.056),
        (4.458, 4.480, 3),
        (0.05, 0.23, 2),
    ),
    (
        'derived',
        {},
        352,
        3,
        4.395,
        (0.225, 0.171, 0, 2.872, 0.028),
        (4.11, 4.41, 2),
        (1.73, 2.24, 2),
    ),
    (
        'derived',
        {},
        542,
        3,
        4.388,
        (0.574, 1.472, 0, 0.034, 0.025),
        (4.73, 4.81, 2),
        (-1.21, -0.86, 2),
    ),
    (
        'derived',
        {'crack_stiffness_ratio': 0.0},
        352,
        3,
        4.325,
        (0.196, 0.001, 0, 0.012, 0),
        (4.407, 4.589, 3),
        (-0.45, 0.44, 2),
    ),
    (
        'derived',
        {'clearance_m': 5e-6},
        352,
        3,
        5.355,
        (0.284, 0.183, 0, 0.210, 0.001),
        (4.91, 5.45, 2),
        (0.13, 0.33, 2),
    ),
    ('derived', {}, 800, 0, 0.0, (2.570, 0, 0, 0, 0), (2.565, 2.569, 3), (0.12, 0.14, 2)),
    (
        'natural',
        {},
        263,
        3,
        4.385,
        (0.168, 0.095, 0, 0.071, 1.749),
        (4.634, 4.719, 3),
        (-1.65, -1.57, 2),
    ),
    (
        'figure',
        {},
        352,
        3,
        4.210,
        (0.199, 0.366, 0, 3.935, 0.020),
        (3.60, 3.85, 2),
        (-0.90, -0.64, 2),
    ),
    (
        'figure',
        {},
        431,
        3,
        4.160,
        (0.180, 0.546, 4.165, 0.398, 0.063),
        (4.32, 4.76, 2),
        (-3.63, 2.81, 2),
    ),
]


def amplitudes(signal: Array, samples: int) -> Array:
    """Amplitudes at ORDERS; a Blackman window keeps the ball-pass order 3.0846 out of 3."""
    window = np.blackman(len(signal))
    turn = 2.0 * np.pi * np.arange(len(signal)) / samples
    lines = np.exp(-1j * np.multiply.outer(ORDERS, turn))
    return np.asarray(2.0 * np.abs(lines @ (signal * window)) / window.sum())


@pytest.mark.slow
@pytest.mark.parametrize('case', TABLE, ids=lambda c: f'{c[0]}-{c[2]}-{c[3]}g-{"".join(c[1])}')
def test_reference_table(case: Any, run_revolutions: Revolutions) -> None:
    variant, changes, speed, load_factor, mean_y, amplitudes_z, poincare_y, poincare_z = case
    parameters = RotorParameters.hou2016(variant, **changes)
    rows, _ = run_revolutions(
        parameters, speed, load_factor, steps=256, revolutions=1800, samples=SAMPLES
    )
    rows = rows[1500 * SAMPLES :]
    assert abs(rows[:, 0].mean() - mean_y) < 2 * PRINTED
    np.testing.assert_allclose(
        amplitudes(rows[:, 1], SAMPLES), amplitudes_z, rtol=0, atol=2 * PRINTED
    )
    section = rows[::SAMPLES]
    for column, (low, high, decimals) in ((0, poincare_y), (1, poincare_z)):
        # half a unit of the last printed digit, and as much for where the 300 points fall
        tolerance = 10.0**-decimals
        assert abs(np.min(section[:, column]) - low) < tolerance
        assert abs(np.max(section[:, column]) - high) < tolerance


@pytest.mark.parametrize(
    ('variant', 'expected'),
    [
        ('derived', (4.060844, 2.872539, 1.196027, 0.738812)),
        ('figure', (3.090793, -0.734131, 0.993563, -0.330060)),
    ],
)
def test_state_after_20_revolutions(
    variant: str, expected: tuple[float, ...], run_revolutions: Revolutions
) -> None:
    parameters = RotorParameters.hou2016(variant)
    _, state = run_revolutions(parameters, 352.0, 3.0, steps=128, revolutions=20)
    # printed to 6 decimals: half a unit, and as much again for another order of rounding
    np.testing.assert_allclose(state[:4], expected, rtol=0, atol=1e-6)


def test_figure_431_visits_two_clusters(run_revolutions: Revolutions) -> None:
    rows, _ = run_revolutions(
        RotorParameters.hou2016('figure'), 431.0, 3.0, steps=256, revolutions=400
    )
    z = np.sort(rows[300:, 1])
    # order 2.5 comes back every second revolution: a gap in Z much wider than each cluster
    assert np.max(np.diff(z)) > 3.0
