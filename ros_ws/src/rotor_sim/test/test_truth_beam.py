# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The beam against closed forms: rigid motions, statics, Euler-Bernoulli and Timoshenko modes."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rotor_common.errors import RigError
from rotor_sim.plant.compiled_plant import CompiledPlant, Instant
from rotor_sim.plant.elements.beam import Beam
from rotor_sim.plant.elements.shaft_segment import ShaftSegment
from rotor_sim.plant.modes import modes
from rotor_sim.plant.plant import Assembly, Node, Plant, assemble
from rotor_sim.plant.statics import static_equilibrium

Array = NDArray[np.float64]

DIAMETER_M, BORE_M, LENGTH_M = 0.06, 0.03, 0.8
DENSITY, MODULUS, POISSON = 7810.0, 2.11e11, 0.29
AREA = math.pi / 4 * (DIAMETER_M**2 - BORE_M**2)
SECOND_MOMENT = math.pi / 64 * (DIAMETER_M**4 - BORE_M**4)


def shaft(
    count: int, length_m: float = LENGTH_M, *, nodes: dict[str, Node] | None = None, **more: Any
) -> Plant:
    """A shaft of equal beams on the nodes n0, n1, ..."""
    values = {
        'outer_diameter_m': DIAMETER_M,
        'inner_diameter_m': BORE_M,
        'density_kg_m3': DENSITY,
        'elastic_modulus_pa': MODULUS,
        'poisson_ratio': POISSON,
    } | more
    places = {f'n{k}': Node(position_m=length_m * k / count) for k in range(count + 1)}
    return Plant(
        nodes=places | (nodes or {}),
        elements=tuple(Beam(node=f'n{k}', other=f'n{k + 1}', **values) for k in range(count)),
    )


def shear_stiffness() -> float:
    """kappa G A by Cowper's table for a hollow circle, written for the ratio of the radii."""
    m = BORE_M / DIAMETER_M
    kappa = (
        6 * (1 + POISSON) * (1 + m**2) ** 2
        / ((7 + 6 * POISSON) * (1 + m**2) ** 2 + (20 + 12 * POISSON) * m**2)
    )  # fmt: skip
    return kappa * MODULUS / (2 * (1 + POISSON)) * AREA


def motion(assembly: Assembly, shift: Any, slope: Any, axis: str) -> Array:
    """Displacements of a shaft along one axis and its slopes, as degrees of freedom."""
    found = np.zeros(assembly.size)
    for k in range(assembly.size // 4):
        x = LENGTH_M * k / (assembly.size // 4 - 1)
        found[assembly.place(f'n{k}', axis)] = shift(x)  # type: ignore[arg-type]
        if axis == 'y':
            found[assembly.place(f'n{k}', 'theta_z')] = slope(x)
        else:  # dz/dx = -theta_y
            found[assembly.place(f'n{k}', 'theta_y')] = -slope(x)
    return found


@pytest.mark.parametrize('axis', ['y', 'z'])
def test_rigid_motions_cost_no_force_and_have_the_shafts_inertia(axis: str) -> None:
    assembly = assemble(shaft(3))
    shift = motion(assembly, lambda _: 1.0, lambda _: 0.0, axis)
    turn = motion(assembly, lambda x: x - LENGTH_M / 2, lambda _: 1.0, axis)
    stiffness, mass = assembly.linear.stiffness, assembly.linear.mass
    for rigid in (shift, turn):
        assert np.abs(stiffness @ rigid).max() < 1e-12 * np.abs(stiffness).max()
    whole = DENSITY * AREA * LENGTH_M
    across = whole * LENGTH_M**2 / 12 + DENSITY * SECOND_MOMENT * LENGTH_M
    assert shift @ mass @ shift == pytest.approx(whole, rel=1e-13)
    assert turn @ mass @ turn == pytest.approx(across, rel=1e-12)
    assert shift @ mass @ turn == pytest.approx(0.0, abs=1e-13 * whole)
    assert np.linalg.eigvalsh(stiffness)[:5] == pytest.approx(
        [0, 0, 0, 0, np.linalg.eigvalsh(stiffness)[4]], abs=1e-9 * np.abs(stiffness).max()
    )


def test_a_turning_rigid_shaft_has_the_gyroscopic_moment_of_its_polar_inertia() -> None:
    # d(I_p W e)/dt for the axis e = (1, theta_z, -theta_y): the moment that its bearings give
    assembly = assemble(shaft(3))
    about_z = motion(assembly, lambda x: x, lambda _: 1.0, 'y')
    about_y = -motion(assembly, lambda x: x, lambda _: 1.0, 'z')
    polar = 2 * DENSITY * SECOND_MOMENT * LENGTH_M
    matrix = assembly.linear.damping_per_speed
    assert about_y @ matrix @ about_z == pytest.approx(polar, rel=1e-12)
    assert about_z @ matrix @ about_y == pytest.approx(-polar, rel=1e-12)
    assert np.array_equal(matrix, -matrix.T)
    # of the same sign as that of a disk
    disk = assemble(Plant(nodes={'d': Node(mass_kg=1, diametral_inertia_kg_m2=1,
                                           polar_inertia_kg_m2=polar)}))  # fmt: skip
    a, b = disk.place('d', 'theta_y'), disk.place('d', 'theta_z')
    assert disk.linear.damping_per_speed[a, b] == pytest.approx(about_y @ matrix @ about_z)


def test_a_force_along_y_tilts_about_plus_z_and_one_along_z_about_minus_y() -> None:
    assembly = assemble(shaft(1))
    held = [assembly.place('n0', axis) for axis in ('y', 'z', 'theta_y', 'theta_z')]
    free = np.setdiff1d(np.arange(assembly.size), held)
    compliance = np.linalg.inv(assembly.linear.stiffness[np.ix_(free, free)])
    row = {name: list(free).index(assembly.place('n1', name)) for name in
           ('y', 'z', 'theta_y', 'theta_z')}  # fmt: skip
    assert compliance[row['theta_z'], row['y']] > 0.0
    assert compliance[row['theta_y'], row['z']] == -compliance[row['theta_z'], row['y']]


@pytest.mark.parametrize('count', [1, 4])
def test_a_cantilever_bends_and_shears_as_in_the_textbook(count: int) -> None:
    # Timoshenko: w = P L^3/(3 E I) + P L/(k G A), slope = P L^2/(2 E I); by a moment M L/(E I)
    assembly = assemble(shaft(count))
    held = [assembly.place('n0', axis) for axis in ('y', 'z', 'theta_y', 'theta_z')]
    free = np.setdiff1d(np.arange(assembly.size), held)
    compliance = np.linalg.inv(assembly.linear.stiffness[np.ix_(free, free)])
    end = list(free).index(assembly.place(f'n{count}', 'y'))
    tilt = list(free).index(assembly.place(f'n{count}', 'theta_z'))
    bending = MODULUS * SECOND_MOMENT
    deflection = LENGTH_M**3 / (3 * bending) + LENGTH_M / shear_stiffness()
    assert compliance[end, end] == pytest.approx(deflection, rel=1e-10)
    assert compliance[tilt, end] == pytest.approx(LENGTH_M**2 / (2 * bending), rel=1e-10)
    assert compliance[tilt, tilt] == pytest.approx(LENGTH_M / bending, rel=1e-10)


def pinned_frequencies(plant: Plant, count: int) -> Array:
    """Natural frequencies of a shaft whose ends do not move but may tilt, one plane, rad/s."""
    assembly = assemble(plant)
    free = [
        k for k, (node, axis) in enumerate(assembly.coordinates)
        if axis in ('y', 'theta_z') and not (axis == 'y' and node in ('n0', f'n{count}'))
    ]  # fmt: skip
    block = np.ix_(free, free)
    squares = np.linalg.eigvals(
        np.linalg.solve(assembly.linear.mass[block], assembly.linear.stiffness[block])
    )
    return np.sqrt(np.sort(squares.real))


def test_slender_pinned_shaft_has_the_frequencies_of_euler_and_bernoulli() -> None:
    length = 40.0 * DIAMETER_M * 10
    found = pinned_frequencies(shaft(16, length), 16)
    for k in (1, 2, 3):
        exact = (k * math.pi / length) ** 2 * math.sqrt(MODULUS * SECOND_MOMENT / DENSITY / AREA)
        # rotary inertia and shear are of the order (pi k d/L)^2 / 4, below 1e-4 here
        assert found[k - 1] == pytest.approx(exact, rel=1.5e-4)


def test_stubby_pinned_shaft_has_the_frequencies_of_timoshenko() -> None:
    # w = Y sin(kx), psi = P cos(kx) in both equations of Timoshenko: a quadratic in omega^2
    length, shear = 4.0 * DIAMETER_M, shear_stiffness()
    coarse, fine = (pinned_frequencies(shaft(n, length), n)[:2] for n in (32, 64))
    found = fine + (fine - coarse) / 3.0  # the error goes with the square of the beams' length
    per_m, inertia = DENSITY * AREA, DENSITY * SECOND_MOMENT
    for number in (1, 2):
        k = number * math.pi / length
        square = np.roots(
            [
                per_m * inertia,
                -(per_m * (MODULUS * SECOND_MOMENT * k**2 + shear) + inertia * shear * k**2),
                MODULUS * SECOND_MOMENT * shear * k**4,
            ]
        ).min()
        assert found[number - 1] == pytest.approx(math.sqrt(square), rel=2e-7)
        bernoulli = k**2 * math.sqrt(MODULUS * SECOND_MOMENT / per_m)
        assert found[number - 1] < 0.93 * bernoulli  # so that the test sees shear at all


def on_springs(plant: Plant, stiffness_n_m: float, **more: Any) -> CompiledPlant:
    """The shaft on springs under its first and last node."""
    ends = (next(iter(plant.nodes)), list(plant.nodes)[-1])
    springs = tuple(ShaftSegment(node=end, stiffness_n_m=stiffness_n_m, **more) for end in ends)
    return CompiledPlant(plant.model_copy(update={'elements': (*plant.elements, *springs)}))


def test_gravity_bends_a_shaft_on_springs_as_in_the_textbook() -> None:
    stiffness = 1e7
    plant = on_springs(shaft(4), stiffness)
    state = static_equilibrium(plant, (9.80665, 0.0))
    load = DENSITY * AREA * 9.80665
    middle = 5 * load * LENGTH_M**4 / (384 * MODULUS * SECOND_MOMENT)
    middle += load * LENGTH_M**2 / (8 * shear_stiffness()) + load * LENGTH_M / (2 * stiffness)
    # at the nodes the loads that are consistent with exact shapes give the exact deflection
    assert state[plant.place('n2', 'y')] == pytest.approx(middle, rel=1e-9)
    slope = load * LENGTH_M**3 / (24 * MODULUS * SECOND_MOMENT)
    assert state[plant.place('n0', 'theta_z')] == pytest.approx(slope, rel=1e-9)


def test_internal_damping_makes_a_shaft_unstable_at_its_critical_speed() -> None:
    # with no other damping the threshold is the natural frequency itself, and the mode that
    # goes wrong whirls forward
    plant = on_springs(shaft(4, internal_damping_s=1e-6), 1e10)
    rest = np.zeros(2 * plant.size)
    first = modes(plant, rest, Instant()).frequencies_rad_s[0]
    for ratio, is_stable in ((0.97, True), (1.03, False)):
        found = modes(plant, rest, Instant(speed_rad_s=ratio * first))
        assert (found.decay_rates_1_s[:2].min() > 0.0) == is_stable
    worst = found.shapes[np.argmin(found.decay_rates_1_s[:2])]
    y, z = worst[plant.place('n2', 'y')], worst[plant.place('n2', 'z')]
    assert y == pytest.approx(1j * z, rel=0.01)  # z lags y: from y to z, as the shaft turns


def test_proportional_damping_gives_each_mode_the_ratio_of_its_frequency() -> None:
    plant = CompiledPlant(shaft(4, damping_s=2e-6))
    found = modes(plant, np.zeros(2 * plant.size), Instant())
    bending = found.frequencies_rad_s > 100.0  # not the rigid motions of a free shaft
    expected = 0.5 * 2e-6 * (found.frequencies_rad_s**2 + found.decay_rates_1_s**2)
    assert bending.sum() >= 4
    assert found.decay_rates_1_s[bending] == pytest.approx(expected[bending], rel=1e-6)


@pytest.mark.parametrize(
    ('change', 'sentence'),
    [
        ({'inner_diameter_m': 0.06}, 'inner_diameter_m = 0.06 m is not below outer_diameter_m'),
        ({'outer_diameter_m': 0.0}, 'outer_diameter_m = 0.0 is out of range'),
        ({'poisson_ratio': 0.6}, 'poisson_ratio = 0.6 is out of range'),
        ({'node': 'ground'}, "node = 'ground': a beam lies between two nodes"),
        ({'node': 'n1', 'other': 'n0'}, 'has no length'),
    ],
)
def test_a_beam_that_cannot_be_is_refused(change: dict[str, Any], sentence: str) -> None:
    values: dict[str, Any] = {'node': 'n0', 'other': 'n1', 'outer_diameter_m': DIAMETER_M, **change}
    with pytest.raises(RigError, match=sentence):
        assemble(Plant(nodes=shaft(1).nodes, elements=(Beam(**values),)))
