# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: ARG001, ARG005 - force functions take five arguments whatever they use
"""Wrong plants and elements: one sentence each, that names what is wrong, before anything runs."""

import functools
import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import numpy as np
import pytest

from rotor_common.errors import ConfigError
from rotor_sim.errors import PlantError
from rotor_sim.plant.compiled_plant import CompiledPlant, Instant
from rotor_sim.plant.element import TRANSLATIONS, Element, Matrices
from rotor_sim.plant.elements.crack import Crack
from rotor_sim.plant.elements.unbalance import Unbalance
from rotor_sim.plant.plant import Node, Plant

MASS = {'mass_kg': 1.0}
NODES: dict[str, Any] = {'disk': MASS, 'left': MASS, 'right': MASS}
SPRING = {'kind': 'shaft_segment', 'node': 'disk', 'stiffness_n_m': 1e5}
BEARING = {'kind': 'ball_bearing', 'node': 'left'}
RUB = {'kind': 'rub', 'node': 'disk', 'stiffness_n_m': 1e6, 'gap_m': 1e-4}
SPALL = {'kind': 'spalled_ball_bearing', 'node': 'left', 'spall_on': 'ball', 'depth_m': 1e-6}
CRACK = {'kind': 'crack', 'node': 'disk', 'stiffness_n_m': 1e5, 'stiffness_ratio': 0.1}
TWINS = [['left', 'right']]


def elements(*each: Any) -> dict[str, Any]:
    return {'nodes': NODES, 'elements': list(each)}


def twins(*each: Any, pairs: Any = TWINS) -> dict[str, Any]:
    return {'nodes': NODES, 'elements': list(each), 'twins': pairs}


WRONG = [
    # the plant and its nodes
    ({'nodes': {}}, 'nodes = {} is not allowed'),
    ({}, 'nodes is missing'),
    ({'nodes': NODES, 'element': []}, "element is not a known key; did you mean 'elements'"),
    ({'nodes': {'disk': {'mass': 1.0}}}, "mass is not a known key; did you mean 'mass_kg'"),
    ({'nodes': {'disk': {'mass_kg': -1.0}}}, 'mass_kg = -1.0 is out of range; allowed: 0 to'),
    ({'nodes': {'disk': {}}}, 'nodes.disk has no mass'),
    ({'nodes': {'ground': MASS}}, "nodes.ground: a node is named .* not 'ground', which never"),
    ({'nodes': {'Disk': MASS}}, 'nodes.Disk: a node is named in small letters'),
    ({'nodes': {'disk': {**MASS, 'polar_inertia_kg_m2': 1.0}}}, 'disk has no moment of inertia'),
    ({'nodes': NODES, 'load_scale': 0.0}, 'load_scale = 0.0 is out of range; allowed: above 0'),
    # elements by their keys
    (elements({'node': 'disk'}), r'elements\[0\]: an element is a mapping with the key kind'),
    (elements('rub'), r'elements\[0\]: an element is a mapping with the key kind'),
    (elements({'kind': 'rubb'}), "kind = 'rubb' is not known; did you mean 'rub'"),
    (elements({'kind': 'xyz'}), "kind = 'xyz' is not known; choose one of .*rub, "),
    (elements({'kind': 'rotor_sim.plant.plant:Node'}), 'is no element: .* derives from'),
    (elements({'kind': 'no_module_here:Rub'}), 'cannot be loaded: No module named'),
    (elements(SPRING, {**SPRING, 'stifness_n_m': 1.0}), r'elements\[1\].stifness_n_m is not a kno'),
    (elements({'kind': 'shaft_segment', 'node': 'disk'}), 'stiffness_n_m is missing; it is: stif'),
    (elements({**SPRING, 'stiffness_n_m': 'soft'}), "stiffness_n_m = 'soft' is not allowed"),
    (elements({**SPRING, 'name': 'My shaft'}), "name = 'My shaft' is not allowed; .* unique"),
    # elements on nodes
    (elements({**SPRING, 'node': 'dsk'}), r"\.node = 'dsk' is no node of the plant; it has disk,"),
    (elements({**SPRING, 'other': 'disk'}), r"\(shaft_segment_1\) has the node 'disk' at two ends"),
    (
        elements(
            {
                'kind': 'hou_crack',
                'disk': 'disk',
                'bearing_1': 'left',
                'bearing_2': 'left',
                'stiffness_ratio': 0.1,
            }
        ),
        "has the node 'left' at two ends",
    ),
    (elements({**SPRING, 'node': 'ground'}), "has the node 'ground' at two ends"),
    (
        elements({'kind': 'unbalance', 'node': 'ground', 'unbalance_kg_m': 1e-3}),
        r"\(unbalance_1\) acts on 'ground' alone",
    ),
    (elements({**SPRING, 'name': 'a'}, {**SPRING, 'name': 'a'}), r"\[1\].name = 'a' stands twice"),
    (elements(SPRING, {**SPRING, 'name': 'shaft_segment_1'}), "name = 'shaft_segment_1' stands tw"),
    (
        elements(
            {
                'kind': 'angular_misalignment',
                'node': 'disk',
                'misalignment_rad': 0.01,
                'stiffness_2x_n_m_rad': 10.0,
            }
        ),
        'nodes.disk has no moment of inertia',
    ),
    # numbers of single elements
    (elements({**RUB, 'gap_m': 0.0}), 'gap_m = 0.0 is out of range; allowed: 1e-09 to 1 m'),
    (elements({**RUB, 'friction_coefficient': 3}), 'friction_coefficient = 3 is out of range'),
    (elements({**RUB, 'slip_velocity_m_s': 0.0}), 'slip_velocity_m_s = 0.0 is out of range'),
    (elements({**RUB, 'sector_half_width_rad': 4.0}), 'sector_half_width_rad = 4.0 is out of'),
    (elements({**BEARING, 'ball_count': 8.5}), 'ball_count = 8.5 is not allowed'),
    (elements({**BEARING, 'inner_radius_m': 0.1}), 'is not above inner_radius_m = 0.1 m'),
    (elements({**SPALL, 'spall_on': 'cage'}), "spall_on = 'cage' is not allowed"),
    (elements({**SPALL, 'length_m': 0.05}), 'length_m = 0.05 m is too long for the ball; allowed'),
    (elements({**SPALL, 'entry_share': 0.8}), r'entry_share \+ exit_share = 1.05 is above 1'),
    (elements({**CRACK, 'law': 'hinge'}), "law = 'hinge' is not allowed; it must be 'gasch'"),
    (elements({**CRACK, 'stiffness_ratio': 1.0}), 'stiffness_ratio = 1.0 is out of range'),
    (
        elements(
            {'kind': 'looseness', 'node': 'disk', 'stiffness_n_m': 1e5, 'lost_share': 1.1}
        ),
        'lost_share = 1.1 is out of range; allowed: 0 to 1',
    ),
    (elements({'kind': 'support', 'node': 'disk'}), 'stiffness_y_n_m is missing'),
    # twins
    (twins(pairs=[['left', 'rigth']]), "twins: 'rigth' is no node of the plant"),
    (twins(pairs=[['left', 'left']]), "twins: 'left' stands twice"),
    (twins(pairs=[['left', 'right'], ['right', 'disk']]), "twins: 'right' stands twice"),
    (twins(pairs=[['left', 'right', 'disk']]), r'twins\[0\] = .* is not allowed'),
    (
        {'nodes': {'left': MASS, 'right': {'mass_kg': 2.0}}, 'twins': TWINS},
        'twins are not alike: the mass of left, y is not that of its twin',
    ),
    (
        twins(
            {'kind': 'support', 'node': 'right', 'stiffness_y_n_m': 1.0, 'stiffness_z_n_m': 1.0}
        ),
        'twins are not alike: the stiffness of left, y',
    ),
    (twins(BEARING), 'twins are not alike: ball_bearing_1 .* nothing like it on the other'),
    (
        twins(BEARING, {**BEARING, 'node': 'right', 'clearance_m': 1e-6}),
        'twins are not alike: ball_bearing_1',
    ),
    (
        twins({**CRACK, 'node': 'left'}, {**CRACK, 'node': 'right', 'law': 'open'}),
        'twins are not alike: crack_1',
    ),
    (
        twins(
            {**SPRING, 'other': 'left'},
            {**SPRING, 'other': 'right'},
            {**CRACK, 'other': 'left'},
        ),
        'twins are not alike: crack_1',
    ),
    (
        twins(
            {
                'kind': 'residual_bow',
                'node': 'left',
                'other': 'right',
                'stiffness_n_m': 1e5,
                'bow_m': 1e-5,
            }
        ),
        'twins are not alike: right accelerates along y unlike its twin',
    ),
]  # fmt: skip


@pytest.mark.parametrize(('data', 'sentence'), WRONG)
def test_wrong_plant_is_one_sentence(data: Mapping[str, Any], sentence: str) -> None:
    with pytest.raises((ConfigError, PlantError), match=sentence) as caught:
        CompiledPlant(Plant.from_mapping(data))
    assert '\n' not in str(caught.value)
    assert 'Traceback' not in str(caught.value)


def test_there_are_at_least_30_rows() -> None:
    assert len(WRONG) >= 30


def test_the_plants_that_the_rows_are_made_of_are_right() -> None:
    """So that each row is refused for what it changes."""
    for each in (SPRING, BEARING, RUB, SPALL, CRACK):
        CompiledPlant(Plant.from_mapping(elements(each)))
    CompiledPlant(Plant.from_mapping(twins(BEARING, {**BEARING, 'node': 'right'})))


class _Own(Element):
    touches = (('node', TRANSLATIONS),)

    kind: str = 'own'
    node: str = 'disk'
    size: float = 2.0


def built(
    force: Any = None,
    *,
    given: Matrices | None = None,
    numbers: Mapping[str, Any] | None = None,
    switches: Any = None,
    axes: Any = TRANSLATIONS,
    live_fields: tuple[str, ...] = (),
) -> CompiledPlant:
    """Return a plant with an element as somebody may write it."""

    class Made(_Own):
        touches: ClassVar[Any] = (('node', axes),)
        live: ClassVar[tuple[str, ...]] = live_fields

        def matrices(self, positions_m: Any) -> Matrices:  # noqa: ARG002
            return given or Matrices()

        def coefficients(self) -> Mapping[str, Any]:
            return super().coefficients() if numbers is None else numbers

    Made.force = staticmethod(force) if force else None
    Made.switches = staticmethod(switches) if switches else None
    return CompiledPlant(Plant(nodes={'disk': Node(mass_kg=1.0)}, elements=(Made(),)))


def good(x: Any, v: Any, p: Any, d: Any, s: Any) -> Any:
    return p.size * x[0], x[1]


def too_many(x: Any, v: Any, p: Any, d: Any, s: Any) -> Any:
    return x[0], x[1], x[0]


def too_few(x: Any, v: Any, p: Any, d: Any, s: Any) -> Any:
    return x[0]


def no_number(x: Any, v: Any, p: Any, d: Any, s: Any) -> Any:
    return 'much', x[1]


def nothing(x: Any, v: Any, p: Any, d: Any, s: Any) -> Any:
    pass


def loops(x: Any, v: Any, p: Any, d: Any, s: Any) -> Any:
    while x[0] > 0.0:
        pass
    return x[0], x[1]


def branches(x: Any, v: Any, p: Any, d: Any, s: Any) -> Any:
    if x[0] > 0.0:
        return x[0], x[1]
    return 0.0, 0.0


def takes_sine(x: Any, v: Any, p: Any, d: Any, s: Any) -> Any:
    return math.sin(x[0]), x[1]


def takes_power(x: Any, v: Any, p: Any, d: Any, s: Any) -> Any:
    return x[0] ** 2, x[1]


def reads_beyond(x: Any, v: Any, p: Any, d: Any, s: Any) -> Any:
    return x[2], x[1]


def writes_into(x: Any, v: Any, p: Any, d: Any, s: Any) -> Any:
    x[0] = 1.0
    return x


def unknown_p(x: Any, v: Any, p: Any, d: Any, s: Any) -> Any:
    return p.sice * x[0], x[1]


def unknown_d(x: Any, v: Any, p: Any, d: Any, s: Any) -> Any:
    return d.angle * x[0], x[1]


def unknown_name(x: Any, v: Any, p: Any, d: Any, s: Any) -> Any:
    return missing_here * x[0], x[1]  # type: ignore[name-defined]  # noqa: F821


def calls_itself(x: Any, v: Any, p: Any, d: Any, s: Any) -> Any:
    return calls_itself(x, v, p, d, s)


def long_loop(x: Any, v: Any, p: Any, d: Any, s: Any) -> Any:
    total = 0.0
    for _ in range(100_000):
        total += x[0]
    return total, x[1]


def other_argument(x: Any, q: Any) -> Any:
    return x[0], q[1]


def infinite(x: Any, v: Any, p: Any, d: Any, s: Any) -> Any:
    return 1e308 * 10.0, x[1]


IN_NO_FILE: dict[str, Any] = {}
exec('def force(x, v, p, d, s):\n    return x[0], x[1]', IN_NO_FILE)  # noqa: S102

WRONG_ELEMENTS: list[tuple[Callable[[], Any], str]] = [
    (lambda: built(too_many), r'own_1 \(own\): its force returns 3 numbers, but it touches 2'),
    (lambda: built(too_few), 'its force returns 1 numbers, but it touches 2'),
    (lambda: built(no_number), "its force returns 'much', not a number"),
    (lambda: built(infinite), 'its force returns inf, not a number'),
    (lambda: built(nothing), 'nothing returns nothing'),
    (lambda: built(loops), '`While` in line 2 of loops cannot be compiled; use assignments'),
    (lambda: built(branches), 'an `if` on a number of the run in line 2 of branches'),
    (
        lambda: built(takes_sine),
        r'a call of `math\.sin` in line 2 of takes_sine cannot be compiled',
    ),
    (lambda: built(takes_power), '`Pow` in line 2 of takes_power cannot be compiled'),
    (lambda: built(reads_beyond), r'`x\[2\]` in line 2 of reads_beyond'),
    (lambda: built(writes_into), r'an assignment to `x\[0\]`'),
    (lambda: built(long_loop), 'a loop that is not over a fixed range in line 3 of long_loop'),
    (lambda: built(unknown_p), 'unknown_p reads sice of the numbers p of own, which has only size'),
    (lambda: built(unknown_d), 'unknown_d reads angle of the drive d, which has only .*speed_rad'),
    (lambda: built(unknown_name), 'the unknown name missing_here in line 2'),
    (lambda: built(calls_itself), 'calls_itself calls itself'),
    (lambda: built(other_argument), 'other_argument takes q; it may take x, v, p, d, s'),
    (lambda: built(lambda x, v, p, d, s: x), 'is no plain function'),
    (lambda: built(functools.partial(good)), 'cannot be read; write it with `def` in a file'),
    (lambda: built(IN_NO_FILE['force']), 'force cannot be read; write it with `def` in a file'),
    (lambda: built(good, switches=takes_sine), r'a call of `math\.sin` in line 2 of takes_sine'),
    (
        lambda: built(good, numbers={}),
        'good reads size of the numbers p of own, which has only not',
    ),
    (lambda: built(good, numbers={'size': 'b'}), "coefficient size = 'b' is no finite number"),
    (lambda: built(good, numbers={'size': math.nan}), 'coefficient size = nan is no finite'),
    (lambda: built(good, live_fields=('depth',)), "its live 'depth' is no number field"),
    (lambda: built(good, live_fields=('node',)), "its live 'node' is no number field"),
    (lambda: built(good, axes=('x', 'y')), r"touches 'x' of node; a node has y, z, theta_y"),
    (lambda: built(good, axes=('theta_z',)), 'nodes.disk has no moment of inertia'),
    (lambda: built(given=Matrices(stiffness=np.eye(3))), r'stiffness matrix is \(3, 3\), but it'),
    (
        lambda: built(given=Matrices(damping=np.full((2, 2), np.nan))),
        'damping matrix holds a number that is not finite',
    ),
    (
        lambda: built(given=Matrices(mass=np.array([[0.0, 3.0], [3.0, 0.0]]))),
        'the mass matrix is not positive definite',
    ),
    (lambda: built(given=Matrices(mass=-2.0 * np.eye(2))), 'nodes.disk has no mass'),
    (
        lambda: built(good).acceleration(np.zeros(4), Instant(live={'own_1.size': 1.0})),
        'own_1.size is no live parameter; there are none',
    ),
    (lambda: built(good).acceleration(np.zeros(3)), 'the state has 3 numbers; this plant has 4'),
]


@pytest.mark.parametrize(('make', 'sentence'), WRONG_ELEMENTS)
def test_wrong_element_is_one_sentence(make: Callable[[], Any], sentence: str) -> None:
    with pytest.raises((ConfigError, PlantError), match=sentence) as caught:
        make()
    assert '\n' not in str(caught.value)


def test_constant_force_acts() -> None:
    """A force that does not depend on anything is no force that is left out."""

    def constant(x: Any, v: Any, p: Any, d: Any, s: Any) -> Any:
        return 5.0, 0.0

    assert built(constant).acceleration([0.1, 0.2, 0.0, 0.0]) == pytest.approx([5.0, 0.0])


def test_elements_that_differ_in_structure_alone_are_two() -> None:
    """A hinge and a notch of the same size on one shaft: each keeps its law."""
    nodes = {'disk': Node(mass_kg=1.0)}
    state = [-1e-3, 0.0, 0.0, 0.0]
    for laws, expected in ((('gasch', 'open'), -10.0), (('open', 'open'), -20.0)):
        cracks = tuple(
            Crack.from_mapping({**CRACK, 'stiffness_ratio': 0.1, 'law': law}) for law in laws
        )
        found = CompiledPlant(Plant(nodes=nodes, elements=cracks)).acceleration(state)
        assert found[0] == pytest.approx(expected)


def test_equal_elements_on_one_node_each_have_their_live_parameter() -> None:
    each = Unbalance(node='disk', unbalance_kg_m=1e-3)
    plant = CompiledPlant(Plant(nodes={'disk': Node(mass_kg=1.0)}, elements=(each, each)))
    assert list(plant.live) == ['unbalance_1.unbalance_kg_m', 'unbalance_2.unbalance_kg_m']
    at = Instant(0.0, 10.0, live={'unbalance_2.unbalance_kg_m': 0.0})
    assert plant.acceleration(np.zeros(4), at) == pytest.approx([0.1, 0.0])
