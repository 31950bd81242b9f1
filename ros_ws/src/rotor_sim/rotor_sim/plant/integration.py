# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""From plans of samples to sampled rows: the one place that calls the engine of a stream."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotor_common.constants import LOAD_RATE_HZ
from rotor_sim.plant.compiled_plant import CompiledPlant

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Lane:
    """A rotor as the integrator sees it; those that agree in `shared` can stand side by side."""

    rate_hz: int
    substeps: int
    plant: CompiledPlant

    @property
    def shared(self) -> tuple[object, ...]:
        """What lanes side by side have in common."""
        return self.rate_hz, self.substeps, self.plant.engine.text


@dataclass(frozen=True)
class Stretch:
    """Consecutive samples of one rotor before they are integrated.

    `state` (2n,) holds at `first_sample`, see `CompiledPlant`. `drive` (samples, columns): the
    angle of each rotation (rad, reduced to one turn), then speed (rad/s) and its increment over the
    sample, then each live parameter and its increment; `turns` the whole turns of the shaft.
    `load` (points, 2) in m/s^2 is the grid's part from the point at or before the first sample on.
    """

    lane: Lane
    first_sample: int
    state: Array
    turns: NDArray[np.int64]
    drive: Array
    load: Array


def integrate(plans: Sequence[Stretch], lanes: int) -> tuple[Array, Array]:
    """Return the rows (plans, samples, n + records) and the states (plans, 2n) after the last.

    A row holds the displacements, then the records of the plant. The plans agree in first sample,
    length and `Lane.shared`; `lanes` is at least their number and has no influence on the bits.
    Nothing is checked: a rotor that diverges gives what it gives.
    """
    first = plans[0]
    lane, plant = first.lane, first.lane.plant
    padded = [*plans, *[plans[-1]] * (lanes - len(plans))]
    states = np.array([plan.state for plan in padded])
    out = np.empty((lanes, len(first.drive), plant.size + len(plant.records)))
    plant.module.stream(
        (0,) * lanes,
        plant.alike(states),
        np.array([plan.lane.plant.coefficients for plan in padded]),
        np.array([plan.lane.plant.ratios for plan in padded]),
        states,
        out,
        lane.rate_hz,
        1.0 / lane.rate_hz,
        lane.substeps,
        first.first_sample,
        np.array([plan.drive for plan in padded]),
        np.array([plan.load for plan in padded]),
        first.first_sample * LOAD_RATE_HZ // lane.rate_hz,
        LOAD_RATE_HZ,
    )
    return out[: len(plans)], states[: len(plans)]
