# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Configuration of the sensors: everything is off by default, and 0 always means off."""

from collections.abc import Mapping
from typing import Any, ClassVar, Self

import pydantic

from rotor_common.configuration import ConfigModel, quantity
from rotor_interfaces.channels import COLUMN_UNITS
from rotor_sim.errors import RotorError
from rotor_sim.sensors.instrument import InstrumentConfig, check_columns
from rotor_sim.sensors.presets import Preset, values_of

HIGHEST_ORDER = 3
"""Highest order of the slow-roll runout."""


class NoiseLevels(ConfigModel):
    """Standard deviations of the recorder's white noise, which can be set live."""

    displacement_noise_m: float = quantity(
        0.0, unit='m', ge=0.0, le=1e-3, description='standard deviation of displacement noise'
    )
    acceleration_noise_m_s2: float = quantity(
        0.0, unit='m/s^2', ge=0.0, le=1e3, description='standard deviation of acceleration noise'
    )
    load_noise_m_s2: float = quantity(
        0.0, unit='m/s^2', ge=0.0, le=1e2, description='standard deviation of load noise'
    )


class SensorGroup(ConfigModel):
    """What all channels of one kind share; [u] is COLUMN_UNIT, the unit of their columns."""

    COLUMN_UNIT: ClassVar[str]

    noise_density: float = quantity(
        0.0,
        unit='u/sqrt(Hz)',
        ge=0.0,
        le=1e3,
        description='one-sided density of the white noise before the filter',
    )
    bias_walk: float = quantity(
        0.0, unit='u/sqrt(s)', ge=0.0, le=1e3, description='random walk of the bias'
    )
    bandwidth_hz: float = quantity(
        0.0, unit='Hz', ge=0.0, le=1e5, description='-3 dB of the low-pass filter; 0: none'
    )
    range: float = quantity(
        0.0, unit='u', ge=0.0, le=1e6, description='largest size of a value, both signs; 0: any'
    )
    bits: int = quantity(
        0, unit='1', ge=0, le=32, description='bits of the converter over the range; 0: none'
    )
    jitter_s: float = quantity(
        0.0, unit='s', ge=0.0, le=1e-4, description='standard deviation of the sampling time'
    )
    dropout_rate: float = quantity(
        0.0, unit='1/s', ge=0.0, le=100.0, description='losses of the channel per second'
    )
    dropout_s: float = quantity(
        0.01, unit='s', gt=0.0, le=100.0, description='length of a loss, which reads NaN'
    )

    @pydantic.model_validator(mode='after')
    def _check_converter(self) -> Self:
        if self.bits and not self.range:
            raise RotorError(
                f'bits = {self.bits} needs a range to divide; set range above 0 or bits to 0'
            )
        return self


class FixedErrors(ConfigModel):
    """Errors of one sensor that stay as they are; [u] is the unit of its column."""

    bias: float = quantity(0.0, unit='u', ge=-1e3, le=1e3, description='reading at zero')
    scale_error: float = quantity(
        0.0, unit='1', ge=-0.9, le=10.0, description='relative error of the sensitivity'
    )
    cross_axis: float = quantity(
        0.0,
        unit='1',
        ge=-1.0,
        le=1.0,
        description='part of the other axis (z for y, y for z) of the same place',
    )


class Runout(ConfigModel):
    """One order of the slow-roll runout: amplitude_m cos(order angle + phase_rad)."""

    order: int = quantity(unit='1', ge=1, le=HIGHEST_ORDER, description='cycles a revolution')
    amplitude_m: float = quantity(unit='m', ge=0.0, le=1e-3, description='amplitude')
    phase_rad: float = quantity(
        0.0, unit='rad', ge=-10.0, le=10.0, description='phase at shaft angle 0'
    )


class ProbeErrors(FixedErrors):
    """Fixed errors of one proximity probe."""

    runout: tuple[Runout, ...] = pydantic.Field(
        default=(), strict=False, description='slow-roll runout of the surface that the probe sees'
    )


class Proximity(SensorGroup):
    """The six proximity probes."""

    COLUMN_UNIT = 'm'

    disk_y: ProbeErrors = pydantic.Field(default=ProbeErrors(), description='errors of the probe')
    disk_z: ProbeErrors = pydantic.Field(default=ProbeErrors(), description='errors of the probe')
    brg1_y: ProbeErrors = pydantic.Field(default=ProbeErrors(), description='errors of the probe')
    brg1_z: ProbeErrors = pydantic.Field(default=ProbeErrors(), description='errors of the probe')
    brg2_y: ProbeErrors = pydantic.Field(default=ProbeErrors(), description='errors of the probe')
    brg2_z: ProbeErrors = pydantic.Field(default=ProbeErrors(), description='errors of the probe')


class Accelerometers(SensorGroup):
    """The four accelerometers."""

    COLUMN_UNIT = 'm/s^2'

    brg1_ay: FixedErrors = pydantic.Field(default=FixedErrors(), description='errors of the sensor')
    brg1_az: FixedErrors = pydantic.Field(default=FixedErrors(), description='errors of the sensor')
    brg2_ay: FixedErrors = pydantic.Field(default=FixedErrors(), description='errors of the sensor')
    brg2_az: FixedErrors = pydantic.Field(default=FixedErrors(), description='errors of the sensor')


class LoadSensor(SensorGroup):
    """The sensor of the apparent gravity."""

    COLUMN_UNIT = 'm/s^2'

    load_y: FixedErrors = pydantic.Field(default=FixedErrors(), description='errors of the sensor')


class Keyphasor(SensorGroup):
    """The key-phasor's probe."""

    COLUMN_UNIT = 'V'

    bias: float = quantity(0.0, unit='V', ge=-1e3, le=1e3, description='reading off the pulse')
    scale_error: float = quantity(
        0.0, unit='1', ge=-0.9, le=10.0, description='relative error of the height of a pulse'
    )
    missed_probability: float = quantity(
        0.0, unit='1', ge=0.0, le=1.0, description='probability that a pulse is missing'
    )
    double_probability: float = quantity(
        0.0, unit='1', ge=0.0, le=1.0, description='probability of a second, false pulse a turn'
    )
    double_offset_rad: float = quantity(
        1.0, unit='rad', ge=0.3, le=5.9, description='angle from a pulse to the false one'
    )


class Housing(ConfigModel):
    """The bearing housings that the accelerometers sit on, one oscillator each in y and z."""

    mass_kg: float = quantity(
        0.0, unit='kg', ge=0.0, le=1e4, description='mass; 0: sensors on the journals'
    )
    natural_frequency_hz: float = quantity(
        1000.0, unit='Hz', ge=1.0, le=1e5, description='undamped natural frequency'
    )
    damping_ratio: float = quantity(0.03, unit='1', ge=0.0, lt=1.0, description='damping ratio')


class SensorConfig(NoiseLevels):
    """What the sensors add to, and leave out of, the truth."""

    preset: Preset = pydantic.Field(
        default='none', description='values of the keys below that are not given'
    )
    proximity: Proximity = pydantic.Field(default=Proximity(), description='proximity probes')
    accelerometers: Accelerometers = pydantic.Field(
        default=Accelerometers(), description='accelerometers of the bearings'
    )
    load: LoadSensor = pydantic.Field(default=LoadSensor(), description='load sensor')
    keyphasor: Keyphasor = pydantic.Field(default=Keyphasor(), description='key-phasor')
    housing: Housing = pydantic.Field(default=Housing(), description='bearing housings')
    encoder: bool = pydantic.Field(default=True, description='whether the angle column is measured')
    imu_rate_hz: int = quantity(
        200, unit='Hz', ge=0, le=50_000, description='rate of the bearing IMUs; 0: none'
    )
    truth_waveform: bool = pydantic.Field(
        default=False, description='whether the waveform without sensor effects is published too'
    )
    instruments: tuple[InstrumentConfig, ...] = pydantic.Field(
        default=(),
        strict=False,
        description='sensors of your own, which add columns to the waveform',
    )

    @property
    def column_units(self) -> dict[str, str]:
        """The units of all columns of the waveform by their names."""
        own = [instrument.columns for instrument in self.instruments]
        return COLUMN_UNITS | {name: unit for columns in own for name, unit in columns.items()}

    @property
    def groups(self) -> dict[str, SensorGroup]:
        """The kinds of channels by their keys."""
        return {
            'proximity': self.proximity,
            'accelerometers': self.accelerometers,
            'load': self.load,
            'keyphasor': self.keyphasor,
        }

    def with_preset(self, preset: str) -> Self:
        """Return these sensors with another preset; values that differ from their preset stay."""
        own = type(self)(preset=self.preset).model_dump(mode='json')
        changed = _difference(self.model_dump(mode='json'), own)
        return type(self).from_mapping({**changed, 'preset': preset}, 'sensors')

    @pydantic.field_validator('instruments')
    @classmethod
    def _check_columns(cls, given: tuple[InstrumentConfig, ...]) -> tuple[InstrumentConfig, ...]:
        check_columns(given)
        return given

    @pydantic.model_serializer(mode='wrap')
    def _without_no_instruments(self, dump: pydantic.SerializerFunctionWrapHandler) -> Any:
        """Leave the key out if there are none: the recorded configuration stays as it was."""
        plain = dump(self)
        if not self.instruments:
            plain.pop('instruments', None)
        return plain

    @pydantic.model_validator(mode='before')
    @classmethod
    def _fill_in(cls, data: Any) -> Any:
        """Fill in the preset's values for keys that are not given."""
        if not isinstance(data, Mapping):
            return data
        return _merged(values_of(data.get('preset', 'none')), data)


def _difference(data: Mapping[str, Any], base: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entries of `data` that differ from those of `base`, mapping by mapping."""
    return {
        key: _difference(value, base[key]) if isinstance(value, Mapping) else value
        for key, value in data.items()
        if value != base.get(key)
    }


def _merged(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    merged = dict(below)
    for key, value in above.items():
        under = merged.get(key)
        if isinstance(value, Mapping) and isinstance(under, Mapping):
            merged[key] = _merged(under, value)
        else:
            merged[key] = value
    return merged
