# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""From plans of samples to sampled rows: the one place that calls the compiled integrator."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotor_common.constants import LOAD_RATE_HZ

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Lane:
    """What the integrator knows of a rotor: see `_kernels.kind` and `_kernels.pack`.

    Rotors whose other fields agree can be integrated side by side.
    """

    rate_hz: int
    substeps: int
    balls: tuple[int, ...]
    curve: tuple[int, ...]
    coefficients: Array

    @property
    def shared(self) -> tuple[object, ...]:
        """What lanes side by side have in common."""
        return self.rate_hz, self.substeps, self.balls, self.curve


@dataclass(frozen=True)
class Stretch:
    """Consecutive samples of one rotor before they are integrated.

    `state` (12,) holds at `first_sample`: y, z, y1, z1, y2, z2 in m and their rates in m/s.
    `drive` (n, 6) is shaft and cage angle (rad, reduced to one turn), speed (rad/s) and its
    increment over the sample, crack and its increment; `turns` the whole turns of the shaft.
    `load` (points, 2) in m/s^2 is the grid's part from the point at or before the first sample on.
    """

    lane: Lane
    first_sample: int
    state: Array
    turns: NDArray[np.int64]
    drive: Array
    load: Array


def integrate(plans: Sequence[Stretch], lanes: int) -> tuple[Array, Array]:
    """Return the rows (plans, n, OUTPUTS) and the states (plans, 12) after the last sample.

    The plans agree in first sample, length and `Lane.shared`; `lanes` is at least their number and
    has no influence on the bits. Nothing is checked: a rotor that diverges gives what it gives.
    """
    from rotor_sim.plant import _kernels  # noqa: PLC0415 - numba is slow to import

    first = plans[0]
    lane = first.lane
    padded = [*plans, *[plans[-1]] * (lanes - len(plans))]
    states = np.array([plan.state for plan in padded])
    out = np.empty((lanes, len(first.drive), _kernels.OUTPUTS))
    _kernels.integrate(
        (0,) * lanes,
        lane.balls,
        lane.curve,
        _kernels.alike(states),
        np.array([plan.lane.coefficients for plan in padded]),
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
