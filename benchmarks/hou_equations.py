# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The equations of motion of Hou et al. (2016) in NumPy, written apart from the plant's elements.

Tests and benchmarks hold the engine against them.

Equation numbers are those of Hou et al. 2016. A state holds y, z (disk), y1, z1, y2, z2
(bearings) in m and their time derivatives in m/s, 12 numbers on the last axis; leading axes are
a batch. Frame `rotor`: y along a positive load, the shaft turns from y to z.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor_sim.plant.parameters import PhaseConvention, RotorParameters, ThetaConvention

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Drive:
    """What acts on the rotor at one instant: angles in rad, SI; load is apparent gravity, m/s^2.

    `cage_angle_rad` is None where the cage has rolled with the shaft from angle 0 (the usual case).
    `force_y_n`, `force_z_n` act on the disk, beside load and unbalance.
    """

    angle_rad: float
    speed_rad_s: float
    load_y_m_s2: float = 0.0
    load_z_m_s2: float = 0.0
    angular_acceleration_rad_s2: float = 0.0
    crack_stiffness_ratio: float | None = None
    cage_angle_rad: float | None = None
    force_y_n: float = 0.0
    force_z_n: float = 0.0


def phase(y: ArrayLike, z: ArrayLike, convention: PhaseConvention = 'atan2_z_y') -> Array:
    """Return phi of the disk's displacement (y, z) in rad; 0 at rest.

    `atan2_z_y` is the true polar angle; `arctan_y_over_z` (principal value) and `atan2_y_z` are
    readings of the paper's unreadable print.
    """
    y, z = np.asarray(y, np.float64), np.asarray(z, np.float64)
    if convention == 'atan2_z_y':
        return np.asarray(np.arctan2(z, y))
    phi = np.arctan2(y, z)
    if convention == 'arctan_y_over_z':
        # the same line through the origin, with z >= 0
        phi = np.where(z < 0.0, np.arctan2(-y, -z), phi)
    return np.asarray(np.where((y == 0.0) & (z == 0.0), 0.0, phi))


def breathing(
    theta: ArrayLike, half_angle: float, convention: ThetaConvention = 'continuous'
) -> Array:
    """Return how far the crack is open, f in 0..1, at theta = w t + beta - phi (rad), eq. (4).

    `continuous` wraps theta into (-pi/2 + alpha, 3pi/2 + alpha]; the other two take theta mod 2pi
    and differ past 3pi/2 + alpha, where eq. (4) says nothing: `gap_open` has f = 0 there,
    `last_branch` continues the last branch. NaN stays NaN.
    """
    theta = np.asarray(theta, np.float64)
    low = half_angle - 0.5 * np.pi if convention == 'continuous' else 0.0
    wrapped = theta - 2.0 * np.pi * np.floor((theta - low) / (2.0 * np.pi))
    rate = 0.5 * np.pi / half_angle
    closing = 0.5 * (1.0 + np.cos((wrapped - 0.5 * np.pi + half_angle) * rate))
    opening = 0.5 * (1.0 + np.cos((wrapped - 1.5 * np.pi - half_angle) * rate))
    if convention == 'gap_open':
        opening = np.where(wrapped > 1.5 * np.pi + half_angle, 0.0, opening)
    f = np.select(
        [
            wrapped <= 0.5 * np.pi - half_angle,
            wrapped <= 0.5 * np.pi + half_angle,
            wrapped <= 1.5 * np.pi - half_angle,
        ],
        [np.ones_like(wrapped), closing, np.zeros_like(wrapped)],
        opening,
    )
    return np.asarray(np.where(np.isnan(theta), np.nan, f))


def crack_opening(
    parameters: RotorParameters, y: ArrayLike, z: ArrayLike, angle_rad: float
) -> Array:
    """Return f for the disk at (y, z) in m and the shaft at `angle_rad`: eq. (4) after phase."""
    theta = angle_rad + parameters.crack_angle_rad - phase(y, z, parameters.phase_convention)
    return breathing(theta, parameters.crack_half_angle_rad, parameters.theta_convention)


def stiffness(
    parameters: RotorParameters, opening: ArrayLike, angle_rad: float, lost_n_m: float
) -> Array:
    """Return the (..., 2, 2) stiffness of one side of the shaft in N/m, eq. (3a-c).

    `opening` is f, `lost_n_m` the stiffness dk (times its scale) that the open crack takes away.
    """
    psi = angle_rad + parameters.crack_angle_rad
    c, s = np.cos(psi), np.sin(psi)
    coupling = -parameters.coupling_sign * s * c
    shape = np.array([[c * c, coupling], [coupling, s * s]])
    lost = lost_n_m * np.asarray(opening)[..., None, None] * shape
    return np.asarray(parameters.shaft_stiffness_n_m * np.eye(2) - lost)


def ball_angles(parameters: RotorParameters, cage_angle_rad: float) -> Array:
    """Return the angles of the balls in rad, 2 pi (j - 1)/N_b + cage angle."""
    count = parameters.ball_count
    return np.asarray(2.0 * np.pi * np.arange(count) / count + cage_angle_rad)


def contact_force(
    parameters: RotorParameters, displacement: ArrayLike, cage_angle_rad: float
) -> Array:
    """Return the force (..., 2) in N of a bearing on its journal, eq. (2).

    `displacement` (..., 2) is y, z of the journal in m; the force points against it, and is zero
    as long as no ball is pressed by more than the clearance.
    """
    balls = ball_angles(parameters, cage_angle_rad)
    c, s = np.cos(balls), np.sin(balls)
    pressed = _pressed(displacement, c, s, parameters.clearance_m)
    load = parameters.contact_stiffness_n_m15 * np.maximum(pressed, 0.0) ** 1.5
    return np.stack([-(load * c).sum(axis=-1), -(load * s).sum(axis=-1)], axis=-1)


def _pressed(displacement: ArrayLike, c: Array, s: Array, clearance_m: float) -> Array:
    # plain sums, no matrix product: BLAS may round differently from call to call
    yz = np.asarray(displacement, np.float64)
    return np.asarray(yz[..., :1] * c + yz[..., 1:] * s - clearance_m)


def acceleration(parameters: RotorParameters, state: ArrayLike, drive: Drive) -> Array:
    """Return the six accelerations (..., 6) in m/s^2 of y, z, y1, z1, y2, z2, eq. (5a-f)."""
    p = parameters
    state = np.asarray(state, np.float64)
    x = state[..., :6].reshape(*state.shape[:-1], 3, 2)
    v = state[..., 6:].reshape(*state.shape[:-1], 3, 2)
    angle, speed = drive.angle_rad, drive.speed_rad_s
    ratio = p.crack_stiffness_ratio
    if drive.crack_stiffness_ratio is not None:
        ratio = drive.crack_stiffness_ratio
    cage = p.cage_ratio * angle if drive.cage_angle_rad is None else drive.cage_angle_rad

    opening = crack_opening(p, x[..., 0, 0], x[..., 0, 1], angle)
    lost = ratio * p.shaft_stiffness_n_m
    at_disk = stiffness(p, opening, angle, p.crack_scale * lost)
    at_bearing = stiffness(p, opening, angle, p.bearing_crack_scale * lost)
    damping = 2.0 * p.damping_ratio * p.disk_mass_kg * speed
    load = p.load_scale * np.array([drive.load_y_m_s2, drive.load_z_m_s2])

    bend = 2.0 * x[..., 0, :] - x[..., 1, :] - x[..., 2, :]
    bend_rate = 2.0 * v[..., 0, :] - v[..., 1, :] - v[..., 2, :]
    c, s = np.cos(angle), np.sin(angle)
    slope = drive.angular_acceleration_rad_s2
    unbalance = p.eccentricity_m * np.array([speed**2 * c + slope * s, speed**2 * s - slope * c])
    force = np.array([drive.force_y_n, drive.force_z_n])
    elastic = damping * bend_rate + _times(at_disk, bend)
    disk = unbalance + load + (force - elastic) / p.disk_mass_kg

    accelerations = [disk]
    for i in (1, 2):
        shaft = damping * (v[..., 0, :] - v[..., i, :])
        shaft = shaft + _times(at_bearing, x[..., 0, :] - x[..., i, :])
        contact = contact_force(p, x[..., i, :], cage)
        accelerations.append((shaft + contact) / p.bearing_mass_kg + load)
    return np.concatenate(accelerations, axis=-1)


def _times(matrix: Array, vector: Array) -> Array:
    return np.asarray((matrix * vector[..., None, :]).sum(axis=-1))


def derivative(parameters: RotorParameters, state: ArrayLike, drive: Drive) -> Array:
    """Return d(state)/dt (..., 12) in m/s and m/s^2."""
    state = np.asarray(state, np.float64)
    return np.concatenate([state[..., 6:], acceleration(parameters, state, drive)], axis=-1)


def rk4_step(
    parameters: RotorParameters,
    state: ArrayLike,
    time_s: float,
    step_s: float,
    drive_at: Callable[[float], Drive],
) -> Array:
    """Return the state one classical Runge-Kutta step later; `drive_at` takes the time in s."""
    state = np.asarray(state, np.float64)
    half = 0.5 * step_s
    middle = drive_at(time_s + half)
    k1 = derivative(parameters, state, drive_at(time_s))
    k2 = derivative(parameters, state + half * k1, middle)
    k3 = derivative(parameters, state + half * k2, middle)
    k4 = derivative(parameters, state + step_s * k3, drive_at(time_s + step_s))
    return np.asarray(state + step_s / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4))


def energy(parameters: RotorParameters, state: ArrayLike, drive: Drive) -> Array:
    """Return the mechanical energy (...) in J of the uncracked rotor in the load's potential.

    Kinetic + elastic (shaft, Hertz contact) + load potential, zero at rest at the origin. It is
    conserved for K = e = xi = 0 at speed 0; a turning cage does work on it.
    """
    p = parameters
    state = np.asarray(state, np.float64)
    x = state[..., :6].reshape(*state.shape[:-1], 3, 2)
    v = state[..., 6:].reshape(*state.shape[:-1], 3, 2)
    mass = np.array([p.disk_mass_kg, p.bearing_mass_kg, p.bearing_mass_kg])[:, None]
    load = p.load_scale * np.array([drive.load_y_m_s2, drive.load_z_m_s2])
    cage = drive.cage_angle_rad
    balls = ball_angles(p, p.cage_ratio * drive.angle_rad if cage is None else cage)
    pressed = _pressed(x[..., 1:, :], np.cos(balls), np.sin(balls), p.clearance_m)
    hertz = 0.4 * p.contact_stiffness_n_m15 * np.maximum(pressed, 0.0) ** 2.5
    bend = x[..., :1, :] - x[..., 1:, :]
    total = (0.5 * mass * v**2 - mass * load * x).sum(axis=(-2, -1))
    total += 0.5 * p.shaft_stiffness_n_m * (bend**2).sum(axis=(-2, -1))
    return np.asarray(total + hertz.sum(axis=(-2, -1)))
