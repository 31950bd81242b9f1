# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The integration step of the suites: finer ones change less than any sensor sees."""

import numpy as np
import pytest
from numpy.typing import NDArray

from maneuver_gen.load_grid import load_grid
from rotor_bench.dataset.suite import Flight, plan_suite
from rotor_interfaces.channels import DISPLACEMENT_COLUMNS
from rotor_sim import LoadGrid, RotorSimulator

SECONDS = 24
PROBE_NOISE_M = 1e-8
"""Of a realistic probe, in a window of 64 revolutions."""


def first_test(family: str, speed_program: str, slowest_rad_s: float) -> Flight:
    """The first cracked flight of `standard` of that kind, with at most 2 um of clearance."""
    return next(
        flight
        for machine in plan_suite('standard')
        for flight in machine.flights
        if flight.grid.crack == 'constant'
        and (flight.grid.family, flight.grid.speed_program) == (family, speed_program)
        and flight.rotor.speed_rad_s >= slowest_rad_s
        and flight.labels['clearance_m'] <= 2e-6
    )


def clean(flight: Flight, steps_per_revolution: int) -> tuple[int, NDArray[np.void]]:
    """Return the steps a sample, and the first seconds of the flight without sensor effects."""
    scenario = flight.scenario.model_copy(update={'steps_per_revolution': steps_per_revolution})
    simulator = RotorSimulator(scenario.rotor_sim())
    grid = LoadGrid.from_points(load_grid(scenario.maneuver, flight.duration_s))
    block = simulator.advance(SECONDS * scenario.rate_hz, grid)
    return simulator.substeps, block.truth_rows


@pytest.mark.slow
@pytest.mark.parametrize(
    ('family', 'speed_program', 'slowest_rad_s'),
    [('pulls_9g', 'steady', 550.0), ('turns', 'governor_steps', 300.0), ('gusts', 'run_up', 400.0)],
)
def test_finer_steps_change_less_than_a_probe_sees(
    family: str, speed_program: str, slowest_rad_s: float
) -> None:
    """Where a bearing loses and finds its balls, runs with any two steps part: docs/datasets.md."""
    flight = first_test(family, speed_program, slowest_rad_s)
    substeps, rows = clean(flight, flight.suite.steps_per_revolution)
    finer, expected = clean(flight, 600)
    assert (substeps, finer) == (2, 6)
    flown = expected['load_y'].max() - expected['load_y'].min()
    assert flown > 5.0, 'the maneuver must have begun'
    for name in DISPLACEMENT_COLUMNS:
        error = rows[name].astype(np.float64) - expected[name]
        assert np.sqrt(np.mean(error**2)) < PROBE_NOISE_M, name
