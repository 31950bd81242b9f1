# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: ANN001, ANN202, PLR0917 - as a user writes it
"""The rotor as a user of any ODE library would write it, in the library's own sin, cos and sqrt.

Dimensionless: lengths over the static deflection, time tau = speed times time. The form suits a
computer best: one root for two opposite balls, no atan2. `peers.py` holds it against
`hou_equations` before anything is timed.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor_sim.plant.parameters import RotorParameters

Array = NDArray[np.float64]

ROTOR = RotorParameters.hou2016('derived')
SPEED_RAD_S = 352.0
LOAD_FACTOR = 3.0
START = np.array([4.0, 0.1, 1.3, 0.0, 1.3, 0.0] + 6 * [0.0])
TURN = 2.0 * math.pi
UNITS = ROTOR.length_scale_m * np.repeat([1.0, SPEED_RAD_S], 6)
"""Multiplies a dimensionless state to give m and m/s."""

SEPARATION = 1e-6
"""Of the two trajectories where a library has no tangent equations."""


def equations(sin: Any, cos: Any, sqrt: Any, absolute: Any, limited: Any, compiled: Any) -> Any:
    """Return f(tau, x, K), the 12 derivatives; `limited` clips to -1/2..1/2."""
    stiffness = 0.5 * (ROTOR.critical_speed_rad_s / SPEED_RAD_S) ** 2
    load = 2.0 * stiffness * LOAD_FACTOR
    unbalance = ROTOR.eccentricity_m / ROTOR.length_scale_m
    inertia = ROTOR.disk_mass_kg / ROTOR.bearing_mass_kg
    hertz = ROTOR.contact_stiffness_n_m15 * math.sqrt(ROTOR.length_scale_m)
    hertz /= ROTOR.bearing_mass_kg * SPEED_RAD_S**2
    damping, beta, cage = 2.0 * ROTOR.damping_ratio, ROTOR.crack_angle_rad, ROTOR.cage_ratio
    diagonal = math.sqrt(0.5)

    def contact(y, z, c, s):
        a, b = y * c + z * s, z * c - y * s  # in the frame of the cage
        p, q = diagonal * (a + b), diagonal * (b - a)
        a, b = a * sqrt(absolute(a)), b * sqrt(absolute(b))
        p, q = diagonal * p * sqrt(absolute(p)), diagonal * q * sqrt(absolute(q))
        a, b = hertz * (a + p - q), hertz * (b + p + q)
        return a * c - b * s, a * s + b * c

    contact = compiled(contact)

    def f(tau, x, K):
        y, z, y1, z1, y2, z2 = x[0], x[1], x[2], x[3], x[4], x[5]
        vy, vz, vy1, vz1, vy2, vz2 = x[6], x[7], x[8], x[9], x[10], x[11]
        c, s = cos(tau + beta), sin(tau + beta)
        opening = limited((c * y + s * z) / sqrt(y * y + z * z))
        lost = K * (0.5 + opening * (1.5 - 2.0 * opening * opening))
        kyy, kzz = stiffness * (1.0 - lost * c * c), stiffness * (1.0 - lost * s * s)
        kyz = -stiffness * lost * s * c
        a, b = 2.0 * y - y1 - y2, 2.0 * z - z1 - z2
        va, vb = 2.0 * vy - vy1 - vy2, 2.0 * vz - vz1 - vz2
        c, s = cos(cage * tau), sin(cage * tau)
        fy1, fz1 = contact(y1, z1, c, s)
        fy2, fz2 = contact(y2, z2, c, s)
        ay = unbalance * cos(tau) + load - damping * va - kyy * a - kyz * b
        az = unbalance * sin(tau) - damping * vb - kyz * a - kzz * b
        ay1 = inertia * (damping * (vy - vy1) + kyy * (y - y1) + kyz * (z - z1)) - fy1 + load
        az1 = inertia * (damping * (vz - vz1) + kyz * (y - y1) + kzz * (z - z1)) - fz1
        ay2 = inertia * (damping * (vy - vy2) + kyy * (y - y2) + kyz * (z - z2)) - fy2 + load
        az2 = inertia * (damping * (vz - vz2) + kyz * (y - y2) + kzz * (z - z2)) - fz2
        return vy, vz, vy1, vz1, vy2, vz2, ay, az, ay1, az1, ay2, az2

    return compiled(f)


def as_it_is(function: Any) -> Any:
    """Return the function, where nothing compiles it by itself."""
    return function


def growth(turn: Callable[[int, Array], Array], first: int, count: int) -> float:
    """Two trajectories in one state (24,), brought together again every revolution."""
    x, total = np.tile(START, 2), 0.0
    x[12:] += SEPARATION / math.sqrt(12.0)
    for n in range(first + count):
        x = turn(n, x)
        apart = x[12:] - x[:12]
        distance = float(np.linalg.norm(apart))
        total += math.log(distance / SEPARATION) if n >= first else 0.0
        x[12:] = x[:12] + apart * (SEPARATION / distance)
    return total / (TURN * count)
