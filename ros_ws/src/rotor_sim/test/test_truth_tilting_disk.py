# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The whirl split of an overhung disk against the closed form of Stodola and Green.

A light shaft on springs at x = 0 and x = a carries a disk at x = a + b (Genta, Dynamics of
Rotating Systems, 2005, section 4.4). With r = y + i z and the slope phi = theta_z - i theta_y,
    m r'' = F,    I_d phi'' - i I_p W phi' = M,    (r, phi) = A (F, M),
a whirl exp(i w t) has det(1 - A diag(m w^2, I_d w^2 - I_p W w)) = 0: forward where w > 0.
"""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from rotor_sim.plant.compiled_plant import CompiledPlant, Instant
from rotor_sim.plant.elements.beam import Beam
from rotor_sim.plant.elements.shaft_segment import ShaftSegment
from rotor_sim.plant.modes import modes
from rotor_sim.plant.plant import Node, Plant

SPAN_M, OVERHANG_M, DIAMETER_M, MODULUS, SPRING = 0.4, 0.15, 0.03, 2.1e11, 1e8
MASS, DIAMETRAL, POLAR = 50.0, 0.5, 0.9
SPEEDS = (0.0, 150.0, 600.0)


def overhung() -> CompiledPlant:
    places = {'n0': 0.0, 'n1': SPAN_M, 'disk': SPAN_M + OVERHANG_M}
    nodes = {name: Node(position_m=x) for name, x in places.items()}
    nodes['disk'] = Node(
        position_m=places['disk'],
        mass_kg=MASS,
        diametral_inertia_kg_m2=DIAMETRAL,
        polar_inertia_kg_m2=POLAR,
    )
    section = {
        'outer_diameter_m': DIAMETER_M,
        'elastic_modulus_pa': MODULUS,
        'density_kg_m3': 0.1,
        'poisson_ratio': 0.3,
    }
    elements = (
        Beam(node='n0', other='n1', **section),  # type: ignore[arg-type]
        Beam(node='n1', other='disk', **section),  # type: ignore[arg-type]
        ShaftSegment(node='n0', stiffness_n_m=SPRING),
        ShaftSegment(node='n1', stiffness_n_m=SPRING),
    )
    return CompiledPlant(Plant(nodes=nodes, elements=elements))


def compliance() -> NDArray[np.float64]:
    """Displacement and slope at the disk for a force and a moment there."""
    a, b = SPAN_M, OVERHANG_M
    bending = MODULUS * math.pi * DIAMETER_M**4 / 64
    # 6 (1 + nu)/(7 + 6 nu) of a full circle times G = E/(2 (1 + nu))
    shear = 3 / (7 + 6 * 0.3) * MODULUS * math.pi * DIAMETER_M**2 / 4
    found = np.array(
        [
            [b**2 * (a + b) / 3, b * (2 * a + 3 * b) / 6],
            [b * (2 * a + 3 * b) / 6, (a + 3 * b) / 3],
        ]
    )
    found /= bending
    # shear forces: P b/a in the span and P overhung; of a moment M/a in the span
    found += np.array([[b**2 / a + b, b / a], [b / a, 1 / a]]) / shear
    # reactions for a force and for a moment at the disk
    reactions = np.array([[-b / a, -1 / a], [(a + b) / a, 1 / a]])
    found += reactions.T @ reactions / SPRING
    return np.asarray(found)


def closed_form(speed: float) -> NDArray[np.float64]:
    """The four whirl speeds w in rad/s, slowest first: forward ones positive."""
    A = compliance()
    det = A[0, 0] * A[1, 1] - A[0, 1] ** 2
    roots = np.roots(
        [
            det * MASS * DIAMETRAL,
            -det * MASS * POLAR * speed,
            -(A[0, 0] * MASS + A[1, 1] * DIAMETRAL),
            A[1, 1] * POLAR * speed,
            1.0,
        ]
    )
    return np.asarray(roots[np.argsort(np.abs(roots))].real, np.float64)


@pytest.mark.parametrize('speed', SPEEDS)
def test_whirl_split_of_an_overhung_disk(speed: float) -> None:
    plant = overhung()
    found = modes(plant, np.zeros(2 * plant.size), Instant(speed_rad_s=speed))
    expected = closed_form(speed)
    assert found.frequencies_rad_s[:4] == pytest.approx(np.abs(expected), rel=1e-5)
    if speed == 0.0:
        return
    assert sorted(np.sign(expected)) == [-1, -1, 1, 1]
    for shape, whirl in zip(found.shapes[:4], expected, strict=True):
        ratio = shape[plant.place('disk', 'z')] / shape[plant.place('disk', 'y')]
        assert ratio == pytest.approx(-1j if whirl > 0.0 else 1j, rel=1e-6)


def test_gyroscopic_moments_part_the_whirls_by_much() -> None:
    # so that the test above sees the disk's polar inertia and its sign at all
    still, fast = np.abs(closed_form(0.0)), closed_form(600.0)
    assert fast[0] < 0.0 < fast[1]  # the backward whirl is the slower one
    assert abs(fast[0]) < 0.9 * still[0]
    assert fast[1] > 1.1 * still[1]
