# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Every impossible configuration ends in one sentence that names key, value and remedy."""

import json
import math
from typing import Any

import pytest

from rotor_common.errors import ConfigError, RigError
from rotor_sim import RotorError, RotorParameters, RotorSimConfig
from rotor_sim.plant.parameters import VARIANTS
from rotor_sim.rotor_config import LiveParameters


def change(sample: int, parameter: str, value: Any) -> dict[str, Any]:
    return {'sample': sample, 'parameter': parameter, 'value': value}


def ramp(at_s: float, to_rad_s: float) -> dict[str, float]:
    return {'at_s': at_s, 'to_rad_s': to_rad_s}


BAD = [
    (
        {'forcing': {'amplitude_n': -1}},
        'forcing.amplitude_n = -1 is out of range; allowed: 0 to 10000 N',
    ),
    ({'forcing': {'phase_rad': 7}}, 'forcing.phase_rad = 7 is out of range; allowed: -6.28319 to'),
    ({'forcing': {'size_n': 7}}, 'forcing.size_n is not a known key'),
    ({'x': 1}, 'x is not a known key; allowed keys: block_samples, changes'),
    ({'varient': 'derived'}, "varient is not a known key; did you mean 'variant'?"),
    ({'variant': 'foo'}, "variant = 'foo' is not allowed; it must be 'derived', 'natural'"),
    ({'variant': 'custom'}, "variant = 'custom' is not allowed"),
    ({'rotor': 3}, 'rotor = 3 is not allowed'),
    (
        {'rotor': {'disk_mass': 3}},
        "rotor.disk_mass is not a known key; did you mean 'disk_mass_kg'?",
    ),
    (
        {'rotor': {'disk_mass_kg': -3}},
        'rotor.disk_mass_kg = -3 is out of range; allowed: 0.1 to 10000 kg',
    ),
    (
        {'rotor': {'disk_mass_kg': 'heavy'}},
        "rotor.disk_mass_kg = 'heavy' is not allowed; it must be a valid number",
    ),
    (
        {'rotor': {'clearance_m': math.nan}},
        'rotor.clearance_m = nan is out of range; allowed: 0 to 0.0001 m',
    ),
    (
        {'rotor': {'ball_count': 8.5}},
        'rotor.ball_count = 8.5 is not allowed; it must be a valid integer',
    ),
    (
        {'rotor': {'crack_stiffness_ratio': 0.6}},
        'rotor.crack_stiffness_ratio = 0.6 is out of range; allowed: 0 to 0.5',
    ),
    ({'rotor': {'load_scale': 2.0, 'disk_mass': 3}}, 'rotor: load_scale belongs to the variant'),
    ({'rotor': {'crack_half_angle_rad': 0}}, 'rotor.crack_half_angle_rad = 0 is out of range'),
    (
        {'rotor': {'load_scale': 2.0}},
        'rotor: load_scale belongs to the variant; choose it by the key `variant`',
    ),
    (
        {'rotor': {'outer_radius_m': 0.03}},
        'rotor: outer_radius_m = 0.03 m is not above inner_radius_m = 0.0401 m',
    ),
    (
        {'variant': 'figure', 'rotor': {'crack_stiffness_ratio': 0.5}},
        "rotor: crack_stiffness_ratio = 0.5 leaves the shaft of variant 'figure' no stiffness",
    ),
    ({'speed': 3}, 'speed = 3 is not allowed'),
    (
        {'speed': {'inital_rad_s': 9}},
        "speed.inital_rad_s is not a known key; did you mean 'initial_rad_s'?",
    ),
    (
        {'speed': {'initial_rad_s': 2000}},
        'speed.initial_rad_s = 2000 is out of range; allowed: 10 to 1200 rad/s',
    ),
    (
        {'speed': {'initial_rad_s': 0}},
        'speed.initial_rad_s = 0 is out of range; allowed: 10 to 1200 rad/s',
    ),
    ({'speed': {'ramps': [ramp(-1, 400)]}}, 'speed.ramps[0].at_s = -1 is out of range'),
    (
        {'speed': {'ramps': [{'to_rad_s': 400}]}},
        'speed.ramps[0].at_s is missing; it is: start after time 0',
    ),
    ({'speed': {'ramps': [ramp(1, 5)]}}, 'speed.ramps[0].to_rad_s = 5 is out of range'),
    (
        {'speed': {'ramps': [ramp(1, 400), ramp(1.5, 500)]}},
        'speed.ramps[1].at_s = 1.5 s is too early: the ramp before it ends at 1.96 s',
    ),
    ({'speed': {'ramps': [ramp(3, 400), ramp(1, 352)]}}, 'speed.ramps[1].at_s = 1 s is too early'),
    (
        {'speed': {'ramps': [ramp(1, 400)], 'highest_rad_s': 390}},
        'speed.highest_rad_s = 390 rad/s is below the 400 rad/s that the speed profile reaches',
    ),
    (
        {'speed': {'governor_acceleration_rad_s2': 0}},
        'speed.governor_acceleration_rad_s2 = 0 is out of range',
    ),
    (
        {'crack_growth': [{'at_s': 1, 'to': 0.7}]},
        'crack_growth[0].to = 0.7 is out of range; allowed: 0 to 0.5',
    ),
    (
        {'variant': 'figure', 'crack_growth': [{'at_s': 1, 'to': 0.5}]},
        'crack_growth[0].to: crack_stiffness_ratio = 0.5 leaves the shaft',
    ),
    (
        {'crack_growth': [{'at_s': 1, 'to': 0.2, 'over_s': 3}, {'at_s': 2, 'to': 0.3}]},
        'crack_growth[1].at_s = 2 s is too early: the growth before it ends at 4 s',
    ),
    ({'rate_hz': 100}, 'rate_hz = 100 is out of range; allowed: 1000 to 200000 Hz'),
    ({'rate_hz': 10240.5}, 'rate_hz = 10240.5 is not allowed; it must be a valid integer'),
    ({'block_samples': 0}, 'block_samples = 0 is out of range; allowed: 1 to 65536'),
    (
        {'steps_per_revolution': 64},
        'steps_per_revolution = 64 is out of range; allowed: 128 to 8192',
    ),
    ({'settle_revolutions': 3000}, 'settle_revolutions = 3000 is out of range; allowed: 0 to 2000'),
    (
        {'sensors': {'imu_rate_hz': 2561}},
        'sensors.imu_rate_hz = 2561 Hz is above a quarter of rate_hz = 10240 Hz',
    ),
    ({'sensors': {'encoder': 1}}, 'sensors.encoder = 1 is not allowed; it must be a valid boolean'),
    (
        {'sensors': {'displacement_noise_m': -1}},
        'sensors.displacement_noise_m = -1 is out of range',
    ),
    ({'seed': -1}, 'seed = -1 is out of range'),
    ({'seed': 'a'}, "seed = 'a' is not allowed; it must be a valid integer"),
    (
        {'changes': [change(5, 'clearance_m', 0.0)]},
        "changes[0].parameter = 'clearance_m' is not allowed",
    ),
    (
        {'changes': [change(-5, 'crack_stiffness_ratio', 0.1)]},
        'changes[0].sample = -5 is out of range',
    ),
    (
        {'changes': [change(5, 'crack_stiffness_ratio', 1.0)]},
        'changes[0]: crack_stiffness_ratio = 1.0 is out of range; allowed: 0 to 0.5',
    ),
    (
        {'changes': [change(5, 'speed_target_rad_s', 1000.0)]},
        'changes[0]: speed_target_rad_s = 1000 rad/s is above 377.0 rad/s',
    ),
    (
        {'changes': [change(5, 'load_noise_m_s2', 1.0), change(4, 'load_noise_m_s2', 0.0)]},
        'changes[1].sample = 4 comes before the change at 5',
    ),
]


@pytest.mark.parametrize(('data', 'sentence'), BAD, ids=[json.dumps(b[0])[:60] for b in BAD])
def test_bad_configuration_gets_its_sentence(data: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ConfigError) as caught:
        RotorSimConfig.from_mapping(data)
    message = str(caught.value)
    assert message.startswith(sentence)
    assert '\n' not in message


@pytest.mark.parametrize(
    ('call', 'sentence'),
    [
        (
            lambda: RotorParameters.hou2016('x'),
            "variant = 'x' is not known; it must be one of derived, natural, figure, figure_chaos",
        ),
        (
            lambda: RotorParameters.hou2016(beta=1.0),
            'beta is not a known key; allowed keys: ',
        ),
        (lambda: RotorParameters.hou2016(clearence_m=1.0), "did you mean 'clearance_m'?"),
        (
            lambda: RotorParameters(load_scale=2.0),
            "load_scale = 2.0 is not that of variant 'derived' (1.0); name the variant `custom`",
        ),
        (
            lambda: RotorParameters(eccentricity_m=1.0),
            'eccentricity_m = 1.0 is out of range; allowed: 0 to 0.001 m',
        ),
    ],
)
def test_bad_parameters_get_their_sentence(call: Any, sentence: str) -> None:
    with pytest.raises(RigError) as caught:
        call()
    assert sentence in str(caught.value)


def test_parameters_are_frozen_and_variants_are_data() -> None:
    p = RotorParameters.hou2016(clearance_m=1e-6)
    with pytest.raises(ValueError, match='frozen'):
        p.clearance_m = 0.0
    for variant, data in VARIANTS.items():
        named = RotorParameters.hou2016(variant)
        assert named.variant == variant
        assert {name: getattr(named, name) for name in data} == data
    assert RotorParameters.hou2016('natural').bearing_crack_scale == pytest.approx(4.0 / 32.1)
    assert RotorParameters.hou2016('figure').bearing_crack_scale == 2.0
    mixed = RotorParameters(variant='custom', load_scale=2.0, coupling_sign=1)
    assert mixed.load_scale == 2.0


def test_every_parameter_says_what_it_is() -> None:
    for name, field in RotorParameters.model_fields.items():
        assert field.description, name
    for model in (RotorSimConfig, LiveParameters):
        for name, field in model.model_fields.items():
            assert field.description, name


def test_a_validated_rotor_is_taken_as_it_is() -> None:
    rotor = RotorParameters.hou2016('figure', ball_count=9)
    config = RotorSimConfig(variant='figure', rotor=rotor)
    assert config.rotor is rotor
    assert RotorSimConfig.from_json(config.model_dump_json()) == config
    with pytest.raises(ConfigError, match="rotor: it is of variant 'figure', not 'derived'"):
        RotorSimConfig(rotor=rotor)


def test_defaults_and_their_step() -> None:
    config = RotorSimConfig()
    assert config.rate_hz == 10_240
    # 512 steps a revolution at 352 rad/s are 28 684 a second: 3 x 10 240, which allow 376.99
    assert config.substeps() == 3
    assert config.speed_limit_rad_s() == pytest.approx(2 * math.pi * 30_720 / 512)
    assert config.rotor == RotorParameters.hou2016()
    assert config.live_parameters().model_dump() == {
        'crack_stiffness_ratio': 0.1,
        'speed_target_rad_s': 352.0,
        'displacement_noise_m': 0.0,
        'acceleration_noise_m_s2': 0.0,
        'load_noise_m_s2': 0.0,
    }


@pytest.mark.parametrize('rate_hz', [1000, 10_240, 100_000])
@pytest.mark.parametrize('highest', [20.0, 352.0, 1200.0])
def test_step_resolves_revolutions_and_bearings(rate_hz: int, highest: float) -> None:
    config = RotorSimConfig.from_mapping(
        {
            'rate_hz': rate_hz,
            'sensors': {'imu_rate_hz': 0},
            'speed': {'initial_rad_s': 20.0, 'highest_rad_s': highest},
        }
    )
    steps_per_s = rate_hz * config.substeps()
    assert steps_per_s * 2 * math.pi / highest >= 512
    # the bearings' fastest mode is about 7100 rad/s at n = 12: 18 steps a period
    assert steps_per_s * 2 * math.pi / 7100 >= 18
    assert config.speed_limit_rad_s() >= highest


def test_growth_and_ramps_may_touch() -> None:
    config = RotorSimConfig.from_mapping(
        {
            'speed': {'ramps': [ramp(0.1, 362.0), ramp(0.3, 352.0)]},  # 0.1 + 0.2 > 0.3 in binary
            'crack_growth': [
                {'at_s': 0.1, 'to': 0.2, 'over_s': 0.2},
                {'at_s': 0.3, 'to': 0.3, 'over_s': 0.2},
            ],
        }
    )
    crack = config.schedules()['crack_stiffness_ratio']
    assert crack.value(3072) == pytest.approx(0.2, abs=1e-3)
    assert crack.value(6000) == 0.3


def test_round_trip_through_json() -> None:
    config = RotorSimConfig.from_mapping(
        {
            'speed': {'ramps': [ramp(1, 400)]},
            'changes': [change(5, 'load_noise_m_s2', 1.0)],
            'rotor': {'ball_count': 9},
        }
    )
    assert RotorSimConfig.from_json(config.model_dump_json()) == config
    assert RotorSimConfig.from_mapping(config.model_dump()) == config


def test_live_ramp_refuses_what_is_fixed() -> None:
    config = RotorSimConfig()
    with pytest.raises(RotorError, match='clearance_m cannot be set while the rotor runs; only'):
        config.live_ramp(0, 'clearance_m', 1e-6)
    with pytest.raises(RotorError, match=r'set speed.highest_rad_s to at least 400'):
        config.live_ramp(0, 'speed_target_rad_s', 400.0)
    with pytest.raises(ConfigError, match='load_noise_m_s2 = -1'):
        config.live_ramp(0, 'load_noise_m_s2', -1.0)
