# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Critical speeds against closed forms, and the plants that come with the rig."""

import math
from pathlib import Path

import numpy as np
import pytest

from rotor_common.errors import RigError
from rotor_sim.plant.campbell import campbell, whirl_of
from rotor_sim.plant.compiled_plant import CompiledPlant, Instant
from rotor_sim.plant.elements.shaft_segment import ShaftSegment
from rotor_sim.plant.modes import modes
from rotor_sim.plant.plant import Node, Plant
from rotor_sim.plant.shipped import load_plant, plant_named, plant_names
from rotor_sim.plant.statics import static_equilibrium

G = 9.80665
FINITE = ('fe_midspan', 'fe_offset', 'fe_two_disks', 'overhung')


def rigid_rotor(polar: float) -> Plant:
    """A disk on the springs of two ends that it is tied to: tilting and shifting apart."""
    nodes = {
        'a': Node(position_m=-0.2, mass_kg=1e-3),
        'disk': Node(mass_kg=5.0, diametral_inertia_kg_m2=0.05, polar_inertia_kg_m2=polar),
        'b': Node(position_m=0.2, mass_kg=1e-3),
    }
    shaft = {'kind': 'beam', 'outer_diameter_m': 0.2, 'density_kg_m3': 1e-3}
    plain = {
        'nodes': {name: node.model_dump() for name, node in nodes.items()},
        'elements': [
            shaft | {'node': 'a', 'other': 'disk'},
            shaft | {'node': 'disk', 'other': 'b'},
            {'kind': 'shaft_segment', 'node': 'a', 'stiffness_n_m': 1e5},
            {'kind': 'shaft_segment', 'node': 'b', 'stiffness_n_m': 1e5},
        ],
    }
    return Plant.from_mapping(plain)


@pytest.mark.parametrize('polar', [0.03, 0.09])
def test_critical_speeds_of_a_rigid_rotor(polar: float) -> None:
    # shift: sqrt(2k/m); tilt with stiffness 2 k l^2: w^2 (I_d -+ I_p) = 2 k l^2 at w = W, forward
    # whirl with the minus sign, which has none for a flat disk (I_p > I_d)
    plant = CompiledPlant(rigid_rotor(polar))
    found = campbell(plant, np.zeros(2 * plant.size), np.linspace(0.0, 1000.0, 21))
    tilt = 2 * 1e5 * 0.2**2
    diametral = 0.05 + 2 * 1e-3 * 0.2**2  # with the ends
    backward = math.sqrt(tilt / (diametral + polar))
    expected = [(math.sqrt(2e5 / (5.0 + 2e-3)), 0.0), (backward, -1.0)]
    if polar < 0.05:
        expected.append((math.sqrt(tilt / (diametral - polar)), 1.0))
    speeds = np.array([each.speed_rad_s for each in found.critical_speeds])
    assert len(speeds) == len(expected) + 1  # the shift comes twice: along y and z
    for speed, whirl in expected:
        nearest = int(np.argmin(np.abs(speeds - speed)))
        assert speeds[nearest] == pytest.approx(speed, rel=1e-4)
        if whirl:
            assert found.critical_speeds[nearest].whirl == pytest.approx(whirl, abs=1e-3)


def test_a_whirl_from_y_to_z_is_forward() -> None:
    plant = CompiledPlant(
        Plant(
            nodes={'disk': Node(mass_kg=1.0)},
            elements=(ShaftSegment(node='disk', stiffness_n_m=1e4),),
        )
    )
    shapes = np.array([[1.0, -1j], [1.0, 1j], [1.0, 1.0]])  # y = cos wt; z = sin wt, -sin wt
    assert whirl_of(plant, shapes) == pytest.approx([1.0, -1.0, 0.0])


def test_jeffcott_is_the_closed_form() -> None:
    plant = CompiledPlant(plant_named('jeffcott'))
    state = static_equilibrium(plant, (G, 0.0))
    assert state[plant.place('disk', 'y')] == pytest.approx(6.0 * G / 8.95e5, rel=1e-9)
    found = campbell(plant, state, np.linspace(0.0, 600.0, 7), (G, 0.0))
    natural, rate = math.sqrt(8.95e5 / 6.0), 46.3 / 12.0
    damped = math.sqrt(natural**2 - rate**2)
    assert [each.speed_rad_s for each in found.critical_speeds] == pytest.approx([damped] * 2)
    assert found.critical_speeds[0].decay_rate_1_s == pytest.approx(rate)


def test_midspan_bends_as_a_pinned_shaft_between_its_journals() -> None:
    plant = CompiledPlant(plant_named('fe_midspan'))
    state = static_equilibrium(plant, (G, 0.0))
    disk, *journals = (state[plant.place(n, 'y')] for n in ('disk', 'bearing_1', 'bearing_2'))
    area, bending = math.pi / 4 * 0.03**2, 2.1e11 * math.pi / 64 * 0.03**4
    load, shear = 7850.0 * area * G, 3 / (7 + 6 * 0.3) * 2.1e11 * area
    expected = 6.17 * G * (0.6**3 / (48 * bending) + 0.6 / (4 * shear))
    expected += load * (5 * 0.6**4 / (384 * bending) + 0.6**2 / (8 * shear))
    # what overhangs bends the other way: load a^2/2 at either end
    expected -= (load * 0.06**2 / 2 + load * 0.04**2 / 2) / 2 * 0.6**2 / (8 * bending)
    assert disk - np.mean(journals) == pytest.approx(expected, rel=1e-6)
    weight = (6.17 + 7850.0 * area * 0.7 + 2 * 3.0) * G
    housings = [state[plant.place(f'housing_{k}', 'y')] for k in (1, 2)]
    assert 3.0e7 * sum(housings) == pytest.approx(weight, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize('name', FINITE)
def test_reduced_plants_that_ship_have_the_modes_of_whole_ones(name: str) -> None:
    fewer = CompiledPlant(plant_named(name))
    whole = CompiledPlant(fewer.plant.model_copy(update={'reduction': None}))
    rest = static_equilibrium(fewer, (G, 0.0))
    everywhere = np.zeros(2 * whole.size)
    everywhere[: whole.size] = fewer.assembly.all_displacements(rest[: fewer.size])
    at = Instant(speed_rad_s=500.0, load_m_s2=(G, 0.0))
    exact = modes(whole, everywhere, at).frequencies_rad_s
    found = modes(fewer, rest, at).frequencies_rad_s
    count = int(np.sum(exact < 2 * math.pi * 600.0))
    assert found[:count] == pytest.approx(exact[:count], rel=2e-3)
    assert found[:2] == pytest.approx(exact[:2], rel=1e-4)


def test_every_plant_that_ships_says_what_it_is_and_stands_on_its_bearings() -> None:
    assert {'hou2016', 'jeffcott', *FINITE} <= set(plant_names())
    for name in plant_names():
        plant = plant_named(name)
        assert plant.description.endswith('.')
        assert plant.from_mapping(plant.model_dump(mode='json')) == plant
        state = static_equilibrium(CompiledPlant(plant), (G, 0.0))
        assert 0.0 < np.max(state) < 1e-3


def test_a_plant_is_read_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / 'mine.yaml'
    path.write_text('nodes: {disk: {mass_kg: 2.0}}\nelements: []\n')
    assert load_plant(path).nodes['disk'].mass_kg == 2.0
    assert load_plant('jeffcott') == plant_named('jeffcott')


@pytest.mark.parametrize(
    ('text', 'sentence'),
    [
        (None, 'is neither a file nor one of fe_midspan'),
        ('- a list\n', 'must be a mapping with the keys nodes and elements'),
        ('nodes: {a: 1\n', 'not valid YAML'),
        ('nodes: {}\n', 'nodes'),
        ('nodes: {a: {mass: 1.0}}\n', "nodes.a.mass is not a known key; did you mean 'mass_kg'"),
        ('nodes: {a: {mass_kg: 1.0}}\nelements: [{kind: beem}]\n', "did you mean 'beam'"),
        (
            'nodes: {a: {mass_kg: 1.0}}\nelements: [{kind: beam, node: a, other: a}]\n',
            'outer_diameter_m is missing',
        ),
    ],
)
def test_a_file_that_is_no_plant_ends_in_one_sentence(
    text: str | None, sentence: str, tmp_path: Path
) -> None:
    path = tmp_path / 'plant.yaml'
    if text is not None:
        path.write_text(text)
    with pytest.raises(RigError, match=sentence):
        load_plant(path)
