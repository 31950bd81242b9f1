# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The streaming simulator: load grid in, blocks out; the bits do not depend on block size."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotor_common.constants import GRAVITY_M_S2, LOAD_RATE_HZ
from rotor_sim.errors import IntegrationError, RotorError
from rotor_sim.plant.compiled_plant import CompiledPlant
from rotor_sim.plant.hou2016 import RECORDS, hou2016
from rotor_sim.plant.integration import Lane, Stretch, integrate
from rotor_sim.plant.statics import static_equilibrium
from rotor_sim.rotor_config import LiveParameters, ParameterChange, RotorSimConfig
from rotor_sim.sensors import ImuSample
from rotor_sim.sensors.instrument import Instruments
from rotor_sim.sensors.sensor_config import NoiseLevels
from rotor_sim.stream.load_grid import LoadGrid

Array = NDArray[np.float64]

_SETTLE_CHUNK = 8192
_LIVE = {'crack_stiffness_ratio': 'crack.stiffness_ratio'}
"""Live parameters of a run that are those of an element."""


@dataclass(frozen=True)
class SimulatedBlock:
    """Consecutive samples; rows have WAVEFORM_DTYPE (SI, frame `rotor`), `time` = k/rate.

    `rows` are the sensors' readings, with the columns of the user's instruments after the others;
    `truth_rows` are without sensor effects. Shaft angle (unwrapped), speed and `truth` are those
    of the first sample. `imu` is for bearing 1 and 2.
    """

    first_sample: int
    rows: NDArray[np.void]
    truth_rows: NDArray[np.void]
    shaft_angle_rad: float
    shaft_speed_rad_s: float
    truth: dict[str, float]
    imu: tuple[tuple[ImuSample, ...], tuple[ImuSample, ...]]


class RotorSimulator:
    """Integrates the rotor block after block from sample 0 on; deterministic."""

    SETTABLE = tuple(LiveParameters.model_fields)

    def __init__(self, config: RotorSimConfig) -> None:
        """Set up the run; raises RotorError or ConfigError for an impossible configuration."""
        self.config = config
        self.parameters = config.rotor
        self.substeps = config.substeps()
        self.next_sample = 0
        self._schedules = config.schedules()
        self._changes: list[ParameterChange] = []
        for change in config.changes:
            self._change(change.sample, change.parameter, change.value)
        forcing = config.forcing
        plant = hou2016(config.rotor, forcing.amplitude_n, forcing.phase_rad)
        self._lane = Lane(config.rate_hz, self.substeps, CompiledPlant(plant, RECORDS))
        self._state = np.full(2 * self._lane.plant.size, np.nan)
        self._prepared = False
        from rotor_sim.sensors.chain import SensorChain  # noqa: PLC0415 - numba is slow to import

        self._sensors = SensorChain(config.sensors, config.seed, config.rate_hz)
        self._instruments = Instruments(config.sensors.instruments, config.rate_hz, config.seed)

    @property
    def changes(self) -> tuple[ParameterChange, ...]:
        """The log of live changes; as `changes` of a configuration it repeats this run."""
        return tuple(self._changes)

    @property
    def state(self) -> Array:
        """Copy of the state (2n,) at `next_sample`: displacements (m), then velocities (m/s)."""
        if not self._prepared:
            raise RotorError('the simulator has no state before prepare(); call it first')
        return self._state.copy()

    def set_parameter(self, name: str, value: float) -> int:
        """Set a live parameter from the next block's first sample on; return that sample.

        Raises RotorError or ConfigError, and changes nothing, for another name or a bad value.
        """
        return self._change(self.next_sample, name, value)

    def _change(self, sample: int, name: str, value: float) -> int:
        ramp = self.config.live_ramp(sample, name, value)
        self._schedules[name].add(ramp)
        change = {'sample': sample, 'parameter': name, 'value': value}
        self._changes.append(ParameterChange.model_validate(change))
        return sample

    def compile(self) -> None:
        """Load or compile the kernels, so that settling and the first block do not wait for it."""
        plan = self._planned(0, 0, np.zeros((1, 2)))
        rows, _ = integrate([plan], 1)
        self.check(plan, rows[0], np.zeros_like(self._state))
        self._sensors.compile()

    def prepare(self, load_grid: LoadGrid) -> None:
        """Compile, find the equilibrium under load point 0 and let the start-up settle.

        Raises IntegrationError if there is no equilibrium or the start-up diverges, RotorError if
        the grid is still empty. Does nothing the second time.
        """
        if self._prepared:
            return
        load = load_grid.window(0, 0)
        self.compile()
        rate = self.config.rate_hz
        revolution = 2.0 * math.pi * rate / self.config.speed.initial_rad_s
        sample = -math.ceil(self.config.settle_revolutions * revolution)
        turns, angle = self._schedules['speed_target_rad_s'].angles(sample, 1)
        self._state = static_equilibrium(
            self._lane.plant,
            (float(load[0, 0]), float(load[0, 1])),
            2.0 * math.pi * float(turns[0]) + float(angle[0]),
        )
        while sample < 0:
            count = min(_SETTLE_CHUNK, -sample)
            points = count * LOAD_RATE_HZ // rate + 3
            plan = self._planned(sample, count, np.repeat(load, points, axis=0))
            rows, states = integrate([plan], 1)
            self.check(plan, rows[0], states[0])
            self._state = states[0]
            sample += count
        self._prepared = True

    def advance(self, n_samples: int, load_grid: LoadGrid) -> SimulatedBlock:
        """Return the next `n_samples` samples; calls `prepare` first if needed.

        Raises:
            RotorError: fewer than 1 sample, or a load grid that ends before the block does.
            IntegrationError: the state left the range of the model; the run is over.

        """
        plan = self.plan(n_samples, load_grid)
        rows, states = integrate([plan], 1)
        self.check(plan, rows[0], states[0])
        return self.finish(plan, rows[0], states[0])

    def plan(self, n_samples: int, load_grid: LoadGrid) -> Stretch:
        """Return the integrator's input for the next `n_samples` samples: first part of `advance`.

        Raises the errors of `advance`, except for a divergence after the start-up.
        """
        if n_samples < 1:
            raise RotorError(f'n_samples = {n_samples} is out of range; allowed: 1 or more')
        first, rate = self.next_sample, self.config.rate_hz
        load = load_grid.window(
            first * LOAD_RATE_HZ // rate, -(-(first + n_samples) * LOAD_RATE_HZ // rate)
        )
        self.prepare(load_grid)
        return self._planned(first, n_samples, load)

    def finish(self, plan: Stretch, out: Array, state: Array) -> SimulatedBlock:
        """Return the block of an integrated plan and move to the sample after it.

        `out` are the sampled rows, see `integrate`; `state` follows the last.
        """
        first, angle = plan.first_sample, plan.drive[:, 0]
        levels = self._noise_levels(first, len(out))
        measured = self._sensors.measure(first, out, plan.turns, angle, levels)
        block = SimulatedBlock(
            first_sample=first,
            rows=self._instruments.widen(measured.rows, measured.truth_rows),
            truth_rows=measured.truth_rows,
            shaft_angle_rad=float(measured.truth_rows['angle'][0]),
            shaft_speed_rad_s=self._schedules['speed_target_rad_s'].value(first),
            truth=self._truth(first, out),
            imu=measured.imu,
        )
        self._state = state.copy()
        self.next_sample += len(out)
        return block

    def _planned(self, first: int, count: int, load: Array) -> Stretch:
        plant = self._lane.plant
        turns, angle = self._schedules['speed_target_rad_s'].angles(first, count)
        rotations = len(plant.ratios)
        drive = np.empty((count, rotations + 2 + 2 * len(plant.live)))
        for column, ratio in enumerate(plant.ratios):
            whole = ratio * turns
            drive[:, column] = (whole - np.floor(whole)) * (2.0 * np.pi) + ratio * angle
        columns = {'speed_target_rad_s': rotations}
        for place, (name, value) in enumerate(plant.live.items()):
            column = rotations + 2 + 2 * place
            drive[:, column], drive[:, column + 1] = value, 0.0
            columns |= {k: column for k, live in _LIVE.items() if live == name}
        for name, column in columns.items():
            drive[:, column], drive[:, column + 1] = self._schedules[name].values(first, count)
        return Stretch(self._lane, first, self._state, turns, drive, load)

    def check(self, plan: Stretch, out: Array, state: Array) -> None:
        """Raise IntegrationError if rows or final state are not finite or outside the bearings.

        The simulator has not advanced then.
        """
        from rotor_sim.stream import _kernels  # noqa: PLC0415 - numba is slow to import

        limit, size = self.parameters.inner_radius_m, self._lane.plant.size
        row = _kernels.first_outside(out, size, limit)
        if row == len(out) and (np.abs(state[:size]) < limit).all():
            return
        sample = plan.first_sample + row
        speed = self._schedules['speed_target_rad_s'].value(sample)
        crack = self._schedules['crack_stiffness_ratio'].value(sample)
        raise IntegrationError(
            f'the rotor diverged at sample {sample} ({sample / self.config.rate_hz:.6f} s): '
            f'variant {self.parameters.variant!r}, {speed:g} rad/s, crack_stiffness_ratio = '
            f'{crack:g}, clearance_m = {self.parameters.clearance_m:g}, {self.substeps} steps a '
            'sample; raise steps_per_revolution or choose milder parameters'
        )

    def _noise_levels(self, first: int, count: int) -> dict[str, Array]:
        """Return the noise levels at each sample, without those that are zero."""
        noisy = [name for name in NoiseLevels.model_fields if self._schedules[name].highest()]
        levels = {name: self._schedules[name].values(first, count)[0] for name in noisy}
        return {name: level for name, level in levels.items() if level.any()}

    def _truth(self, first: int, out: Array) -> dict[str, float]:
        """Return the ground truth at the first sample of a block."""
        now = {name: schedule.value(first) for name, schedule in self._schedules.items()}
        speed = self._schedules['speed_target_rad_s']
        return {
            'crack_stiffness_ratio': now['crack_stiffness_ratio'],
            'clearance_m': self.parameters.clearance_m,
            'eccentricity_m': self.parameters.eccentricity_m,
            'forcing_n': self.config.forcing.amplitude_n,
            'speed_rad_s': now['speed_target_rad_s'],
            'load_factor': float(out[0, 10]) / GRAVITY_M_S2,
            'lateral_load_factor': float(out[0, 11]) / GRAVITY_M_S2,
            **now,
            'speed_target_rad_s': speed.target(first),
        }
