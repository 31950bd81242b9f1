# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Many rotors at constant speed and load, integrated side by side over whole revolutions."""

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor_common.constants import GRAVITY_M_S2, LANES
from rotor_dynamics.errors import AnalysisError
from rotor_sim.plant.compiled_plant import CompiledPlant
from rotor_sim.plant.hou2016 import hou2016
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


@functools.lru_cache(maxsize=4096)
def _compiled(parameters: RotorParameters) -> CompiledPlant:
    return CompiledPlant(hou2016(parameters))


def plant_of(point: OperatingPoint) -> CompiledPlant:
    """Return the rotor of a point as a plant with its engine."""
    return _compiled(point.parameters)


def engine_of(point: OperatingPoint) -> str:
    """Return the text of a point's engine: trajectories side by side must share it."""
    p = point.parameters
    return _engine(p.ball_count, p.crack_half_angle_rad, p.theta_convention == 'last_branch')


@functools.lru_cache(maxsize=4096)
def _engine(ball_count: int, crack_half_angle_rad: float, is_continued: bool) -> str:
    """Return the engine by what decides it: a map has very many points of one engine."""
    parameters = RotorParameters.hou2016(
        'figure' if is_continued else 'derived',
        ball_count=ball_count,
        crack_half_angle_rad=crack_half_angle_rad,
    )
    return _compiled(parameters).engine.text


class Ensemble:
    """Trajectories of operating points, advanced together; the neighbours have no influence.

    All points must agree in `engine_of`, and all take `steps_per_revolution` as it is. States are
    (n, 2m) in m and m/s: the displacements of the m degrees of freedom in the order of the plant's
    `coordinates`, then their time derivatives, in frame `rotor`; for the rotor of Hou et al. y, z
    (disk), y1, z1, y2, z2 (bearings). The shaft stands at angle 0 whenever control returns;
    `revolution` counts, since the cage goes on turning. A trajectory that diverges becomes
    infinite or NaN, silently. How many stand side by side does not change the bits.
    """

    def __init__(
        self,
        points: Sequence[OperatingPoint],
        steps_per_revolution: int,
        states: ArrayLike | None = None,
        revolution: int = 0,
    ) -> None:
        plants = [plant_of(point) for point in points]
        kinds = len({plant.engine.text for plant in plants})
        if kinds != 1:
            raise AnalysisError(
                f'{len(points)} points of {kinds} kinds; points side by side need rotors of the '
                'same elements, ball_count, and crack_half_angle_rad pi/6 for all or none of them'
            )
        self.points = tuple(points)
        self.revolution = revolution
        self._plant = plants[0]
        self._speed = np.array([point.speed_rad_s for point in points])
        self._lanes = (0,) * (1 if len(points) <= _FEW else LANES)
        self._rows = self._plant.engine.rows
        height = self._rows.coefficients + len(self._plant.coefficients)
        groups = -(-len(points) // len(self._lanes))
        self._buffer = np.zeros((groups, height, len(self._lanes)))
        half_steps = np.arange(2 * steps_per_revolution + 1) * (math.pi / steps_per_revolution)
        self._cosines, self._sines = np.cos(half_steps), np.sin(half_steps)
        self._set_constants(plants, half_steps[1])
        self.states = (
            np.array([fixed_start(point.parameters) for point in points])
            if states is None
            else np.asarray(states, np.float64)
        )

    def _set_constants(self, plants: Sequence[CompiledPlant], half_step_rad: float) -> None:
        rows, count = self._rows, len(self.points)
        ratios = np.array([plant.ratios for plant in plants])
        half_turns = np.stack([np.cos(ratios * half_step_rad), np.sin(ratios * half_step_rad)], 2)
        live = np.array([list(plant.live.values()) for plant in plants]).reshape(count, -1)
        self._set(rows.load, np.array([[point.load_m_s2, 0.0] for point in self.points]))
        self._set(rows.drive, self._speed[:, np.newaxis])
        for place in range(live.shape[1]):
            self._set(rows.drive + 2 + 2 * place, live[:, place : place + 1])
        self._set(rows.ratios, ratios)
        self._set(rows.half_turns, half_turns.reshape(count, -1))
        self._set(rows.step, 2.0 * half_step_rad / self._speed[:, np.newaxis])
        self._set(rows.coefficients, np.array([plant.coefficients for plant in plants]))

    @property
    def _size(self) -> int:
        return 2 * self._plant.size

    @property
    def states(self) -> Array:
        """The states (n, 2m) in m and m/s; may be set."""
        return self._get(self._rows.state, self._size)

    @states.setter
    def states(self, states: Array) -> None:
        self._set(self._rows.state, np.broadcast_to(states, (len(self.points), self._size)))

    def advance(self, revolutions: int, samples_per_revolution: int = 0) -> Array:
        """Go on by whole revolutions; return y, z (m), y', z' (m/s) of the disk (n, samples, 4).

        The first sample is the state at the start; samples_per_revolution divides the steps.
        """
        return self._run(revolutions, samples_per_revolution, (), saltation=False)

    def advance_tangents(
        self, tangents: ArrayLike, revolutions: int = 1, *, saltation: bool = True
    ) -> Array:
        """Go on with one tangent (n, 2m) a trajectory; return the tangents at the end.

        Positions in m and derivatives by the shaft angle in m/rad. `saltation`: whether a tangent
        jumps where the right-hand side does, which the true linearisation asks for.
        """
        scale = np.repeat(
            np.stack([np.ones_like(self._speed), self._speed], axis=1), self._plant.size, axis=1
        )
        self._set(self._rows.tangent, np.asarray(tangents, np.float64) * scale)
        self._run(revolutions, 0, (0,), saltation=saltation)
        return np.asarray(self._get(self._rows.tangent, self._size) / scale)

    def _run(
        self, revolutions: int, samples: int, tangent: tuple[int, ...], *, saltation: bool
    ) -> Array:
        steps = len(self._cosines) // 2
        if samples and steps % samples:
            raise AnalysisError(
                f'samples_per_revolution = {samples} does not divide the {steps} steps'
            )
        groups, height, lanes = self._buffer.shape
        size = self._plant.size
        observed = np.array([0, 1, size, size + 1])
        out = np.empty((groups, revolutions * samples, len(observed), lanes))
        self._plant.module.revolve(
            self._buffer.reshape(-1),
            height,
            self._lanes,
            self._plant.alike(self._get(self._rows.state, self._size)),
            tangent,
            saltation,
            self.revolution,
            revolutions,
            self._cosines,
            self._sines,
            steps // samples if samples else 0,
            observed,
            out,
        )
        self.revolution += revolutions
        record = out.transpose(0, 3, 1, 2).reshape(groups * lanes, -1, len(observed))
        return record[: len(self.points)]

    def _get(self, row: int, count: int) -> Array:
        part = self._buffer[:, row : row + count].transpose(0, 2, 1)
        return part.reshape(-1, count)[: len(self.points)].copy()

    def _set(self, row: int, values: Array) -> None:
        # spare lanes repeat the last trajectory: anything finite would do
        groups, _, lanes = self._buffer.shape
        padded = np.concatenate([values, values[-1:].repeat(groups * lanes - len(values), axis=0)])
        rows = slice(row, row + values.shape[1])
        self._buffer[:, rows] = padded.reshape(groups, lanes, -1).transpose(0, 2, 1)
