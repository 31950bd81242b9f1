# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The integration step of the suites: finer ones change less than any sensor sees."""

import numpy as np
import pytest
from numpy.typing import NDArray

from maneuver_gen.load_grid import load_grid
from rotor_bringup.dataset.suite import Flight, plan_suite
from rotor_interfaces.waveform import DISPLACEMENT_COLUMNS
from rotor_sim import LoadGrid, RotorSimulator

SECONDS = 4


def first_test(family: str, slowest_rad_s: float) -> Flight:
    """The first flight of `standard` with a crack, of a family and a machine as fast or faster."""
    return next(
        flight
        for machine in plan_suite('standard')
        for flight in machine.flights
        if flight.grid.crack == 'constant'
        and flight.grid.family == family
        and flight.rotor.speed_rad_s >= slowest_rad_s
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
    ('family', 'slowest_rad_s'), [('climb_dive', 220.0), ('gusts', 450.0), ('turns', 600.0)]
)
def test_more_steps_change_less_than_a_probe_sees(family: str, slowest_rad_s: float) -> None:
    """Measured 0.1, 7 and 3 nm RMS at most; a window's noise of a realistic probe is 10 nm.

    Where a bearing loses and finds its balls (loads below 1 with clearance) two runs part anyway,
    with any step.
    """
    flight = first_test(family, slowest_rad_s)
    substeps, rows = clean(flight, flight.suite.steps_per_revolution)
    finer, expected = clean(flight, 1200)
    assert (substeps, finer) == (2, 12)
    for name in DISPLACEMENT_COLUMNS:
        error = rows[name].astype(np.float64) - expected[name]
        assert np.sqrt(np.mean(error**2)) < 1e-8, name
