# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Opening laws of a crack: stiffness over one turn, and its orders under a dominant weight."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad

from rotor_common.errors import ConfigError
from rotor_sim.plant.compiled_plant import CompiledPlant, Instant
from rotor_sim.plant.elements.crack import Crack
from rotor_sim.plant.elements.shaft_segment import ShaftSegment
from rotor_sim.plant.elements.unbalance import Unbalance
from rotor_sim.plant.modes import modes
from rotor_sim.plant.plant import Node, Plant
from rotor_sim.plant.statics import static_equilibrium

Array = NDArray[np.float64]

MASS, STIFFNESS, RATIO, ANGLE = 5.0, 8e5, 0.2, 0.6
LAWS = ('gasch', 'mayes', 'open')
OPENING: dict[str, Callable[[Any], Array]] = {
    'gasch': lambda chi: (np.cos(chi) > 0.0).astype(float),
    'mayes': lambda chi: 0.5 * (1.0 + np.cos(chi)),
    'open': np.ones_like,
}
TURN = (np.arange(720) + 0.5) * (2.0 * math.pi / 720)


def cracked(law: str, ratio: float = RATIO, angle_rad: float = ANGLE) -> CompiledPlant:
    return CompiledPlant(
        Plant(
            nodes={'disk': Node(mass_kg=MASS)},
            elements=(
                ShaftSegment(node='disk', stiffness_n_m=STIFFNESS),
                Crack.from_mapping(
                    {
                        'node': 'disk',
                        'law': law,
                        'stiffness_n_m': STIFFNESS,
                        'stiffness_ratio': ratio,
                        'angle_rad': angle_rad,
                    }
                ),
            ),
        )
    )


def force_over_turn(law: str, bend: Array) -> Array:
    """What the crack gives back, (turn, 2) in N, of a bend that stands still."""
    plant, state = cracked(law), np.concatenate([bend, np.zeros(2)])
    found = [plant.acceleration(state, Instant(angle)) for angle in map(float, TURN)]
    return MASS * np.array(found) + STIFFNESS * bend


def order(signal: Array, n: int) -> complex:
    """Return the complex amplitude of cos(n t) over one turn; the mean for n = 0."""
    return complex(np.mean(signal * np.exp(-1j * n * TURN))) * (2.0 if n else 1.0)


@pytest.mark.parametrize('law', LAWS)
@pytest.mark.parametrize('way', [0.0, 1.0, -2.5])
def test_lost_force_over_one_turn(law: str, way: float) -> None:
    """K k f(chi) cos(chi) |b| along n, chi the angle from the bend to the crack."""
    size = 3e-5
    bend = size * np.array([math.cos(way), math.sin(way)])
    psi = TURN + ANGLE
    along = RATIO * STIFFNESS * size * OPENING[law](psi - way) * np.cos(psi - way)
    expected = along[:, np.newaxis] * np.stack([np.cos(psi), np.sin(psi)], axis=1)
    scale = RATIO * STIFFNESS * size
    assert force_over_turn(law, bend) == pytest.approx(expected, abs=1e-9 * scale)


@pytest.mark.parametrize(
    ('law', 'orders'),
    [
        # the series of cos^2 over the half wave that is open
        ('gasch', (1 / 4, 4 / (3 * math.pi), 1 / 4, 4 / (15 * math.pi), 0.0)),
        # (1 + cos)(1 + cos 2 .)/4
        ('mayes', (1 / 4, 3 / 8, 1 / 4, 1 / 8, 0.0)),
        # (1 + cos 2 .)/2
        ('open', (1 / 2, 0.0, 1 / 2, 0.0, 0.0)),
    ],
)
def test_orders_of_the_stiffness_under_a_dominant_weight(
    law: str, orders: tuple[float, ...]
) -> None:
    """Of the stiffness lost along the weight, over K k: f cos^2 as a Fourier series of the turn."""
    lost = force_over_turn(law, np.array([1e-5, 0.0]))[:, 0] / (RATIO * STIFFNESS * 1e-5)
    for n, expected in enumerate(orders):
        found = order(lost, n) * np.exp(-1j * n * ANGLE)  # the crack leads by its angle
        assert found == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize(
    ('law', 'orders'),
    [
        # a square wave: 1/2 + 2/pi (cos - cos 3 ./3 + cos 5 ./5 ...)
        ('gasch', (1 / 2, 2 / math.pi, 0.0, -2 / (3 * math.pi), 0.0, 2 / (5 * math.pi))),
        ('mayes', (1 / 2, 1 / 2, 0.0, 0.0, 0.0, 0.0)),
        ('open', (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
    ],
)
def test_orders_of_the_opening(law: str, orders: tuple[float, ...]) -> None:
    """Of f itself, from the force along n over K k cos(chi) |b|: Gasch has odd orders, Mayes 1."""
    bend = np.array([1e-5, 0.0])
    psi = TURN + ANGLE
    n = np.stack([np.cos(psi), np.sin(psi)], axis=1)
    along = (force_over_turn(law, bend) * n).sum(axis=1)
    opening = along / (RATIO * STIFFNESS * 1e-5 * np.cos(psi))
    for k, expected in enumerate(orders):
        found = order(opening, k) * np.exp(-1j * k * ANGLE)
        assert found == pytest.approx(expected, abs=5e-3)


@pytest.mark.parametrize('law', ['gasch', 'open'])
def test_static_deflection_over_one_turn(law: str) -> None:
    """m g/k (1 + K/(1 - K) cos^2) along the weight while open, and the part across it."""
    plant, load = cracked(law), 9.81
    rest = MASS * load / STIFFNESS
    for angle in np.linspace(0.0, 2.0 * math.pi, 25)[:-1]:
        psi = float(angle) + ANGLE
        share = RATIO / (1.0 - RATIO) * float(OPENING[law](np.array(psi)))
        expected = rest * np.array(
            [1.0 + share * math.cos(psi) ** 2, share * math.cos(psi) * math.sin(psi)]
        )
        found = static_equilibrium(plant, (load, 0.0), float(angle))
        assert found[:2] == pytest.approx(expected, rel=1e-9, abs=1e-9 * rest)


def test_mean_deflection_of_mayes_to_first_order() -> None:
    """A shallow crack: K/4 more than the whole shaft over one turn, since f cos^2 has mean 1/4."""
    ratio, load = 1e-4, 9.81
    plant = cracked('mayes', ratio)
    angles = np.linspace(0.0, 2.0 * math.pi, 16, endpoint=False)
    found = np.mean([static_equilibrium(plant, (load, 0.0), float(a))[0] for a in angles])
    rest = MASS * load / STIFFNESS
    assert found / rest - 1.0 == pytest.approx(0.25 * ratio, rel=1e-3)
    mean, _ = quad(lambda t: 0.5 * (1.0 + math.cos(t)) * math.cos(t) ** 2, 0.0, 2.0 * math.pi)
    assert mean / (2.0 * math.pi) == pytest.approx(0.25, rel=1e-12)


def test_notch_splits_the_natural_frequency() -> None:
    """At rest: sqrt(k/m) across the notch, sqrt((1 - K) k/m) along it; a hinge that bends, too."""
    expected = np.sqrt(np.array([1.0 - RATIO, 1.0]) * STIFFNESS / MASS)
    found = modes(cracked('open'), np.zeros(4), Instant())
    assert found.frequencies_rad_s == pytest.approx(expected, rel=1e-12)
    bent = 1e-5 * np.array([math.cos(ANGLE), math.sin(ANGLE), 0.0, 0.0])
    found = modes(cracked('gasch'), bent, Instant())
    assert found.frequencies_rad_s == pytest.approx(expected, rel=1e-12)
    found = modes(cracked('gasch'), -bent, Instant())
    assert found.frequencies_rad_s == pytest.approx(np.full(2, expected[1]), rel=1e-12)


@pytest.mark.parametrize('law', LAWS)
def test_tangent_is_that_of_differences(law: str) -> None:
    plant = cracked(law)
    state, at = np.array([2e-5, 1e-5, 0.0, 0.0]), Instant(0.2)
    slope = plant.jacobian(state, at)
    for k in range(2):
        move = 1e-10 * np.eye(4)[k]
        change = plant.acceleration(state + move, at) - plant.acceleration(state - move, at)
        assert slope[:, k] == pytest.approx(change / 2e-10, rel=1e-5, abs=1.0)
    assert np.isfinite(plant.jacobian(np.zeros(4), at)).all()


@pytest.mark.parametrize('law', LAWS)
def test_crack_between_two_nodes_pushes_both(law: str) -> None:
    """Action and reaction; a shift of both nodes changes nothing."""
    plant = CompiledPlant(
        Plant(
            nodes={'disk': Node(mass_kg=1.0), 'journal': Node(mass_kg=1.0)},
            elements=(
                Crack.from_mapping(
                    {
                        'node': 'disk',
                        'other': 'journal',
                        'law': law,
                        'stiffness_n_m': STIFFNESS,
                        'stiffness_ratio': RATIO,
                    }
                ),
            ),
        )
    )
    state = np.array([3e-5, 1e-5, 1e-5, -1e-5, 0.0, 0.0, 0.0, 0.0])
    found = plant.acceleration(state, Instant(0.3))
    assert found[:2] == pytest.approx(-found[2:], rel=1e-12)
    assert np.hypot(*found[:2]) > 0.5
    shift = np.array([2e-5, -4e-5, 2e-5, -4e-5, 0.0, 0.0, 0.0, 0.0])
    assert plant.acceleration(state + shift, Instant(0.3)) == pytest.approx(found, rel=1e-9)


@pytest.mark.parametrize('law', LAWS)
def test_depth_0_gives_the_bits_of_no_crack(law: str) -> None:
    nodes = {'disk': Node(mass_kg=MASS)}
    whole = CompiledPlant(
        Plant(
            nodes=nodes,
            elements=(
                ShaftSegment(node='disk', stiffness_n_m=STIFFNESS, damping_n_s_m=10.0),
                Unbalance(node='disk', unbalance_kg_m=1e-3),
            ),
        )
    )
    sound = CompiledPlant(
        Plant(nodes=nodes, elements=(*whole.plant.elements, cracked(law, 0.0).plant.elements[1]))
    )
    for k in range(20):
        state, at = np.array([2e-5, 1e-6 * k, 0.01, -0.02]), Instant(0.4 * k, 200.0)
        assert sound.acceleration(state, at).tobytes() == whole.acceleration(state, at).tobytes()


def test_two_cracks_at_any_angle_add_up() -> None:
    """Two notches at right angles take K k from both directions alike."""
    one, two = cracked('open', angle_rad=0.2), cracked('open', angle_rad=0.2 + 0.5 * math.pi)
    both = CompiledPlant(
        Plant(nodes=one.plant.nodes, elements=(*one.plant.elements, two.plant.elements[1]))
    )
    for angle in (0.0, 0.7, 2.0):
        found = both.acceleration([1e-5, 2e-5, 0.0, 0.0], Instant(angle))
        expected = -(1.0 - RATIO) * STIFFNESS / MASS * np.array([1e-5, 2e-5])
        assert found == pytest.approx(expected, rel=1e-9)


def test_unknown_law_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"law = 'hinge' is not allowed; it must be 'gasch'"):
        cracked('hinge')
