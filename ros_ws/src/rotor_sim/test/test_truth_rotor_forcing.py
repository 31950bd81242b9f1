# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The force at twice the speed against the response of one mass on one spring, and the weight."""

import cmath
import math

import numpy as np
import pytest

from rotor_common.constants import GRAVITY_M_S2
from rotor_sim import LoadGrid, RotorSimConfig, RotorSimulator
from rotor_sim.plant.integration import integrate

RATE_HZ = 10_240
AMPLITUDE_N, PHASE_RAD = 150.0, 0.7


@pytest.mark.parametrize('samples_per_revolution', [1024, 512, 400])
def test_disk_answers_twice_the_speed_as_one_mass_on_a_spring(samples_per_revolution: int) -> None:
    """In p = y + iz: m p'' + 2 c p' + 2 k p = A exp(i (2 g + phase)), so p2 = A exp(i phase)/
    (2k - 4 m w^2 + 4 i c w), c = 2 xi m w; the three speeds lie below, near and above resonance.

    Heavy journals on hard balls hardly move: their contact is 1e4 times stiffer than the shaft.
    """
    speed = 2.0 * math.pi * RATE_HZ / samples_per_revolution
    m, k, damping = 32.1, 1e6, 0.05
    config = RotorSimConfig.from_mapping(
        {
            'rotor': {
                'disk_mass_kg': m,
                'shaft_stiffness_n_m': k,
                'damping_ratio': damping,
                'bearing_mass_kg': 1000.0,
                'contact_stiffness_n_m15': 1e13,
                'crack_stiffness_ratio': 0.0,
                'eccentricity_m': 0.0,
            },
            'speed': {'initial_rad_s': speed},
            # the swing from the start decays as exp(-2 xi w t): by exp(-125)
            'settle_revolutions': 200,
            'forcing': {'amplitude_n': AMPLITUDE_N, 'phase_rad': PHASE_RAD},
        }
    )
    simulator = RotorSimulator(config)
    n = 4 * samples_per_revolution
    plan = simulator.plan(n, LoadGrid.from_points([[GRAVITY_M_S2, 0.0]] * (n // 102 + 2)))
    (out,), _ = integrate([plan], 1)
    line = np.exp(-2j * plan.drive[:, 0])
    response = complex(np.mean((out[:, 0] + 1j * out[:, 1]) * line))
    stiffness = 2.0 * k - 4.0 * m * speed**2 + 4j * (2.0 * damping * m * speed) * speed
    expected = AMPLITUDE_N * cmath.exp(1j * PHASE_RAD) / stiffness
    # the journals yield by 1e-4 of the shaft, and near resonance that is 10 times as much
    assert abs(response - expected) < 2e-3 * abs(expected)
    # what turns backwards is none of the force's; the weight's own 2x is none either
    backwards = complex(np.mean((out[:, 0] + 1j * out[:, 1]) / line))
    assert abs(backwards) < 2e-3 * abs(expected)


def test_bearings_carry_the_weight_and_feel_the_force() -> None:
    """Over whole revolutions the mean contact force is half the disk's weight and the journal's."""
    config = RotorSimConfig.from_mapping(
        {
            'rotor': {'crack_stiffness_ratio': 0.0},
            'speed': {'initial_rad_s': 2.0 * math.pi * RATE_HZ / 200},
            'forcing': {'amplitude_n': 50.0},
        }
    )
    simulator = RotorSimulator(config)
    plan = simulator.plan(4000, LoadGrid.from_points([[2.0 * GRAVITY_M_S2, 0.0]] * 42))
    (out,), _ = integrate([plan], 1)
    p = config.rotor
    weight = 2.0 * GRAVITY_M_S2 * (0.5 * p.disk_mass_kg + p.bearing_mass_kg)
    for column in (12, 14):  # against the load, which points along +y
        # the cage turns 7.7 times in 20 revolutions: its orders average out to a percent
        assert out[:, column].mean() == pytest.approx(-weight, rel=0.01)
        assert abs(out[:, column + 1].mean()) < 0.01 * weight
        force = out[:, column] - out[:, column].mean()
        assert abs(np.mean(force * np.exp(-2j * plan.drive[:, 0]))) > 1.0
