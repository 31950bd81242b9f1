# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Coupling misalignment: steady amplitudes by the linear receptance of the rotor."""

import cmath
import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rotor_sim.errors import PlantError
from rotor_sim.plant.compiled_plant import CompiledPlant, Instant
from rotor_sim.plant.element import Element, Matrices
from rotor_sim.plant.elements.angular_misalignment import AngularMisalignment
from rotor_sim.plant.elements.parallel_misalignment import ParallelMisalignment
from rotor_sim.plant.elements.shaft_segment import ShaftSegment
from rotor_sim.plant.plant import Node, Plant

DISK, HUB, SHAFT, GROUND_STIFFNESS, DAMPING = 12.0, 3.0, 5e6, 2e6, 300.0
OFFSET, K_1, K_2, PHASE_1, PHASE_2 = 2e-4, 3e5, 8e5, 0.4, -1.3
TILT_STIFFNESS, DIAMETRAL, POLAR = 3e4, 0.05, 0.09


def in_time(parts: dict[int, Any], angle: float, speed: float) -> tuple[NDArray[np.float64], ...]:
    """Place, velocity and acceleration of y + i z = sum of z_n e^(i n W t), node by node."""
    moved = []
    for power in range(3):
        at = sum(
            (1j * n * speed) ** power * z * cmath.exp(1j * n * angle) for n, z in parts.items()
        )
        moved.append(np.array([part for one in at for part in (one.real, one.imag)]))
    return tuple(moved)


@pytest.mark.parametrize('speed', [60.0, 200.0, 391.0, 800.0])
def test_parallel_offset_moves_the_disk_by_the_receptance(speed: float) -> None:
    """Force on the hub, response of disk and hub: (K + i n W C - (n W)^2 M)^-1 at n = 1, 2."""
    plant = CompiledPlant(
        Plant(
            nodes={'disk': Node(mass_kg=DISK), 'hub': Node(mass_kg=HUB)},
            elements=(
                ShaftSegment(node='disk', other='hub', stiffness_n_m=SHAFT),
                ShaftSegment(node='disk', stiffness_n_m=GROUND_STIFFNESS, damping_n_s_m=DAMPING),
                ParallelMisalignment(
                    node='hub',
                    offset_m=OFFSET,
                    stiffness_1x_n_m=K_1,
                    stiffness_2x_n_m=K_2,
                    phase_1x_rad=PHASE_1,
                    phase_2x_rad=PHASE_2,
                ),
            ),
        )
    )
    k = np.array([[SHAFT + GROUND_STIFFNESS, -SHAFT], [-SHAFT, SHAFT]])
    parts = {}
    for n, force in (
        (1, cmath.rect(K_1 * OFFSET, PHASE_1)),
        (2, cmath.rect(K_2 * OFFSET, PHASE_2)),
    ):
        dynamic = k + np.diag([1j * n * speed * DAMPING, 0.0])
        dynamic = dynamic - (n * speed) ** 2 * np.diag([DISK, HUB])
        parts[n] = np.linalg.solve(dynamic, [0.0, force])
    assert min(abs(z[0]) for z in parts.values()) > 1e-7
    for angle in (0.0, 1.1, 3.0, 5.5):
        place, velocity, expected = in_time(parts, angle, speed)
        found = plant.acceleration(np.concatenate([place, velocity]), Instant(angle, speed))
        scale = SHAFT / HUB * float(np.max(np.abs(place)))
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-11 * scale)


class _TiltSpring(Element):
    """A spring against tilting, as stands in for a beam here."""

    touches = (('node', ('theta_y', 'theta_z')),)

    kind: str = 'tilt_spring'
    node: str

    def matrices(self, positions_m: Any) -> Matrices:  # noqa: ARG002
        return Matrices(stiffness=TILT_STIFFNESS * np.eye(2))


def tilting(node: Node) -> CompiledPlant:
    return CompiledPlant(
        Plant(
            nodes={'hub': node},
            elements=(
                _TiltSpring(node='hub'),
                AngularMisalignment(
                    node='hub',
                    misalignment_rad=0.01,
                    stiffness_1x_n_m_rad=400.0,
                    stiffness_2x_n_m_rad=900.0,
                    phase_1x_rad=PHASE_1,
                    phase_2x_rad=PHASE_2,
                ),
            ),
        )
    )


def test_angle_tilts_a_gyroscopic_hub_by_the_receptance() -> None:
    """theta_y + i theta_z: M_n/(k - (n W)^2 I_d + n W^2 I_p), from I_d t'' - i W I_p t' + k t."""
    plant = tilting(Node(mass_kg=HUB, diametral_inertia_kg_m2=DIAMETRAL, polar_inertia_kg_m2=POLAR))
    assert plant.coordinates[2:] == (('hub', 'theta_y'), ('hub', 'theta_z'))
    for speed in (100.0, 500.0, 900.0):
        parts = {}
        for n, moment in ((1, cmath.rect(4.0, PHASE_1)), (2, cmath.rect(9.0, PHASE_2))):
            stiffness = TILT_STIFFNESS - (n * speed) ** 2 * DIAMETRAL + n * speed**2 * POLAR
            parts[n] = np.array([0.0, moment / stiffness])
        for angle in (0.0, 1.1, 3.0):
            place, velocity, expected = in_time(parts, angle, speed)
            found = plant.acceleration(np.concatenate([place, velocity]), Instant(angle, speed))
            assert found == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_angle_wants_a_node_that_tilts() -> None:
    with pytest.raises(PlantError, match=r'hub has no moment of inertia: .* diametral_inertia'):
        tilting(Node(mass_kg=HUB))


def test_amplitudes_by_hand_at_one_instant() -> None:
    """At shaft angle 30 degrees: 1x at 30 + 0, 2x at 60 + 90 degrees."""
    plant = CompiledPlant(
        Plant(
            nodes={'hub': Node(mass_kg=1.0)},
            elements=(
                ParallelMisalignment(
                    node='hub',
                    offset_m=1e-3,
                    stiffness_1x_n_m=2000.0,
                    stiffness_2x_n_m=1000.0,
                    phase_2x_rad=math.pi / 2,
                ),
            ),
        )
    )
    root = math.sqrt(3.0)
    found = plant.acceleration(np.zeros(4), Instant(math.pi / 6))
    assert found == pytest.approx([root - 0.5 * root, 1.0 + 0.5], rel=1e-12)
