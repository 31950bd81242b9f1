# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Many rotors at constant speed and load, integrated side by side: the face of `_lanes`."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor_common.constants import GRAVITY_M_S2, LANES
from rotor_dynamics import _lanes
from rotor_dynamics.errors import AnalysisError
from rotor_sim.plant.breathing import breathing_polynomial
from rotor_sim.plant.parameters import RotorParameters

Array = NDArray[np.float64]

FIXED_START = (4.0, 0.1, 1.3, 0.0, 1.3, 0.0)
"""The start of the reference values, Y, Z, Y1, Z1, Y2, Z2 over the static deflection, at rest."""

LARGEST_STEP = 1.25
"""Largest step times fastest mode. RK4 is stable to 2.8; beyond this it damps the bearing's modes
by more than the model does. N = 256 stands down to 140 rad/s, N = 128 down to 280."""

FEWEST_STEPS = 128
FEWEST_STEPS_WITH_CLEARANCE = 256
"""Steps a revolution below which results are wrong: balls that leave and hit the race need more
(docs/physics.md)."""

MOST_STEPS = 2**17
STEPS_MULTIPLE = 64
"""Steps a revolution are a multiple of this, so that so many samples of it can be recorded."""

_FEW = 4
"""Up to so many trajectories are cheaper one by one than in a group of 16 lanes."""

_POLYNOMIAL_TERMS = 24
_POLYNOMIAL_ERROR = 1e-10


@dataclass(frozen=True)
class OperatingPoint:
    """A rotor at constant speed (rad/s) under a constant load factor G: load_y = G * 9.81 m/s^2."""

    parameters: RotorParameters
    speed_rad_s: float
    load_factor: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.speed_rad_s) and 1.0 <= self.speed_rad_s <= 1e4):
            raise AnalysisError(
                f'speed_rad_s = {self.speed_rad_s:g} rad/s is out of range; allowed: 1 to 1e4 '
                '(a rotor at rest has no revolution to sample)'
            )
        if not (math.isfinite(self.load_factor) and abs(self.load_factor) <= 20.0):
            raise AnalysisError(
                f'load_factor = {self.load_factor:g} is out of range; allowed: -20 to 20'
            )

    @property
    def load_m_s2(self) -> float:
        """Apparent gravity along y, m/s^2."""
        return self.load_factor * GRAVITY_M_S2


def fixed_start(parameters: RotorParameters) -> Array:
    """Return FIXED_START as a state (12,) in m and m/s: the start of every point by default."""
    return np.array([*FIXED_START, *(0.0,) * 6]) * parameters.length_scale_m


def checked_start(initial_state: ArrayLike | None) -> Array | None:
    """Return a start as 12 numbers in SI, None for the fixed one; AnalysisError for others."""
    if initial_state is None:
        return None
    start = np.asarray(initial_state, np.float64)
    if start.shape != (12,) or not np.isfinite(start).all():
        raise AnalysisError(
            f'initial_state has the shape {start.shape}; give 12 finite numbers: y, z, y1, z1, '
            'y2, z2 in m and their time derivatives in m/s'
        )
    return start


def check_breathing(point: OperatingPoint) -> None:
    """Raise AnalysisError for a crack whose breathing the kernel cannot take."""
    if not kernel_of(point)[1]:
        _breathing(point.parameters)


def steps_needed(point: OperatingPoint, steps_per_revolution: int) -> int:
    """Return the steps a revolution that resolve the bearing's modes: N times 1, 2, 4, ...

    Slow revolutions take longer and need more steps. Raises AnalysisError where N is too small
    for what the rotor does within a revolution.
    """
    clearance = point.parameters.clearance_m
    fewest = FEWEST_STEPS_WITH_CLEARANCE if clearance > 0.0 else FEWEST_STEPS
    if not fewest <= steps_per_revolution <= MOST_STEPS or steps_per_revolution % STEPS_MULTIPLE:
        why = f' with clearance_m = {clearance:g} m' if clearance > 0.0 else ''
        raise AnalysisError(
            f'steps_per_revolution = {steps_per_revolution} does not serve{why}; '
            f'allowed: multiples of {STEPS_MULTIPLE} from {fewest} to {MOST_STEPS}'
        )
    mode = point.parameters.fastest_mode_rad_s
    doublings = math.log2(2.0 * math.pi * mode / (point.speed_rad_s * steps_per_revolution))
    return steps_per_revolution << max(math.ceil(doublings - math.log2(LARGEST_STEP)), 0)


def kernel_of(point: OperatingPoint) -> tuple[int, bool]:
    """Return what trajectories must share to stand side by side: balls, and whether alpha is 30.

    alpha = 30 degrees, the paper's, has a closed form; other angles take a polynomial.
    """
    p = point.parameters
    return p.ball_count, abs(p.crack_half_angle_rad - math.pi / 6.0) < 1e-12


def _breathing(p: RotorParameters) -> Array:
    """Return the polynomial of `_lanes`; AnalysisError where none describes the breathing."""
    polynomial, error = breathing_polynomial(
        p.crack_half_angle_rad, _POLYNOMIAL_TERMS, continued=p.theta_convention == 'last_branch'
    )
    if not error <= _POLYNOMIAL_ERROR:
        raise AnalysisError(
            f'crack_half_angle_rad = {p.crack_half_angle_rad:g} is too narrow for theta_convention '
            "'last_branch' in an analysis; use 0.3 to 1.57, or another convention"
        )
    return polynomial


class Ensemble:
    """Trajectories of operating points, advanced together; the neighbours have no influence.

    All points must agree in `kernel_of`, and all take `steps_per_revolution` as it is. States are
    (n, 12) in m and m/s: y, z (disk), y1, z1, y2, z2 (bearings) and their time derivatives, in
    frame `rotor`. The shaft stands at angle 0 whenever control returns; `revolution` counts, since
    the cage goes on turning. A trajectory that diverges becomes infinite or NaN, silently. Up to
    4 trajectories and more run by different machine code: results then differ by rounding.
    """

    def __init__(
        self,
        points: Sequence[OperatingPoint],
        steps_per_revolution: int,
        states: ArrayLike | None = None,
        revolution: int = 0,
    ) -> None:
        kernels = {kernel_of(point) for point in points}
        if len(kernels) != 1:
            raise AnalysisError(
                f'{len(points)} points of {len(kernels)} kinds; points side by side need the same '
                'ball_count, and all or none of them the crack_half_angle_rad pi/6'
            )
        ((balls, closed_form),) = kernels
        self.points = tuple(points)
        self.revolution = revolution
        self._speed = np.array([point.speed_rad_s for point in points])
        directions = balls // 2 if balls % 2 == 0 else balls
        self._balls = (0,) * directions
        self._terms = () if closed_form else (0,) * _POLYNOMIAL_TERMS
        self._lanes = (0,) * (1 if len(points) <= _FEW else LANES)
        self._rows = _lanes.BALLS + 2 * directions + len(self._terms)
        groups = -(-len(points) // len(self._lanes))
        self._buffer = np.empty((groups, self._rows, len(self._lanes)))
        half_steps = np.arange(2 * steps_per_revolution + 1) * (math.pi / steps_per_revolution)
        self._cosines, self._sines = np.cos(half_steps), np.sin(half_steps)
        step = 2.0 * math.pi / steps_per_revolution
        columns = [_coefficients(point, step, directions, len(self._terms)) for point in points]
        self._set(slice(_lanes.COS_CAGE, self._rows), np.array(columns))
        self.states = (
            np.array([fixed_start(point.parameters) for point in points])
            if states is None
            else np.asarray(states, np.float64)
        )

    @property
    def states(self) -> Array:
        """The states (n, 12) in m and m/s; may be set."""
        return self._get(slice(_lanes.STATE, _lanes.STATE + 12)) * self._scale(self._speed)

    @states.setter
    def states(self, states: Array) -> None:
        rows = np.broadcast_to(states, (len(self.points), 12)) / self._scale(self._speed)
        self._set(slice(_lanes.STATE, _lanes.STATE + 12), rows)

    def advance(self, revolutions: int, samples_per_revolution: int = 0) -> Array:
        """Go on by whole revolutions; return y, z (m), y', z' (m/s) of the disk (n, samples, 4).

        The first sample is the state at the start; samples_per_revolution divides the steps.
        """
        return self._run(revolutions, samples_per_revolution, (), saltation=False)

    def advance_tangents(
        self, tangents: ArrayLike, revolutions: int = 1, *, saltation: bool = True
    ) -> Array:
        """Go on with one tangent (n, 12) a trajectory; return the tangents at the end.

        Positions in m and derivatives by tau in m/rad. `saltation`: whether a tangent jumps where
        the right-hand side does, which the true linearisation asks for.
        """
        tangents = np.broadcast_to(np.asarray(tangents, np.float64), (len(self.points), 12))
        self._set(slice(_lanes.TANGENT, _lanes.TANGENT + 12), tangents)
        self._run(revolutions, 0, (0,), saltation=saltation)
        return self._get(slice(_lanes.TANGENT, _lanes.TANGENT + 12))

    def _run(
        self, revolutions: int, samples: int, tangent: tuple[int, ...], *, saltation: bool
    ) -> Array:
        steps = len(self._cosines) // 2
        if samples and steps % samples:
            raise AnalysisError(
                f'samples_per_revolution = {samples} does not divide the {steps} steps'
            )
        groups, _, lanes = self._buffer.shape
        out = np.empty((groups, revolutions * samples, _lanes.QUANTITIES, lanes))
        _lanes.advance(
            self._buffer.reshape(-1),
            self._rows,
            self._lanes,
            tangent,
            saltation,
            self.revolution,
            revolutions,
            self._cosines,
            self._sines,
            self._balls,
            self._terms,
            steps // samples if samples else 0,
            out,
        )
        self.revolution += revolutions
        record = out.transpose(0, 3, 1, 2).reshape(groups * lanes, -1, _lanes.QUANTITIES)
        record = record[: len(self.points)]
        record[..., 2:] *= self._speed[:, np.newaxis, np.newaxis]
        return record

    @staticmethod
    def _scale(speed: Array) -> Array:
        """Return what turns m and m/rad into m and m/s, (n, 12)."""
        return np.repeat(np.stack([np.ones_like(speed), speed], axis=1), 6, axis=1)

    def _get(self, rows: slice) -> Array:
        part = self._buffer[:, rows].transpose(0, 2, 1)
        return part.reshape(-1, part.shape[-1])[: len(self.points)].copy()

    def _set(self, rows: slice, values: Array) -> None:
        # spare lanes repeat the last trajectory: anything finite would do
        groups, _, lanes = self._buffer.shape
        padded = np.concatenate([values, values[-1:].repeat(groups * lanes - len(values), axis=0)])
        self._buffer[:, rows] = padded.reshape(groups, lanes, -1).transpose(0, 2, 1)


def _coefficients(point: OperatingPoint, step_rad: float, directions: int, terms: int) -> Array:
    """Return the rows of one lane from COS_CAGE on: eq. (5) over w^2."""
    p, speed = point.parameters, point.speed_rad_s
    stiffness, square = p.shaft_stiffness_n_m, speed * speed
    disk, bearing = p.disk_mass_kg * square, p.bearing_mass_kg * square
    lost = p.crack_stiffness_ratio * stiffness
    edge = math.sin(p.crack_half_angle_rad)
    continued = p.theta_convention == 'last_branch'
    values = {
        _lanes.COS_CAGE: 1.0,
        _lanes.SIN_CAGE: 0.0,
        _lanes.COS_CAGE_STEP: math.cos(0.5 * step_rad * p.cage_ratio),
        _lanes.SIN_CAGE_STEP: math.sin(0.5 * step_rad * p.cage_ratio),
        _lanes.CAGE_RATIO: p.cage_ratio,
        _lanes.STIFFNESS_DISK: stiffness / disk,
        _lanes.STIFFNESS_BEARING: stiffness / bearing,
        _lanes.CRACK_DISK: p.crack_scale * lost / disk,
        _lanes.CRACK_BEARING: p.bearing_crack_scale * lost / bearing,
        _lanes.COUPLING: -float(p.coupling_sign),
        _lanes.DAMPING_DISK: 2.0 * p.damping_ratio,
        _lanes.DAMPING_BEARING: 2.0 * p.damping_ratio * p.disk_mass_kg / p.bearing_mass_kg,
        _lanes.ECCENTRICITY: p.eccentricity_m,
        _lanes.CONTACT: p.contact_stiffness_n_m15 / bearing,
        _lanes.CLEARANCE: p.clearance_m,
        _lanes.CLEARANCE_BEHIND: p.clearance_m if p.ball_count % 2 == 0 else math.inf,
        _lanes.LOAD: p.load_scale * point.load_m_s2 / square,
        _lanes.COS_CRACK: math.cos(p.crack_angle_rad),
        _lanes.SIN_CRACK: math.sin(p.crack_angle_rad),
        _lanes.PHASE_FROM_Z: float(p.phase_convention != 'atan2_z_y'),
        _lanes.PHASE_FLIP: -1.0 if p.phase_convention == 'arctan_y_over_z' else 1.0,
        _lanes.SIN_HALF_ANGLE: edge,
        _lanes.HIGHEST_COSINE: 1.0 if continued else edge,
        _lanes.GAP: float(p.theta_convention != 'gap_open'),
        _lanes.JUMPS: float(p.theta_convention != 'continuous'),
        _lanes.REGION: 0.0,
        _lanes.NEXT_REGION: 0.0,
    }
    angles = 2.0 * np.pi * np.arange(directions) / p.ball_count
    polynomial = _breathing(p) if terms else np.empty(0)
    rows = [values[row] for row in range(_lanes.COS_CAGE, _lanes.BALLS)]
    return np.concatenate([rows, np.cos(angles), np.sin(angles), polynomial])
