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


def amplitudes(signal: Array, samples: int) -> Array:
    """Amplitudes at ORDERS; a Blackman window keeps the ball-pass order 3.0846 out of 3."""
    window = np.blackman(len(signal))
    turn = 2.0 * np.pi * np.arange(len(signal)) / samples
    lines = np.exp(-1j * np.multiply.outer(ORDERS, turn))
    return np.asarray(2.0 * np.abs(lines @ (signal * window)) / window.sum())


@pytest.mark.slow
def test_reference_table(reference: Any, run_revolutions: Revolutions) -> None:
    variant, changes, speed, load_factor, mean_y, amplitudes_z, *section_limits, _ = reference
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
    for column, (low, high, decimals) in enumerate(section_limits):
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
