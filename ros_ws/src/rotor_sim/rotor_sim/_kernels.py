# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: PLR0917 - compiled functions take no keyword-only arguments
"""The equations of `model` and classical RK4, compiled; one trajectory, scalar code.

Conventions: float64, C order, SI. No fastmath: NaN stays NaN, and no term is reassociated, so the
same input gives the same bits whatever the block size. `cache=True` keeps the machine code on
disk; every callee stands at module level (a closure would miss the cache).

Coefficients (`pack` makes them): see the P_ indices. Drive: per sample the values at its start and
their increment over the sample, so that a jump at a sample never reaches into the one before.
"""

import math
from collections.abc import Callable
from typing import Any, Protocol, TypeVar

import numba
import numpy as np
from numpy.typing import NDArray

from rotor_sim.parameters import RotorParameters

Array = NDArray[np.float64]
Function = TypeVar('Function', bound=Callable[..., Any])

(
    P_STIFFNESS_DISK,
    P_STIFFNESS_BEARING,
    P_CRACK_DISK,
    P_CRACK_BEARING,
    P_COUPLING,
    P_DAMPING_DISK,
    P_DAMPING_BEARING,
    P_ECCENTRICITY,
    P_CONTACT,
    P_CLEARANCE,
    P_LOAD_SCALE,
    P_COS_CRACK,
    P_SIN_CRACK,
    P_CRACK_ANGLE,
    P_HALF_ANGLE,
    P_PHASE,
    P_THETA,
    P_CAGE_RATIO,
) = range(18)
_PHASES = ('atan2_z_y', 'arctan_y_over_z', 'atan2_y_z')
_THETAS = ('continuous', 'gap_open', 'last_branch')

Instant = tuple[float, float, float, float, float, float, float, float, float, float]
"""Angle, cos, sin; cos, sin of the cage; speed, angular acceleration; crack; load y, z."""

OUTPUTS = 12
"""Columns of a sampled row: six displacements, four bearing accelerations, load y and z."""

_HALF_PI = 0.5 * math.pi
_TWO_PI = 2.0 * math.pi


class _Decorator(Protocol):
    def __call__(self, function: Function, /) -> Function: ...


_OPTIONS: dict[str, Any] = {'cache': True, 'fastmath': False, 'error_model': 'numpy'}
_jit: _Decorator = numba.njit(**_OPTIONS)
_inline: _Decorator = numba.njit(**_OPTIONS, forceinline=True)


def pack(parameters: RotorParameters) -> tuple[Array, Array]:
    """Return the coefficients of the kernel and the (2, N_b) cosines and sines of the balls."""
    p = parameters
    coefficients = np.empty(18)
    k, m, m_b = p.shaft_stiffness_n_m, p.disk_mass_kg, p.bearing_mass_kg
    coefficients[P_STIFFNESS_DISK] = k / m
    coefficients[P_STIFFNESS_BEARING] = k / m_b
    coefficients[P_CRACK_DISK] = p.crack_scale * k / m
    coefficients[P_CRACK_BEARING] = p.bearing_crack_scale * k / m_b
    coefficients[P_COUPLING] = -p.coupling_sign
    coefficients[P_DAMPING_DISK] = 2.0 * p.damping_ratio
    coefficients[P_DAMPING_BEARING] = 2.0 * p.damping_ratio * m / m_b
    coefficients[P_ECCENTRICITY] = p.eccentricity_m
    coefficients[P_CONTACT] = p.contact_stiffness_n_m15 / m_b
    coefficients[P_CLEARANCE] = p.clearance_m
    coefficients[P_LOAD_SCALE] = p.load_scale
    coefficients[P_COS_CRACK] = math.cos(p.crack_angle_rad)
    coefficients[P_SIN_CRACK] = math.sin(p.crack_angle_rad)
    coefficients[P_CRACK_ANGLE] = p.crack_angle_rad
    coefficients[P_HALF_ANGLE] = p.crack_half_angle_rad
    coefficients[P_PHASE] = _PHASES.index(p.phase_convention)
    coefficients[P_THETA] = _THETAS.index(p.theta_convention)
    coefficients[P_CAGE_RATIO] = p.cage_ratio
    balls = 2.0 * np.pi * np.arange(p.ball_count) / p.ball_count
    return coefficients, np.stack([np.cos(balls), np.sin(balls)])


@_inline
def _phase(y: float, z: float, convention: float) -> float:
    if y == 0.0 and z == 0.0:
        return 0.0
    if convention == 0.0:
        return math.atan2(z, y)
    if convention == 1.0 and z < 0.0:
        return math.atan2(-y, -z)
    return math.atan2(y, z)


@_inline
def _breathing(theta: float, half_angle: float, convention: float) -> float:
    low = half_angle - _HALF_PI if convention == 0.0 else 0.0
    wrapped = theta - _TWO_PI * math.floor((theta - low) / _TWO_PI)
    if wrapped <= _HALF_PI - half_angle:
        return 1.0
    if wrapped <= _HALF_PI + half_angle:
        return 0.5 * (1.0 + math.cos((wrapped - _HALF_PI + half_angle) * _HALF_PI / half_angle))
    if wrapped <= 3.0 * _HALF_PI - half_angle:
        return 0.0
    if convention == 1.0 and wrapped > 3.0 * _HALF_PI + half_angle:
        return 0.0
    return 0.5 * (1.0 + math.cos((wrapped - 3.0 * _HALF_PI - half_angle) * _HALF_PI / half_angle))


@_inline
def _contact(
    y: float, z: float, cos_cage: float, sin_cage: float, clearance: float, balls: Array
) -> tuple[float, float]:
    """Sum of pressed^1.5 (cos, sin) over the balls, in the frame of the rotor."""
    # in the frame of the cage the balls stand still: two rotations instead of one per ball
    along = y * cos_cage + z * sin_cage
    across = z * cos_cage - y * sin_cage
    force_along = 0.0
    force_across = 0.0
    for j in range(balls.shape[1]):
        pressed = along * balls[0, j] + across * balls[1, j] - clearance
        if pressed > 0.0:
            load = pressed * math.sqrt(pressed)
            force_along += load * balls[0, j]
            force_across += load * balls[1, j]
    return (
        force_along * cos_cage - force_across * sin_cage,
        force_along * sin_cage + force_across * cos_cage,
    )


@_inline
def _accelerations(p: Array, balls: Array, state: Array, drive: Instant, out: Array) -> None:
    """Write the velocities to out[0:6] and the accelerations to out[6:12], eq. (5a-f)."""
    angle, cos_angle, sin_angle, cos_cage, sin_cage, speed, slope, crack, load_y, load_z = drive
    cos_psi = cos_angle * p[P_COS_CRACK] - sin_angle * p[P_SIN_CRACK]
    sin_psi = sin_angle * p[P_COS_CRACK] + cos_angle * p[P_SIN_CRACK]
    theta = angle + p[P_CRACK_ANGLE] - _phase(state[0], state[1], p[P_PHASE])
    open_part = crack * _breathing(theta, p[P_HALF_ANGLE], p[P_THETA])
    lost_yy = open_part * cos_psi * cos_psi
    lost_zz = open_part * sin_psi * sin_psi
    lost_yz = open_part * sin_psi * cos_psi * p[P_COUPLING]

    bend_y = 2.0 * state[0] - state[2] - state[4]
    bend_z = 2.0 * state[1] - state[3] - state[5]
    k, lost = p[P_STIFFNESS_DISK], p[P_CRACK_DISK]
    c = p[P_DAMPING_DISK] * speed
    gravity_y = p[P_LOAD_SCALE] * load_y
    gravity_z = p[P_LOAD_SCALE] * load_z
    out[6] = (
        p[P_ECCENTRICITY] * (speed * speed * cos_angle + slope * sin_angle)
        + gravity_y
        - c * (2.0 * state[6] - state[8] - state[10])
        - k * bend_y
        + lost * (lost_yy * bend_y + lost_yz * bend_z)
    )
    out[7] = (
        p[P_ECCENTRICITY] * (speed * speed * sin_angle - slope * cos_angle)
        + gravity_z
        - c * (2.0 * state[7] - state[9] - state[11])
        - k * bend_z
        + lost * (lost_yz * bend_y + lost_zz * bend_z)
    )
    k, lost = p[P_STIFFNESS_BEARING], p[P_CRACK_BEARING]
    c = p[P_DAMPING_BEARING] * speed
    for i in (2, 4):
        force_y, force_z = _contact(
            state[i], state[i + 1], cos_cage, sin_cage, p[P_CLEARANCE], balls
        )
        rise_y = state[0] - state[i]
        rise_z = state[1] - state[i + 1]
        out[i + 6] = (
            k * rise_y
            - lost * (lost_yy * rise_y + lost_yz * rise_z)
            + c * (state[6] - state[i + 6])
            - p[P_CONTACT] * force_y
            + gravity_y
        )
        out[i + 7] = (
            k * rise_z
            - lost * (lost_yz * rise_y + lost_zz * rise_z)
            + c * (state[7] - state[i + 7])
            - p[P_CONTACT] * force_z
            + gravity_z
        )
    for i in range(6):
        out[i] = state[6 + i]


@_inline
def _instant(
    half: int,
    halves: int,
    rate_hz: int,
    sample_s: float,
    motion: tuple[float, float, float, float, float, float],
    cage_ratio: float,
    grid: Array,
    position: int,
    load_rate_hz: int,
) -> Instant:
    """Return what acts on the rotor `half` of `halves` after a sample.

    `motion` is angle, cage angle, speed and its increment, crack and its increment at the sample;
    `position` is the sample on the load grid, in units of 1/(rate halves load rate).
    """
    angle, cage, speed, speed_increment, crack, crack_increment = motion
    u = half / halves
    turned = u * (speed + 0.5 * u * speed_increment) * sample_s
    angle += turned
    cage += cage_ratio * turned
    denominator = halves * rate_hz
    place = position + half * load_rate_hz
    index = place // denominator
    part = (place - index * denominator) / denominator
    load_y, load_z = grid[index, 0], grid[index, 1]
    if part > 0.0:  # the last point of the grid has no successor
        load_y += (grid[index + 1, 0] - load_y) * part
        load_z += (grid[index + 1, 1] - load_z) * part
    return (
        angle,
        math.cos(angle),
        math.sin(angle),
        math.cos(cage),
        math.sin(cage),
        speed + u * speed_increment,
        speed_increment / sample_s,
        crack + u * crack_increment,
        load_y,
        load_z,
    )


@_jit
def integrate(
    p: Array,
    balls: Array,
    state: Array,
    out: Array,
    rate_hz: int,
    sample_s: float,
    substeps: int,
    first_sample: int,
    angle: Array,
    cage: Array,
    speed: Array,
    speed_increment: Array,
    crack: Array,
    crack_increment: Array,
    grid: Array,
    grid_first: int,
    load_rate_hz: int,
) -> None:
    """Integrate out.shape[0] samples of `substeps` RK4 steps; advances `state` in place.

    Args:
        p: coefficients, see `pack`.
        balls: (2, N_b), see `pack`.
        state: (12,), at the first sample; at return at the sample after the last.
        out: (n, 12), filled with each sample's row (see OUTPUTS), accelerations from the equations.
        rate_hz: samples per second, for the place on the load grid.
        sample_s: 1/rate_hz in s.
        substeps: steps per sample.
        first_sample: absolute index; may be negative only where `grid` is constant.
        angle: (n,) shaft angle at each sample in rad, reduced to one turn.
        cage: (n,) cage angle at each sample in rad, likewise.
        speed: (n,) at each sample in rad/s.
        speed_increment: (n,) change of the speed over the sample, which is linear.
        crack: (n,) crack stiffness ratio at each sample.
        crack_increment: (n,) likewise.
        grid: (points, 2) load in m/s^2, linear between points.
        grid_first: index of the point in row 0 of `grid`.
        load_rate_hz: grid points per second.

    """
    step = sample_s / substeps
    halves = 2 * substeps
    ratio = p[P_CAGE_RATIO]
    origin = grid_first * halves * rate_hz
    trial, k1, k2 = np.empty(12), np.empty(12), np.empty(12)
    k3, k4 = np.empty(12), np.empty(12)
    for n in range(out.shape[0]):
        motion = (angle[n], cage[n], speed[n], speed_increment[n], crack[n], crack_increment[n])
        position = (first_sample + n) * halves * load_rate_hz - origin
        start = _instant(0, halves, rate_hz, sample_s, motion, ratio, grid, position, load_rate_hz)
        for half in range(0, halves, 2):
            middle = _instant(
                half + 1, halves, rate_hz, sample_s, motion, ratio, grid, position, load_rate_hz
            )
            end = _instant(
                half + 2, halves, rate_hz, sample_s, motion, ratio, grid, position, load_rate_hz
            )
            _accelerations(p, balls, state, start, k1)
            if half == 0:
                out[n, :6] = state[:6]
                out[n, 6:10] = k1[8:]
                out[n, 10] = start[8]
                out[n, 11] = start[9]
            for i in range(12):
                trial[i] = state[i] + 0.5 * step * k1[i]
            _accelerations(p, balls, trial, middle, k2)
            for i in range(12):
                trial[i] = state[i] + 0.5 * step * k2[i]
            _accelerations(p, balls, trial, middle, k3)
            for i in range(12):
                trial[i] = state[i] + step * k3[i]
            _accelerations(p, balls, trial, end, k4)
            for i in range(12):
                state[i] += step / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
            start = end
