# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A rotor as nodes and elements, and the numbers that its equation of motion is made of."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
import pydantic
from numpy.typing import ArrayLike, NDArray

from rotor_common.configuration import ConfigModel, quantity
from rotor_sim.errors import PlantError
from rotor_sim.plant.element import ALL_AXES, AMPLITUDE, GROUND, TRANSLATIONS, Axis, Element
from rotor_sim.plant.reduction import Reduced, Reduction, reduce
from rotor_sim.plant.registry import AnyElement

Array = NDArray[np.float64]


class Node(ConfigModel):
    """A place on the machine: what is lumped there, and where it is.

    A node moves in y and z; one with a moment of inertia, or under a beam, tilts as well.
    """

    position_m: float = quantity(
        0.0, unit='m', ge=-1e3, le=1e3, description='place along the shaft, for beams and pictures'
    )
    mass_kg: float = quantity(0.0, unit='kg', ge=0.0, le=1e5, description='lumped mass')
    diametral_inertia_kg_m2: float = quantity(
        0.0, unit='kg m^2', ge=0.0, le=1e5, description='lumped moment of inertia across the shaft'
    )
    polar_inertia_kg_m2: float = quantity(
        0.0, unit='kg m^2', ge=0.0, le=1e5, description='lumped moment of inertia about the shaft'
    )

    @property
    def tilts(self) -> bool:
        """Whether the node has an inertia against tilting of its own."""
        return self.diametral_inertia_kg_m2 > 0.0 or self.polar_inertia_kg_m2 > 0.0


class Plant(ConfigModel):
    """A rotor: nodes by name, and the elements between them."""

    description: str = pydantic.Field(default='', description='what it is, in one sentence')
    nodes: dict[str, Node] = pydantic.Field(min_length=1, description='places on the machine')
    elements: tuple[AnyElement, ...] = pydantic.Field(
        default=(), strict=False, description='what acts on the nodes'
    )
    twins: tuple[tuple[str, str], ...] = pydantic.Field(
        default=(),
        strict=False,
        description='pairs of nodes that nothing tells apart: computed once while they move alike',
    )
    load_scale: float = quantity(
        1.0, unit='1', gt=0.0, le=10.0, description="factor on the aircraft's load"
    )
    reduction: Reduction | None = pydantic.Field(
        default=None, description='integrate with fewer coordinates; unset: with all'
    )

    @pydantic.model_validator(mode='after')
    def _check(self) -> Self:
        for name in self.nodes:
            if name == GROUND or not _is_name(name):
                raise PlantError(
                    f'nodes.{name}: a node is named in small letters, digits and _, and not '
                    f'{GROUND!r}, which never moves'
                )
        names: set[str] = set()
        for place, (name, element) in enumerate(self.named_elements()):
            if name in names:
                raise PlantError(f'elements[{place}].name = {name!r} stands twice; rename one')
            names.add(name)
            _check_ends(f'elements[{place}]', name, element, self.nodes)
        return self

    @pydantic.model_validator(mode='after')
    def _check_twins_and_reduction(self) -> Self:
        paired = [node for pair in self.twins for node in pair]
        kept = () if self.reduction is None else self.reduction.keep
        for key, nodes in (('twins', paired), ('reduction.keep', kept)):
            for node in nodes:
                if node not in self.nodes:
                    raise PlantError(
                        f'{key}: {node!r} is no node of the plant; it has {", ".join(self.nodes)}'
                    )
        if twice := [node for node in paired if paired.count(node) > 1]:
            raise PlantError(f'twins: {twice[0]!r} stands twice; a node has one twin, not itself')
        if self.twins and self.reduction is not None:
            raise PlantError(
                'reduction: the modes of a reduced plant tell twins apart; take out twins or '
                'reduction'
            )
        return self

    def named_elements(self) -> list[tuple[str, Element]]:
        """Return the elements with their names: given ones, else the kind and a number."""
        counts: dict[str, int] = {}
        named = []
        for element in self.elements:
            kind = type(element).model_fields['kind'].default
            counts[kind] = counts.get(kind, 0) + 1
            named.append((element.name or f'{kind}_{counts[kind]}', element))
        return named

    def coordinates(self) -> tuple[tuple[str, Axis], ...]:
        """Return the degrees of freedom in the order of the state: node and axis."""
        tilting = {name for name, node in self.nodes.items() if node.tilts}
        for element in self.elements:
            for key, axes in element.touches:
                if set(axes) - set(TRANSLATIONS):
                    tilting.add(getattr(element, key))
        return tuple(
            (name, axis)
            for name in self.nodes
            for axis in (ALL_AXES if name in tilting else TRANSLATIONS)
        )


def _is_name(name: str) -> bool:
    return name.isidentifier() and name.islower()


def _check_ends(where: str, name: str, element: Element, nodes: Mapping[str, Node]) -> None:
    ends = [getattr(element, key) for key, _ in element.touches]
    for (key, axes), node in zip(element.touches, ends, strict=True):
        if node != GROUND and node not in nodes:
            raise PlantError(
                f'{where}.{key} = {node!r} is no node of the plant; it has {", ".join(nodes)}'
            )
        if unknown := [axis for axis in axes if axis not in ALL_AXES]:
            raise PlantError(
                f'{where} ({name}) touches {unknown[0]!r} of {key}; a node has '
                f'{", ".join(ALL_AXES)}'
            )
        if ends.count(node) > 1:
            raise PlantError(f'{where} ({name}) has the node {node!r} at two ends')
    if set(ends) == {GROUND}:
        raise PlantError(f'{where} ({name}) acts on {GROUND!r} alone, which never moves')


@dataclass(frozen=True)
class PlacedElement:
    """An element with what the equation of motion needs of it.

    `places` are the indices of its degrees of freedom in the state, None on the ground;
    `like` is the place among the elements of the twin whose numbers it shares, or its own.
    """

    name: str
    element: Element
    places: tuple[int | None, ...]
    like: int


@dataclass(frozen=True)
class LinearPart:
    """The matrices of a plant, (n, n) in SI, and where they may differ from 0.

    `mass`, `damping`, `damping_per_speed`, `stiffness`, `stiffness_per_speed` as in `Matrices`;
    `gyroscopic` is the polar inertia in `damping_per_speed`; `load` (n, 2) is the mass that the
    load along y and z acts on, kg.
    """

    mass: Array
    damping: Array
    damping_per_speed: Array
    stiffness: Array
    stiffness_per_speed: Array
    load: Array
    patterns: Mapping[str, NDArray[np.bool_]]

    def transformed(self, to_all: Array) -> 'LinearPart':
        """Return the linear part for coordinates that `to_all` (n, m) gives these from."""
        there = (to_all != 0.0).astype(float)
        patterns = {
            name: there.T @ pattern.astype(float) @ there > 0.0
            for name, pattern in self.patterns.items()
        }
        matrices = {name: to_all.T @ getattr(self, name) @ to_all for name in patterns}
        return LinearPart(**matrices, load=to_all.T @ self.load, patterns=patterns)


@dataclass(frozen=True)
class Assembly:
    """A plant laid out for integration: coordinates, placed elements and the linear part."""

    coordinates: tuple[tuple[str, Axis], ...]
    canonical: tuple[int, ...]
    """For each coordinate the one whose twin it is, or itself."""
    elements: tuple[PlacedElement, ...]
    linear: LinearPart
    reduced: Reduced | None = None
    """Of a reduced plant, whose coordinates are kept ones and ('mode_1', 'amplitude'), ..."""

    @property
    def size(self) -> int:
        """The number n of degrees of freedom."""
        return len(self.coordinates)

    def place(self, node: str, axis: Axis) -> int:
        """Return the index of a degree of freedom in the state."""
        return self.coordinates.index((node, axis))

    def all_displacements(self, displacements: ArrayLike) -> NDArray[Any]:
        """Return (..., all) of `Plant.coordinates` for displacements (..., n) of this layout."""
        found = np.asarray(displacements)
        return found if self.reduced is None else found @ self.reduced.transformation.T


def assemble(plant: Plant) -> Assembly:
    """Lay out a plant; raises PlantError for one that has no equation of motion."""
    coordinates = plant.coordinates()
    index = {coordinate: k for k, coordinate in enumerate(coordinates)}
    twin_of = {second: first for first, second in plant.twins}
    canonical = tuple(
        index.get((twin_of.get(node, node), axis), k) for k, (node, axis) in enumerate(coordinates)
    )
    placed: list[PlacedElement] = []
    for name, element in plant.named_elements():
        places = tuple(
            None if getattr(element, key) == GROUND else index[getattr(element, key), axis]
            for key, axes in element.touches
            for axis in axes
        )
        _check_numbers(name, element)
        twin = _twin(placed, element, places, canonical)
        placed.append(PlacedElement(name, element, places, twin))
    linear = _linear_part(plant, coordinates, placed)
    _check_masses(linear.mass, coordinates)
    _check_twins(placed, linear, coordinates, canonical)
    whole = Assembly(coordinates, canonical, tuple(placed), linear)
    return whole if plant.reduction is None else _reduced(plant, whole, plant.reduction)


def _reduced(plant: Plant, whole: Assembly, reduction: Reduction) -> Assembly:
    """Return the layout of a reduced plant; its elements are those with a force.

    Disks keep their tilts: modes of a shaft at rest tell little of gyroscopic moments.
    """
    acting = [each for each in whole.elements if each.element.force is not None]
    touched = {place for each in acting for place in each.places if place is not None}
    nodes = {*reduction.keep, *(name for name, node in plant.nodes.items() if node.tilts)}
    kept = sorted(touched | {k for k, (node, _) in enumerate(whole.coordinates) if node in nodes})
    translations = np.array([axis in TRANSLATIONS for _, axis in whole.coordinates])
    linear = whole.linear
    reduced = reduce(linear.mass, linear.stiffness, kept, translations, reduction.highest_hz)
    index: dict[int | None, int | None] = {None: None, **{k: j for j, k in enumerate(kept)}}
    elements = (
        replace(each, places=tuple(index[place] for place in each.places), like=k)
        for k, each in enumerate(acting)
    )
    modes = tuple((f'mode_{k + 1}', AMPLITUDE) for k in range(len(reduced.kept_hz)))
    coordinates = (*(whole.coordinates[k] for k in kept), *modes)
    return Assembly(
        coordinates,
        tuple(range(len(coordinates))),
        tuple(elements),
        linear.transformed(reduced.transformation),
        reduced,
    )


def _twin(
    before: Sequence[PlacedElement],
    element: Element,
    places: tuple[int | None, ...],
    canonical: Sequence[int],
) -> int:
    """Return the place of an earlier element that acts alike on twin nodes, or the own place."""
    alike = [None if place is None else canonical[place] for place in places]
    for k, other in enumerate(before):
        if (
            other.places != places
            and [None if place is None else canonical[place] for place in other.places] == alike
            and _acts_alike(other.element, element)
        ):
            return k
    return len(before)


def _acts_alike(one: Element, other: Element) -> bool:
    return (
        type(one) is type(other)
        and one.coefficients() == other.coefficients()
        and one.structure() == other.structure()
        and one.rotations() == other.rotations()
        and all(getattr(one, name) == getattr(other, name) for name in one.live)
    )


def _check_twins(
    placed: Sequence[PlacedElement],
    linear: LinearPart,
    coordinates: Sequence[tuple[str, Axis]],
    canonical: Sequence[int],
) -> None:
    """Refuse twins of which one has a matrix or a force that the other has not."""
    other = {k: c for k, c in enumerate(canonical) if k != c}
    other |= {c: k for k, c in other.items()}
    order = [other.get(k, k) for k in range(len(canonical))]
    for what in ('mass', 'damping', 'damping_per_speed', 'stiffness', 'stiffness_per_speed'):
        matrix = getattr(linear, what)
        differ = np.abs(matrix - matrix[np.ix_(order, order)]) > 1e-12 * np.abs(matrix).max()
        if differ.any():
            node, axis = coordinates[int(np.argmax(differ.any(axis=1)))]
            raise PlantError(
                f'twins are not alike: the {what} of {node}, {axis} is not that of its twin; '
                'give both nodes the same, or take the pair out of twins'
            )
    for each in placed:
        swapped = tuple(None if k is None else other.get(k, k) for k in each.places)
        if each.element.force is None or set(swapped) == set(each.places):
            continue
        if not any(
            one.places == swapped and _acts_alike(one.element, each.element) for one in placed
        ):
            raise PlantError(
                f'twins are not alike: {each.name} ({each.element.kind}) acts on one of them and '
                'nothing like it on the other; give both the same, or take the pair out of twins'
            )


def _check_numbers(name: str, element: Element) -> None:
    for key in element.live:
        if not isinstance(getattr(element, key, None), int | float):
            raise PlantError(f'{name} ({element.kind}): its live {key!r} is no number field')
    for key, value in element.coefficients().items():
        for one in value if isinstance(value, tuple) else (value,):
            if not isinstance(one, int | float) or not math.isfinite(one):
                raise PlantError(
                    f'{name} ({element.kind}): its coefficient {key} = {one!r} is no finite number'
                )


def _linear_part(
    plant: Plant, coordinates: Sequence[tuple[str, Axis]], placed: Iterable[PlacedElement]
) -> LinearPart:
    n = len(coordinates)
    names = ('mass', 'damping', 'damping_per_speed', 'stiffness', 'stiffness_per_speed')
    total = {name: np.zeros((n, n)) for name in names}
    patterns = {name: np.zeros((n, n), bool) for name in names}
    index = {coordinate: k for k, coordinate in enumerate(coordinates)}
    for name, node in plant.nodes.items():
        for axis in TRANSLATIONS:
            k = index[name, axis]
            total['mass'][k, k] += node.mass_kg
        if (name, 'theta_y') in index:
            a, b = index[name, 'theta_y'], index[name, 'theta_z']
            total['mass'][a, a] += node.diametral_inertia_kg_m2
            total['mass'][b, b] += node.diametral_inertia_kg_m2
            total['damping_per_speed'][a, b] += node.polar_inertia_kg_m2
            total['damping_per_speed'][b, a] -= node.polar_inertia_kg_m2
            patterns['damping_per_speed'][[a, b], [b, a]] = True
    positions = {name: node.position_m for name, node in plant.nodes.items()}
    for each in placed:
        matrices = each.element.matrices(positions)
        ours = [k for k, place in enumerate(each.places) if place is not None]
        theirs = [place for place in each.places if place is not None]
        given = {name: getattr(matrices, name) for name in names}
        for name, matrix in given.items():
            _check_matrix(each, name, matrix)
        for name, matrix in given.items():
            if matrix is None:
                continue
            total[name][np.ix_(theirs, theirs)] += matrix[np.ix_(ours, ours)]
            pattern = _pattern(name, given)[np.ix_(ours, ours)]
            patterns[name][np.ix_(theirs, theirs)] |= pattern
    load = np.zeros((n, 2))
    for k, axis in enumerate(TRANSLATIONS):
        unit = np.array([float(own == axis) for _, own in coordinates])
        load[:, k] = plant.load_scale * (total['mass'] @ unit)
    return LinearPart(**total, load=load, patterns=patterns)


def _check_matrix(each: PlacedElement, name: str, matrix: Array | None) -> None:
    n = len(each.places)
    if matrix is not None and matrix.shape != (n, n):
        raise PlantError(
            f'{each.name}: its {name} matrix is {matrix.shape}, but it touches {n} degrees of '
            'freedom'
        )
    if matrix is not None and not np.isfinite(matrix).all():
        raise PlantError(f'{each.name}: its {name} matrix holds a number that is not finite')


def _pattern(name: str, given: Mapping[str, Array | None]) -> NDArray[np.bool_]:
    """Return where a matrix of an element may differ from 0.

    That is by structure: where another one does, so that a factor that happens to be 0 does not
    change the compiled code. Those per speed count apart: gyroscopic moments couple planes that
    stiffness does not.
    """
    alike = [
        matrix != 0.0
        for other, matrix in given.items()
        if matrix is not None and other.endswith('speed') == name.endswith('speed')
    ]
    return np.asarray(np.logical_or.reduce(alike))


def _check_masses(mass: Array, coordinates: Sequence[tuple[str, Axis]]) -> None:
    for k, (node, axis) in enumerate(coordinates):
        if not mass[k, k] > 0.0:
            what = 'mass' if axis in TRANSLATIONS else 'moment of inertia'
            raise PlantError(
                f'nodes.{node} has no {what}: it would move without inertia; give it '
                f'{"mass_kg" if what == "mass" else "diametral_inertia_kg_m2"}, or a beam'
            )
    if not np.linalg.eigvalsh(mass)[0] > 0.0:
        raise PlantError('the mass matrix is not positive definite; check the masses of the nodes')
