# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The streaming simulator: load grid in, blocks out, the same bits for any block size."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotor_interfaces.waveform import ACCELERATION_COLUMNS, CHANNEL_COLUMNS, WAVEFORM_DTYPE
from rotor_sim import sensors
from rotor_sim.config import LiveParameters, NoiseLevels, ParameterChange, RotorSimConfig
from rotor_sim.errors import IntegrationError, RotorError
from rotor_sim.load_grid import LOAD_RATE_HZ, LoadGrid
from rotor_sim.parameters import GRAVITY_M_S2
from rotor_sim.sensors import ImuDecimator, ImuSample
from rotor_sim.statics import static_equilibrium

Array = NDArray[np.float64]
Angles = tuple[NDArray[np.int64], Array, Array]

_SETTLE_CHUNK = 8192
_NOISE_OF = {
    **{
        name: (
            'acceleration_noise_m_s2' if name in ACCELERATION_COLUMNS else 'displacement_noise_m'
        )
        for name in CHANNEL_COLUMNS
    },
    'load_y': 'load_noise_m_s2',
}
"""Level that each noisy column follows; the order numbers the noise channels."""


@dataclass(frozen=True)
class SimulatedBlock:
    """Consecutive samples; rows have WAVEFORM_DTYPE (SI, frame `rotor`), `time` = k/rate.

    `rows` is what the sensors say, `truth_rows` the same without sensor effects. Shaft angle
    (unwrapped), speed and `truth` hold at the first sample. `imu` is for bearing 1 and 2.
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
        """Lay out the run; raises RotorError or ConfigError for what cannot be."""
        self.config = config
        self.parameters = config.parameters()
        self.substeps = config.substeps()
        self.next_sample = 0
        self._schedules = config.schedules()
        self._changes: list[ParameterChange] = []
        for change in config.changes:
            self._change(change.sample, change.parameter, change.value)
        self._state = np.full(12, np.nan)
        self._prepared = False
        imu_rate = config.sensors.imu_rate_hz
        self._imu = ImuDecimator(config.rate_hz, imu_rate) if imu_rate else None

    @property
    def changes(self) -> tuple[ParameterChange, ...]:
        """The log of live changes; as `changes` of a configuration it repeats this run."""
        return tuple(self._changes)

    @property
    def state(self) -> Array:
        """Copy of the state (12,) at `next_sample`: y, z, y1, z1, y2, z2 (m), their rates (m/s)."""
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
        """Load or compile the kernel, so that neither settling nor the first block waits for it."""
        state, self._state = self._state, np.zeros(12)
        self._integrate(0, 0, self._angles(0, 0), np.zeros((1, 2)))
        self._state = state

    def prepare(self, load_grid: LoadGrid) -> None:
        """Compile, find the equilibrium under load point 0 and let the start-up settle.

        Raises IntegrationError where there is no equilibrium or the start-up diverges, RotorError
        where the grid is still empty. Does nothing the second time.
        """
        if self._prepared:
            return
        load = load_grid.window(0, 0)
        self.compile()
        rate = self.config.rate_hz
        revolution = 2.0 * math.pi * rate / self.config.speed.initial_rad_s
        sample = -math.ceil(self.config.settle_revolutions * revolution)
        _, angle, cage = self._angles(sample, 1)
        self._state = static_equilibrium(
            self.parameters,
            (float(load[0, 0]), float(load[0, 1])),
            float(angle[0]),
            cage_angle_rad=float(cage[0]),
        )
        while sample < 0:
            count = min(_SETTLE_CHUNK, -sample)
            points = count * LOAD_RATE_HZ // rate + 3
            angles = self._angles(sample, count)
            self._integrate(sample, count, angles, np.repeat(load, points, axis=0))
            sample += count
        self._prepared = True

    def advance(self, n_samples: int, load_grid: LoadGrid) -> SimulatedBlock:
        """Return the next `n_samples` samples; calls `prepare` first where that is still to do.

        Raises:
            RotorError: fewer than 1 sample, or a load grid that ends before the block does.
            IntegrationError: the state left what the model can describe; the run is over.

        """
        if n_samples < 1:
            raise RotorError(f'n_samples = {n_samples} is out of range; allowed: 1 or more')
        first, rate = self.next_sample, self.config.rate_hz
        load = load_grid.window(
            first * LOAD_RATE_HZ // rate, -(-(first + n_samples) * LOAD_RATE_HZ // rate)
        )
        self.prepare(load_grid)
        angles = self._angles(first, n_samples)
        out = self._integrate(first, n_samples, angles, load)
        turns, angle, _ = angles
        unwrapped = turns * (2.0 * np.pi) + angle
        truth_rows = self._truth_rows(first, out, angle, unwrapped)
        noise = self._noise(first, n_samples)
        block = SimulatedBlock(
            first_sample=first,
            rows=self._sensed_rows(truth_rows, out, noise),
            truth_rows=truth_rows,
            shaft_angle_rad=float(unwrapped[0]),
            shaft_speed_rad_s=self._schedules['speed_target_rad_s'].value(first),
            truth=self._truth(first, out),
            imu=self._imu_samples(out, noise),
        )
        self.next_sample += n_samples
        return block

    def _angles(self, first: int, count: int) -> Angles:
        """Return whole turns of the shaft, its angle and the cage's, both in one turn (rad)."""
        turns, angle = self._schedules['speed_target_rad_s'].angles(first, count)
        ratio = self.parameters.cage_ratio
        cage = ((ratio * turns) % 1.0) * (2.0 * np.pi) + ratio * angle
        return turns, angle, cage

    def _integrate(self, first: int, count: int, angles: Angles, load: Array) -> Array:
        from rotor_sim import _kernels  # noqa: PLC0415 - numba is slow to import

        speed, speed_increment = self._schedules['speed_target_rad_s'].values(first, count)
        crack, crack_increment = self._schedules['crack_stiffness_ratio'].values(first, count)
        out = np.empty((count, _kernels.OUTPUTS))
        coefficients, balls = _kernels.pack(self.parameters)
        _kernels.integrate(
            coefficients,
            balls,
            self._state,
            out,
            self.config.rate_hz,
            1.0 / self.config.rate_hz,
            self.substeps,
            first,
            angles[1],
            angles[2],
            speed,
            speed_increment,
            crack,
            crack_increment,
            load,
            first * LOAD_RATE_HZ // self.config.rate_hz,
            LOAD_RATE_HZ,
        )
        self._check(first, out)
        return out

    def _check(self, first: int, out: Array) -> None:
        """Refuse a state that is not finite or leaves the bearings: never hand it out."""
        limit = self.parameters.inner_radius_m
        inside = (np.abs(out[:, :6]) < limit).all(axis=1) & np.isfinite(out).all(axis=1)
        if inside.all() and (np.abs(self._state[:6]) < limit).all():
            return
        sample = first + (int(np.argmin(inside)) if not inside.all() else len(out))
        speed = self._schedules['speed_target_rad_s'].value(sample)
        crack = self._schedules['crack_stiffness_ratio'].value(sample)
        raise IntegrationError(
            f'the rotor diverged at sample {sample} ({sample / self.config.rate_hz:.6f} s): '
            f'variant {self.parameters.variant!r}, {speed:g} rad/s, crack_stiffness_ratio = '
            f'{crack:g}, clearance_m = {self.parameters.clearance_m:g}, {self.substeps} steps a '
            'sample; raise steps_per_revolution or choose milder parameters'
        )

    def _truth_rows(
        self, first: int, out: Array, angle: Array, unwrapped: Array
    ) -> NDArray[np.void]:
        rows = np.zeros(len(out), WAVEFORM_DTYPE)
        index = np.arange(len(out))
        rows['time'] = index / self.config.rate_hz
        rows['sample'] = first + index
        rows['angle'] = unwrapped
        for column, name in enumerate(CHANNEL_COLUMNS):
            rows[name] = out[:, column]
        rows['keyphasor'] = sensors.keyphasor(angle)
        rows['load_y'] = out[:, len(CHANNEL_COLUMNS)]
        return rows

    def _noise(self, first: int, count: int) -> dict[str, Array]:
        """Return the noise of every column whose level is not zero all over the block."""
        levels = {
            name: self._schedules[name].values(first, count)[0] for name in NoiseLevels.model_fields
        }
        return {
            name: levels[level] * sensors.white_noise(self.config.seed, channel, first, count)
            for channel, (name, level) in enumerate(_NOISE_OF.items())
            if levels[level].any()
        }

    def _sensed_rows(
        self, truth_rows: NDArray[np.void], out: Array, noise: dict[str, Array]
    ) -> NDArray[np.void]:
        rows = truth_rows.copy()
        for column, name in enumerate(_NOISE_OF):
            if name in noise:
                rows[name] = out[:, column] + noise[name]
        if not self.config.sensors.encoder:
            rows['angle'] = np.nan
        return rows

    def _truth(self, first: int, out: Array) -> dict[str, float]:
        """Return the ground truth at the first sample of a block."""
        now = {name: schedule.value(first) for name, schedule in self._schedules.items()}
        speed = self._schedules['speed_target_rad_s']
        return {
            'crack_stiffness_ratio': now['crack_stiffness_ratio'],
            'clearance_m': self.parameters.clearance_m,
            'eccentricity_m': self.parameters.eccentricity_m,
            'speed_rad_s': now['speed_target_rad_s'],
            'load_factor': float(out[0, -2]) / GRAVITY_M_S2,
            'lateral_load_factor': float(out[0, -1]) / GRAVITY_M_S2,
            **now,
            'speed_target_rad_s': speed.target(first),
        }

    def _imu_samples(
        self, out: Array, noise: dict[str, Array]
    ) -> tuple[tuple[ImuSample, ...], tuple[ImuSample, ...]]:
        """Return what the bearings' IMUs say: acceleration minus apparent gravity, decimated."""
        if self._imu is None:
            return (), ()
        channels = []
        for i, name in enumerate(ACCELERATION_COLUMNS):
            specific_force = out[:, 6 + i] - out[:, 10 + i % 2]
            channels.append(specific_force + noise[name] if name in noise else specific_force)
        done = self._imu.push(channels)
        return (
            tuple(ImuSample(index, values[0], values[1]) for index, values in done),
            tuple(ImuSample(index, values[2], values[3]) for index, values in done),
        )
