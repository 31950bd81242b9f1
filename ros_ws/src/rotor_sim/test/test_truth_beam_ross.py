# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Beams and disks against ROSS (Timbó et al., J. Open Source Softw. 5 (2020) 2120).

Runs where ROSS is installed, see ross_requirements.txt. ROSS has its shaft along z and (x, y)
across, turning from x to y: its (x, y, alpha, beta) are (y, z, theta_y, theta_z) of frame `rotor`.
"""

import warnings
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rotor_sim.plant.compiled_plant import CompiledPlant, Instant
from rotor_sim.plant.elements.beam import Beam
from rotor_sim.plant.elements.shaft_segment import ShaftSegment
from rotor_sim.plant.modes import modes
from rotor_sim.plant.plant import Node, Plant, assemble

with warnings.catch_warnings():
    warnings.simplefilter('ignore')
    ross: Any = pytest.importorskip('ross')

pytestmark = pytest.mark.filterwarnings('ignore')

ACROSS = np.array([0, 1, 3, 4, 6, 7, 9, 10])
"""Degrees of freedom of ROSS that bend; the others are along the shaft and about it."""

STEEL: dict[str, Any] = {
    'density_kg_m3': 7810.0,
    'elastic_modulus_pa': 2.11e11,
    'poisson_ratio': 0.29,
}
LENGTHS = (0.11, 0.05, 0.08, 0.06, 0.13)
DIAMETERS = (0.03, 0.05, 0.06, 0.05, 0.03)
DISKS = {2: (12.0, 0.06, 0.11), 3: (20.0, 0.15, 0.28)}
"""Node: kg, diametral and polar kg m^2."""
STIFFNESS = 3.0e7


def steel() -> Any:
    return ross.Material('steel', rho=7810.0, E=2.11e11, Poisson=0.29)


@pytest.mark.parametrize(('bore', 'length'), [(0.0, 0.1), (0.03, 0.1), (0.045, 0.4)])
def test_element_matrices(bore: float, length: float) -> None:
    theirs = ross.ShaftElement(length, bore, 0.06, material=steel())
    values = STEEL | {'outer_diameter_m': 0.06, 'inner_diameter_m': bore}
    ours = Beam(node='a', other='b', **values).matrices({'a': 1.0, 'b': 1.0 + length})
    block = np.ix_(ACROSS, ACROSS)
    for found, expected in (
        (ours.mass, theirs.M()), (ours.stiffness, theirs.K()), (ours.damping_per_speed, theirs.G())
    ):  # fmt: skip
        assert found is not None
        scale = np.abs(expected[block]).max()
        assert found == pytest.approx(expected[block], rel=1e-6, abs=1e-12 * scale)


def rotors() -> tuple[CompiledPlant, Any]:
    """A stepped shaft with two disks on springs: ours, and that of ROSS."""
    places = np.concatenate([[0.0], np.cumsum(LENGTHS)])
    nodes = {}
    for k, place in enumerate(places):
        mass, diametral, polar = DISKS.get(k, (0.0, 0.0, 0.0))
        nodes[f'n{k}'] = Node(
            position_m=float(place),
            mass_kg=mass,
            diametral_inertia_kg_m2=diametral,
            polar_inertia_kg_m2=polar,
        )
    beams = [
        Beam(node=f'n{k}', other=f'n{k + 1}', outer_diameter_m=diameter, **STEEL)
        for k, diameter in enumerate(DIAMETERS)
    ]
    springs = [ShaftSegment(node=node, stiffness_n_m=STIFFNESS) for node in ('n0', 'n5')]
    ours = CompiledPlant(Plant(nodes=nodes, elements=(*beams, *springs)))
    shaft = [
        ross.ShaftElement(length, 0.0, diameter, material=steel())
        for length, diameter in zip(LENGTHS, DIAMETERS, strict=True)
    ]
    disks = [ross.DiskElement(n=n, m=m, Id=i, Ip=p) for n, (m, i, p) in DISKS.items()]
    bearings = [ross.BearingElement(n=n, kxx=STIFFNESS, cxx=0.0) for n in (0, 5)]
    return ours, ross.Rotor(shaft, disks, bearings)


def lateral(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    kept = [k for k in range(len(matrix)) if k % 6 in (0, 1, 3, 4)]
    return matrix[np.ix_(kept, kept)]


def test_assembled_matrices() -> None:
    ours, theirs = rotors()
    linear = assemble(ours.plant).linear
    stiffness = linear.stiffness.copy()
    for node in ('n0', 'n5'):
        for axis in ('y', 'z'):
            k = ours.place(node, axis)
            stiffness[k, k] += STIFFNESS
    gyroscopic = linear.damping_per_speed
    for found, expected in (
        (linear.mass, theirs.M()), (stiffness, theirs.K(0.0)), (gyroscopic, theirs.G())
    ):  # fmt: skip
        scale = np.abs(expected).max()
        assert found == pytest.approx(lateral(expected), rel=1e-6, abs=1e-12 * scale)


@pytest.mark.parametrize('speed', [0.0, 400.0, 1500.0])
def test_whirl_frequencies(speed: float) -> None:
    ours, theirs = rotors()
    found = modes(ours, np.zeros(2 * ours.size), Instant(speed_rad_s=speed)).frequencies_rad_s
    theirs_rad_s = theirs.run_modal(speed, num_modes=24, sparse=False).wd
    for frequency in found[:6]:  # ROSS has those of torsion among them
        assert np.abs(theirs_rad_s / frequency - 1.0).min() < 1e-6


def test_critical_speeds() -> None:
    ours, theirs = rotors()
    expected = np.sort(theirs.run_critical_speed(num_modes=8, rtol=1e-9).wd())
    for critical in expected[:4]:
        at = Instant(speed_rad_s=float(critical))
        found = modes(ours, np.zeros(2 * ours.size), at).frequencies_rad_s
        assert np.abs(found / critical - 1.0).min() < 1e-6
