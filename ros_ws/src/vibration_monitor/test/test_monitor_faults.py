# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""What the monitor does with gaps, restarts, faulty angles and malformed blocks."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from monitor_signals import EPOCH_NS, RATE_HZ, blocks, run, same, steady_angle, table
from rotor_common.errors import WireError
from rotor_interfaces.waveform import WaveformBlock
from vibration_monitor import IndicatorRecord, Level, VibrationMonitor
from vibration_monitor.monitor import MAX_INVALID_RECORDS

SPEED = 700.0
ANGLE = steady_angle(3.0, SPEED)
REVOLUTIONS = ANGLE / (2 * math.pi)
ROWS = table(
    ANGLE,
    {
        'disk_z': np.cos(ANGLE) + 0.01 * np.random.default_rng(8).standard_normal(len(ANGLE)),
        'disk_y': np.sin(ANGLE),
    },
)
REFERENCE = {record.window: record for record in run(VibrationMonitor(), blocks(ROWS, 256))}


def windows_across(first: float, last: float) -> set[int]:
    """Numbers of the windows that overlap the open interval of revolutions."""
    return {w for w in range(100) if 16 * w < last and 16 * w + 64 > first}


def check_against_reference(records: list[IndicatorRecord], invalid: set[int]) -> None:
    """Every window is there once; the invalid ones are NaN, the others as without the fault."""
    assert sorted(record.window for record in records) == list(range(len(records)))
    for record in records:
        if record.window in invalid:
            assert not record.valid
            assert record.reason
            assert record.spectrum is None
            assert np.isnan(record.values).all()
            assert record.first_sample == record.last_sample
        else:
            reference = REFERENCE[record.window]
            assert record.valid
            assert not record.reason
            assert record.values.tobytes() == reference.values.tobytes()
            assert record.stamp_ns == reference.stamp_ns
    stamps = [record.stamp_ns for record in records]
    assert stamps == sorted(stamps)


@pytest.mark.slow
@settings(max_examples=20, deadline=None)
@given(st.integers(1, 25_000), st.integers(1, 6000), st.integers(100, 3000))
def test_a_gap_makes_exactly_the_windows_across_it_invalid(
    start: int, length: int, size: int
) -> None:
    monitor = VibrationMonitor()
    resumed = start + length
    stream = blocks(ROWS[:start], size) + blocks(ROWS[resumed:], size)
    records = run(monitor, stream)
    # the fault lies between the last sample before and the first sample after
    across = windows_across(REVOLUTIONS[start - 1], REVOLUTIONS[resumed])
    check_against_reference(records, across)
    # a window across the gap is known to be lost at once, even where it would end after the stream
    assert len(records) == max(len(REFERENCE), 1 + max(across))
    for record in records:
        if not record.valid:
            assert record.reason == f'{length} samples before sample {resumed} were lost'
            assert record.last_sample == resumed
            time_ns = round(resumed / RATE_HZ * 1e9)
            assert abs(record.stamp_ns - EPOCH_NS - time_ns) <= 1
    status = monitor.status()
    assert status['gaps [1]'] == 1
    assert status['lost samples [1]'] == length
    assert status['invalid windows [1]'] == len(across)
    assert status['windows [1]'] == len(records)
    assert status['angle faults [1]'] == 0


def test_a_gap_that_swallows_hours_is_counted_and_bounded() -> None:
    monitor = VibrationMonitor()
    run(monitor, blocks(ROWS[:2000], 256))
    later = ROWS[:2000].copy()
    hours = 10**6
    later['sample'] += 10**9
    later['angle'] += 2 * math.pi * 16 * hours
    records = run(monitor, blocks(later, 256))
    assert len(records) == MAX_INVALID_RECORDS
    assert [record.window for record in records] == list(range(MAX_INVALID_RECORDS))
    assert monitor.status()['windows skipped in gaps [1]'] == hours - MAX_INVALID_RECORDS
    assert not any(record.valid for record in records)


def test_a_restart_is_a_new_run_and_not_a_loss() -> None:
    monitor = VibrationMonitor()
    first = run(monitor, blocks(ROWS[:20_000], 256))
    second = run(monitor, blocks(ROWS, 256))
    assert same(first, list(REFERENCE.values())[: len(first)])
    assert same(second, list(REFERENCE.values()))
    status = monitor.status()
    assert status['restarts [1]'] == 1
    assert status['lost samples [1]'] == 0
    assert status['invalid windows [1]'] == 0
    assert status['windows [1]'] == len(first) + len(second)


def test_a_new_run_may_have_other_channels_and_another_rate() -> None:
    monitor = VibrationMonitor()
    run(monitor, blocks(ROWS, 256))
    angle = steady_angle(2.0, 400.0, rate_hz=5000)
    dtype = np.dtype([('sample', '<f8'), ('time', '<f8'), ('angle', '<f8'), ('case_y', '<f4')])
    rows = table(angle, {'case_y': np.cos(angle)}, dtype)
    records = run(monitor, blocks(rows, 256, rate_hz=5000))
    assert records[0].value('case_y/amplitude_order_1') == pytest.approx(1.0, rel=1e-4)
    assert records[0].value('speed_rad_s') == pytest.approx(400.0, rel=1e-9)


@pytest.mark.slow
@settings(max_examples=20, deadline=None)
@given(st.integers(1, 25_000), st.integers(1, 3000), st.integers(100, 3000))
def test_missing_angles_make_exactly_the_windows_across_them_invalid(
    start: int, length: int, size: int
) -> None:
    rows = ROWS.copy()
    rows['angle'][start : start + length] = math.nan
    monitor = VibrationMonitor()
    records = run(monitor, blocks(rows, size))
    check_against_reference(
        records, windows_across(REVOLUTIONS[start - 1], REVOLUTIONS[start + length])
    )
    status = monitor.status()
    assert status['angle faults [1]'] == 1
    assert status['lost samples [1]'] == 0
    touched = (start + length - 1) // size - start // size + 1
    assert status['blocks without angle [1]'] == touched
    assert all('angle is missing' in record.reason for record in records if not record.valid)


def _stuck(angle: NDArray[np.float64]) -> None:
    angle[15_000] = angle[14_999]


def _one_back(angle: NDArray[np.float64]) -> None:
    angle[15_000:] -= angle[15_000] - angle[14_998]


def _jump_ahead(angle: NDArray[np.float64]) -> None:
    angle[15_000:] += 2 * math.pi * 40


def _jump_back(angle: NDArray[np.float64]) -> None:
    angle[15_000:] -= 2 * math.pi * 120


def _spike(angle: NDArray[np.float64]) -> None:
    angle[15_000] += 1e6


def _reversal(angle: NDArray[np.float64]) -> None:
    angle[15_000:] = 2 * angle[15_000] - angle[15_000:]


@pytest.mark.parametrize('fault', [_stuck, _one_back, _jump_ahead, _jump_back, _spike, _reversal])
def test_an_angle_that_does_not_rise_steadily_is_a_fault(fault) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    rows = ROWS.copy()
    fault(rows['angle'])
    results = []
    for size in (64, 256, 1000, len(rows)):
        monitor = VibrationMonitor()
        results.append(run(monitor, blocks(rows, size)))
        assert monitor.status()['angle faults [1]']
    assert all(same(result, results[0]) for result in results)
    first_bad = 15_000
    for record in results[0]:
        if record.valid:
            assert record.last_sample < first_bad or record.first_sample >= first_bad - 1
        else:
            assert 'does not rise steadily' in record.reason
            assert np.isnan(record.values).all()
    assert any(not record.valid for record in results[0])
    valid_after = [r for r in results[0] if r.valid and r.first_sample >= first_bad - 1]
    assert bool(valid_after) is (fault is not _reversal)


def test_without_any_angle_there_is_no_record_and_no_alarm_level() -> None:
    rows = ROWS.copy()
    rows['angle'] = math.nan
    names = [name for name in rows.dtype.names or () if name != 'angle']
    for stream in (
        blocks(rows, 256),
        [WaveformBlock(b.stamp_ns, b.rows[names]) for b in blocks(ROWS, 256)],
    ):
        monitor = VibrationMonitor()
        assert run(monitor, stream) == []
        status = monitor.status()
        assert status['blocks without angle [1]'] == len(stream)
        assert status['last fault'] == 'the shaft angle is missing'
        assert monitor.alarm.level is Level.STALE


def test_a_shaft_at_rest_gives_no_numbers_and_no_flood() -> None:
    angle = np.concatenate((ANGLE[:20_000], np.full(20_000, ANGLE[19_999])))
    rows = table(angle, {'disk_z': np.cos(np.arange(len(angle)) * 0.07)})
    monitor = VibrationMonitor()
    records = run(monitor, blocks(rows, 256))
    after = [record for record in records if record.last_sample >= 20_000]
    assert after
    assert len(after) <= 5
    assert not any(record.valid for record in after)
    assert monitor.alarm.level is Level.STALE


def _block(**changes: object) -> WaveformBlock:
    rows = ROWS[1000:1256].copy()
    rows['time'] = np.arange(256) / RATE_HZ
    for name, values in changes.items():
        rows[name] = values
    return WaveformBlock(EPOCH_NS, rows)


@pytest.mark.parametrize(
    ('block', 'sentence'),
    [
        (WaveformBlock(0, _block().rows[[]]), 'no `sample` column or no rows'),
        (WaveformBlock(0, _block().rows[['time', 'angle', 'disk_z']]), 'no `sample` column'),
        (WaveformBlock(0, _block().rows[['sample', 'angle', 'disk_z']]), 'no `time` column'),
        (_block(sample=np.arange(256) * 2.0), 'at sample 0 do not follow one another'),
        (_block(sample=math.nan), 'not a whole number'),
        (_block(time=0.0), 'time must rise'),
        (_block(time=math.nan), 'time must rise'),
        (_block(time=-np.arange(256.0)), 'time must rise'),
        (_block(time=np.arange(256) * 1e4), 'time must rise'),
    ],
)
def test_a_malformed_block_is_refused_and_counts_as_lost(
    block: WaveformBlock, sentence: str
) -> None:
    monitor = VibrationMonitor()
    stream = blocks(ROWS, 256)
    run(monitor, stream[:3])
    with pytest.raises(WireError, match=sentence):
        monitor.push(block)
    assert monitor.status()['blocks [1]'] == 3
    records = run(monitor, stream[4:])
    assert monitor.status()['lost samples [1]'] == 256
    across = windows_across(REVOLUTIONS[3 * 256 - 1], REVOLUTIONS[4 * 256])
    check_against_reference(records, across)
