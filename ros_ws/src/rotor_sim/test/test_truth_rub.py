# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A rub: energy, direction of the friction, and nothing at all without contact."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad_vec, solve_ivp

from plant_stream import streamed
from rotor_common.errors import ConfigError
from rotor_sim.plant.compiled_plant import CompiledPlant, Instant
from rotor_sim.plant.elements.rub import Rub
from rotor_sim.plant.elements.shaft_segment import ShaftSegment
from rotor_sim.plant.elements.unbalance import Unbalance
from rotor_sim.plant.plant import Node, Plant

Array = NDArray[np.float64]

MASS, SHAFT, CONTACT, GAP, MU, RADIUS = 2.0, 2e4, 3e5, 1e-4, 0.2, 0.05


def rotor(damping_n_s_m: float = 0.0, **rub: Any) -> CompiledPlant:
    values = {
        'stiffness_n_m': CONTACT,
        'gap_m': GAP,
        'friction_coefficient': MU,
        'shaft_radius_m': RADIUS,
        **rub,
    }
    return CompiledPlant(
        Plant(
            nodes={'disk': Node(mass_kg=MASS)},
            elements=(
                ShaftSegment(node='disk', stiffness_n_m=SHAFT, damping_n_s_m=damping_n_s_m),
                Rub(node='disk', **values),
            ),
        )
    )


def energy(state: Array) -> float:
    """Of the mass, the shaft and the spring of the contact, J."""
    depth = max(math.hypot(state[0], state[1]) - GAP, 0.0)
    speed, place = state[2:] @ state[2:], state[:2] @ state[:2]
    return float(0.5 * (MASS * speed + SHAFT * place + CONTACT * depth * depth))


@pytest.mark.parametrize(
    ('start', 'speed_rad_s', 'is_lost'),
    [
        ((1e-4, 0.0, 0.0, 0.03), 0.0, True),  # along the ring, no drive: all friction is loss
        ((1e-4, 0.0, 0.0, 0.03), 60.0, True),  # a forward whirl is braked
        ((1e-4, 0.0, 0.0, -0.03), 60.0, False),  # a backward whirl is fed by the drive
    ],
)
def test_energy_lost_is_the_work_of_the_friction(
    start: tuple[float, ...], speed_rad_s: float, is_lost: bool
) -> None:
    """Mass on an undamped spring in contact: E(t) - E(0) = -integral of mu N sign(u) v_t dt."""
    plant = rotor(slip_velocity_m_s=1e-6)
    at = Instant(speed_rad_s=speed_rad_s)

    def slope(_t: float, state: Array) -> Array:
        return np.concatenate([state[2:], plant.acceleration(state, at)])

    found = solve_ivp(
        slope, (0.0, 0.02), start, method='DOP853', rtol=1e-11, atol=1e-14, dense_output=True
    )

    def power(t: float) -> Array:
        y, z, v_y, v_z = found.sol(t)
        r = math.hypot(y, z)
        tangential = (y * v_z - z * v_y) / r
        normal = CONTACT * max(r - GAP, 0.0)
        slide = RADIUS * speed_rad_s + tangential
        return np.array([-MU * normal * math.copysign(1.0, slide) * tangential, normal])

    (work, impulse), _ = quad_vec(power, 0.0, 0.02, epsabs=1e-12, epsrel=1e-10, limit=2000)
    before, after = energy(np.array(start)), energy(found.y[:, -1])
    assert impulse > 0.02  # N s: it has touched
    assert after - before == pytest.approx(work, rel=1e-6)
    assert abs(work) > 0.05 * before
    assert (after < before) is is_lost


@pytest.mark.parametrize('angle', [0.0, 0.7, 2.0, -2.5])
def test_friction_pushes_a_turning_shaft_backward(angle: float) -> None:
    """Contact at the angle: N inward, mu N against the turning, which is from y to z."""
    depth = 2e-5
    n, t = (
        np.array([math.cos(angle), math.sin(angle)]),
        np.array([-math.sin(angle), math.cos(angle)]),
    )
    plant = rotor()
    state = np.concatenate([(GAP + depth) * n, np.zeros(2)])
    for speed, sign in ((100.0, 1.0), (-100.0, -1.0), (0.0, 0.0)):
        force = MASS * plant.acceleration(state, Instant(speed_rad_s=speed)) + SHAFT * state[:2]
        assert force @ n == pytest.approx(-CONTACT * depth, rel=1e-9)
        assert force @ t == pytest.approx(-sign * MU * CONTACT * depth, rel=1e-9, abs=1e-12)
    # a node that moves faster backward than the surface forward: the friction turns round
    state[2:] = -10.0 * t
    force = MASS * plant.acceleration(state, Instant(speed_rad_s=100.0)) + SHAFT * state[:2]
    assert force @ t == pytest.approx(MU * CONTACT * depth, rel=1e-9)


def test_friction_is_linear_below_the_slip_velocity() -> None:
    plant = rotor(slip_velocity_m_s=0.1)
    state = np.array([GAP + 1e-5, 0.0, 0.0, 0.0])
    for part in (0.25, 0.5, 1.0, 2.0):
        at = Instant(speed_rad_s=part * 0.1 / RADIUS)
        drag = -MASS * plant.acceleration(state, at)[1]
        assert drag == pytest.approx(min(part, 1.0) * MU * CONTACT * 1e-5, rel=1e-9)


@pytest.mark.parametrize('share', [0.8, 1.2])
def test_threshold_of_backward_whirl(share: float) -> None:
    """A backward whirl of radius r grows where mu N > c w r, by the power balance."""
    depth = 1e-5
    r, normal = GAP + depth, CONTACT * depth
    w = math.sqrt((SHAFT * r + normal) / (MASS * r))
    damping = 100.0
    plant = rotor(damping, friction_coefficient=share * damping * w * r / normal)
    state = np.array([r, 0.0, 0.0, -w * r])
    found = plant.acceleration(state, Instant(speed_rad_s=5.0 * w * r / RADIUS))
    assert found[0] == pytest.approx(-w * w * r, rel=1e-9)  # it is an orbit
    growth = float(found[1] * state[3])
    assert growth == pytest.approx((share - 1.0) * damping * w * r * w * r / MASS, rel=1e-9)
    assert (growth > 0.0) is (share > 1.0)


def test_sector_carries_within_its_edges_alone() -> None:
    plant = rotor(sector_angle_rad=1.0, sector_half_width_rad=0.3, friction_coefficient=0.0)
    for angle, is_there in ((0.69, False), (0.71, True), (1.29, True), (1.31, False), (4.1, False)):
        state = np.array([math.cos(angle), math.sin(angle), 0.0, 0.0]) * 1.1 * GAP
        force = MASS * plant.acceleration(state) + SHAFT * state[:2]
        expected = CONTACT * 0.1 * GAP if is_there else 0.0
        assert np.hypot(*force) == pytest.approx(expected, rel=1e-9, abs=1e-12)
    assert plant.engine.switches == 1
    assert rotor().engine.switches == 0


def test_ring_about_its_centre() -> None:
    plant = rotor(centre_y_m=3e-4, centre_z_m=-1e-4)
    at_rest = plant.acceleration([3e-4, -1e-4, 0.0, 0.0])
    assert at_rest == pytest.approx([-SHAFT * 3e-4 / MASS, SHAFT * 1e-4 / MASS], rel=1e-12)
    lifted = plant.acceleration([3e-4, -1e-4 + 1.5 * GAP, 0.0, 0.0])
    assert lifted[1] - at_rest[1] == pytest.approx(
        -(SHAFT * 1.5 * GAP + CONTACT * 0.5 * GAP) / MASS, rel=1e-9
    )


def test_derived_tangent_is_that_of_differences() -> None:
    plant = rotor(slip_velocity_m_s=10.0)
    state, at = np.array([9e-5, 7e-5, 0.02, -0.01]), Instant(speed_rad_s=30.0)
    slope = plant.jacobian(state, at)
    for k, step in enumerate((1e-9, 1e-9, 1e-5, 1e-5)):
        move = step * np.eye(4)[k]
        change = plant.acceleration(state + move, at) - plant.acceleration(state - move, at)
        assert slope[:, k] == pytest.approx(change / (2.0 * step), rel=1e-5, abs=1e-3)


@pytest.mark.parametrize('name', ['gap_m', 'slip_velocity_m_s'])
def test_no_division_by_zero_can_be_asked_for(name: str) -> None:
    with pytest.raises(ConfigError, match=rf'{name} = 0\.0 is out of range; allowed'):
        rotor(**{name: 0.0})


@pytest.mark.slow
def test_without_contact_the_states_are_those_without_the_rub() -> None:
    """Bit for bit, over 500 samples of a loaded, unbalanced rotor; with contact they are not."""
    found = {}
    for gap in (None, 1.0, 5e-5):
        rub = Rub(
            node='disk',
            stiffness_n_m=CONTACT,
            gap_m=gap or 1.0,
            friction_coefficient=MU,
            shaft_radius_m=RADIUS,
        )
        elements = (
            ShaftSegment(node='disk', stiffness_n_m=SHAFT, damping_n_s_m=5.0),
            Unbalance(node='disk', unbalance_kg_m=2e-4),
            *((rub,) if gap else ()),
        )
        plant = CompiledPlant(Plant(nodes={'disk': Node(mass_kg=MASS)}, elements=elements))
        samples, last = streamed(plant, 80.0, load_m_s2=(9.81, 0.0))
        found[gap] = samples.tobytes() + last.tobytes()
    assert found[None] == found[1.0]
    assert found[None] != found[5e-5]
