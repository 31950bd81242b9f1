# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The monitor as a stream: blocks, joining, columns, indicators by name, limits of memory."""

import cmath
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from monitor_signals import (
    BALL_PASS,
    EPOCH_NS,
    RATE_HZ,
    blocks,
    ramp_angle,
    run,
    same,
    signal,
    steady_angle,
    table,
)
from rotor_common.constants import MIN_SAMPLES_PER_CYCLE
from rotor_interfaces.channels import CHANNEL_COLUMNS, COLUMN_UNITS
from rotor_interfaces.messages import sample_stamp_ns
from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock
from vibration_monitor import (
    AlarmConfig,
    AlarmRule,
    AlarmState,
    Level,
    MonitorConfig,
    VibrationMonitor,
)
from vibration_monitor import monitor as monitor_module
from vibration_monitor.indicators import EXTRAS


def noisy_rows(duration_s: float = 2.5, seed: int = 3) -> NDArray[np.void]:
    """A run-up with noise on every channel, so that any wrong bit shows."""
    rng = np.random.default_rng(seed)
    angle = ramp_angle(duration_s, 300.0, 40.0)
    base = signal(angle, [(1.0, 1e-6, 0.2), (3.0, 3e-7, 1.0), (BALL_PASS, 1e-6, 0.0)])
    channels = {
        name: base * rng.uniform(0.5, 2.0) + 1e-7 * rng.standard_normal(len(angle))
        for name in CHANNEL_COLUMNS
    }
    channels['load_y'] = 9.81 + rng.standard_normal(len(angle))
    return table(angle, channels)


RULES = AlarmConfig(
    rules=(
        AlarmRule(indicator='disk_z/ratio_2_1', warn=0.3, error=0.6),
        AlarmRule(indicator='disk_z/ratio_3_1', warn=0.5, error=2.0),
    )
)
SETTINGS = MonitorConfig(extras=('spectrum', 'statistics', 'whirl', 'orbit'), alarm=RULES)
ROWS = noisy_rows()
REFERENCE = run(VibrationMonitor(SETTINGS), blocks(ROWS, 256))


def test_the_reference_is_worth_comparing_with() -> None:
    assert len(REFERENCE) >= 4
    assert all(record.valid and np.isfinite(record.values).all() for record in REFERENCE)


@pytest.mark.parametrize('size', [7, 64, 205, 256, 1000, 4096, len(ROWS)])
def test_block_size_changes_no_bit(size: int) -> None:
    assert same(run(VibrationMonitor(SETTINGS), blocks(ROWS, size)), REFERENCE)


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(st.lists(st.integers(1, 3000), max_size=30))
def test_no_split_changes_a_bit(sizes: list[int]) -> None:
    assert same(run(VibrationMonitor(SETTINGS), blocks(ROWS, sizes)), REFERENCE)


def test_blocks_of_one_sample_are_placed_in_time_by_their_stamps() -> None:
    # no time column ever tells the rate
    angle = steady_angle(0.35, 1190.0)
    rows = table(angle, {'disk_z': np.cos(angle)})
    expected = run(VibrationMonitor(SETTINGS), blocks(rows, 256))
    assert len(expected) == 1
    assert same(run(VibrationMonitor(SETTINGS), blocks(rows, 1)), expected)


@pytest.mark.parametrize('size', [1, 2, 3, 7, 256])
@pytest.mark.parametrize('rate_hz', [1000, 10007, 12345, 44100, 65537, 131072, 200000])
def test_any_whole_rate_is_found_whatever_the_blocks(rate_hz: int, size: int) -> None:
    angle = steady_angle(2048 / rate_hz, 0.01 * rate_hz, rate_hz)
    clock = VibrationMonitor(SETTINGS)._clock
    for block in blocks(table(angle, {}), size, rate_hz):
        clock.take(block.first_sample, block.stamp_ns, block.rows['time'])
    assert clock.rate_hz() == rate_hz
    assert clock.stamp_ns(1_000_003) == sample_stamp_ns(EPOCH_NS, 1_000_003, rate_hz)


def test_two_monitors_agree_and_a_recorded_block_is_not_changed() -> None:
    stream = blocks(ROWS, 256)
    before = [block.rows.tobytes() for block in stream]
    for block in stream:
        block.rows.flags.writeable = False
    assert same(run(VibrationMonitor(SETTINGS), stream), REFERENCE)
    assert [block.rows.tobytes() for block in stream] == before


@pytest.mark.parametrize('first', [1, 500, 3001, 8000])
def test_joining_late_gives_the_same_windows_from_the_first_whole_one(first: int) -> None:
    records = run(VibrationMonitor(SETTINGS), blocks(ROWS[first:], 256))
    assert records
    assert same(records, REFERENCE[-len(records) :], alarm=False)
    start = 2 * math.pi * 16 * records[0].window
    assert ROWS['angle'][first] <= start
    # and no earlier window would have been whole
    assert ROWS['angle'][first] > start - 2 * math.pi * 16


@pytest.mark.parametrize('order', [list(COLUMN_UNITS)[::-1], sorted(COLUMN_UNITS)])
def test_columns_may_stand_in_any_order(order: list[str]) -> None:
    dtype = np.dtype([(name, WAVEFORM_DTYPE[name]) for name in order])
    rows = np.zeros(len(ROWS), dtype)
    for name in order:
        rows[name] = ROWS[name]
    assert same(run(VibrationMonitor(SETTINGS), blocks(rows, 205)), REFERENCE)


def test_other_columns_neither_help_nor_disturb() -> None:
    kept = ['sample', 'time', 'angle', 'disk_z', 'brg2_ay']
    extra = [('temperature', '<f4'), ('load_z', '<f4'), ('counter', '<i4'), ('case_y', '<f8')]
    rows = np.zeros(len(ROWS), [(name, WAVEFORM_DTYPE[name]) for name in kept] + extra)
    for name in kept:
        rows[name] = ROWS[name]
    rows['temperature'] = np.nan
    rows['case_y'] = np.cos(ROWS['angle'])
    records = run(VibrationMonitor(SETTINGS), blocks(rows, 256))
    assert len(records) == len(REFERENCE)
    for record, reference in zip(records, REFERENCE, strict=True):
        channels = {name.split('/')[0] for name in record.names if '/' in name}
        assert channels == {'disk_z', 'brg2_ay', 'case_y'}
        assert record.value('case_y/amplitude_order_1') == pytest.approx(1.0, rel=1e-4)
        assert math.isnan(record.value('load_factor'))
        assert math.isnan(record.value('brg1_y/rms'))
        for name in record.names:
            if name.startswith(('disk_z', 'brg2_ay', 'speed')):
                assert record.value(name) == reference.value(name), name


def test_chosen_channels_and_extras_change_no_number() -> None:
    config = MonitorConfig(channels=('brg1_ay', 'disk_z', 'case_y'), extras=('statistics',))
    records = run(VibrationMonitor(config), blocks(ROWS, 256))
    assert len(records) == len(REFERENCE)
    for record, reference in zip(records, REFERENCE, strict=True):
        assert record.spectrum is None
        assert record.indicators().keys() == set(record.names)
        for name, value in record.indicators().items():
            if name.startswith('case_y/'):
                # the waveform does not have it
                assert math.isnan(value), name
            else:
                assert value == reference.value(name), name
        vector = record.vector('disk_z', 'order_2')
        assert abs(vector) == pytest.approx(record.value('disk_z/amplitude_order_2'), rel=1e-12)
        assert cmath.phase(vector) == pytest.approx(record.value('disk_z/phase_order_2'))
        assert cmath.isnan(record.vector('disk_y', 'order_2'))


def test_all_extras_together_do_not_depend_on_the_blocks() -> None:
    config = MonitorConfig.from_mapping({'extras': EXTRAS, 'critical_speed_rad_s': 700.0})
    records = run(VibrationMonitor(config), blocks(ROWS, 256))
    for size in (100, 3000):
        assert same(run(VibrationMonitor(config), blocks(ROWS, size)), records)
    assert 'crack_ratio_low' in records[0].names
    for record, reference in zip(records, REFERENCE, strict=True):
        assert len(record.names) == len(record.values)
        for name in reference.names:
            assert record.value(name) == reference.value(name), name


def test_channels_are_fixed_by_the_first_block_of_a_run() -> None:
    stream = blocks(ROWS, 256)
    names = [name for name in ROWS.dtype.names or () if name != 'disk_y']
    changed = [WaveformBlock(block.stamp_ns, block.rows[names]) for block in stream[20:]]
    records = run(VibrationMonitor(SETTINGS), [*stream[:20], *changed])
    for record, reference in zip(records, REFERENCE, strict=True):
        assert record.names == reference.names
        assert math.isnan(record.value('disk_y/rms'))
        assert record.value('disk_z/rms') == reference.value('disk_z/rms')


@pytest.mark.parametrize('name', ['disk_y', 'brg2_az', 'load_y'])
@pytest.mark.parametrize('bad', [math.nan, math.inf])
def test_a_bad_value_spoils_its_own_channel_only(name: str, bad: float) -> None:
    rows = ROWS.copy()
    hole = REFERENCE[1].first_sample - 5
    rows[name][hole] = bad
    records = run(VibrationMonitor(SETTINGS), blocks(rows, 256))
    # the whirl of a plane needs both of its displacements
    own = {'disk_y': ('disk_y/', 'disk/'), 'load_y': ('load_factor',)}.get(name, (f'{name}/',))
    for record, reference in zip(records, REFERENCE, strict=True):
        assert record.valid
        for value, expected, key in zip(record.values, reference.values, record.names, strict=True):
            if key.startswith(own) and record.window == 0:
                assert math.isnan(value), key
            else:
                assert value == expected, key
        assert record.spectrum is not None
        if record.window == 0 and name != 'load_y':
            assert np.isnan(record.spectrum.amplitudes[name]).all()


def test_a_dead_sensor_gives_no_numbers() -> None:
    rows = ROWS.copy()
    rows['disk_z'] = 1.5e-6
    for record in run(VibrationMonitor(SETTINGS), blocks(rows, 256)):
        dead = [v for v, n in zip(record.values, record.names, strict=True) if 'disk_z' in n]
        assert np.isnan(dead).all()
        assert record.value('disk_y/rms') > 0
    assert record.alarm.level is Level.STALE
    assert 'disk_z/ratio_2_1: no valid value' in record.alarm.reasons[0]


def test_ratios_are_floored_and_the_floor_is_published() -> None:
    angle = steady_angle(2.0, 352.0)
    components = [(1.0, 2e-8, 0.0), (3.0, 5e-8, 0.0)]
    acceleration = [(1.0, 0.1, 0.0), (3.0, 0.05, 0.0)]
    rows = table(
        angle, {'disk_z': signal(angle, components), 'brg1_ay': signal(angle, acceleration)}
    )
    record = run(VibrationMonitor(SETTINGS), blocks(rows, 256))[0]
    assert record.value('disk_z/ratio_denominator') == 1e-7
    assert record.value('disk_z/ratio_3_1') == pytest.approx(0.5, rel=1e-4)
    assert record.value('brg1_ay/ratio_denominator') == record.value('brg1_ay/amplitude_order_1')
    assert record.value('brg1_ay/ratio_3_1') == pytest.approx(0.5, rel=1e-4)
    floored = MonitorConfig(displacement_floor_m=1e-9, acceleration_floor_m_s2=1.0)
    record = run(VibrationMonitor(floored), blocks(rows, 256))[0]
    assert record.value('disk_z/ratio_3_1') == pytest.approx(2.5, rel=1e-4)
    assert record.value('brg1_ay/ratio_denominator') == 1.0


def test_names_are_stable_and_complete() -> None:
    names = REFERENCE[0].names
    assert names[:3] == ('speed_rad_s', 'load_factor', 'load_factor_range')
    assert [name.split('/')[0] for name in names[3:]] == [
        *(channel for channel in CHANNEL_COLUMNS for _ in range(27)),
        *(plane for plane in ('disk', 'brg1', 'brg2') for _ in range(2 * 8 + 3)),
    ]
    for kind in (
        *(f'{what}_order_{order}' for what in ('amplitude', 'phase') for order in ('0.5', '1')),
        *('amplitude_ball_pass', 'phase_ball_pass', 'ratio_2_1', 'ratio_3_1', 'ratio_4_1'),
        *('ratio_2.5_1', 'ratio_denominator', 'rms', 'crest_factor', 'kurtosis'),
    ):
        assert f'disk_z/{kind}' in names
    assert all(record.names is names for record in REFERENCE)
    assert len(names) == len(REFERENCE[0].values) == 273 + 3 * 19
    assert math.isnan(REFERENCE[0].value('no/such'))


def test_orders_that_the_samples_do_not_resolve_are_nan() -> None:
    angle = steady_angle(1.0, 1200.0)
    rows = table(angle, {'disk_z': np.cos(angle)})
    record = run(VibrationMonitor(SETTINGS), blocks(rows, 256))[0]
    assert record.spectrum is not None
    limit = RATE_HZ / (1200.0 / (2 * math.pi)) / MIN_SAMPLES_PER_CYCLE
    assert 8 < limit < 10
    resolved = record.spectrum.orders <= limit
    amplitudes = record.spectrum.amplitudes['disk_z']
    assert np.isfinite(amplitudes[resolved]).all()
    assert np.isnan(amplitudes[~resolved]).all()
    slow = steady_angle(2.0, 352.0, rate_hz=1000)
    rows = table(slow, {'disk_z': np.cos(slow)})
    record = run(VibrationMonitor(SETTINGS), blocks(rows, 256, rate_hz=1000))[0]
    # 17.8 samples a revolution: the spectrum up to order 2.97, vectors up to 8.9
    assert record.spectrum is not None
    assert np.flatnonzero(np.isfinite(record.spectrum.amplitudes['disk_z']))[-1] == 190
    assert math.isfinite(record.value('disk_z/amplitude_order_5'))
    assert record.value('speed_rad_s') == pytest.approx(352.0, rel=1e-9)
    slow = steady_angle(2.0, 352.0, rate_hz=340)
    rows = table(slow, {'disk_z': np.cos(slow)})
    record = run(VibrationMonitor(SETTINGS), blocks(rows, 256, rate_hz=340))[0]
    # 6.07 samples a revolution: vectors up to 3.03 less 4 bins
    assert math.isfinite(record.value('disk_z/amplitude_order_2.5'))
    for name in ('amplitude_order_3', 'phase_order_3', 'ratio_3_1', 'amplitude_ball_pass'):
        assert math.isnan(record.value(f'disk_z/{name}')), name


def test_a_hop_as_long_as_the_window_and_a_longer_window() -> None:
    config = MonitorConfig(window_revolutions=100, hop_revolutions=100)
    angle = steady_angle(4.0, 352.0)
    rows = table(angle, {'disk_z': signal(angle, [(1.0, 1e-6, 0.5), (2.5, 5e-7, 2.0)])})
    records = run(VibrationMonitor(config), blocks(rows, 256))
    assert [record.window for record in records] == [0, 1]
    for record in records:
        assert record.value('disk_z/amplitude_order_2.5') == pytest.approx(5e-7, rel=1e-4)
        assert record.value('disk_z/phase_order_2.5') == pytest.approx(2.0, abs=1e-4)


@pytest.mark.parametrize('size', [64, 1000])
def test_a_window_is_judged_by_the_first_block_past_its_end(size: int) -> None:
    monitor = VibrationMonitor(SETTINGS)
    for block in blocks(ROWS, size):
        for record in monitor.push(block):
            # the first sample past the end belongs to this block
            assert block.first_sample <= record.last_sample + 1 < block.first_sample + size


def test_memory_holds_what_open_windows_need() -> None:
    monitor = VibrationMonitor(SETTINGS)
    for block in blocks(ROWS, 64):
        monitor.push(block)
        # one window of 64 revolutions at 300 rad/s or faster, a hop less, and a block
        assert len(monitor._buffer) <= 64 * 2 * math.pi / 300.0 * RATE_HZ + 64


def test_a_shaft_that_hardly_turns_is_invalid_and_bounds_the_memory(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    limit = 20_000
    monkeypatch.setattr(monitor_module, 'MAX_WINDOW_SAMPLES', limit)
    speed = 150.0  # 64 revolutions take 27 450 samples
    angle = np.concatenate(
        (steady_angle(6.0, speed), 6.0 * speed + steady_angle(4.0, 352.0) + speed / RATE_HZ)
    )
    rows = table(angle, {'disk_z': np.cos(angle)})
    results = []
    for size in (256, 5000):
        monitor = VibrationMonitor(SETTINGS)
        records = []
        for block in blocks(rows, size):
            records += monitor.push(block)
            assert len(monitor._buffer) <= limit * 1.25 + size
        results.append(records)
    assert same(*results)
    slow = [record for record in results[0] if record.last_sample < 6 * RATE_HZ]
    assert len(slow) > 3
    assert all(not record.valid and 'more than 20000 samples' in record.reason for record in slow)
    assert results[0][-1].valid
    assert results[0][-1].value('speed_rad_s') == pytest.approx(352.0, rel=1e-9)


def test_the_alarm_follows_the_windows_and_goes_stale_without_them() -> None:
    angle = steady_angle(6.0, 352.0)
    rows = table(angle, {'disk_z': signal(angle, [(1.0, 1e-6, 0.0), (2.0, 9e-7, 0.0)])})
    rule = AlarmRule(indicator='disk_z/ratio_2_1', warn=0.1, error=0.5)
    config = MonitorConfig(alarm=AlarmConfig(rules=(rule,), required=2, out_of=3))
    monitor = VibrationMonitor(config)
    assert monitor.alarm == AlarmState.cannot_judge('no window is complete yet')
    records = run(monitor, blocks(rows, 256))
    assert [record.alarm.level for record in records[:3]] == [Level.STALE, Level.ERROR, Level.ERROR]
    assert 'disk_z/ratio_2_1 = 0.9' in records[1].alarm.reasons[0]
    assert monitor.alarm == records[-1].alarm
    # the encoder fails: nothing is judged any more, and the alarm says so once 64 + 3 * 16
    # revolutions' worth of samples have passed since the last window
    blind = table(angle * math.nan, {'disk_z': rows['disk_z']})
    blind['sample'] += len(rows)
    levels: list[Level] = []
    for block in blocks(blind, 256):
        assert monitor.push(block) == []
        levels.append(monitor.alarm.level)
    assert levels[0] == Level.ERROR
    patience = (64 + 3 * 16) * 2 * math.pi / 352.0 * RATE_HZ
    seen = (levels.index(Level.STALE) + 1) * 256 + len(rows) - records[-1].last_sample
    assert patience < seen < patience + 260
    assert levels[-1] == Level.STALE
    assert 'the shaft angle is missing' in monitor.alarm.reasons[0]
