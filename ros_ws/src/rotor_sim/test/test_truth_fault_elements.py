# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""All faults on one rotor: the compiled engine against another integrator, and its tangent."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from plant_stream import streamed
from rotor_sim.plant.compiled_plant import CompiledPlant, Instant
from rotor_sim.plant.plant import Plant

Array = NDArray[np.float64]

SPEED = 140.0
LOAD = (9.81, 1.0)
SHAFT = 4e6
TURN_SPEED = 110.0


def everything(*, slip_velocity_m_s: float = 0.05) -> CompiledPlant:
    """A disk between a spalled bearing on a loose support and a sound one, with all faults."""
    spalls = [
        {
            'kind': 'spalled_ball_bearing',
            'node': 'left',
            'housing': 'pedestal',
            'spall_on': place,
            'depth_m': 3e-6,
            'contact_stiffness_n_m15': 3e9,
            'ball_count': balls,
        }
        for place, balls in (('outer_race', 9), ('inner_race', 8), ('ball', 7))
    ]
    return CompiledPlant(
        Plant.from_mapping(
            {
                'nodes': {
                    'disk': {
                        'mass_kg': 20.0,
                        'diametral_inertia_kg_m2': 0.3,
                        'polar_inertia_kg_m2': 0.5,
                    },
                    'left': {'mass_kg': 3.0},
                    'right': {'mass_kg': 3.0},
                    'pedestal': {'mass_kg': 5.0},
                },
                'elements': [
                    {
                        'kind': 'shaft_segment',
                        'node': 'disk',
                        'other': end,
                        'stiffness_n_m': SHAFT,
                        'damping_n_s_m': 900.0,
                    }
                    for end in ('left', 'right')
                ]
                + spalls
                + [
                    {'kind': 'ball_bearing', 'node': 'right'},
                    {
                        'kind': 'support',
                        'node': 'pedestal',
                        'stiffness_y_n_m': 2e7,
                        'stiffness_z_n_m': 9e6,
                        'damping_y_n_s_m': 2000.0,
                        'damping_z_n_s_m': 2000.0,
                    },
                    {
                        'kind': 'looseness',
                        'node': 'pedestal',
                        'stiffness_n_m': 2e7,
                        'lost_share': 0.7,
                        'gap_m': -1e-6,
                    },
                    {'kind': 'unbalance', 'node': 'disk', 'unbalance_kg_m': 6e-4},
                    {
                        'kind': 'residual_bow',
                        'node': 'disk',
                        'other': 'left',
                        'stiffness_n_m': SHAFT,
                        'bow_m': 1e-5,
                        'phase_rad': 1.0,
                    },
                    {
                        'kind': 'parallel_misalignment',
                        'node': 'right',
                        'offset_m': 1e-4,
                        'stiffness_2x_n_m': 8e5,
                    },
                    {
                        'kind': 'angular_misalignment',
                        'node': 'disk',
                        'misalignment_rad': 1e-3,
                        'stiffness_2x_n_m_rad': 500.0,
                    },
                    *(
                        {
                            'kind': 'crack',
                            'node': 'disk',
                            'other': end,
                            'law': law,
                            'stiffness_n_m': SHAFT,
                            'stiffness_ratio': 0.15,
                            'angle_rad': angle,
                        }
                        for end, law, angle in (
                            ('left', 'gasch', 0.3),
                            ('right', 'mayes', 2.0),
                            ('right', 'open', 4.0),
                        )
                    ),
                    {
                        'kind': 'rub',
                        'node': 'disk',
                        'stator': 'pedestal',
                        'stiffness_n_m': 3e6,
                        'gap_m': 3e-5,
                        'friction_coefficient': 0.15,
                        'shaft_radius_m': 0.03,
                        'slip_velocity_m_s': slip_velocity_m_s,
                    },
                ],
            }
        )
    )


@pytest.mark.slow
def test_compiled_engine_agrees_with_another_integrator() -> None:
    """DOP853 on the equations as plain Python, to 1e-7 of the largest place after 0.1 s."""
    plant = everything()
    n = plant.size

    def slope(t: float, state: Array) -> Array:
        at = Instant(SPEED * t, SPEED, LOAD)
        return np.concatenate([state[n:], plant.acceleration(state, at)])

    samples, last = streamed(plant, SPEED, load_m_s2=LOAD, samples=200, rate_hz=2000, substeps=40)
    assert np.isfinite(samples).all()
    reached = np.hypot(samples[:, 0] - samples[:, 8], samples[:, 1] - samples[:, 9]).max()
    assert reached > 3.5e-5  # the disk has rubbed
    found = solve_ivp(
        slope, (0.0, 0.1), np.zeros(2 * n), 'DOP853', rtol=1e-8, atol=1e-13, max_step=2e-4
    )
    scale = np.abs(samples).max()
    translations = [k for k, (_, axis) in enumerate(plant.coordinates) if axis in ('y', 'z')]
    assert found.success
    error = np.abs(found.y[translations, -1] - last[translations]).max()
    assert error < 1e-7 * scale


@pytest.mark.parametrize('angle', [0.4, 2.9])
def test_derived_tangent_is_that_of_differences(angle: float) -> None:
    """At a state in contact everywhere; both sides of every kink are far away."""
    plant = everything(slip_velocity_m_s=10.0)
    n = plant.size
    state = np.zeros(2 * n)
    state[:n] = [5e-5, 2e-5, 1e-4, -2e-4, 8e-6, 3e-6, 7e-6, -4e-6, 2e-6, 1e-6]
    state[n:] = 1e-3
    at = Instant(angle, SPEED, LOAD)
    slope = plant.jacobian(state, at)
    for k in range(2 * n):
        step = 1e-10 if k < n else 1e-6
        move = step * np.eye(2 * n)[k]
        change = plant.acceleration(state + move, at) - plant.acceleration(state - move, at)
        size = float(np.abs(slope[:, k]).max())
        assert slope[:, k] == pytest.approx(change / (2.0 * step), abs=1e-4 * size + 1e-3)


@pytest.mark.slow
def test_tangent_over_revolutions_is_the_difference_of_two_runs() -> None:
    """A sector whose edge the node crosses in contact: only with saltation they agree."""
    plant = CompiledPlant(
        Plant.from_mapping(
            {
                'nodes': {'disk': {'mass_kg': 2.0}},
                'elements': [
                    {
                        'kind': 'shaft_segment',
                        'node': 'disk',
                        'stiffness_n_m': 2e4,
                        'damping_n_s_m': 40.0,
                    },
                    {
                        'kind': 'rub',
                        'node': 'disk',
                        'stiffness_n_m': 2e4,
                        'gap_m': 1e-4,
                        'sector_half_width_rad': 1.0,
                    },
                    {'kind': 'unbalance', 'node': 'disk', 'unbalance_kg_m': 4e-4},
                ],
            }
        )
    )
    start, direction = np.array([1e-4, 0.0, 0.0, 0.01]), np.array([0.3, 1.0, 20.0, -40.0])
    _, tangent = revolved(plant, start, direction, saltation=True)
    _, without = revolved(plant, start, direction, saltation=False)

    def slope(t: float, state: Array) -> Array:
        at = Instant(TURN_SPEED * t, TURN_SPEED)
        return np.concatenate([state[2:], plant.acceleration(state, at)])

    ends = [
        solve_ivp(
            slope,
            (0.0, 2.0 * math.pi / TURN_SPEED),
            start + small * direction,
            'DOP853',
            rtol=1e-11,
            atol=1e-16,
            max_step=1e-3,
        ).y[:, -1]
        for small in (2e-8, -2e-8)
    ]
    change = (ends[0] - ends[1]) / 4e-8
    scale = np.abs(change).max()
    assert np.abs(tangent - change).max() < 1e-2 * scale
    assert np.abs(without - change).max() > 1e-1 * scale


def revolved(
    plant: CompiledPlant, start: Array, direction: Array, *, saltation: bool
) -> tuple[Array, Array]:
    """Return state and tangent after one turn of the shaft in 4096 steps."""
    steps, speed, rows, n = 4096, TURN_SPEED, plant.engine.rows, plant.size
    b = np.zeros(rows.coefficients + len(plant.coefficients))
    b[rows.state : rows.state + 2 * n] = start
    b[rows.tangent : rows.tangent + 2 * n] = direction
    b[rows.drive] = speed
    b[rows.drive + 2 : rows.drive + 2 + 2 * len(plant.live) : 2] = list(plant.live.values())
    b[rows.ratios : rows.ratios + len(plant.ratios)] = plant.ratios
    b[rows.step] = 2.0 * math.pi / (steps * speed)
    b[rows.coefficients :] = plant.coefficients
    turn = np.arange(2 * steps + 1) * (math.pi / steps)
    observed, out = np.array([0]), np.empty((1, 0, 1, 1))
    plant.module.revolve(
        b, len(b), (0,), (), (0,), saltation, 0, 1, np.cos(turn), np.sin(turn), 0, observed, out
    )
    return b[: 2 * n].copy(), b[rows.tangent : rows.tangent + 2 * n].copy()
