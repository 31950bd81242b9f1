# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A residual bow on a Jeffcott rotor: the closed forms of Nicholas, Gunter and Allaire, 1976."""

import cmath
import math

import numpy as np
import pytest

from rotor_sim.plant.compiled_plant import CompiledPlant, Instant
from rotor_sim.plant.elements.residual_bow import ResidualBow
from rotor_sim.plant.elements.shaft_segment import ShaftSegment
from rotor_sim.plant.elements.unbalance import Unbalance
from rotor_sim.plant.plant import Node, Plant

MASS, STIFFNESS, DAMPING, ECCENTRICITY, BOW = 10.0, 2e6, 250.0, 4e-5, 1e-5
NATURAL = math.sqrt(STIFFNESS / MASS)
RATIO = DAMPING / (2.0 * math.sqrt(STIFFNESS * MASS))
ANGLES = (0.0, 0.9, 2.2, 4.0)


def jeffcott(bow_m: float, phase_rad: float, unbalance_phase_rad: float = 0.0) -> CompiledPlant:
    return CompiledPlant(
        Plant(
            nodes={'disk': Node(mass_kg=MASS)},
            elements=(
                ShaftSegment(node='disk', stiffness_n_m=STIFFNESS, damping_n_s_m=DAMPING),
                Unbalance(
                    node='disk',
                    unbalance_kg_m=MASS * ECCENTRICITY,
                    phase_rad=unbalance_phase_rad,
                ),
                ResidualBow(node='disk', stiffness_n_m=STIFFNESS, bow_m=bow_m, phase_rad=phase_rad),
            ),
        )
    )


def on_circle(whirl: complex, speed: float, angle: float) -> np.ndarray:
    """The state of y + i z = whirl e^(i W t)."""
    place = whirl * cmath.exp(1j * angle)
    velocity = 1j * speed * place
    return np.array([place.real, place.imag, velocity.real, velocity.imag])


@pytest.mark.parametrize('phase', [0.0, 1.0, math.pi, -2.0])
@pytest.mark.parametrize('f', [0.3, 0.999, 1.7])
def test_whirl_is_that_of_the_closed_form(phase: float, f: float) -> None:
    """Z = (b e^(i phase) + e f^2)/(1 - f^2 + 2 i xi f), f = W/w_n, at every angle."""
    plant, speed = jeffcott(BOW, phase), f * NATURAL
    bow = BOW * cmath.exp(1j * phase)
    whirl = (bow + ECCENTRICITY * f * f) / (1.0 - f * f + 2j * RATIO * f)
    for angle in ANGLES:
        state = on_circle(whirl, speed, angle)
        found = plant.acceleration(state, Instant(angle, speed))
        assert found == pytest.approx(-(speed**2) * state[:2], rel=1e-9, abs=1e-9 * speed**2 * BOW)


def test_bow_cancels_the_unbalance_at_one_speed() -> None:
    """Opposite to the unbalance: the disk stays at 0 at W = w_n sqrt(b/e), and at no other."""
    plant = jeffcott(BOW, 0.5 + math.pi, 0.5)
    still = NATURAL * math.sqrt(BOW / ECCENTRICITY)
    scale = ECCENTRICITY * still**2
    for angle in ANGLES:
        found = plant.acceleration(np.zeros(4), Instant(angle, still))
        assert np.hypot(*found) < 1e-12 * scale
        for other in (0.9, 1.1):
            found = plant.acceleration(np.zeros(4), Instant(angle, other * still))
            assert np.hypot(*found) == pytest.approx(abs(other**2 - 1.0) * scale, rel=1e-9)


def test_slow_roll_shows_the_bow_itself() -> None:
    plant = jeffcott(BOW, 0.8)
    for angle in ANGLES:
        state = on_circle(BOW * cmath.exp(0.8j), 0.0, angle)
        assert plant.acceleration(state, Instant(angle)) == pytest.approx([0.0, 0.0], abs=1e-12)


def test_bow_between_two_nodes_pushes_both_and_nothing_else() -> None:
    plant = CompiledPlant(
        Plant(
            nodes={'disk': Node(mass_kg=MASS), 'journal': Node(mass_kg=1.0)},
            elements=(
                ResidualBow(
                    node='disk', other='journal', stiffness_n_m=STIFFNESS, bow_m=BOW, phase_rad=0.3
                ),
            ),
        )
    )
    found = plant.acceleration(np.zeros(8), Instant(1.0))
    push = STIFFNESS * BOW * np.array([math.cos(1.3), math.sin(1.3)])
    assert found == pytest.approx([*(push / MASS), *-push], rel=1e-12)


def test_no_bow_gives_the_bits_of_no_element() -> None:
    state, at = np.array([2e-5, -3e-5, 0.1, 0.2]), Instant(0.7, 300.0)
    plant = jeffcott(0.0, 0.3)
    bare = Plant(nodes=plant.plant.nodes, elements=plant.plant.elements[:2])
    without = CompiledPlant(bare).acceleration(state, at)
    assert plant.acceleration(state, at).tobytes() == without.tobytes()
    bent = plant.acceleration(state, Instant(0.7, 300.0, live={'residual_bow_1.bow_m': 1e-9}))
    assert bent.tobytes() != without.tobytes()
