# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The bearing housing under an accelerometer: one damped oscillator in y and one in z.

    M x'' + 2 zeta w M x' + w^2 M x = -F

with F the contact force on the journal, so -F acts on the housing; x'' is what the accelerometer
feels. The journal does not feel the housing's motion: its stiffness is meant to be well above
that of the balls. Exact for a force that is linear between samples (first-order hold).
"""

import functools
import math

import numpy as np
from numpy.typing import NDArray

from rotor_sim.sensors.sensor_config import Housing

Array = NDArray[np.float64]


@functools.cache
def matrices(config: Housing, rate_hz: int) -> Array:
    """Return the coefficients (4, 3) of `_noiseless_kernels.housing`.

    Rows 0 and 1: Phi and Gamma_0; row 2: Gamma_1; row 3: w^2, 2 zeta w, 1/M, where
    (x, v)[n+1] = Phi (x, v)[n] + Gamma_0 u[n] + Gamma_1 u[n+1], u = -F.
    Franklin, Powell, Workman, Digital Control of Dynamic Systems (first-order hold).
    """
    from scipy.linalg import expm  # noqa: PLC0415 - slow to import

    w = 2.0 * math.pi * config.natural_frequency_hz
    system = np.zeros((4, 4))
    system[0, 1] = 1.0
    system[1] = (-w * w, -2.0 * config.damping_ratio * w, 1.0 / config.mass_kg, 0.0)
    system[2, 3] = rate_hz  # u rises by 1 over the sample
    step = expm(system / rate_hz)
    packed = np.zeros((4, 3))
    packed[:2, :2] = step[:2, :2]
    packed[:2, 2] = step[:2, 2] - step[:2, 3]
    packed[2, :2] = step[:2, 3]
    packed[3] = (w * w, 2.0 * config.damping_ratio * w, 1.0 / config.mass_kg)
    return packed


def at_rest(config: Housing, force: Array) -> Array:
    """Return the state (4, 3) of housings at rest under the contact forces (4,) in N."""
    w = 2.0 * math.pi * config.natural_frequency_hz
    state = np.zeros((4, 3))
    state[:, 0] = -force / (config.mass_kg * w * w)
    state[:, 2] = -force
    return state
