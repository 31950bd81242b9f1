# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Names, units and settings of the indicators; statistics of samples."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rotor_common.errors import ConfigError
from rotor_interfaces.channels import CHANNEL_COLUMNS, COLUMN_UNITS, channels_of, is_channel
from vibration_monitor import MonitorConfig
from vibration_monitor.indicators import EXTRAS, indicator_names, unit_of
from vibration_monitor.indicators.registry import kinds
from vibration_monitor.indicators.statistics import statistics


def test_channels_are_the_vibration_columns() -> None:
    assert channels_of(tuple(COLUMN_UNITS)) == CHANNEL_COLUMNS
    assert channels_of(tuple(COLUMN_UNITS)[::-1]) == CHANNEL_COLUMNS
    assert channels_of(('zeta_y', 'time', 'brg1_az', 'case_ay', 'disk_y', 'load_z', 'angle')) == (
        'disk_y',
        'brg1_az',
        'case_ay',
        'zeta_y',
    )


@pytest.mark.parametrize(
    'name', ['load_y', 'load_z', 'y', '_y', 'ay', 'disk', 'disk_x', 'disk_y/rms', 'disk_y ', '']
)
def test_other_columns_are_no_channels(name: str) -> None:
    assert not is_channel(name)


def test_units_agree_with_the_wire() -> None:
    for channel in CHANNEL_COLUMNS:
        assert unit_of(f'{channel}/rms') == COLUMN_UNITS[channel]
        assert unit_of(f'{channel}/amplitude_order_1') == COLUMN_UNITS[channel]
        assert unit_of(f'{channel}/ratio_denominator') == COLUMN_UNITS[channel]
        assert unit_of(f'{channel}/phase_ball_pass') == 'rad'
        assert unit_of(f'{channel}/load_slope_error_order_2') == COLUMN_UNITS[channel]
        assert unit_of(f'{channel}/passage_amplitude_order_2') == COLUMN_UNITS[channel]
        assert unit_of(f'{channel}/passage_speed_order_2') == 'rad/s'
        for kind in ('ratio_3_1', 'crest_factor', 'kurtosis', 'envelope_prominence_cage'):
            assert unit_of(f'{channel}/{kind}') == '1'
    assert unit_of('disk/forward_order_1') == 'm'
    assert unit_of('disk/orbit_turns') == '1'
    assert unit_of('brg1_ay/envelope_line_cage') == 'm/s^2'
    assert unit_of('speed_rad_s') == 'rad/s'
    assert unit_of('load_factor_range') == '1'


def test_ratios_need_their_order() -> None:
    found = kinds('disk_y', (1.0, 3.0, 6.5), ())
    assert [kind for kind in found if kind.startswith('ratio')] == [
        'ratio_3_1',
        'ratio_denominator',
    ]
    assert 'amplitude_order_6.5' in found


def test_names_are_unique() -> None:
    config = MonitorConfig.from_mapping({'extras': EXTRAS, 'critical_speed_rad_s': 530.0})
    names = indicator_names(CHANNEL_COLUMNS, config)
    assert len(set(names)) == len(names)


@settings(deadline=None)
@given(
    st.lists(st.floats(-1e3, 1e3).map(lambda x: round(x, 3)), min_size=2, max_size=50).filter(
        lambda x: max(x) > min(x)
    ),
    st.floats(-100.0, 100.0),
    st.floats(1e-6, 1e6),
)
def test_statistics_follow_shift_and_scale(values: list[float], shift: float, scale: float) -> None:
    samples = np.array(values)
    rms, crest, kurtosis = statistics(samples)
    # moment inequalities that hold for any sample
    assert crest >= 1 - 1e-9
    assert 1 - 1e-9 <= kurtosis <= len(values) + 1e-9
    moved = statistics(scale * (samples + shift))
    # rounding of values up to 1100 against differences of 1e-3 and more
    assert moved[0] == pytest.approx(scale * rms, rel=1e-8)
    assert moved[1:] == pytest.approx([crest, kurtosis], rel=1e-8)


def test_statistics_of_known_samples() -> None:
    # a square wave has no peaks; one impulse among n samples has kurtosis n - 2 + 1/(n - 1)
    assert statistics(np.array([1.0, -1.0, 1.0, -1.0])) == [1.0, 1.0, 1.0]
    impulse = np.zeros(100)
    impulse[42] = 1.0
    rms, crest, kurtosis = statistics(impulse)
    assert rms == pytest.approx(math.sqrt(0.01 * 0.99))
    assert crest == pytest.approx(0.99 / math.sqrt(0.01 * 0.99))
    assert kurtosis == pytest.approx(98 + 1 / 99)


@pytest.mark.parametrize(
    ('settings', 'sentence'),
    [
        ({'window_revolutions': 63}, r'window_revolutions = 63 is out of range.*64 to 512'),
        ({'window_revolutions': 513}, 'window_revolutions = 513 is out of range'),
        ({'window_revolutions': 64.0}, 'window_revolutions = 64.0 is not allowed'),
        ({'hop_revolutions': 0}, r'hop_revolutions = 0 is out of range'),
        (
            {'hop_revolutions': 65},
            'hop_revolutions = 65 would leave revolutions unseen.*1 to .* 64',
        ),
        ({'orders': [0.1, 1.0]}, 'orders: 0.1 is out of range; allowed: 0.25 to 50'),
        ({'orders': [1.0, 51]}, 'orders: 51 is out of range'),
        ({'orders': [2.0, 1.0]}, 'orders: the orders must rise'),
        ({'orders': [1.0, 1.0]}, 'orders: the orders must rise and none may be given twice'),
        ({'orders': [2.0, 3.0]}, 'orders: 1 is missing'),
        ({'orders': [1.0, 2.00000001]}, 'orders: 2.00000001 has more than 6 digits'),
        ({'orders': ['a']}, r"orders\[0\] = 'a' is not allowed"),
        ({'ball_pass_order': 3.0}, 'ball_pass_order = 3 cannot .* order 3 .*take 3 out of orders'),
        (
            {'ball_pass_order': 3.05},
            'cannot be told from order 3 in 64 revolutions; use window_revolutions = 81 or more',
        ),
        ({'displacement_floor_m': 0.0}, 'displacement_floor_m = 0.0 is out of range.*above 0'),
        ({'acceleration_floor_m_s2': -1.0}, 'acceleration_floor_m_s2 = -1.0 is out of range'),
        ({'spectrum_max_order': 0.5}, 'spectrum_max_order = 0.5 is out of range.*1 to 50'),
        ({'spectrum_max_order': math.nan}, 'spectrum_max_order = nan'),
        ({'windows': 64}, 'windows is not a known key'),
        ({'channels': ['disk']}, "channels: 'disk' is no channel name"),
        ({'channels': ['disk_z', 'disk_z']}, "channels: 'disk_z' is given more than once"),
        ({'channels': ['disk_y']}, "extras holds 'crack', but channels does not hold 'disk_z'"),
        ({'extras': ['orbits']}, r"extras\[0\]: 'orbits' is not allowed.*'orbit'"),
        ({'extras': ['orbit', 'orbit']}, "extras: 'orbit' is given more than once"),
        ({'extras': ['passage']}, "extras holds 'passage', which needs critical_speed_rad_s"),
        ({'critical_speed_rad_s': 0.0}, 'critical_speed_rad_s = 0.0 is out of range.*above 0'),
        ({'envelope_band_hz': [3000.0, 1000.0]}, 'envelope_band_hz: 3000 to 1000 Hz is no band'),
        ({'trend_windows': 5}, 'trend_windows = 5 is out of range; allowed: 6 to 1000'),
        (
            {'extras': ['envelope'], 'ball_count': 3},
            'ball_pass_order = 3.08462 is not below ball_count = 3',
        ),
        (
            {
                'extras': [],
                'alarm': {'rules': [{'indicator': 'disk_z/rms', 'warn': 1, 'error': 1}]},
            },
            "unknown indicator 'disk_z/rms'; add 'statistics' to extras",
        ),
        (
            {
                'channels': ['disk_z'],
                'extras': ['orbit'],
                'alarm': {'rules': [{'indicator': 'disk/orbit_turns', 'warn': 2, 'error': 2}]},
            },
            "unknown indicator 'disk/orbit_turns'; channels does not hold 'disk_y'",
        ),
        ({'alarm': {'rules': []}}, 'alarm: rules is empty'),
        (
            {'alarm': {'required': 6}},
            'alarm: required = 6 is more than out_of = 5; allowed: 1 to 5',
        ),
        ({'alarm': {'required': 0}}, 'alarm.required = 0 is out of range.*1 to 100'),
        ({'alarm': {'release_ratio': 1.1}}, 'alarm.release_ratio = 1.1 is out of range'),
        ({'alarm': {'release_ratio': 0.0}}, 'alarm.release_ratio = 0.0 is out of range'),
        (
            {'alarm': {'rules': [{'indicator': 'disk_z/rms', 'warn': 2.0, 'error': 1.0}]}},
            r'alarm.rules\[0\]: error = 1 is below warn = 2 for disk_z/rms',
        ),
        (
            {'alarm': {'rules': [{'indicator': 'disk_z/rms', 'warn': 0.0, 'error': 1.0}]}},
            r'alarm.rules\[0\].warn = 0.0 is out of range.*above 0',
        ),
        (
            {'alarm': {'rules': [{'indicator': 'disk_z/rms', 'warn': 1.0}]}},
            r'alarm.rules\[0\].error is missing',
        ),
        (
            {'alarm': {'rules': [{'indicator': 'disk_z/rms', 'warn': 1.0, 'error': 1.0}] * 2}},
            'alarm: rules holds disk_z/rms more than once',
        ),
        (
            {'alarm': {'rules': [{'indicator': 'disk_z/ratio_31', 'warn': 1.0, 'error': 1.0}]}},
            "unknown indicator 'disk_z/ratio_31'; did you mean 'ratio_3_1'",
        ),
        (
            {'alarm': {'rules': [{'indicator': 'disk/rms', 'warn': 1.0, 'error': 1.0}]}},
            "unknown indicator 'disk/rms'; 'disk' is no channel name",
        ),
        (
            {'alarm': {'rules': [{'indicator': 'xyz', 'warn': 1.0, 'error': 1.0}]}},
            "unknown indicator 'xyz'; allowed: speed_rad_s, load_factor, load_factor_range",
        ),
        (
            {'orders': [1.0, 2.0]},
            "extras holds 'crack', which needs order 3 in orders",
        ),
        (
            {
                'orders': [1.0, 2.0],
                'extras': [],
                'alarm': {'rules': [{'indicator': 'disk_z/ratio_3_1', 'warn': 1, 'error': 2}]},
            },
            "unknown indicator 'disk_z/ratio_3_1'; did you mean 'ratio_2_1'",
        ),
    ],
)
def test_wrong_settings_end_in_one_sentence(settings: dict[str, object], sentence: str) -> None:
    with pytest.raises(ConfigError, match=sentence) as error:
        MonitorConfig.from_mapping(settings)
    assert '\n' not in str(error.value)


def test_settings_survive_json() -> None:
    config = MonitorConfig.from_mapping(
        {'hop_revolutions': 8, 'orders': [1, 2, 2.5, 3], 'alarm': {'required': 2}}
    )
    assert config.orders == (1.0, 2.0, 2.5, 3.0)
    assert MonitorConfig.from_json(config.model_dump_json()) == config
    assert MonitorConfig.from_json('{}') == MonitorConfig()
