# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A plant ready to be integrated: its engine, its numbers, and single evaluations."""

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor_sim.errors import PlantError
from rotor_sim.plant import engine
from rotor_sim.plant.element import Axis
from rotor_sim.plant.generator import (
    Engine,
    Record,
    coefficients,
    rotations_of,
    structure_of,
    write,
)
from rotor_sim.plant.plant import Assembly, Plant, assemble

Array = NDArray[np.float64]

_engines: dict[object, Engine] = {}


@dataclass(frozen=True)
class Instant:
    """What acts on a plant at one instant, SI; the load is apparent gravity in frame `rotor`.

    `live` replaces the values of live parameters, by `element.field`.
    """

    angle_rad: float = 0.0
    speed_rad_s: float = 0.0
    load_m_s2: tuple[float, float] = (0.0, 0.0)
    angular_acceleration_rad_s2: float = 0.0
    live: Mapping[str, float] | None = None


class CompiledPlant:
    """A plant with its engine; plants of one structure share the compiled code.

    States are (..., 2n): displacements (m, rad) in the order of `coordinates`, then velocities.
    """

    def __init__(self, plant: Plant, records: Sequence[Record] = ()) -> None:
        """Lay out the plant and write its engine; raises PlantError. Nothing is compiled yet."""
        self.plant = plant
        self.assembly: Assembly = assemble(plant)
        key = structure_of(self.assembly, records)
        if key not in _engines:
            _engines[key] = write(self.assembly, records)
        self.engine = _engines[key]
        self.records = tuple(records)
        values = coefficients(self.assembly)
        self.coefficients = np.array([values[name] for name in self.engine.coefficients])
        self.ratios = rotations_of(self.assembly)[1]
        """Of each rotation to the shaft, the shaft's first."""
        elements = dict(plant.named_elements())
        self.live = {
            f'{name}.{field}': float(getattr(elements[name], field))
            for name, field in self.engine.live
        }
        """The live parameters by `element.field`, with their values at time 0."""
        if plant.twins:
            self._check_twins()

    def _check_twins(self) -> None:
        """Refuse an element between twins that tells them apart, from one state of them alike."""
        n, order = self.size, list(self.assembly.canonical)
        state = 1e-5 * np.cos(np.arange(1.0, 2 * n + 1))
        state = np.concatenate([state[:n][order], state[n:][order]])
        found = self.acceleration(state, Instant(1.0, 100.0, (10.0, 3.0), 5.0))
        differ = np.abs(found - found[order]) > 1e-9 * np.abs(found).max()
        if differ.any():
            node, axis = self.coordinates[int(np.argmax(differ))]
            raise PlantError(
                f'twins are not alike: {node} accelerates along {axis} unlike its twin; take the '
                'pair out of twins'
            )

    @property
    def size(self) -> int:
        """The number n of degrees of freedom."""
        return self.assembly.size

    @property
    def coordinates(self) -> tuple[tuple[str, Axis], ...]:
        """The degrees of freedom: node and axis."""
        return self.assembly.coordinates

    @property
    def module(self) -> Any:
        """The compiled functions, see `engine_text`."""
        return engine.load(self.engine.text)

    def place(self, node: str, axis: Axis) -> int:
        """Return the index of a degree of freedom in the state."""
        return self.assembly.place(node, axis)

    def alike(self, states: Array) -> tuple[int, ...]:
        """Return the tuple `alike` of the engine for the states (lanes, 2n) it starts from.

        Empty unless in each lane twins are at the same place with the same velocity, bit for bit.
        They then stay so, since nothing in the equations tells one from the other.
        """
        order = np.array(self.assembly.canonical)
        order = np.concatenate([order, order + self.size])
        there_are = (order != np.arange(2 * self.size)).any()
        return (0,) if there_are and states[:, order].tobytes() == states.tobytes() else ()

    def acceleration(self, state: ArrayLike, at: Instant = Instant()) -> Array:
        """Return the accelerations (n,) in m/s^2 or rad/s^2 at a state (2n,)."""
        found, _ = self._plain['acceleration'](*self._arguments(state, at))
        return np.array(found)

    def recorded(self, state: ArrayLike, at: Instant = Instant()) -> Array:
        """Return the `records` at a state."""
        _, found = self._plain['acceleration'](*self._arguments(state, at))
        return np.array(found)

    def jacobian(self, state: ArrayLike, at: Instant = Instant()) -> Array:
        """Return d(acceleration)/d(state), (n, 2n), at a state: the derived tangent."""
        n = self.size
        b, i, lanes, x, v, turns, drive, load = self._arguments(state, at)
        # all columns at once: a change is an array, and no choice depends on it
        units = list(np.eye(2 * n))
        _, change = self._plain['acceleration_tangent'](
            b, i, lanes, x, v, units[:n], units[n:], turns, drive, load
        )
        return np.array([np.broadcast_to(row, 2 * n) for row in change])

    @functools.cached_property
    def _plain(self) -> dict[str, Any]:
        return _plain(self.engine.text)

    def _arguments(self, state: ArrayLike, at: Instant) -> tuple[Any, ...]:
        values = [float(value) for value in np.asarray(state, np.float64)]
        if len(values) != 2 * self.size:
            raise PlantError(f'the state has {len(values)} numbers; this plant has {2 * self.size}')
        live = {**self.live, **(at.live or {})}
        if unknown := live.keys() - self.live.keys():
            raise PlantError(
                f'{min(unknown)} is no live parameter; there are {", ".join(self.live) or "none"}'
            )
        rows = self.engine.rows
        b = [0.0] * rows.coefficients + self.coefficients.tolist()
        turns = [of(ratio * at.angle_rad) for ratio in self.ratios for of in (math.cos, math.sin)]
        drive = (at.speed_rad_s, at.angular_acceleration_rad_s2, *live.values())
        return b, 0, 1, values[: self.size], values[self.size :], turns, drive, at.load_m_s2


@functools.lru_cache(maxsize=64)
def _plain(text: str) -> dict[str, Any]:
    return engine.plain(text)
