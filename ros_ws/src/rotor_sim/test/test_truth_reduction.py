# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Reduced plants against whole ones, and against closed forms of Euler, Bernoulli, Timoshenko."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from rotor_common.errors import RigError
from rotor_sim.plant.compiled_plant import CompiledPlant, Instant
from rotor_sim.plant.elements.ball_bearing import BallBearing
from rotor_sim.plant.elements.beam import Beam
from rotor_sim.plant.elements.shaft_segment import ShaftSegment
from rotor_sim.plant.elements.unbalance import Unbalance
from rotor_sim.plant.modes import modes
from rotor_sim.plant.plant import Node, Plant, assemble
from rotor_sim.plant.reduction import Reduction
from rotor_sim.plant.statics import static_equilibrium

COUNT, LENGTH_M, DIAMETER_M, DENSITY, MODULUS = 8, 0.8, 0.03, 7850.0, 2.1e11
AREA = math.pi / 4 * DIAMETER_M**2
BENDING = MODULUS * math.pi / 64 * DIAMETER_M**4
LIMIT_HZ = 600.0


def rotor(supports: tuple[Any, ...] = (), *, disk: bool = True, **more: Any) -> Plant:
    """A shaft with a disk beside its middle, and what supports it."""
    nodes = {f'n{k}': Node(position_m=LENGTH_M * k / COUNT) for k in range(COUNT + 1)}
    if disk:
        nodes['n3'] = Node(
            position_m=nodes['n3'].position_m,
            mass_kg=8.0,
            diametral_inertia_kg_m2=0.03,
            polar_inertia_kg_m2=0.058,
        )
    beams = (
        Beam(node=f'n{k}', other=f'n{k + 1}', outer_diameter_m=DIAMETER_M, internal_damping_s=1e-7)
        for k in range(COUNT)
    )
    return Plant(nodes=nodes, elements=(*beams, *supports), **more)


SPRINGS = tuple(ShaftSegment(node=n, stiffness_n_m=2e7, damping_n_s_m=50.0) for n in ('n0', 'n8'))
BEARINGS = tuple(BallBearing(node=n) for n in ('n0', 'n8'))
UNBALANCE = Unbalance(node='n3', unbalance_kg_m=1e-4)


def reduced(plant: Plant, highest_hz: float = LIMIT_HZ, keep: tuple[str, ...] = ()) -> Plant:
    return plant.model_copy(update={'reduction': Reduction(highest_hz=highest_hz, keep=keep)})


@pytest.mark.parametrize(('stiffness', 'tolerance'), [(1e4, 1e-3), (2e7, 1e-4), (1e10, 1e-4)])
@pytest.mark.parametrize('speed', [0.0, 800.0])
def test_modes_below_the_limit_are_right_whatever_the_supports(
    stiffness: float, tolerance: float, speed: float
) -> None:
    springs = tuple(ShaftSegment(node=n, stiffness_n_m=stiffness) for n in ('n0', 'n8'))
    whole = CompiledPlant(rotor(springs))
    fewer = CompiledPlant(reduced(whole.plant))
    assert fewer.size < whole.size / 2
    at = Instant(speed_rad_s=speed)
    exact = modes(whole, np.zeros(2 * whole.size), at).frequencies_rad_s
    found = modes(fewer, np.zeros(2 * fewer.size), at).frequencies_rad_s
    count = int(np.sum(exact < 2 * math.pi * LIMIT_HZ))
    assert count >= 6
    assert found[:count] == pytest.approx(exact[:count], rel=tolerance)


def test_a_lower_limit_keeps_fewer_modes() -> None:
    sizes = [assemble(reduced(rotor(SPRINGS), hertz)).size for hertz in (50.0, 600.0, 3000.0)]
    assert sizes[0] < sizes[1] < sizes[2] < assemble(rotor(SPRINGS)).size


def test_static_deflection_is_exact_at_the_kept_nodes() -> None:
    plant = CompiledPlant(reduced(rotor(SPRINGS, disk=False), keep=('n4',)))
    state = static_equilibrium(plant, (9.80665, 0.0))
    load = DENSITY * AREA * 9.80665
    shear = 3 / (7 + 6 * 0.3) * MODULUS * AREA
    middle = 5 * load * LENGTH_M**4 / (384 * BENDING)
    middle += load * LENGTH_M**2 / (8 * shear) + load * LENGTH_M / (2 * 2e7)
    assert state[plant.place('n4', 'y')] == pytest.approx(middle, rel=1e-9)
    assert state[plant.place('n4', 'theta_z')] == pytest.approx(0.0, abs=1e-12)
    everywhere = plant.assembly.all_displacements(state[: plant.size])
    left = plant.plant.coordinates().index(('n0', 'theta_z'))
    slope = load * LENGTH_M**3 / (24 * BENDING)
    assert everywhere[left] == pytest.approx(slope, rel=2e-2)  # not kept: only near
    quarter = [everywhere[plant.plant.coordinates().index((f'n{k}', 'y'))] for k in (2, 6)]
    assert quarter[0] == pytest.approx(quarter[1], rel=1e-9)


def test_static_deflection_in_ball_bearings_is_that_of_the_whole_plant() -> None:
    whole = CompiledPlant(rotor((*BEARINGS, UNBALANCE)))
    fewer = CompiledPlant(reduced(whole.plant))
    exact = static_equilibrium(whole, (9.80665, 2.0))
    found = static_equilibrium(fewer, (9.80665, 2.0))
    for node in ('n0', 'n3', 'n8'):
        for axis in ('y', 'z'):
            expected = exact[whole.place(node, axis)]
            assert found[fewer.place(node, axis)] == pytest.approx(expected, rel=1e-7, abs=1e-15)


def test_modes_with_the_kept_nodes_held_are_those_of_a_clamped_beam() -> None:
    # cosh(a) cos(a) = 1 for a = 4.730041, 7.853205; a slender shaft, so shear is small
    plant = rotor(SPRINGS, disk=False)
    thin = tuple(
        each.model_copy(update={'outer_diameter_m': 0.004}) if isinstance(each, Beam) else each
        for each in plant.elements
    )
    plant = plant.model_copy(update={'elements': thin})
    found = assemble(reduced(plant, 1.0, keep=('n0', 'n8'))).reduced
    assert found is not None
    wave = math.sqrt(MODULUS * 0.004**2 / 16 / DENSITY) / (2 * math.pi * LENGTH_M**2)
    frequencies = (*found.kept_hz, *found.left_out_hz)
    assert len(frequencies) == 4 * (COUNT - 1)
    for k, a in ((0, 4.730041), (2, 7.853205)):
        assert frequencies[k] == pytest.approx(a**2 * wave, rel=1e-3)
        assert frequencies[k + 1] == pytest.approx(frequencies[k], rel=1e-12)  # y and z
    assert all(hertz > 1.0 for hertz in found.left_out_hz)


def test_it_moves_as_the_whole_plant_does_where_its_coordinates_reach() -> None:
    # M_r a_r = T' M a for equal displacements x = T x_r: every matrix, the load and all forces
    whole = CompiledPlant(rotor((*BEARINGS, UNBALANCE)))
    fewer = CompiledPlant(reduced(whole.plant, keep=('n3',)))
    assert fewer.assembly.reduced is not None
    to_all = fewer.assembly.reduced.transformation
    random = np.random.default_rng(5)
    at = Instant(1.1, 700.0, (20.0, -5.0), 30.0)
    for _ in range(3):
        x, v = 1e-5 * random.normal(size=(2, fewer.size))
        force = whole.assembly.linear.mass @ whole.acceleration(
            np.concatenate([to_all @ x, to_all @ v]), at
        )
        found = fewer.assembly.linear.mass @ fewer.acceleration(np.concatenate([x, v]), at)
        expected = to_all.T @ force
        assert found == pytest.approx(expected, rel=1e-7, abs=1e-8 * np.abs(force).max())


def test_load_acts_on_the_whole_mass() -> None:
    assembly = assemble(reduced(rotor(SPRINGS)))
    together = np.array([float(axis == 'y') for _, axis in assembly.coordinates])
    whole = 8.0 + DENSITY * AREA * LENGTH_M
    assert together @ assembly.linear.load[:, 0] == pytest.approx(whole, rel=1e-12)
    assert together @ assembly.linear.mass @ together == pytest.approx(whole, rel=1e-12)


def test_the_bending_planes_stay_apart() -> None:
    # exact zeros, which the engine leaves out
    linear = assemble(reduced(rotor(SPRINGS))).linear
    for matrix in (linear.mass, linear.stiffness):
        assert np.sum(matrix != 0.0) <= matrix.size / 2
    assert linear.patterns['stiffness'].sum() <= linear.stiffness.size / 2
    assert not (linear.patterns['stiffness'] & linear.patterns['damping_per_speed']).any()


@pytest.mark.slow
def test_the_compiled_engine_flies_a_reduced_plant_as_its_matrix_exponential() -> None:
    plant = CompiledPlant(reduced(rotor(SPRINGS)))
    n, rate, count, substeps, speed = plant.size, 10240, 400, 16, 500.0
    system = np.zeros((2 * n, 2 * n))
    system[:n, n:] = np.eye(n)
    system[n:] = plant.jacobian(np.zeros(2 * n), Instant(speed_rad_s=speed))
    start = np.zeros(2 * n)
    # the shape of a static deflection, so that fast modes have no part in it
    start[:n] = static_equilibrium(plant, (50.0, 20.0))[:n]
    drives = np.zeros((1, count, 3))
    drives[..., 0] = np.mod(speed * np.arange(count) / rate, 2 * math.pi)
    drives[..., 1] = speed
    states, out = start[np.newaxis].copy(), np.empty((1, count, n))
    plant.module.stream(
        (0,), (), plant.coefficients[np.newaxis], np.array([plant.ratios]), states, out,
        rate, 1.0 / rate, substeps, 0, drives, np.zeros((1, 10, 2)), 0, 100,
    )  # fmt: skip
    exact = expm(system * count / rate) @ start
    assert states[0, :n] == pytest.approx(exact[:n], abs=1e-6 * np.abs(exact[:n]).max())
    assert np.abs(exact[:n]).max() > 0.1 * np.abs(start[:n]).max()


ON_ONE_SPRING = rotor(SPRINGS[:1], disk=False).model_dump(mode='json')['elements']


@pytest.mark.parametrize(
    ('change', 'sentence'),
    [
        ({'reduction': {'highest_hz': 0.0}}, 'highest_hz = 0.0 is out of range'),
        ({'reduction': {}}, 'highest_hz is missing'),
        ({'reduction': {'highest_hz': 9.0, 'keep': ['n99']}}, "reduction.keep: 'n99' is no node"),
        (
            {'reduction': {'highest_hz': 9.0}, 'twins': [['n0', 'n8']]},
            'take out twins or reduction',
        ),
        (
            {'reduction': {'highest_hz': 9.0}, 'elements': ON_ONE_SPRING},
            'does not hold the rest',
        ),
    ],
)
def test_a_reduction_that_cannot_be_is_refused(change: dict[str, Any], sentence: str) -> None:
    plain = rotor(SPRINGS, disk=False).model_dump(mode='json') | change
    with pytest.raises(RigError, match=sentence):
        assemble(Plant.from_mapping(plain))
