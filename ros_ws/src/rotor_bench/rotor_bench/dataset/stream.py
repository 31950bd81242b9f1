# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Simulates several flights in lock-step, block by block; no flight is held in memory."""

from collections.abc import Iterator, Sequence

from maneuver_gen.load_grid import load_grid
from rotor_bench.dataset.suite import Flight
from rotor_bench.errors import DatasetError
from rotor_sim.stream import fleet
from rotor_sim.stream.load_grid import LoadGrid
from rotor_sim.stream.simulator import RotorSimulator, SimulatedBlock


def fly(flights: Sequence[Flight], block_samples: int) -> Iterator[list[SimulatedBlock]]:
    """Yield the next block of every flight, in their order, until the flights end together.

    The bytes of a flight depend neither on the others nor on `block_samples`. The last block may
    be shorter. Raises DatasetError unless all flights are equally long, IntegrationError where a
    rotor diverges.
    """
    lengths = {round(f.duration_s * f.suite.rate_hz) for f in flights}
    if len(lengths) != 1 or block_samples < 1:
        raise DatasetError(
            f'{len(flights)} flights of {len(lengths)} lengths in blocks of {block_samples} cannot '
            'fly together; give at least one, all equally long, and 1 sample or more a block'
        )
    (end,) = lengths
    grids = [LoadGrid.from_points(load_grid(f.scenario.maneuver, f.duration_s)) for f in flights]
    simulators = [RotorSimulator(flight.scenario.rotor_sim()) for flight in flights]
    for first in range(0, end, block_samples):
        count = min(block_samples, end - first)
        yield fleet.advance(simulators, count, grids)
