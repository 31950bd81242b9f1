# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Simulates many rotors side by side: the same bytes as one by one, several times faster."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from rotor_common.constants import LANES
from rotor_sim.errors import IntegrationError, RotorError
from rotor_sim.plant.integration import Stretch, integrate
from rotor_sim.stream.load_grid import LoadGrid
from rotor_sim.stream.simulator import RotorSimulator, SimulatedBlock

Array = NDArray[np.float64]

_FEW = 3
"""Up to this many rotors are faster one by one than in a full group of lanes."""


def advance(
    simulators: Sequence[RotorSimulator], n_samples: int, grids: Sequence[LoadGrid]
) -> list[SimulatedBlock]:
    """Return the next `n_samples` samples of every simulator, each with its own load grid.

    The blocks have the bytes of `simulator.advance(n_samples, grid)`. Rotors that agree in rate,
    steps a sample, ball count and the kind of their breathing function (crack_half_angle_rad is 30
    degrees; another; another with a continued last branch) are integrated up to 16 at a time. Full
    groups are fastest; other differences between rotors cost nothing.

    Raises:
        RotorError: the simulators are not at the same sample, differ in rate or are not as many as
            the grids, or one of them raises it, see `RotorSimulator.advance`.
        IntegrationError: rotors diverged. For one simulator's error the message gives its index,
            and none of them has advanced: the others can continue without it.

    """
    _check_alike(simulators, grids)
    plans = []
    for place, (simulator, grid) in enumerate(zip(simulators, grids, strict=True)):
        try:
            plans.append(simulator.plan(n_samples, grid))
        except (RotorError, IntegrationError) as error:
            raise type(error)(f'simulators[{place}]: {error}') from None
    results = _integrated(plans)
    for place, simulator in enumerate(simulators):
        try:
            simulator.check(plans[place], *results[place])
        except IntegrationError as error:
            raise IntegrationError(f'simulators[{place}]: {error}') from None
    return [
        simulator.finish(plan, *result)
        for simulator, plan, result in zip(simulators, plans, results, strict=True)
    ]


def _check_alike(simulators: Sequence[RotorSimulator], grids: Sequence[LoadGrid]) -> None:
    if len(simulators) != len(grids):
        raise RotorError(
            f'{len(simulators)} simulators cannot use {len(grids)} load grids; give one to each'
        )
    if len(set(map(id, simulators))) != len(simulators):
        raise RotorError('a simulator occurs twice in the fleet; give every rotor its own')
    for place, simulator in enumerate(simulators):
        for what, value, first in (
            ('next_sample', simulator.next_sample, simulators[0].next_sample),
            ('rate_hz', simulator.config.rate_hz, simulators[0].config.rate_hz),
        ):
            if value != first:
                raise RotorError(
                    f'simulators[{place}]: {what} = {value}, but that of simulators[0] is {first}; '
                    'they must be equal'
                )


def _integrated(plans: Sequence[Stretch]) -> list[tuple[Array, Array]]:
    """Return the rows and the final state of every plan, in order."""
    results: dict[int, tuple[Array, Array]] = {}
    for places, lanes in _groups(plans):
        rows, states = integrate([plans[place] for place in places], lanes)
        results.update(zip(places, zip(rows, states, strict=True), strict=True))
    return [results[place] for place in range(len(plans))]


def _groups(plans: Sequence[Stretch]) -> Iterable[tuple[Sequence[int], int]]:
    """Yield which plans to integrate together, and in how many lanes."""
    kinds: dict[object, list[int]] = {}
    for place, plan in enumerate(plans):
        kinds.setdefault(plan.lane.shared, []).append(place)
    for alike in kinds.values():
        for group in (alike[i : i + LANES] for i in range(0, len(alike), LANES)):
            if len(group) > _FEW:
                yield group, LANES
            else:
                yield from (([place], 1) for place in group)
