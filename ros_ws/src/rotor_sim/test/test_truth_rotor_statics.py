# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Static equilibrium against closed forms and against the equations of motion at rest."""

import itertools
import math

import numpy as np
import pytest
from hou_equations import Drive, acceleration
from numpy.typing import NDArray

from rotor_common.constants import GRAVITY_M_S2
from rotor_sim import IntegrationError, RotorParameters
from rotor_sim.plant import statics
from rotor_sim.plant.compiled_plant import CompiledPlant
from rotor_sim.plant.hou2016 import hou2016

UNCRACKED = RotorParameters.hou2016(crack_stiffness_ratio=0.0, eccentricity_m=0.0)
HALF_PITCH = math.pi / 8


def test_scales_of_the_paper() -> None:
    """sqrt(2k/m), m g/(2k) and N_b r_i/(r_i + r_o) by hand, to the digits of docs/physics.md."""
    derived, figure = RotorParameters.hou2016(), RotorParameters.hou2016('figure')
    assert derived.critical_speed_rad_s == pytest.approx(math.sqrt(5e7 / 32.1), rel=1e-12)
    assert derived.length_scale_m == pytest.approx(32.1 * 9.81 / 5e7, rel=1e-12)
    assert figure.length_scale_m == pytest.approx(12.597e-6, abs=1e-9)
    # the mixed scales of `figure`: its load is 19.62 m/s^2 per unit of G
    load = figure.length_scale_m * figure.critical_speed_rad_s**2
    assert load == pytest.approx(19.62, rel=1e-12)
    assert derived.ball_pass_order == pytest.approx(3.0846, abs=5e-5)


def static_equilibrium(
    p: RotorParameters, load_m_s2: tuple[float, float], angle_rad: float = 0.0
) -> NDArray[np.float64]:
    return statics.static_equilibrium(CompiledPlant(hou2016(p)), load_m_s2, angle_rad)


@pytest.mark.parametrize(
    ('load_factor', 'cage_rad', 'expected', 'printed'),
    [
        (1.0, 0.0, 1.6356, 5e-5),
        (1.0, HALF_PITCH, 1.6400, 5e-5),
        (3.0, 0.0, 4.3221, 5e-5),
        (3.0, HALF_PITCH, 4.3312, 5e-5),
        (10.0, 0.0, 12.950, 5e-4),
        (10.0, HALF_PITCH, 12.971, 5e-4),
    ],
)
def test_static_check_of_the_model(
    load_factor: float, cage_rad: float, expected: float, printed: float
) -> None:
    """Y of the disk over the length scale, k = 2.5e7 N/m, to the printed digits."""
    state = static_equilibrium(
        UNCRACKED, (load_factor * GRAVITY_M_S2, 0.0), cage_rad / UNCRACKED.cage_ratio
    )
    y = state / UNCRACKED.length_scale_m
    assert y[0] == pytest.approx(expected, abs=printed)
    # the shaft bends by exactly G, whatever the bearings do
    assert y[0] - y[2] == pytest.approx(load_factor, rel=1e-12)
    # Hertz: K_b C d^1.5 carries half the disk and the bearing, C = sum of cos^2.5
    balls = cage_rad + 2.0 * math.pi * np.arange(8) / 8
    c = (np.maximum(np.cos(balls), 0.0) ** 2.5).sum()
    force = load_factor * GRAVITY_M_S2 * (0.5 * 32.1 + 4.0)
    assert state[2] == pytest.approx((force / (1.334e10 * c)) ** (2.0 / 3.0), rel=1e-10)


CASES = list(
    itertools.product(
        (-3.0, -0.1, 0.01, 1.0, 3.0, 10.0),
        (0.0, 5e-6, 50e-6),
        (0.0, 0.1, 0.3),
        (0.0, 1.0, 2.7, 5.3),
    )
)


@pytest.mark.parametrize('lateral', [0.0, 0.4])
def test_nothing_accelerates_at_equilibrium(lateral: float) -> None:
    for load_factor, clearance, crack, angle in CASES:
        p = RotorParameters.hou2016(
            crack_stiffness_ratio=crack, clearance_m=clearance, eccentricity_m=0.0
        )
        load = (load_factor * GRAVITY_M_S2, lateral * GRAVITY_M_S2)
        state = static_equilibrium(p, load, angle)
        rest = acceleration(p, state, Drive(angle, 0.0, *load))
        # Newton stops at 1e-12 of the force; the stiffest mode turns 1e-16 m into 1e-8 m/s^2
        assert np.abs(rest).max() < 1e-6, (load_factor, clearance, crack, angle)


@pytest.mark.parametrize('variant', ['natural', 'figure', 'figure_chaos'])
def test_other_variants_balance_with_some_opening(variant: str) -> None:
    """f may jump across the balance; then the disk is held by some f between 0 and 1."""
    jumps = 0
    cases = CASES[::5]
    for load_factor, clearance, crack, angle in cases:
        p = RotorParameters.hou2016(
            variant, crack_stiffness_ratio=crack, clearance_m=clearance, eccentricity_m=0.0
        )
        load = (load_factor * GRAVITY_M_S2, 0.0)
        state = static_equilibrium(p, load, angle)
        rest = acceleration(p, state, Drive(angle, 0.0, *load))
        jumps += bool(np.abs(rest).max() > 1e-6)
        # with no crack in the equations the same state is off by what some f <= 1 explains
        bend = 2.0 * np.hypot(*(state[:2] - state[2:4]))
        most = p.crack_scale * crack * p.shaft_stiffness_n_m * bend / p.disk_mass_kg
        assert np.abs(rest[:2]).max() <= most + 1e-6
    assert jumps <= 0.1 * len(cases)


def test_symmetric_load_reverses_the_displacement() -> None:
    up = static_equilibrium(UNCRACKED, (9.81, 0.0))
    down = static_equilibrium(UNCRACKED, (-9.81, 0.0))
    # an even number of balls: the bearing is symmetric
    np.testing.assert_allclose(up, -down, rtol=0, atol=1e-12 * UNCRACKED.length_scale_m)


@pytest.mark.parametrize('clearance', [0.0, 20e-6])
def test_weightless_rotor_stays_at_the_origin(clearance: float) -> None:
    p = RotorParameters.hou2016(clearance_m=clearance)
    assert not static_equilibrium(p, (0.0, 0.0), 1.0).any()


def test_nothing_to_hold_the_rotor_is_said() -> None:
    p = RotorParameters.hou2016(contact_stiffness_n_m15=0.0)
    with pytest.raises(IntegrationError, match='nothing holds the rotor'):
        static_equilibrium(p, (9.81, 0.0))
