# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Manoeuvres as configuration: one model per profile, told apart by the key `profile`.

A load factor is apparent gravity in units of 9.81 m/s^2: the normal one pushes the rotor to +y
(down in the airframe; level flight is 1), the lateral one to +z (to the left wing).
"""

import difflib
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import pydantic

from maneuver_gen.errors import ManeuverError
from maneuver_gen.gusts import Wave, gust_waves
from maneuver_gen.profiles import SMOOTH_STEP_PEAK_SLOPE, RatePulse
from rotor_common.configuration import ConfigModel, quantity
from rotor_common.constants import GRAVITY_M_S2
from rotor_common.errors import DataError
from rotor_common.plain_data import parse_json

LOAD_FACTOR_RANGE = (-3.0, 12.0)
LATERAL_LOAD_FACTOR_RANGE = (-3.0, 3.0)
LONGEST_S = 86400.0
SHIPPED = 'shipped:'
"""Start of the path of a flight that comes with the rig: the same on every machine."""


def _load_factor(default: Any = ..., *, description: str) -> Any:
    low, high = LOAD_FACTOR_RANGE
    return quantity(default, unit='1', description=description, ge=low, le=high)


def _lateral_load_factor(description: str) -> Any:
    low, high = LATERAL_LOAD_FACTOR_RANGE
    return quantity(0.0, unit='1', description=description, ge=low, le=high)


def _time(default: Any = ..., *, description: str, ge: float = 0.0) -> Any:
    return quantity(default, unit='s', description=description, ge=ge, le=LONGEST_S)


class Constant(ConfigModel):
    """The same load for the whole run."""

    profile: Literal['constant'] = 'constant'
    load_factor: float = _load_factor(1.0, description='normal load factor; level flight is 1')
    lateral_load_factor: float = _lateral_load_factor('lateral load factor, positive to the left')


class Step(ConfigModel):
    """A sudden change of the load factor (within one grid interval, 10 ms)."""

    profile: Literal['step'] = 'step'
    before: float = _load_factor(1.0, description='load factor before the step')
    after: float = _load_factor(description='load factor from the step on')
    at_s: float = _time(description='time of the step')


class Ramp(ConfigModel):
    """A straight line from one load factor to another."""

    profile: Literal['ramp'] = 'ramp'
    before: float = _load_factor(1.0, description='load factor before the ramp')
    after: float = _load_factor(description='load factor after the ramp')
    start_s: float = _time(0.0, description='time at which the ramp starts')
    duration_s: float = _time(description='how long the ramp takes', ge=0.01)


class Sinusoid(ConfigModel):
    """A load factor that swings: mean + amplitude sin(2 pi f t + phase)."""

    profile: Literal['sinusoid'] = 'sinusoid'
    mean: float = _load_factor(1.0, description='mean load factor')
    amplitude: float = quantity(
        unit='1', description='zero-to-peak load factor of the swing', ge=0, le=7.5
    )
    # the grid of 100 Hz, read with straight lines, rounds a peak at 5 Hz by 1.2 % at most
    frequency_hz: float = quantity(unit='Hz', description='frequency of the swing', gt=0, le=5)
    phase_rad: float = quantity(
        0.0, unit='rad', description='phase of the swing at time 0', ge=-6.3, le=6.3
    )

    @pydantic.model_validator(mode='after')
    def _within_range(self) -> 'Sinusoid':
        _check_range(
            self.mean - self.amplitude, self.mean + self.amplitude, 'lower mean or amplitude'
        )
        return self


class ClimbDive(ConfigModel):
    """Climbing-diving flight: level, pull-up, climb, push-over, dive, pull-out, level.

    Speed is constant and the flight-path rate gives the load, as in Hou et al. 2016, eq. (1).
    The paper's rate is constant; here it rises and falls smoothly with a limited onset.
    """

    profile: Literal['climb_dive'] = 'climb_dive'
    speed_m_s: float = quantity(120.0, unit='m/s', description='flight speed v', ge=30, le=600)
    pull_rate_rad_s: float = quantity(
        0.1635, unit='rad/s', description='flight-path rate of pull-up and pull-out', gt=0, le=1
    )
    push_rate_rad_s: float = quantity(
        0.0736, unit='rad/s', description='flight-path rate of the push-over, downward', gt=0, le=1
    )
    climb_angle_rad: float = quantity(
        0.36, unit='rad', description='flight-path angle of the climb', gt=0, le=1.57
    )
    dive_angle_rad: float = quantity(
        0.36,
        unit='rad',
        description='flight-path angle of the dive, below the horizon',
        gt=0,
        le=1.57,
    )
    onset_per_s: float = quantity(
        5.0, unit='1/s', description='largest change per second of w_maneuver v / g', ge=0.1, le=20
    )
    level_s: float = _time(1.5, description='level flight before the pull-up and after the end')
    climb_s: float = _time(0.6, description='straight climb')
    dive_s: float = _time(0.6, description='straight dive')
    weight: bool = pydantic.Field(
        True, description='false leaves out the weight, as eq. (1): level flight is then 0'
    )

    @pydantic.model_validator(mode='after')
    def _within_range(self) -> 'ClimbDive':
        steepest = max(self.climb_angle_rad, self.dive_angle_rad)
        least, most = (math.cos(steepest), 1.0) if self.weight else (0.0, 0.0)
        _check_range(
            least - self.push_rate_rad_s * self.speed_m_s / GRAVITY_M_S2,
            most + self.pull_rate_rad_s * self.speed_m_s / GRAVITY_M_S2,
            'lower speed_m_s, pull_rate_rad_s or push_rate_rad_s',
        )
        self.pulses()
        return self

    def pulses(self) -> tuple[RatePulse, RatePulse, RatePulse]:
        """Return pull-up, push-over and pull-out; raises ManeuverError if an angle is too small."""
        climb, dive = self.climb_angle_rad, self.dive_angle_rad
        pull, push = self.pull_rate_rad_s, -self.push_rate_rad_s
        pull_up = self._pulse('climb_angle_rad', self.level_s, pull, climb)
        push_over = self._pulse(
            'climb_angle_rad + dive_angle_rad', pull_up.end_s + self.climb_s, push, -climb - dive
        )
        pull_out = self._pulse('dive_angle_rad', push_over.end_s + self.dive_s, pull, dive)
        return pull_up, push_over, pull_out

    def _pulse(self, name: str, start_s: float, rate_rad_s: float, angle_rad: float) -> RatePulse:
        load_factor_change = abs(rate_rad_s) * self.speed_m_s / GRAVITY_M_S2
        transition_s = SMOOTH_STEP_PEAK_SLOPE * load_factor_change / self.onset_per_s
        hold_s = angle_rad / rate_rad_s - transition_s
        if hold_s < 0.0:
            raise ManeuverError(
                f'{name} = {abs(angle_rad):g} rad is passed before the flight-path rate reaches '
                f'{abs(rate_rad_s):g} rad/s at onset_per_s = {self.onset_per_s:g}; the angle must '
                f'be at least {abs(rate_rad_s) * transition_s:.4g} rad, or the onset faster'
            )
        return RatePulse(start_s, rate_rad_s, transition_s, hold_s)


class Turn(ConfigModel):
    """Level coordinated turn: load factor 1 / cos(bank); lateral load only from stated slip."""

    profile: Literal['turn'] = 'turn'
    bank_rad: float = quantity(
        unit='rad', description='bank angle of the turn, either side', ge=-1.48, le=1.48
    )
    level_s: float = _time(1.5, description='level flight before and after the turn')
    roll_s: float = _time(1.5, description='how long rolling in takes, and rolling out', ge=0.1)
    turn_s: float = _time(10.0, description='how long the bank is held')
    slip_load_factor: float = _lateral_load_factor(
        'lateral load factor from slip, in step with the bank, positive to the left wing'
    )


class Recorded(ConfigModel):
    """A flight recorded in a CSV file with the columns of `recorded.read_flight`."""

    profile: Literal['recorded'] = 'recorded'
    path: str = pydantic.Field(
        min_length=1,
        description='CSV file, relative to the folder of the scenario file; or shipped:NAME',
    )
    start_s: float = quantity(0.0, unit='s', description='time in the file at which the run starts')


class Gusts(ConfigModel):
    """Rough air: a load factor that wanders as in Dryden turbulence, set by `seed`."""

    profile: Literal['gusts'] = 'gusts'
    mean: float = _load_factor(1.0, description='mean load factor')
    # the peaks of a Gaussian course stand some three times higher
    rms: float = quantity(
        0.2, unit='1', description='root mean square of the load factor about its mean', ge=0, le=1
    )
    speed_m_s: float = quantity(120.0, unit='m/s', description='flight speed', ge=30, le=600)
    scale_m: float = quantity(
        533.4, unit='m', description='scale length of the turbulence', ge=10, le=2000
    )
    seed: int = quantity(0, unit='1', description='which course of the gusts', ge=0, le=2**62)

    @pydantic.model_validator(mode='after')
    def _within_range(self) -> 'Gusts':
        most = sum(wave.amplitude for wave in self.waves())
        _check_range(self.mean - most, self.mean + most, 'lower mean or rms')
        return self

    def waves(self) -> tuple[Wave, ...]:
        """Return the sinusoids that make up the course about its mean."""
        return gust_waves(self.rms, self.speed_m_s, self.scale_m, self.seed)


def _check_range(least: float, most: float, remedy: str) -> None:
    low, high = LOAD_FACTOR_RANGE
    # round-off of a limit that is met exactly
    if least < low - 1e-9 or most > high + 1e-9:
        raise ManeuverError(
            f'the load factor could run from {least:.4g} to {most:.4g}; allowed: {low:g} to '
            f'{high:g}, so {remedy}'
        )


def _known_profile(*names: str) -> pydantic.BeforeValidator:
    """Return a check of the key `profile` that says which names there are."""

    def check(value: Any) -> Any:
        if isinstance(value, ConfigModel):
            return value
        choices = f'choose one of {", ".join(names)}'
        if not isinstance(value, Mapping):
            raise ManeuverError(f'a manoeuvre is a mapping with the key profile; {choices}')
        if 'profile' not in value:
            raise ManeuverError(f'profile is missing; {choices}')
        if value['profile'] not in names:
            close = difflib.get_close_matches(str(value['profile']), names, n=1)
            hint = f'did you mean {close[0]!r}?' if close else choices
            raise ManeuverError(f'profile = {value["profile"]!r} is not known here; {hint}')
        return value

    return pydantic.BeforeValidator(check)


_SINGLE = ('constant', 'step', 'ramp', 'sinusoid', 'climb_dive', 'turn', 'recorded', 'gusts')

SingleManeuver = Annotated[
    Annotated[
        Constant | Step | Ramp | Sinusoid | ClimbDive | Turn | Recorded | Gusts,
        pydantic.Field(discriminator='profile'),
    ],
    _known_profile(*_SINGLE),
]


class Segment(ConfigModel):
    """One part of a sequence."""

    duration_s: float = _time(description='how long the segment lasts', ge=0.01)
    maneuver: SingleManeuver = pydantic.Field(description='any profile but a sequence')


class Sequence(ConfigModel):
    """Segments one after the other; each blends smoothly out of the one before.

    The last segment goes on for as long as the run lasts.
    """

    profile: Literal['sequence'] = 'sequence'
    blend_s: float = quantity(
        0.5,
        unit='s',
        description='time from the start of a segment to blend into it',
        ge=0.05,
        le=60,
    )
    # not strict: the check of `profile` leaves lists, which strict mode does not take for tuples
    segments: tuple[Segment, ...] = pydantic.Field(
        strict=False, description='list of duration_s and maneuver, at least one'
    )

    @pydantic.model_validator(mode='after')
    def _room_to_blend(self) -> 'Sequence':
        if not self.segments:
            raise ManeuverError('segments is empty; a sequence has at least one segment')
        for number, segment in enumerate(self.segments):
            if number and segment.duration_s < self.blend_s:
                raise ManeuverError(
                    f'segments[{number}].duration_s = {segment.duration_s:g} is shorter than '
                    f'blend_s = {self.blend_s:g}; lengthen the segment or shorten the blend'
                )
        return self


ManeuverConfig = Annotated[
    Annotated[
        Constant | Step | Ramp | Sinusoid | ClimbDive | Turn | Recorded | Gusts | Sequence,
        pydantic.Field(discriminator='profile'),
    ],
    _known_profile(*_SINGLE, 'sequence'),
]
"""Type of a model's field that holds a manoeuvre."""


class _Root(ConfigModel):
    maneuver: ManeuverConfig


def parse_maneuver(data: Mapping[str, Any] | str) -> ManeuverConfig:
    """Return the manoeuvre of plain data (YAML, JSON) or of a JSON text.

    Raises ConfigError for wrong content and ManeuverError for a text that is not JSON.
    """
    if isinstance(data, str):
        try:
            data = parse_json(data)
        except DataError as error:
            raise ManeuverError(f'the manoeuvre is not valid JSON: {error}') from None
    return _Root.from_mapping({'maneuver': data}).maneuver


def resolve_paths(data: Any, folder: Path) -> Any:
    """Return plain data of a manoeuvre with flight files relative to `folder` made absolute.

    Shipped flights stay as they are. Wrong data pass through unchanged: `parse_maneuver` says
    what is wrong with them.
    """
    if isinstance(data, list):
        return [resolve_paths(item, folder) for item in data]
    if not isinstance(data, Mapping):
        return data
    resolved = {
        key: resolve_paths(value, folder) if key in ('segments', 'maneuver') else value
        for key, value in data.items()
    }
    path = data.get('path')
    if data.get('profile') != 'recorded' or not isinstance(path, str):
        return resolved
    if path and not path.startswith(SHIPPED):
        resolved['path'] = str((folder / path).absolute())
    return resolved
