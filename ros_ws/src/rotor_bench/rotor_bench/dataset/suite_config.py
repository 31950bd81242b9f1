# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The description of a suite: the shipped tables and a user's own YAML."""

from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import pydantic

from rotor_bench.errors import DatasetError
from rotor_common.configuration import ConfigModel, quantity
from rotor_common.errors import DataError
from rotor_common.plain_data import LARGEST_YAML, parse_yaml
from rotor_common.text_file import read_text

Family = Literal[
    'level', 'climb_dive', 'pulls_3g', 'pulls_5g', 'pulls_9g', 'turns', 'recorded', 'gusts'
]
SpeedProgram = Literal['steady', 'run_up', 'run_down', 'governor_steps']
Confounder = Literal['none', 'eccentricity', 'clearance', 'misalignment', 'sensor_fault']
NoisePreset = Literal['realistic', 'quiet', 'noisy', 'none']
SensorFault = Literal[
    'probe_gain', 'probe_scratch', 'probe_noise', 'probe_dropouts', 'missed_pulses',
    'double_pulses', 'load_gain',
]  # fmt: skip

MOST_FLIGHTS = 100_000
SHORTEST_FLIGHT_S = 10.0


def respelt(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return a suite, or a row of the manifest, with the old key `manoeuvre` as `maneuver`."""
    return {'maneuver' if key == 'manoeuvre' else key: value for key, value in data.items()}


def _ordered(value: tuple[float, float]) -> tuple[float, float]:
    if value[0] > value[1]:
        raise DatasetError(f'the range [{value[0]:g}, {value[1]:g}] runs backwards; give low, high')
    return value


Range = Annotated[tuple[float, float], pydantic.AfterValidator(_ordered)]


def _range(description: str, unit: str, *, ge: float, le: float) -> Any:
    """Return a field that holds [low, high], both between `ge` and `le`."""

    def inside(value: tuple[float, float]) -> tuple[float, float]:
        if not ge <= value[0] <= value[1] <= le:
            raise DatasetError(f'{list(value)} is out of range; allowed: {ge:g} to {le:g} {unit}')
        return value

    field = pydantic.Field(description=f'{description}, {unit}')
    field.metadata.append(pydantic.AfterValidator(inside))
    return field


def _levels(description: str) -> Any:
    return pydantic.Field(min_length=1, description=description)


class Group(ConfigModel):
    """Machines that have the same number of flights of each kind."""

    name: str = pydantic.Field(min_length=1, description='name of the group')
    split: Literal['train', 'test'] = pydantic.Field(description='split that its flights belong to')
    machines: int = quantity(unit='1', description='number of machines', ge=1, le=10_000)
    healthy: int = quantity(unit='1', description='healthy test flights a machine', ge=0, le=100)
    cracked: int = quantity(unit='1', description='cracked test flights a machine', ge=0, le=100)
    growing: int = quantity(
        unit='1',
        description='flights a machine with a growing crack, each beside a healthy one as long',
        ge=0,
        le=10,
    )
    held_out: bool = pydantic.Field(description='whether it flies the held-out families')
    noise: tuple[NoisePreset, ...] = _levels('noise presets, dealt to the machines in turn')


class Reference(ConfigModel):
    """One healthy flight that a machine's baseline is fitted on."""

    family: Family | Literal['mixed'] = pydantic.Field(description='maneuver family')
    speed_program: SpeedProgram | Literal['sweep'] = pydantic.Field(description='speed program')


class MachineDraws(ConfigModel):
    """What differs from machine to machine."""

    speed_rad_s: Range = _range('nominal speed', 'rad/s', ge=50.0, le=1000.0)
    eccentricities_m: tuple[float, ...] = _levels('eccentricity ladder, m')
    clearances_m: tuple[float, ...] = _levels('clearance ladder, m')
    misalignments_n: tuple[float, ...] = _levels('2x force ladder, N')
    shaft_stiffness_n_m: Range = _range('stiffness of the shaft', 'N/m', ge=1e6, le=1e9)
    damping_ratio: Range = _range('damping ratio of the shaft', '1', ge=0.0, le=0.5)
    crack_half_angle_rad: Range = _range(
        'half angle over which a crack opens', 'rad', ge=0.01, le=1.57
    )


class ChangeDraws(ConfigModel):
    """What a confounder changes after the reference flights."""

    eccentricity_factor: Range = _range('factor on the eccentricity', '', ge=1.0, le=10.0)
    clearance_step_m: Range = _range('added to the clearance', 'm', ge=0.0, le=5e-5)
    misalignment_step_n: Range = _range('added to the 2x force', 'N', ge=0.0, le=5e3)


class SensorDraws(ConfigModel):
    """The sensors of a machine, and what a fault of one changes."""

    noise_factors: dict[NoisePreset, float] = pydantic.Field(
        description='factor on noise densities and bias walks of the preset `realistic`'
    )
    probe_scale_error: float = quantity(
        unit='1', description='scale errors of the probes, either side', ge=0.0, le=0.5
    )
    probe_bias_m: float = quantity(
        unit='m', description='bias of the probes, either side', ge=0.0, le=1e-3
    )
    accelerometer_scale_error: float = quantity(
        unit='1', description='scale errors of the accelerometers, either side', ge=0.0, le=0.5
    )
    cross_axis: float = quantity(
        unit='1', description='cross-axis sensitivities, either side', ge=0.0, le=0.5
    )
    load_bias_m_s2: float = quantity(
        unit='m/s^2', description='bias of the load sensor, either side', ge=0.0, le=50.0
    )
    load_scale_error: float = quantity(
        unit='1', description='scale error of the load sensor, either side', ge=0.0, le=0.5
    )
    runout_m: tuple[Range, ...] = pydantic.Field(
        max_length=3, description='slow-roll runout of order 1, 2, 3 in each plane, m'
    )
    faults: tuple[SensorFault, ...] = _levels('sensor faults, one of which a flight has')
    fault_gain: float = quantity(
        unit='1', description='added to the scale error of disk_y', ge=-0.8, le=5.0
    )
    fault_scratch_m: float = quantity(
        unit='m', description='runout of orders 1 to 3 added at the disk', ge=0.0, le=1e-4
    )
    fault_noise_m_sqrt_hz: float = quantity(
        unit='m/sqrt(Hz)', description='added to the noise of the probes', ge=0.0, le=1e-6
    )
    fault_dropouts_per_s: float = quantity(
        unit='1/s', description='losses of each probe', ge=0.0, le=100.0
    )
    fault_pulses: float = quantity(
        unit='1', description='probability of a missed or double pulse', ge=0.0, le=1.0
    )
    fault_load_gain: float = quantity(
        unit='1', description='added to the scale error of the load', ge=-0.8, le=5.0
    )


class SpeedDraws(ConfigModel):
    """Speed programs, as parts of the machine's nominal speed."""

    steady: Range = _range('steady flights', '', ge=0.1, le=1.5)
    sweep: Range = _range('ends of run-ups and run-downs', '', ge=0.1, le=1.5)
    reference_sweep: Range = _range('ends of the reference sweep', '', ge=0.1, le=1.5)
    steps: Range = _range('levels of the governor', '', ge=0.1, le=1.5)
    step_every_s: Range = _range('time between steps of the governor', 's', ge=1.0, le=1e4)
    governor_acceleration_rad_s2: float = quantity(
        unit='rad/s^2', description='acceleration of the governor steps', ge=0.1, le=2000.0
    )

    def highest(self) -> float:
        """Return the highest part of the nominal speed that any program reaches."""
        return max(self.steady[1], self.sweep[1], self.reference_sweep[1], self.steps[1])


class ManeuverDraws(ConfigModel):
    """Lengths and depths of the maneuvers of a flight."""

    level_leg_s: Range = _range('level legs between maneuvers', 's', ge=0.0, le=1e4)
    blend_s: float = quantity(unit='s', description='time into and out of a pull', ge=0.1, le=60.0)
    pull_hold_s: Range = _range('a pull after its onset', 's', ge=0.0, le=1e4)
    pull_depth: Range = _range('part of the load factor above 1', '', ge=0.0, le=1.0)
    bank_rad: Range = _range('bank of a turn, either side', 'rad', ge=0.0, le=1.45)
    turn_s: Range = _range('a turn after rolling in', 's', ge=0.0, le=1e4)
    slip_load_factor: Range = _range('lateral load factor in turns', '', ge=-1.0, le=1.0)
    climb_pull_load_factor: Range = _range('load factor of a pull-up', '', ge=1.2, le=6.0)
    climb_push_load_factor: Range = _range('load factor of a push-over', '', ge=-1.0, le=0.8)
    climb_speed_m_s: Range = _range('flight speed of a climb-dive', 'm/s', ge=60.0, le=600.0)
    gust_patch_s: Range = _range('length of a patch of rough air', 's', ge=1.0, le=1e4)
    gust_rms: Range = _range('root mean square of the load factor in it', '', ge=0.0, le=0.5)


class SuiteConfig(ConfigModel):
    """Everything that the plan of a suite depends on, besides its seed."""

    name: str = pydantic.Field(
        pattern='^[A-Za-z0-9_-]+$', description='short name of letters, digits, _ and -'
    )
    description: str = pydantic.Field('', description='what is in it, for people')
    rate_hz: int = quantity(unit='Hz', description='samples per second', ge=1000, le=200_000)
    block_samples: int = quantity(unit='1', description='samples per block', ge=16, le=65_536)
    steps_per_revolution: int = quantity(
        unit='1', description='least integration steps per revolution', ge=128, le=8192
    )
    settle_revolutions: int = quantity(
        unit='1', description='revolutions before time 0', ge=0, le=2000
    )
    flight_s: float = quantity(
        unit='s', description='length of a flight', ge=SHORTEST_FLIGHT_S, le=3600.0
    )
    growth_s: float = quantity(
        unit='s', description='length of a flight with a growing crack',
        ge=SHORTEST_FLIGHT_S, le=36_000.0,
    )  # fmt: skip
    groups: tuple[Group, ...] = _levels('groups of machines')
    references: tuple[Reference, ...] = _levels('reference flights of every machine')
    crack_stiffness_ratios: tuple[float, ...] = _levels('crack ladder K = dk/k')
    growth_to: float = quantity(unit='1', description='K at the end of a growth', gt=0.0, le=0.5)
    families: tuple[Family, ...] = _levels('maneuver families')
    held_out_families: tuple[Family, ...] = pydantic.Field(
        description='families that no flight of the train split belongs to'
    )
    speed_programs: tuple[SpeedProgram, ...] = _levels('speed programs')
    confounders: tuple[Confounder, ...] = _levels('what changes after the reference flights')
    machine: MachineDraws = pydantic.Field(description='one machine')
    sensors: SensorDraws = pydantic.Field(description='sensors')
    changes: ChangeDraws = pydantic.Field(description='what confounders change')
    speed: SpeedDraws = pydantic.Field(description='speed programs')
    maneuver: ManeuverDraws = pydantic.Field(description='maneuvers')

    @pydantic.model_validator(mode='after')
    def _check(self) -> Self:
        flights = sum(
            group.machines
            * (len(self.references) + group.healthy + group.cracked + 2 * group.growing)
            for group in self.groups
        )
        if flights > MOST_FLIGHTS:
            raise DatasetError(
                f'{flights} flights are too many; a suite has at most {MOST_FLIGHTS}'
            )
        for group in self.groups:
            unknown = set(group.noise) - {'none', *self.sensors.noise_factors}
            if unknown:
                raise DatasetError(
                    f'noise preset {min(unknown)!r} of group {group.name!r} has no factor; add it '
                    'to sensors.noise_factors'
                )
        if not self.families_of(held_out=False):
            raise DatasetError('held_out_families leaves no family; keep at least one')
        return self

    @classmethod
    def from_mapping(cls, data: Mapping[str, Any], where: str = '') -> Self:
        """Return the suite from plain data, also from those of an older data set."""
        return super().from_mapping(respelt(data), where)

    def families_of(self, *, held_out: bool) -> tuple[str, ...]:
        """Return the families that a group flies."""
        return tuple(f for f in self.families if held_out or f not in self.held_out_families)

    def plain(self) -> dict[str, Any]:
        """Return plain data that makes an equal description again."""
        return self.model_dump(mode='json')


def shipped_suites() -> list[str]:
    """Return the names of the suites that come with the rig."""
    return sorted(entry.name[:-5] for entry in _folder().iterdir() if entry.name.endswith('.yaml'))


def load_suite(source: str) -> SuiteConfig:
    """Return the suite of a shipped name or a YAML file.

    A file may start from another suite by the key `base`, a shipped name or a path relative to
    the file; its keys replace those of the base, mappings key by key.

    Raises DatasetError or ConfigError with one sentence.
    """
    return SuiteConfig.from_mapping(_read(source, Path()))


def _folder() -> Any:
    return files('rotor_bench') / 'dataset' / 'suites'


def _read(source: str, folder: Path, depth: int = 0) -> dict[str, Any]:
    if source in shipped_suites():
        text, place = (_folder() / f'{source}.yaml').read_text('utf-8'), Path()
    else:
        path = folder / source
        if not path.is_file():
            raise DatasetError(
                f'suite {source!r} is neither a file nor one of {", ".join(shipped_suites())}'
            )
        try:
            text, place = read_text(path, LARGEST_YAML), path.parent
        except DataError as error:
            raise DatasetError(f'suite {error}') from None
    data = respelt(_parse(text, source))
    base = data.pop('base', None)
    if base is None:
        return data
    if depth > 8 or not isinstance(base, str):
        raise DatasetError(f'suite {source}: base must be a suite that does not lead back to it')
    return _merged(_read(base, place, depth + 1), data)


def _parse(text: str, source: str) -> dict[str, Any]:
    try:
        data = parse_yaml(text)
    except DataError as error:
        raise DatasetError(f'suite {source}: {error}') from None
    if not isinstance(data, dict):
        raise DatasetError(f'suite {source} must be a mapping of keys such as `base`')
    return data


def _merged(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return `base` with `changes`: mappings are merged, everything else is replaced."""
    result = dict(base)
    for key, value in changes.items():
        old = result.get(key)
        both = isinstance(old, Mapping) and isinstance(value, Mapping)
        result[key] = _merged(old, value) if both else value  # type: ignore[arg-type]
    return result
