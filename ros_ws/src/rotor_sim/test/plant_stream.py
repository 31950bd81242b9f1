# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A plant at constant speed and load through its compiled stream, for truth tests."""

import numpy as np
from numpy.typing import NDArray

from rotor_sim.plant.compiled_plant import CompiledPlant

Array = NDArray[np.float64]

_LOAD_RATE_HZ = 100


def streamed(
    plant: CompiledPlant,
    speed_rad_s: float,
    *,
    load_m_s2: tuple[float, float] = (0.0, 0.0),
    samples: int = 500,
    rate_hz: int = 2000,
    substeps: int = 10,
) -> tuple[Array, Array]:
    """Return the samples (samples, n + records) and the last state (2n,), from rest at 0."""
    t = np.arange(samples) / rate_hz
    r = len(plant.ratios)
    drives = np.zeros((1, samples, r + 2 + 2 * len(plant.live)))
    for k, ratio in enumerate(plant.ratios):
        drives[0, :, k] = np.mod(ratio * speed_rad_s * t, 2.0 * np.pi)
    drives[0, :, r] = speed_rad_s
    drives[0, :, r + 2 :: 2] = list(plant.live.values())
    points = samples * _LOAD_RATE_HZ // rate_hz + 3
    grids = np.tile(np.array(load_m_s2), (1, points, 1))
    states = np.zeros((1, 2 * plant.size))
    out = np.empty((1, samples, plant.size + len(plant.records)))
    plant.module.stream(
        (0,), plant.alike(states), plant.coefficients[np.newaxis], np.array([plant.ratios]), states,
        out, rate_hz, 1.0 / rate_hz, substeps, 0, drives, grids, 0, _LOAD_RATE_HZ,
    )  # fmt: skip
    return out[0], states[0]
