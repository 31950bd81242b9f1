# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Static equilibrium of the rotor under a constant load, the start of every run."""

import numpy as np
from numpy.typing import NDArray

from rotor_sim.errors import IntegrationError
from rotor_sim.plant.model import ball_angles, contact_force, crack_opening, stiffness
from rotor_sim.plant.parameters import RotorParameters

Array = NDArray[np.float64]

_ITERATIONS = 40
_ACCEPTED = 1e-6
_HALVINGS = 30


def static_equilibrium(
    parameters: RotorParameters,
    load_m_s2: tuple[float, float],
    angle_rad: float = 0.0,
    crack_stiffness_ratio: float | None = None,
    cage_angle_rad: float | None = None,
) -> Array:
    """Return the state (12,) at rest in m and m/s: displacements in balance, velocities 0.

    The unbalance is left out (it turns). `load_m_s2` is (y, z) in frame `rotor`. Without load the
    rotor is put at the origin; with clearance that is one of many places in the gap. Where f
    jumps across the balance (variants other than `derived`), f is taken in between, as the
    average of switching back and forth (Filippov).

    Raises:
        IntegrationError: nothing holds the rotor, or the search did not converge.

    """
    from scipy.optimize import brentq  # noqa: PLC0415 - slow to import

    p = parameters
    load = p.load_scale * np.array(load_m_s2, np.float64)
    if not load.any():
        return np.zeros(12)
    if p.contact_stiffness_n_m15 == 0.0:
        raise IntegrationError(
            f'no equilibrium under a load of ({load[0]:g}, {load[1]:g}) m/s^2: '
            'contact_stiffness_n_m15 = 0 lets the shaft fall; raise it or take the load away'
        )
    ratio = p.crack_stiffness_ratio if crack_stiffness_ratio is None else crack_stiffness_ratio
    cage = p.cage_ratio * angle_rad if cage_angle_rad is None else cage_angle_rad
    lost = ratio * p.shaft_stiffness_n_m

    def displacements(opening: float) -> tuple[Array, Array]:
        at_disk = stiffness(p, opening, angle_rad, p.crack_scale * lost)
        bend = np.linalg.solve(at_disk, 0.5 * p.disk_mass_kg * load)
        at_bearing = stiffness(p, opening, angle_rad, p.bearing_crack_scale * lost)
        pull = (at_bearing * bend).sum(axis=-1) + p.bearing_mass_kg * load
        journal = _seat(p, pull, cage)
        return journal + bend, journal

    def excess(opening: float) -> float:
        disk, _ = displacements(opening)
        return float(crack_opening(p, disk[0], disk[1], angle_rad)) - opening

    # f stays within 0..1, so the excess is >= 0 at 0 and <= 0 at 1
    opening = 0.0
    if ratio > 0.0 and excess(0.0) > 0.0:
        opening = 1.0 if excess(1.0) >= 0.0 else float(brentq(excess, 0.0, 1.0, xtol=1e-15))
    disk, journal = displacements(opening)
    return np.concatenate([disk, journal, journal, np.zeros(6)])


def _seat(parameters: RotorParameters, force: Array, cage_angle_rad: float) -> Array:
    """Return where the balls carry `force` (2,) in N: the minimum of a convex potential.

    Newton's method with a step limit and halving; where one ball alone carries, the potential is
    flat sideways and the point nearest the start is taken.
    """
    p = parameters
    size = float(np.hypot(*force))
    balls = ball_angles(p, cage_angle_rad)
    c, s = np.cos(balls), np.sin(balls)
    reach = (size / p.contact_stiffness_n_m15) ** (2.0 / 3.0)
    x = force / size * (p.clearance_m + reach)
    limit = p.clearance_m + reach
    # a clearance far wider than the contact's press leaves fewer digits to the press
    tolerance = size * (1e-12 + 2e-15 * p.clearance_m / reach)

    def pressed(point: Array) -> Array:
        return np.asarray(np.maximum(point[0] * c + point[1] * s - p.clearance_m, 0.0))

    def residual(point: Array) -> Array:
        return np.asarray(contact_force(p, point, cage_angle_rad) + force)

    def potential(point: Array) -> float:
        hertz = 0.4 * p.contact_stiffness_n_m15 * np.sum(pressed(point) ** 2.5)
        return float(hertz - force[0] * point[0] - force[1] * point[1])

    for _ in range(_ITERATIONS):
        missing = residual(x)
        norm = float(np.hypot(*missing))
        if norm <= tolerance:
            break
        slope = 1.5 * p.contact_stiffness_n_m15 * np.sqrt(pressed(x))
        cross = np.sum(slope * c * s)
        curvature = np.array([[np.sum(slope * c * c), cross], [cross, np.sum(slope * s * s)]])
        # with one ball pressed there is none sideways; this part fades with the residual
        curvature += 0.01 * norm / limit * np.eye(2)
        step: Array = np.linalg.solve(curvature, missing)
        step *= min(1.0, limit / float(np.hypot(*step)))
        for _ in range(_HALVINGS):
            trial = x + step
            if potential(trial) < potential(x) or float(np.hypot(*residual(trial))) < norm:
                break
            step *= 0.5
        x = x + step
    # a force almost along one ball: its neighbour is hardly touched, and slow to find
    if not float(np.hypot(*residual(x))) <= _ACCEPTED * size:
        raise IntegrationError(
            f'no static equilibrium found under a load of {size:g} N on a bearing with '
            f'clearance_m = {p.clearance_m:g} m; start from a larger load or without clearance'
        )
    return np.asarray(x)
