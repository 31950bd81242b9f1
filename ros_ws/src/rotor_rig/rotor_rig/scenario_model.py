# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Scenarios: one YAML file describes a run, live or offline."""

import copy
import json
import math
import re
import textwrap
from collections.abc import Iterator, Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any, Self

import pydantic

from maneuver_gen import ManeuverConfig, resolve_paths
from maneuver_gen.load_grid import check_duration
from rotor_common.configuration import ConfigModel, quantity, unit_of
from rotor_common.constants import OFFLINE_EPOCH_NS
from rotor_common.errors import DataError
from rotor_common.plain_data import LARGEST_YAML, dump_yaml, parse_yaml
from rotor_common.text_file import read_text
from rotor_recording.bag_folder import is_recording
from rotor_recording.reading import Recording
from rotor_rig.errors import ScenarioError
from rotor_sim.plant.parameters import RotorParameters, Variant
from rotor_sim.rotor_config import (
    CrackRamp,
    Forcing,
    ParameterChange,
    RotorSimConfig,
    SpeedConfig,
)
from rotor_sim.sensors.sensor_config import SensorConfig
from vibration_monitor.monitor_config import MonitorConfig

DEFAULT_SCENARIO = 'climb_dive'
LONGEST_BLOCK_S = 2.0
ROUNDING = 1e-3
"""A value of the monitor that differs from the rotor's by less was only rounded."""


def _simulated(name: str) -> Any:
    """Return the field of the simulator's configuration: default, unit, range and text."""
    return copy.copy(RotorSimConfig.model_fields[name])


class Scenario(ConfigModel):
    """Everything that a run depends on: rotor, speed, sensors, maneuver, monitor, length, seed.

    The keys of a scenario file are the fields; `docs/scenarios.md` says what they mean. All
    values are SI. What the monitor must know of the rotor is filled in where it is not given.
    """

    variant: Variant = _simulated('variant')
    rotor: RotorParameters = _simulated('rotor')
    speed: SpeedConfig = _simulated('speed')
    crack_growth: tuple[CrackRamp, ...] = _simulated('crack_growth')
    forcing: Forcing = _simulated('forcing')
    rate_hz: int = _simulated('rate_hz')
    block_samples: int = _simulated('block_samples')
    steps_per_revolution: int = _simulated('steps_per_revolution')
    settle_revolutions: int = _simulated('settle_revolutions')
    sensors: SensorConfig = _simulated('sensors')
    seed: int = _simulated('seed')
    changes: tuple[ParameterChange, ...] = _simulated('changes')
    name: str = pydantic.Field(
        pattern='^[A-Za-z0-9_-]+$',
        description='short name of letters, digits, _ and -, used for the recording',
    )
    description: str = pydantic.Field(default='', description='what the scenario shows, for people')
    duration_s: float = quantity(20.0, unit='s', description='length of the run', gt=0, le=86400)
    epoch_ns: int = quantity(
        OFFLINE_EPOCH_NS, unit='ns', description='stamp of time 0 in an offline run', ge=0, lt=2**62
    )
    maneuver: ManeuverConfig = pydantic.Field(description='what the aircraft flies')
    monitor: MonitorConfig = pydantic.Field(  # type: ignore[assignment]
        default={}, description='what the monitor computes and when it warns'
    )

    @pydantic.field_validator('monitor', mode='wrap')
    @classmethod
    def _know_the_rotor(
        cls,
        monitor: Any,
        validate: pydantic.ValidatorFunctionWrapHandler,
        info: pydantic.ValidationInfo,
    ) -> Any:
        """Return the monitor, with missing values that follow from the rotor filled in."""
        if not isinstance(monitor, Mapping):
            return validate(monitor)
        rotor, crack = info.data.get('rotor'), monitor.get('crack', {})
        if rotor is not None and isinstance(crack, Mapping):
            crack = _crack_facts(rotor) | dict(crack)
            monitor = _bearing_facts(rotor) | dict(monitor) | {'crack': crack}
        return MonitorConfig.model_validate_json(json.dumps(monitor))

    @pydantic.model_validator(mode='after')
    def _check(self) -> Self:
        self.rotor_sim().check()
        check_duration(self.maneuver, self.duration_s)
        if self.block_samples > LONGEST_BLOCK_S * self.rate_hz:
            raise ScenarioError(
                f'block_samples = {self.block_samples} at rate_hz = {self.rate_hz} is longer than '
                f'{LONGEST_BLOCK_S:g} s, more than the load is published ahead; make it shorter'
            )
        return self

    def rotor_sim(self) -> RotorSimConfig:
        """Return the simulator's configuration; its parts have been checked here."""
        parts = {name: getattr(self, name) for name in RotorSimConfig.model_fields}
        return RotorSimConfig.model_construct(**parts)

    def warnings(self) -> list[str]:
        """Return one sentence for each value of the monitor that contradicts the rotor."""
        return [
            f'monitor.{prefix}{name} = {getattr(section, name):g} contradicts the rotor, which '
            f'has {value:g}; leave it out unless the monitor is to be wrong'
            for section, prefix, facts in (
                (self.monitor.crack, 'crack.', _crack_facts(self.rotor)),
                (self.monitor, '', _bearing_facts(self.rotor)),
            )
            for name, value in facts.items()
            if not math.isclose(getattr(section, name), value, rel_tol=ROUNDING)
        ]

    def plain(self) -> dict[str, Any]:
        """Return the scenario as plain data that makes an equal scenario again."""
        return self.model_dump(mode='json')

    def yaml(self) -> str:
        """Return the YAML of an equal scenario: every value, with its unit.

        Values of the rotor that the variant sets are comments.
        """
        return ''.join(_yaml_lines(self, self.plain()))


def _yaml_lines(
    model: ConfigModel, plain: Mapping[str, Any], indent: str = '', column_unit: str = ''
) -> Iterator[str]:
    """Yield the YAML lines of a part; `column_unit` is what its unit [u] stands for."""
    column_unit = getattr(model, 'COLUMN_UNIT', column_unit)
    for name, value in plain.items():
        part, unit = getattr(model, name), unit_of(type(model).model_fields[name])
        if isinstance(part, ConfigModel) and value:
            yield f'{indent}{name}:\n'
            yield from _yaml_lines(part, value, indent + '  ', column_unit)
        else:
            text = dump_yaml({name: value}).rstrip()
            if unit not in {'', '1'} and '\n' not in text:
                text += f'  # {re.sub("^u", column_unit, unit)}'
            yield textwrap.indent(text + '\n', indent)
    if isinstance(model, RotorParameters):
        for name in sorted(type(model).model_fields.keys() - plain.keys() - {'variant'}):
            yield f'{indent}# {name}: {getattr(model, name)}, of the variant\n'


def _crack_facts(rotor: RotorParameters) -> dict[str, float]:
    """Return the values of `monitor.crack` that follow from the rotor."""
    return {
        'rigid_critical_speed_rad_s': rotor.critical_speed_rad_s,
        'damping_ratio': rotor.damping_ratio,
        'crack_half_angle_rad': rotor.crack_half_angle_rad,
    }


def _bearing_facts(rotor: RotorParameters) -> dict[str, float]:
    """Return the values of `monitor` that follow from the bearings."""
    return {'ball_pass_order': rotor.ball_pass_order, 'ball_count': rotor.ball_count}


def shipped_scenarios() -> list[str]:
    """Return the names of the scenarios that come with the rig."""
    folder = files('rotor_rig') / 'scenarios'
    return sorted(entry.name[:-5] for entry in folder.iterdir() if entry.name.endswith('.yaml'))


def load_scenario(source: str, **changes: Any) -> Scenario:
    """Return the scenario of a shipped name, a YAML file or a recording.

    Args:
        source: a name from `shipped_scenarios`, a path to a YAML file, or a recording, whose
            run it then repeats, parameter changes included.
        changes: top-level keys that replace the file's, such as `duration_s`.

    Raises:
        ScenarioError: not found, not readable, not YAML.
        ConfigError: a key, type or value that is not allowed.

    """
    path = Path(source)
    if source in shipped_scenarios():
        text = (files('rotor_rig') / 'scenarios' / f'{source}.yaml').read_text('utf-8')
        data = _parse(text, source)
    elif is_recording(path):
        data = _from_recording(path)
    elif path.is_file():
        data = _parse(_read(path), source)
    else:
        raise ScenarioError(
            f'scenario {source!r} is neither a file nor one of {", ".join(shipped_scenarios())}'
        )
    data.setdefault('name', path.stem)
    if 'maneuver' in data:
        data['maneuver'] = resolve_paths(data['maneuver'], path.parent.resolve())
    return Scenario.from_mapping({**data, **changes})


def _read(path: Path) -> str:
    try:
        return read_text(path, LARGEST_YAML)
    except DataError as error:
        raise ScenarioError(f'scenario {error}') from None


def _parse(text: str, source: str) -> dict[str, Any]:
    try:
        data = parse_yaml(text)
    except DataError as error:
        raise ScenarioError(f'scenario {source}: {error}') from None
    if not isinstance(data, dict):
        raise ScenarioError(f'scenario {source} must be a mapping of keys such as `maneuver`')
    return data


def _from_recording(path: Path) -> dict[str, Any]:
    config = Recording(path).config()
    scenario = (config or {}).get('scenario')
    if not isinstance(scenario, Mapping) or not scenario:
        raise ScenarioError(f'recording {path} holds no scenario, so its run cannot be repeated')
    return dict(scenario)
