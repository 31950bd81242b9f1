# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Configuration of a simulated run: rotor, speed, crack growth, sampling, sensors."""

import contextlib
import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, Self

import pydantic

from rotor_common.configuration import ConfigModel, quantity
from rotor_common.errors import RigError
from rotor_sim.errors import RotorError
from rotor_sim.plant.parameters import (
    HIGHEST_CRACK,
    OF_THE_VARIANT,
    VARIANTS,
    RotorParameters,
    Variant,
)
from rotor_sim.sensors.sensor_config import NoiseLevels, SensorConfig
from rotor_sim.stream.schedule import Ramp, RampSchedule

SPEED_RANGE_RAD_S = (10.0, 1200.0)
STEPS_PER_PERIOD = 18
"""Integration steps in a period of the fastest mode; RK4 then damps it by 2e-4 a period."""


def _speed(description: str, default: Any = ...) -> Any:
    low, high = SPEED_RANGE_RAD_S
    return quantity(default, unit='rad/s', ge=low, le=high, description=description)


def _acceleration(description: str) -> Any:
    return quantity(50.0, unit='rad/s^2', ge=0.01, le=2000.0, description=description)


def _crack(description: str) -> Any:
    return quantity(unit='1', ge=0.0, le=HIGHEST_CRACK, description=description)


def _time(description: str, default: Any = ...) -> Any:
    return quantity(default, unit='s', ge=0.0, le=1e6, description=description)


@contextlib.contextmanager
def _at(key: str) -> Iterator[None]:
    """Name the key in front of the message of an error."""
    try:
        yield
    except RigError as error:
        raise RotorError(f'{key}: {error}') from None


class SpeedRamp(ConfigModel):
    """One change of the shaft's speed at constant angular acceleration."""

    at_s: float = _time('start after time 0')
    to_rad_s: float = _speed('speed that the ramp goes to')
    acceleration_rad_s2: float = _acceleration('angular acceleration, unsigned')


class SpeedConfig(ConfigModel):
    """Speed of the shaft over the run."""

    initial_rad_s: float = _speed('speed at time 0 and while the start-up settles', 352.0)
    ramps: tuple[SpeedRamp, ...] = pydantic.Field(
        default=(), description='changes of speed, in order'
    )
    highest_rad_s: float | None = _speed(
        'highest speed the integration step must resolve; unset: that of the profile', None
    )
    governor_acceleration_rad_s2: float = _acceleration(
        'angular acceleration after a live change of the speed target'
    )


class CrackRamp(ConfigModel):
    """One growth of the crack, linear in time; over_s = 0 is a step."""

    at_s: float = _time('start after time 0')
    to: float = _crack('crack stiffness ratio K that the ramp goes to')
    over_s: float = _time('time that it takes', 0.0)


class Forcing(ConfigModel):
    """A force on the disk that turns with twice the shaft's speed, as from a misalignment.

    F = amplitude (cos, sin)(2 x shaft angle + phase) along y, z.
    """

    amplitude_n: float = quantity(0.0, unit='N', ge=0.0, le=1e4, description='size of the force')
    phase_rad: float = quantity(
        0.0,
        unit='rad',
        ge=-2.0 * math.pi,
        le=2.0 * math.pi,
        description='direction of the force at shaft angle 0, from y to z',
    )


class LiveParameters(NoiseLevels):
    """What can be set during a run; everything else is fixed before it starts."""

    crack_stiffness_ratio: float = _crack('K = dk/k; changes in one step at a sample')
    speed_target_rad_s: float = _speed(
        'speed that the governor goes to at governor_acceleration_rad_s2'
    )


class ParameterChange(ConfigModel):
    """One entry in the log of a run: `parameter` was set to `value` at `sample`."""

    sample: int = quantity(unit='1', ge=0, le=2**53, description='absolute sample index')
    parameter: Literal[
        'crack_stiffness_ratio',
        'speed_target_rad_s',
        'displacement_noise_m',
        'acceleration_noise_m_s2',
        'load_noise_m_s2',
    ] = pydantic.Field(description='name of a live parameter')
    value: float = quantity(unit='SI', description='new value')


def _fill_in(rotor: Any, info: pydantic.ValidationInfo) -> Any:
    """Add what the variant, a field beside the rotor, sets to the values that are given."""
    variant: str | None = info.data.get('variant')
    if isinstance(rotor, RotorParameters) and variant not in (None, rotor.variant):
        raise RotorError(f'it is of variant {rotor.variant!r}, not {variant!r}; name it as variant')
    if not isinstance(rotor, Mapping):
        return rotor
    if fixed := OF_THE_VARIANT & {*rotor}:
        raise RotorError(f'{min(fixed)} belongs to the variant; choose it by the key `variant`')
    return {**VARIANTS.get(variant or '', {}), 'variant': variant or 'custom', **rotor}


Rotor = Annotated[
    RotorParameters,
    pydantic.Field(strict=False),
    pydantic.BeforeValidator(_fill_in),
    pydantic.PlainSerializer(lambda rotor: rotor.model_dump(exclude=OF_THE_VARIANT)),
]
"""A rotor in a model whose field `variant`, which comes first, sets what is not given here."""


class RotorSimConfig(ConfigModel):
    """Everything that the simulator needs to know before a run; the load comes separately."""

    variant: Variant = pydantic.Field(default='derived', description='reading of the equations')
    rotor: Rotor = pydantic.Field(default={}, description='rotor at time 0')  # type: ignore[assignment]
    speed: SpeedConfig = pydantic.Field(default=SpeedConfig(), description='speed of the shaft')
    crack_growth: tuple[CrackRamp, ...] = pydantic.Field(
        default=(), description='growth of the crack, in order'
    )
    forcing: Forcing = pydantic.Field(
        default=Forcing(), description='force at twice the speed, as from a misalignment'
    )
    rate_hz: int = quantity(
        10_240, unit='Hz', ge=1000, le=200_000, description='samples per second'
    )
    block_samples: int = quantity(256, unit='1', ge=1, le=65_536, description='samples per block')
    steps_per_revolution: int = quantity(
        512,
        unit='1',
        ge=128,
        le=8192,
        description='least number of integration steps per revolution at the highest speed',
    )
    settle_revolutions: int = quantity(
        200, unit='1', ge=0, le=2000, description='unpublished revolutions before time 0'
    )
    sensors: SensorConfig = pydantic.Field(default=SensorConfig(), description='sensor effects')
    seed: int = quantity(0, unit='1', ge=0, le=2**62, description='seed of the noise')
    changes: tuple[ParameterChange, ...] = pydantic.Field(
        default=(), description='log of live changes to repeat, in order'
    )

    def substeps(self) -> int:
        """Return m, the integration steps per sample.

        The smallest m that gives `steps_per_revolution` at the highest speed and
        STEPS_PER_PERIOD in a period of the fastest mode of the bearings.
        """
        highest = self.speed.highest_rad_s or self._speed_schedule().highest()
        revolution = self.steps_per_revolution * highest
        mode = STEPS_PER_PERIOD * self.rotor.fastest_mode_rad_s
        return math.ceil(max(revolution, mode) / (2.0 * math.pi * self.rate_hz))

    def speed_limit_rad_s(self) -> float:
        """Return the speed up to which `substeps` gives `steps_per_revolution`, rad/s."""
        rate = 2.0 * math.pi * self.rate_hz * self.substeps() / self.steps_per_revolution
        return min(rate, SPEED_RANGE_RAD_S[1])

    def schedules(self) -> dict[str, RampSchedule]:
        """Return the planned course of each live parameter over the samples, without `changes`.

        That of the speed target is the speed itself.
        """
        crack = RampSchedule(self.rotor.crack_stiffness_ratio, self.rate_hz)
        for growth in self.crack_growth:
            start = round(growth.at_s * self.rate_hz)
            crack.add(Ramp(start, growth.to, duration_s=growth.over_s))
        constant = {
            name: RampSchedule(getattr(self.sensors, name), self.rate_hz)
            for name in NoiseLevels.model_fields
        }
        return {
            'crack_stiffness_ratio': crack,
            'speed_target_rad_s': self._speed_schedule(),
            **constant,
        }

    def live_parameters(self) -> LiveParameters:
        """Return the live parameters at time 0."""
        return LiveParameters(
            crack_stiffness_ratio=self.rotor.crack_stiffness_ratio,
            speed_target_rad_s=self.speed.initial_rad_s,
            **{name: getattr(self.sensors, name) for name in NoiseLevels.model_fields},
        )

    def live_ramp(self, sample: int, parameter: str, value: float) -> Ramp:
        """Return the ramp of a live change; raises RotorError if the change is not allowed."""
        if parameter not in LiveParameters.model_fields:
            raise RotorError(
                f'{parameter} cannot be set while the rotor runs; only '
                f'{", ".join(LiveParameters.model_fields)} can'
            )
        LiveParameters(**(self.live_parameters().model_dump() | {parameter: value}))
        if parameter == 'crack_stiffness_ratio':
            self.rotor.check_crack(value)
        if parameter != 'speed_target_rad_s':
            return Ramp(sample, value)
        limit = self.speed_limit_rad_s()
        if value > limit:
            raise RotorError(
                f'speed_target_rad_s = {value:g} rad/s is above {limit:.1f} rad/s, the most that '
                f'the integration step of this run resolves; set speed.highest_rad_s to at least '
                f'{value:g} before the start'
            )
        return Ramp(sample, value, rate_per_s=self.speed.governor_acceleration_rad_s2)

    def _speed_schedule(self) -> RampSchedule:
        schedule = RampSchedule(self.speed.initial_rad_s, self.rate_hz)
        for ramp in self.speed.ramps:
            start = round(ramp.at_s * self.rate_hz)
            schedule.add(Ramp(start, ramp.to_rad_s, rate_per_s=ramp.acceleration_rad_s2))
        return schedule

    def check(self) -> Self:
        """Raise RotorError if values contradict each other."""
        self._check_speed()
        self._check_crack_growth()
        if self.sensors.imu_rate_hz * 4 > self.rate_hz:
            raise RotorError(
                f'sensors.imu_rate_hz = {self.sensors.imu_rate_hz} Hz is above a quarter of '
                f'rate_hz = {self.rate_hz} Hz; lower it or set it to 0 for no IMU'
            )
        for key, group in self.sensors.groups.items():
            if group.bandwidth_hz >= 0.5 * self.rate_hz:
                raise RotorError(
                    f'sensors.{key}.bandwidth_hz = {group.bandwidth_hz:g} Hz is not below half of '
                    f'rate_hz = {self.rate_hz} Hz; lower it or set it to 0 for no filter'
                )
        last = 0
        for i, change in enumerate(self.changes):
            if change.sample < last:
                raise RotorError(
                    f'changes[{i}].sample = {change.sample} comes before the change at {last}; '
                    'changes stand in order of their samples'
                )
            last = change.sample
            with _at(f'changes[{i}]'):
                self.live_ramp(change.sample, change.parameter, change.value)
        return self

    _check = pydantic.model_validator(mode='after')(check)

    def _check_speed(self) -> None:
        speed, end, reached = self.speed, 0.0, self.speed.initial_rad_s
        for i, ramp in enumerate(speed.ramps):
            if ramp.at_s < end - 1.0 / self.rate_hz:
                raise RotorError(
                    f'speed.ramps[{i}].at_s = {ramp.at_s:g} s is too early: the ramp before it '
                    f'ends at {end:.6g} s; ramps stand in order and do not overlap'
                )
            end = ramp.at_s + abs(ramp.to_rad_s - reached) / ramp.acceleration_rad_s2
            reached = ramp.to_rad_s
        highest = self._speed_schedule().highest()
        if speed.highest_rad_s is not None and highest > speed.highest_rad_s:
            raise RotorError(
                f'speed.highest_rad_s = {speed.highest_rad_s:g} rad/s is below the {highest:g} '
                'rad/s that the speed profile reaches; raise it or leave it out'
            )

    def _check_crack_growth(self) -> None:
        end = 0.0
        for i, growth in enumerate(self.crack_growth):
            if growth.at_s < end - 1.0 / self.rate_hz:
                raise RotorError(
                    f'crack_growth[{i}].at_s = {growth.at_s:g} s is too early: the growth before '
                    f'it ends at {end:.6g} s; entries stand in order and do not overlap'
                )
            end = growth.at_s + growth.over_s
            with _at(f'crack_growth[{i}].to'):
                self.rotor.check_crack(growth.to)
