# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The sensor chain: turns rotor states into sensor readings, block by block; docs/sensors.md.

Order of the effects: housing and pulse faults (the quantity itself), cross-axis, runout, scale,
bias and its walk, noise, low-pass filter, sampling jitter, recorder noise, range and steps of the
converter, loss of the channel.
"""

import functools
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor_common.constants import LANES
from rotor_interfaces.channels import CHANNELS
from rotor_interfaces.waveform import WAVEFORM_DTYPE
from rotor_sim.sensors import _kernels, _noiseless_kernels
from rotor_sim.sensors._noiseless_kernels import COLUMNS, KEYPHASOR
from rotor_sim.sensors.housing import at_rest, matrices
from rotor_sim.sensors.imu import ImuDecimator, ImuSample
from rotor_sim.sensors.sensor_config import (
    FixedErrors,
    NoiseLevels,
    ProbeErrors,
    SensorConfig,
    SensorGroup,
)

Array = NDArray[np.float64]
Imu = tuple[tuple[ImuSample, ...], tuple[ImuSample, ...]]

KEYPHASOR_VOLT = 5.0
KEYPHASOR_WIDTH_RAD = math.radians(12.0)
FILTER_ORDER = 2 * _kernels.SECTIONS
"""Order of the Butterworth low-pass."""

_LEVEL: dict[str, str] = {
    'displacement': 'displacement_noise_m',
    'acceleration': 'acceleration_noise_m_s2',
    'load': 'load_noise_m_s2',
}
"""Level of the recorder noise for the columns of each kind."""
_LEVEL_OF = {COLUMNS.index(c.name): _LEVEL[c.kind] for c in CHANNELS if c.kind in _LEVEL}


class Measured(NamedTuple):
    """Rows (WAVEFORM_DTYPE) of the sensors and of the truth, and the IMU of bearing 1 and 2."""

    rows: NDArray[np.void]
    truth_rows: NDArray[np.void]
    imu: Imu


class SensorChain:
    """The sensors of one machine; they keep their state from block to block, from sample 0 on."""

    def __init__(self, config: SensorConfig, seed: int, rate_hz: int) -> None:
        self._config, self._seed, self._rate = config, seed, rate_hz
        self._started = False
        self._imu = ImuDecimator(rate_hz, config.imu_rate_hz) if config.imu_rate_hz else None
        self._housing = matrices(config.housing, rate_hz) if config.housing.mass_kg else None
        self._housing_state = np.zeros((4, 3))
        self._known = np.zeros((_kernels.ROWS, LANES))
        groups = [config.groups[c.noise_group] for c in CHANNELS if c.noise_group]
        self._lay_out_errors(groups)
        self._lay_out_filter(groups)
        self._lay_out_losses(groups)
        keyphasor = config.keyphasor
        self._faults = (
            keyphasor.missed_probability,
            keyphasor.double_probability,
            keyphasor.double_offset_rad,
        )
        self._faulty = any(self._faults[:2])
        self._senses = bool(self._active.any())
        limited = np.isfinite(self._known[_noiseless_kernels.RANGE, : len(COLUMNS)])
        self._active |= (self._loss_rate > 0.0) | limited
        self._active[KEYPHASOR] |= self._faulty

    def _lay_out_errors(self, groups: list[SensorGroup]) -> None:
        k = _noiseless_kernels
        errors, off = self._known[:9, : len(COLUMNS)], np.zeros((9, len(COLUMNS)))
        runouts = self._known[_kernels.RUNOUT : _kernels.SECTION, : len(COLUMNS)]
        off[k.GAIN] = 1.0
        off[k.RANGE] = np.inf
        errors[:] = off
        walk_s = _kernels.WALK_SAMPLES / self._rate
        for c, (name, group) in enumerate(zip(COLUMNS, groups, strict=True)):
            own: Any = getattr(group, name, group)
            errors[k.BIAS, c] = own.bias
            errors[k.GAIN, c] += own.scale_error
            errors[k.WALK_STEP, c] = group.bias_walk * math.sqrt(walk_s)
            errors[k.DEVIATION, c] = group.noise_density * math.sqrt(0.5 * self._rate)
            errors[k.OFF_SAMPLES, c] = group.jitter_s * self._rate
            errors[k.RANGE, c] = group.range or np.inf
            if group.bits:
                errors[k.STEP, c] = group.range * 2.0 ** (1 - group.bits)
                errors[k.STEPS, c] = 1.0 / errors[k.STEP, c]
            if isinstance(own, FixedErrors):
                errors[k.CROSS, c] = own.cross_axis
            if isinstance(own, ProbeErrors):
                for runout in own.runout:
                    row = 2 * (runout.order - 1)
                    runouts[row, c] += runout.amplitude_m * math.cos(runout.phase_rad)
                    runouts[row + 1, c] -= runout.amplitude_m * math.sin(runout.phase_rad)
        self._active = (errors[: k.RANGE] != off[: k.RANGE]).any(axis=0)
        self._active |= runouts.any(axis=0)

    def _lay_out_filter(self, groups: list[SensorGroup]) -> None:
        filtered = np.array([group.bandwidth_hz > 0.0 for group in groups])
        sections = self._known[_kernels.SECTION : _kernels.AT_REST].reshape(
            FILTER_ORDER // 2, 5, -1
        )
        at_rest = self._known[_kernels.AT_REST : _kernels.STATE].reshape(FILTER_ORDER // 2, 2, -1)
        sections[:, 0] = 1.0
        for c in np.flatnonzero(filtered):
            sections[:, :, c], at_rest[:, :, c] = _low_pass(groups[c].bandwidth_hz, self._rate)
        self._active |= filtered

    def _lay_out_losses(self, groups: list[SensorGroup]) -> None:
        self._loss_rate = np.array([group.dropout_rate / self._rate for group in groups])
        self._loss_length = np.array(
            [max(round(group.dropout_s * self._rate), 1) for group in groups], np.int64
        )
        self._loss_state = np.zeros((2, len(COLUMNS)), np.int64)
        self._next_loss = np.full(len(COLUMNS), np.inf)
        for c in np.flatnonzero(self._loss_rate):
            first = _kernels.uniform(self._seed, int(c), _kernels.DROPOUT, 0)
            self._next_loss[c] = -math.log(first) / self._loss_rate[c]
            self._loss_state[0, c] = 1

    def compile(self) -> None:
        """Load or compile the kernels, so that the first block does not wait for them."""
        levels = {name: np.ones(1) for name in NoiseLevels.model_fields}
        other = SensorChain(self._config, self._seed, self._rate)
        other.measure(0, np.zeros((1, 16)), np.zeros(1, np.int64), np.zeros(1), levels)

    def measure(
        self,
        first_sample: int,
        out: Array,
        turns: NDArray[np.int64],
        angle: Array,
        levels: Mapping[str, Array] | None = None,
    ) -> Measured:
        """Return the readings of the sensors for the next samples; call it block after block.

        Args:
            first_sample: absolute index of the first sample.
            out: (n, 12 or more), columns of `rotor_sim.plant._kernels`; 12 to 15 are needed for
                housings.
            turns: (n,) whole turns of the shaft.
            angle: (n,) the rest of its angle in rad.
            levels: (n,) standard deviations of the recorder noise by their names in NoiseLevels;
                missing ones are zero.

        """
        angle = np.ascontiguousarray(angle)
        clean = np.empty((len(out), len(COLUMNS) + 1))
        truth = np.empty((len(out), WAVEFORM_DTYPE.itemsize // 4), np.float32)
        _noiseless_kernels.lay_out(
            first_sample,
            float(self._rate),
            0.5 * KEYPHASOR_WIDTH_RAD,
            KEYPHASOR_VOLT,
            turns,
            angle,
            out,
            self._housing_acceleration(out),
            clean,
            truth.view(np.float64),
            truth,
        )
        raw = truth.copy()
        sensed = clean
        noisy = {c: levels[k] for c, k in _LEVEL_OF.items() if k in levels} if levels else {}
        if noisy or self._active.any():
            sensed = self._sense(first_sample, clean, turns, angle, noisy=noisy, raw=raw)
        rows = _rows(raw)
        if not self._config.encoder:
            rows['angle'] = np.nan
        self._started = True
        return Measured(rows, _rows(truth), self._imu_samples(sensed, out))

    def _housing_acceleration(self, out: Array) -> Array:
        """Return the housings' accelerations (n, 4); (0, 4) if sensors are on the journals."""
        if self._housing is None:
            return np.empty((0, 4))
        force = np.ascontiguousarray(out[:, _noiseless_kernels.OUT_FORCE :][:, :4])
        if not self._started:
            self._housing_state = at_rest(self._config.housing, force[0])
        acceleration = np.empty_like(force)
        _noiseless_kernels.housing(self._housing, self._housing_state, force, acceleration)
        return acceleration

    def _sense(
        self,
        first: int,
        clean: Array,
        turns: NDArray[np.int64],
        angle: Array,
        *,
        noisy: Mapping[int, Array],
        raw: NDArray[np.float32],
    ) -> Array:
        """Return `clean` with the sensors' effects; also write the result to the rows `raw`."""
        if self._faulty:
            clean = clean.copy()
            _kernels.faulty_pulses(
                self._seed,
                turns,
                angle,
                0.5 * KEYPHASOR_WIDTH_RAD,
                KEYPHASOR_VOLT,
                self._faults,
                clean[:, KEYPHASOR],
            )
        work = np.empty((len(clean), LANES))
        if self._senses:
            _kernels.sense(
                self._seed, first, self._started, self._known.ravel(), clean, angle, work.ravel()
            )
        else:
            work[:, : len(COLUMNS)] = clean[:, : len(COLUMNS)]
            work[:, len(COLUMNS) :] = 0.0
        active = self._active
        if noisy:
            active = active.copy()
            active[list(noisy)] = True
        normal = np.empty(len(work))
        for c, level in noisy.items():
            _kernels.normals(self._seed, c, _kernels.RECORDER, first, normal)
            work[:, c] += level * normal
        if self._loss_rate.any():
            _kernels.dropouts(
                self._seed,
                first,
                self._loss_rate,
                self._loss_length,
                self._loss_state,
                self._next_loss,
                work,
            )
        _noiseless_kernels.convert(self._known.ravel(), active, work.ravel(), raw)
        return work

    def _imu_samples(self, sensed: Array, out: Array) -> Imu:
        """Return the bearings' IMUs: sensed acceleration minus apparent gravity, decimated."""
        if self._imu is None:
            return (), ()
        k = _noiseless_kernels
        specific_force = sensed[:, k.ACCELERATIONS : k.VIBRATIONS].copy()
        by_place = specific_force.reshape(len(out), -1, 2)
        by_place -= out[:, None, k.OUT_LOAD : k.OUT_FORCE]
        first, values = self._imu.push(specific_force)
        done = list(enumerate(values.tolist(), first))
        return (
            tuple(ImuSample(index, value[0], value[1]) for index, value in done),
            tuple(ImuSample(index, value[2], value[3]) for index, value in done),
        )


@functools.cache
def _low_pass(bandwidth_hz: float, rate_hz: int) -> tuple[Array, Array]:
    """Return b0, b1, b2, a1, a2 (sections, 5), and the steady states for an input of 1."""
    from scipy import signal  # noqa: PLC0415 - slow to import

    sections = signal.butter(FILTER_ORDER, bandwidth_hz, fs=rate_hz, output='sos')
    return sections[:, [0, 1, 2, 4, 5]], signal.sosfilt_zi(sections)


def _rows(raw: NDArray[np.float32]) -> NDArray[np.void]:
    return np.asarray(raw.view(WAVEFORM_DTYPE)[:, 0])
