# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Properties of the breathing crack, the Hertzian bearing and the equations of motion."""

import math
from typing import get_args

import numpy as np
import pytest
from hou_equations import (
    Drive,
    acceleration,
    breathing,
    contact_force,
    crack_opening,
    phase,
    stiffness,
)
from hypothesis import given
from hypothesis import strategies as st

from rotor_sim import RotorParameters
from rotor_sim.plant.parameters import PhaseConvention, ThetaConvention

PI = math.pi
THETAS: tuple[ThetaConvention, ...] = get_args(ThetaConvention)
PHASES: tuple[PhaseConvention, ...] = get_args(PhaseConvention)
angles = st.floats(-50.0, 50.0)
half_angles = st.floats(0.05, PI / 2)
displacements = st.tuples(st.floats(-1e-4, 1e-4), st.floats(-1e-4, 1e-4))
DERIVED = RotorParameters.hou2016()


@pytest.mark.parametrize('convention', THETAS)
@given(theta=angles, half_angle=half_angles)
def test_opening_stays_between_closed_and_open(
    convention: ThetaConvention, theta: float, half_angle: float
) -> None:
    assert 0.0 <= float(breathing(theta, half_angle, convention)) <= 1.0


@given(theta=angles, half_angle=half_angles, step=st.floats(1e-9, 1e-3))
def test_derived_opening_is_continuous(theta: float, half_angle: float, step: float) -> None:
    change = abs(float(breathing(theta + step, half_angle) - breathing(theta, half_angle)))
    # steepest slope of (1 + cos(u pi/(2 alpha)))/2; 1e-13: rounding of angles up to 50
    assert change <= 0.25 * PI / half_angle * step + 1e-13 / half_angle


@given(theta=angles, half_angle=half_angles)
def test_derived_opening_has_the_symmetries_of_eq_4(theta: float, half_angle: float) -> None:
    f = float(breathing(theta, half_angle))
    slack = 1e-13 / half_angle
    assert float(breathing(-theta, half_angle)) == pytest.approx(f, abs=slack)
    assert float(breathing(theta + 2 * PI, half_angle)) == pytest.approx(f, abs=slack)
    # half a turn on, what was open is closed
    assert float(breathing(theta + PI, half_angle)) == pytest.approx(1.0 - f, abs=slack)


@pytest.mark.parametrize(
    ('degrees', 'continuous', 'gap_open', 'last_branch'),
    [
        (30, 1, 1, 1),
        (90, 0.5, 0.5, 0.5),
        (180, 0, 0, 0),
        (270, 0.5, 0.5, 0.5),
        (299, 1, 1, 1),
        (301, 1, 0, 1),
        (330, 1, 0, 0.5),
        (359, 1, 0, 0),
    ],
)
def test_conventions_of_theta_by_hand(
    degrees: float, continuous: float, gap_open: float, last_branch: float
) -> None:
    """Eq. (4) with alpha = 30 degrees; 1 degree off a flat top changes f by 7e-4."""
    theta = math.radians(degrees)
    for turns in (-1, 0, 1):
        for convention, expected in zip(THETAS, (continuous, gap_open, last_branch), strict=True):
            f = float(breathing(theta + 2 * PI * turns, PI / 6, convention))
            assert f == pytest.approx(expected, abs=1e-3), convention


@pytest.mark.parametrize('convention', THETAS)
def test_opening_of_nan_is_nan(convention: ThetaConvention) -> None:
    assert np.isnan(breathing(np.nan, PI / 6, convention))


def test_conventions_of_phi_by_hand() -> None:
    y, z = np.array([1.0, -1.0, 0.0, 0.0]), np.array([1.0, -1.0, 2.0, 0.0])
    expected = {
        'atan2_z_y': [PI / 4, -3 * PI / 4, PI / 2, 0.0],
        'arctan_y_over_z': [PI / 4, PI / 4, 0.0, 0.0],
        'atan2_y_z': [PI / 4, -3 * PI / 4, 0.0, 0.0],
    }
    for convention in PHASES:
        np.testing.assert_allclose(phase(y, z, convention), expected[convention], atol=1e-15)
    # principal value: the two others tell y = 2, z = 1 from its reflection
    assert float(phase(2.0, -1.0, 'arctan_y_over_z')) == pytest.approx(math.atan(-2.0))
    assert float(phase(2.0, 1.0, 'atan2_z_y')) == pytest.approx(math.atan(0.5))
    assert float(phase(2.0, 1.0, 'atan2_y_z')) == pytest.approx(math.atan(2.0))


def test_crack_in_the_direction_of_sag_is_open_and_opposite_closed() -> None:
    down = -DERIVED.crack_angle_rad
    assert float(crack_opening(DERIVED, 1e-5, 0.0, down)) == 1.0
    assert float(crack_opening(DERIVED, 1e-5, 0.0, down + PI)) == 0.0


@given(angle=angles)
def test_open_crack_softens_only_across_itself(angle: float) -> None:
    k, lost = DERIVED.shaft_stiffness_n_m, 2.5e6
    matrix = stiffness(DERIVED, 1.0, angle, lost)
    psi = angle + DERIVED.crack_angle_rad
    along, across = np.array([np.cos(psi), np.sin(psi)]), np.array([-np.sin(psi), np.cos(psi)])
    np.testing.assert_allclose(matrix @ along, (k - lost) * along, atol=1e-8 * k)
    np.testing.assert_allclose(matrix @ across, k * across, atol=1e-8 * k)


@given(displacement=displacements, cage=angles, clearance=st.floats(0.0, 5e-5))
def test_contact_opposes_the_displacement(
    displacement: tuple[float, float], cage: float, clearance: float
) -> None:
    p = RotorParameters.hou2016(clearance_m=clearance)
    force = contact_force(p, displacement, cage)
    assert float(force @ np.array(displacement)) <= 0.0
    if math.hypot(*displacement) < clearance * (1 - 1e-12):
        assert not force.any()


@given(
    displacement=displacements,
    cage=angles,
    clearance=st.floats(0.0, 5e-5),
    balls=st.integers(3, 20),
    pitches=st.integers(-5, 5),
)
def test_contact_is_the_same_one_ball_pitch_on(
    displacement: tuple[float, float], cage: float, clearance: float, balls: int, pitches: int
) -> None:
    p = RotorParameters.hou2016(clearance_m=clearance, ball_count=balls)
    here = contact_force(p, displacement, cage)
    there = contact_force(p, displacement, cage + 2 * PI * pitches / balls)
    scale = p.contact_stiffness_n_m15 * 1e-4**1.5 * balls
    np.testing.assert_allclose(here, there, rtol=0, atol=1e-11 * scale)


@given(displacement=displacements, cage=angles)
def test_contact_turns_with_the_bearing(displacement: tuple[float, float], cage: float) -> None:
    c, s = np.cos(cage), np.sin(cage)
    turn = np.array([[c, -s], [s, c]])
    turned = contact_force(DERIVED, turn @ np.array(displacement), cage)
    expected = turn @ contact_force(DERIVED, displacement, 0.0)
    scale = DERIVED.contact_stiffness_n_m15 * 1e-4**1.5 * 8
    np.testing.assert_allclose(turned, expected, rtol=0, atol=1e-11 * scale)


@given(displacement=displacements, cage=angles, factor=st.floats(0.1, 10.0))
def test_contact_is_hertzian(displacement: tuple[float, float], cage: float, factor: float) -> None:
    """Without clearance the force is homogeneous of degree 1.5 (elliptic contact, Hertz 1881)."""
    force = contact_force(DERIVED, displacement, cage)
    scaled = contact_force(DERIVED, np.array(displacement) * factor, cage)
    scale = DERIVED.contact_stiffness_n_m15 * (1e-4 * factor) ** 1.5 * 8
    np.testing.assert_allclose(scaled, factor**1.5 * force, rtol=0, atol=1e-12 * scale)


def test_one_ball_alone_carries_by_hand() -> None:
    p = RotorParameters.hou2016(ball_count=3, clearance_m=2e-6)
    force = contact_force(p, [10e-6, 0.0], 0.0)
    np.testing.assert_allclose(force, [-1.334e10 * 8e-6**1.5, 0.0], rtol=1e-12, atol=1e-9)


def test_accelerations_take_batches() -> None:
    states = np.random.default_rng(1).normal(size=(4, 3, 12)) * 1e-5
    drive = Drive(1.0, 352.0, 29.43, 1.0, angular_acceleration_rad_s2=30.0)
    together = acceleration(DERIVED, states, drive)
    assert together.shape == (4, 3, 6)
    alone = acceleration(DERIVED, states[2, 1], drive)
    np.testing.assert_allclose(together[2, 1], alone, rtol=0, atol=1e-14 * np.abs(alone).max())


def test_angular_acceleration_pushes_the_heavy_spot_back() -> None:
    """m e (w^2 cos g + w' sin g), m e (w^2 sin g - w' cos g): the second part alone, at g = 0."""
    p = RotorParameters.hou2016(contact_stiffness_n_m15=0.0)
    drive = Drive(0.0, 0.0, angular_acceleration_rad_s2=100.0)
    np.testing.assert_allclose(
        acceleration(p, np.zeros(12), drive), [0.0, -1e-3, 0, 0, 0, 0], atol=1e-18
    )
