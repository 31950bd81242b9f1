# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Configuration errors are one sentence with key, value, range and remedy."""

from typing import Annotated, Literal

import pydantic
import pytest

from rotor_common.configuration import ConfigModel, bounds_of, quantity, range_text, unit_of
from rotor_common.errors import ConfigError


class Shaft(ConfigModel):
    stiffness_n_m: float = quantity(2.5e7, unit='N/m', description='stiffness a side', gt=0)
    crack_ratio: float = quantity(0.0, unit='1', description='crack depth measure', ge=0, le=0.5)


class Constant(ConfigModel):
    profile: Literal['constant'] = 'constant'
    load_factor: float = quantity(unit='1', description='load factor', ge=-3, le=12)


class Step(ConfigModel):
    profile: Literal['step'] = 'step'
    at_s: float = quantity(unit='s', description='time of the step', ge=0)

    @pydantic.model_validator(mode='after')
    def _even(self) -> 'Step':
        if self.at_s > 100:
            raise ValueError('at_s lies after the end of the run')
        return self


class Rig(ConfigModel):
    shaft: Shaft = Shaft()
    maneuver: Annotated[Constant | Step, pydantic.Field(discriminator='profile')] = Constant(
        load_factor=1.0
    )
    steps: tuple[Step, ...] = ()


@pytest.mark.parametrize(
    ('data', 'sentence'),
    [
        ({'shaft': {'crack_ratio': 0.7}}, ('rig.shaft.crack_ratio = 0.7 is out of range; allowed: '
         '0 to 0.5 (crack depth measure)')),
        ({'shaft': {'stiffness_n_m': 0}}, ('rig.shaft.stiffness_n_m = 0 is out of range; allowed: '
         'above 0 N/m (stiffness a side)')),
        ({'shaft': {'crack_rato': 0.1}}, ("rig.shaft.crack_rato is not a known key; did you mean "
         "'crack_ratio'?")),
        ({'qqq': 1}, 'rig.qqq is not a known key; allowed keys: maneuver, shaft, steps'),
        ({'shaft': {'crack_ratio': 'deep'}}, ("rig.shaft.crack_ratio = 'deep' is not allowed; it "
         'must be a valid number, 0 to 0.5')),
        ({'maneuver': {'profile': 'constant'}}, ('rig.maneuver.load_factor is missing; it is: '
         'load factor')),
        ({'maneuver': {'profile': 'constant', 'load_factor': 20}},
         'rig.maneuver.load_factor = 20 is out of range; allowed: -3 to 12 (load factor)'),
        ({'maneuver': {'profile': 'constant', 'load_factor': 2, 'g': 1}},
         'rig.maneuver.g is not a known key; allowed keys: load_factor, profile'),
        ({'maneuver': {'profile': 'step', 'at_s': 200}},
         'rig.maneuver: at_s lies after the end of the run'),
        ({'steps': [{'at_s': 1}, {'at_s': -1}]},
         'rig.steps[1].at_s = -1 is out of range; allowed: 0 s or more (time of the step)'),
        ({'shaft': 5}, 'rig.shaft = 5 is not allowed; it must be an object'),
        ({'shaft': {'crack_ratio': float('nan')}}, 'rig.shaft.crack_ratio'),
    ],
)  # fmt: skip
def test_one_sentence(data: dict[str, object], sentence: str) -> None:
    with pytest.raises(ConfigError) as caught:
        Rig.from_mapping(data, 'rig')
    assert sentence in str(caught.value)
    assert '\n' not in str(caught.value)


def test_the_wrong_profile_names_the_right_ones() -> None:
    with pytest.raises(ConfigError, match=r"'constant', 'step'"):
        Rig.from_mapping({'maneuver': {'profile': 'loop'}})


def test_python_construction_gives_the_same_sentence() -> None:
    with pytest.raises(ConfigError, match=r'crack_ratio = 0\.7 is out of range'):
        Shaft(crack_ratio=0.7)


def test_models_are_frozen_and_refuse_non_finite_numbers() -> None:
    with pytest.raises(pydantic.ValidationError):
        Shaft().crack_ratio = 0.1
    with pytest.raises(ConfigError):
        Shaft(stiffness_n_m=float('inf'))


def test_data_that_is_not_plain_is_refused() -> None:
    with pytest.raises(ConfigError, match='not plain'):
        Rig.from_mapping({'shaft': {1, 2}})


def test_units_and_ranges_come_from_the_field() -> None:
    field = Shaft.model_fields['crack_ratio']
    assert unit_of(field) == '1'
    assert bounds_of(field) == {'ge': 0, 'le': 0.5}
    assert range_text(Shaft.model_fields['stiffness_n_m']) == 'above 0 N/m'
