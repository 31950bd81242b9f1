# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Supports and looseness: split critical speeds, whirl between them, bilinear frequency."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from rotor_sim.plant.compiled_plant import CompiledPlant, Instant
from rotor_sim.plant.elements.looseness import Looseness
from rotor_sim.plant.elements.shaft_segment import ShaftSegment
from rotor_sim.plant.elements.support import Support
from rotor_sim.plant.elements.unbalance import Unbalance
from rotor_sim.plant.modes import modes
from rotor_sim.plant.plant import Node, Plant
from rotor_sim.plant.statics import static_equilibrium

DISK, HOUSING, SHAFT, K_Y, K_Z = 8.0, 2.0, 4e6, 9e6, 3e6
ECCENTRICITY = 2e-5


def jeffcott(*others: Any, **support: Any) -> CompiledPlant:
    """Disk on a shaft in a housing, and the housing on its support."""
    return CompiledPlant(
        Plant(
            nodes={'disk': Node(mass_kg=DISK), 'housing': Node(mass_kg=HOUSING)},
            elements=(
                ShaftSegment(node='disk', other='housing', stiffness_n_m=SHAFT),
                Support(node='housing', stiffness_y_n_m=K_Y, stiffness_z_n_m=K_Z, **support),
                Unbalance(node='disk', unbalance_kg_m=DISK * ECCENTRICITY),
                *others,
            ),
        )
    )


def natural(k: float) -> tuple[float, float]:
    """Two masses, two springs: the roots of m_d m_h w^4 - (m_d (k_s + k) + m_h k_s) w^2 + k_s k."""
    b, c = DISK * (SHAFT + k) + HOUSING * SHAFT, SHAFT * k
    root = math.sqrt(b * b - 4.0 * DISK * HOUSING * c)
    return math.sqrt(2.0 * c / (b + root)), math.sqrt((b + root) / (2.0 * DISK * HOUSING))


def test_criticals_are_split() -> None:
    found = modes(jeffcott(), np.zeros(8), Instant(speed_rad_s=300.0))
    expected = sorted(natural(K_Y) + natural(K_Z))
    assert found.frequencies_rad_s == pytest.approx(expected, rel=1e-12)
    assert found.decay_rates_1_s == pytest.approx(np.zeros(4), abs=1e-9)
    assert expected[1] / expected[0] > 1.2


def test_unbalance_response_diverges_at_both_and_whirls_backward_between() -> None:
    """The steady orbit by the closed form of each plane satisfies the equation of motion."""
    plant = jeffcott()
    (low, _), (high, _) = natural(K_Z), natural(K_Y)

    def receptance(k: float, speed: float) -> NDArray[np.float64]:
        square = speed * speed
        dynamic = [[SHAFT - square * DISK, -SHAFT], [-SHAFT, SHAFT + k - square * HOUSING]]
        return np.linalg.solve(np.array(dynamic), [DISK * ECCENTRICITY * square, 0.0])

    for speed, is_backward in ((0.7 * low, False), (0.5 * (low + high), True), (1.1 * high, False)):
        along, across = receptance(K_Y, speed), receptance(K_Z, speed)
        assert (float(along[0] * across[0]) < 0.0) is is_backward
        for angle in (0.0, 0.4, 2.0):
            c, s = math.cos(angle), math.sin(angle)
            place = np.array([along[0] * c, across[0] * s, along[1] * c, across[1] * s])
            found = plant.acceleration(np.concatenate([place, np.zeros(4)]), Instant(angle, speed))
            assert found == pytest.approx(-speed * speed * place, rel=1e-9, abs=1e-12)


def test_dampers_decay_as_those_of_one_mass() -> None:
    """A mass on a support: decay rates c/(2 m), frequencies sqrt(k/m - (c/(2 m))^2)."""
    plant = CompiledPlant(
        Plant(
            nodes={'housing': Node(mass_kg=HOUSING)},
            elements=(
                Support(
                    node='housing',
                    stiffness_y_n_m=K_Y,
                    stiffness_z_n_m=K_Z,
                    damping_y_n_s_m=300.0,
                    damping_z_n_s_m=700.0,
                ),
            ),
        )
    )
    found = modes(plant, np.zeros(4), Instant())
    decay = np.array([700.0, 300.0]) / (2.0 * HOUSING)
    assert found.decay_rates_1_s == pytest.approx(decay, rel=1e-9)
    expected = np.sqrt(np.array([K_Z, K_Y]) / HOUSING - decay**2)
    assert found.frequencies_rad_s == pytest.approx(expected, rel=1e-12)


def test_coupling_of_y_and_z_turns_the_principal_axes() -> None:
    """k_yz of springs k_1, k_2 turned by 0.3 rad gives back their frequencies."""
    c, s = math.cos(0.3), math.sin(0.3)
    k = np.array([[c, -s], [s, c]]) @ np.diag([K_Y, K_Z]) @ np.array([[c, s], [-s, c]])
    plant = CompiledPlant(
        Plant(
            nodes={'housing': Node(mass_kg=HOUSING)},
            elements=(
                Support(
                    node='housing',
                    stiffness_y_n_m=float(k[0, 0]),
                    stiffness_z_n_m=float(k[1, 1]),
                    stiffness_yz_n_m=float(k[0, 1]),
                ),
            ),
        )
    )
    found = modes(plant, np.zeros(4), Instant())
    assert found.frequencies_rad_s == pytest.approx(
        np.sqrt(np.array([K_Z, K_Y]) / HOUSING), rel=1e-12
    )
    assert abs(found.shapes[1, 1] / found.shapes[1, 0]) == pytest.approx(s / c, rel=1e-9)


def loose(share: float, gap_m: float = 0.0, angle_rad: float = math.pi) -> CompiledPlant:
    return CompiledPlant(
        Plant(
            nodes={'housing': Node(mass_kg=HOUSING)},
            elements=(
                Support(node='housing', stiffness_y_n_m=K_Y, stiffness_z_n_m=K_Y),
                Looseness(
                    node='housing',
                    stiffness_n_m=K_Y,
                    lost_share=share,
                    gap_m=gap_m,
                    angle_rad=angle_rad,
                ),
            ),
        )
    )


@pytest.mark.parametrize('share', [0.0, 0.3, 0.75, 0.96])
@pytest.mark.parametrize('angle', [math.pi, 0.0, 1.1])
def test_bilinear_frequency(share: float, angle: float) -> None:
    """Free vibration along n about gap 0 has w = 2 w1 w2/(w1 + w2), whatever its size."""
    plant = loose(share, angle_rad=angle)
    n = np.array([math.cos(angle), math.sin(angle)])
    w1 = math.sqrt(K_Y / HOUSING)
    w2 = w1 * math.sqrt(1.0 - share)
    period = 2.0 * math.pi / (2.0 * w1 * w2 / (w1 + w2))

    def slope(_t: float, state: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.concatenate([state[2:], plant.acceleration(state)])

    def passes(_t: float, state: NDArray[np.float64]) -> float:
        return float(state[:2] @ n)

    passes.direction = 1.0  # type: ignore[attr-defined]
    start = np.concatenate([np.zeros(2), 0.1 * n])
    found = solve_ivp(
        slope, (0.0, 5.5 * period), start, 'DOP853', events=passes, rtol=1e-10, atol=1e-13
    )
    at = np.array([t for t in found.t_events[0] if t > 0.1 * period])
    assert at == pytest.approx(period * np.arange(1, 6), rel=1e-6)


def test_deflection_beyond_the_gap_is_that_of_two_springs_in_a_row() -> None:
    """Load F along n: F/k up to the gap g, then g + (F - k g)/((1 - s) k)."""
    gap, share = 1e-6, 0.6
    plant = loose(share, gap, 0.0)
    for force in (0.5 * K_Y * gap, 3.0 * K_Y * gap, -3.0 * K_Y * gap):
        found = static_equilibrium(plant, (force / HOUSING, 0.0))
        beyond = max(force - K_Y * gap, 0.0)
        expected = force / K_Y if beyond == 0.0 else gap + beyond / ((1.0 - share) * K_Y)
        assert found[0] == pytest.approx(expected, rel=1e-9)
        assert found[1] == 0.0


def test_nothing_lost_gives_the_bits_of_no_looseness() -> None:
    state, at = np.array([2e-5, -3e-5, -4e-5, 1e-6, 0.1, 0.2, -0.3, 0.0]), Instant(0.7, 300.0)
    without = jeffcott().acceleration(state, at)
    tight = Looseness(node='housing', stiffness_n_m=K_Y, lost_share=0.0)
    assert jeffcott(tight).acceleration(state, at).tobytes() == without.tobytes()
    slack = Looseness(node='housing', stiffness_n_m=K_Y, lost_share=0.01)
    assert jeffcott(slack).acceleration(state, at).tobytes() != without.tobytes()
