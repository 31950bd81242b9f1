# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The key-phasor as the source of the angle: faults, refusals, and changes from the encoder."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from monitor_signals import RATE_HZ, blocks, run, same, signal, steady_angle, table
from vibration_monitor import Level, MonitorConfig, VibrationMonitor
from vibration_monitor.keyphasor import (
    CHUNK_SAMPLES,
    MAX_MISSED,
    MAX_PERIOD_SAMPLES,
    KeyphasorAngle,
    PulseCounts,
)
from vibration_monitor.monitor_config import AlarmConfig, AlarmRule

RULE = AlarmRule(indicator='disk_z/ratio_2_1', warn=0.3, error=0.6)
CONFIG = MonitorConfig(orders=(1.0, 2.0, 3.0), extras=(), alarm=AlarmConfig(rules=(RULE,)))
SPEED = 500.0
PERIOD = 2 * math.pi / SPEED * RATE_HZ


def train(times: NDArray[Any], samples: int, width: float = 2.0) -> NDArray[np.float64]:
    """Return smooth pulses of height 1 at these times (in samples)."""
    index = np.arange(samples)
    volts = np.zeros(samples)
    for time in times.tolist():
        volts += np.exp(-(((index - time) / width) ** 2) / 2)
    return volts


def angles_of(volts: NDArray[np.float64], revolution: int = 0) -> tuple[np.ndarray, PulseCounts]:
    counts = PulseCounts()
    source = KeyphasorAngle(revolution, counts)
    angles = np.concatenate((source.push(volts), source.finish()))
    assert len(angles) == len(volts)
    return angles, counts


def test_the_angle_between_pulses_is_a_cubic_through_them() -> None:
    # a shaft whose angle is a cubic of time: interpolation is exact
    index = np.arange(9000.0)
    turns = index / 120 + 20 * (index / 9000) ** 3
    times = np.interp(np.arange(1, 90), turns, index)
    for _ in range(5):
        slope = 1 / 120 + 60 * times**2 / 9000**3
        times -= (times / 120 + 20 * (times / 9000) ** 3 - np.arange(1, 90)) / slope
    angles, counts = angles_of(train(times, 9000), revolution=7)
    known = np.flatnonzero(np.isfinite(angles))
    assert np.array_equal(known, np.arange(known[0], known[-1] + 1))
    # the second pulse is revolution 7; one sample before it belongs to the first interval
    assert known[0] == math.ceil(times[1]) - 1
    # the area ends 3.5 deviations off, where one sample, 7 from the centre, is 2e-3 of an area of 5
    np.testing.assert_allclose(angles[known], turns[known] + 5, rtol=0, atol=4e-3 / 100)
    assert counts == PulseCounts()


@settings(max_examples=30, deadline=None)
@given(
    st.floats(1e-3, 1e3),
    st.floats(-1e3, 1e3),
    st.floats(20.0, 2000.0),
    st.floats(0.02, 0.2),
    st.integers(0, 2**32 - 1),
)
def test_height_offset_width_and_period_of_the_pulses_do_not_matter(
    height: float, offset: float, period: float, width: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    samples = int(12 * period) + CHUNK_SAMPLES
    times = np.arange(rng.uniform(0.3, 1.0), samples / period, 1.0) * period
    deviation = max(1.0, width * period / 4)
    noise = 0.02 * rng.standard_normal(samples)
    angles, counts = angles_of(offset + height * (train(times, samples, deviation) + noise))
    known = np.isfinite(angles)
    assert known.any()
    assert counts == PulseCounts()
    expected = (np.arange(samples) - times[1]) / period
    # 2 percent of noise on the 7 deviations of samples of a pulse moves its centre by 0.05
    # sqrt(deviation) samples; four times that, for the largest of 60 and the choice of the ends,
    # and 0.1 samples for the tails of pulses of three samples
    tolerance = (0.1 + 0.2 * math.sqrt(deviation)) / period
    np.testing.assert_allclose(angles[known], expected[known], rtol=0, atol=tolerance)


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(1, 4000), max_size=20))
def test_pieces_change_no_bit(sizes: list[int]) -> None:
    rng = np.random.default_rng(4)
    volts = train(np.arange(50, 20_000, 150.3), 20_000) + 0.05 * rng.standard_normal(20_000)
    whole, _ = angles_of(volts)
    source = KeyphasorAngle(0, PulseCounts())
    parts = [source.push(part) for part in np.split(volts, np.cumsum(sizes).clip(0, 20_000))]
    assert np.concatenate((*parts, source.finish())).tobytes() == whole.tobytes()


@pytest.mark.parametrize('seed', range(3))
@pytest.mark.parametrize('bits', [None, 0.5])
def test_noise_is_no_shaft(seed: int, bits: float | None) -> None:
    volts = np.random.default_rng(seed).standard_normal(60_000)
    if bits:
        volts = np.round(volts / bits) * bits
    angles, _ = angles_of(volts)
    assert np.isnan(angles).all()


@pytest.mark.parametrize('volts', [0.0, 5.0, math.nan])
def test_a_dead_key_phasor_gives_no_angle(volts: float) -> None:
    angles, counts = angles_of(np.full(10_000, volts))
    assert np.isnan(angles).all()
    assert counts == PulseCounts()


def test_random_pulses_are_no_shaft() -> None:
    rng = np.random.default_rng(3)
    times = np.cumsum(rng.exponential(300.0, 300) + 20)
    angles, _ = angles_of(train(times, 60_000))
    assert np.count_nonzero(np.isfinite(angles)) < 0.05 * len(angles)


def test_two_keys_on_the_shaft_are_refused() -> None:
    """Alternating intervals of 0.2 and 0.8 must not pass for a shaft of five times the speed."""
    turns = np.arange(100.0)
    times = np.sort(np.concatenate((turns, turns + 0.2))) * 150.0 + 20
    angles, _ = angles_of(train(times, 15_000))
    assert np.isnan(angles).all()


@pytest.mark.parametrize('missing', [1, MAX_MISSED, MAX_MISSED + 1])
def test_bridges_have_a_limit(missing: int) -> None:
    times = np.delete(np.arange(60), range(30, 30 + missing)) * 150.0 + 20
    angles, counts = angles_of(train(times, 60 * 150))
    hole = angles[30 * 150 + 20 : (30 + missing - 1) * 150 + 20]
    if missing <= MAX_MISSED:
        assert np.isfinite(hole).all()
        assert counts == PulseCounts(missed=missing)
        expected = (np.arange(len(angles)) - times[1]) / 150
        known = np.isfinite(angles)
        np.testing.assert_allclose(angles[known], expected[known], rtol=0, atol=1e-6)
    else:
        assert np.isnan(hole).all()
        assert counts == PulseCounts(lost_trains=1)
        known = np.flatnonzero(np.isfinite(angles))
        # it goes on, with whole revolutions that rise
        assert known[-1] > 50 * 150
        assert (np.diff(angles[known]) > 0).all()


def test_a_spike_does_not_hide_the_pulses() -> None:
    volts = train(np.arange(20, 30_000, 150.0), 30_000)
    volts[15_080] = 100.0
    angles, counts = angles_of(volts)
    known = np.isfinite(angles)
    assert known[2000:28_000].all()
    assert counts.extra == 1
    assert counts.lost_trains == 0


def test_a_shaft_that_stops_and_starts_again() -> None:
    first, second = np.arange(20, 12_000, 150.0), np.arange(60_000, 75_000, 100.0)
    angles, counts = angles_of(train(np.concatenate((first, second)), 75_000))
    assert np.isnan(angles[12_500:60_000]).all()
    assert np.isfinite(angles[60_200:74_000]).all()
    assert counts.lost_trains == 1
    assert math.floor(angles[60_200]) > np.nanmax(angles[:12_500]) - 1


def test_the_wait_is_bounded() -> None:
    """A pulse now and then, slower than any shaft: nothing may pile up."""
    source = KeyphasorAngle(0, PulseCounts())
    volts = train(np.arange(100, 400_000, 1.5 * MAX_PERIOD_SAMPLES), 400_000)
    returned = 0
    for sent, part in enumerate(np.split(volts, 400), start=1):
        returned += len(source.push(part))
        assert sent * 1000 - returned <= 2 * MAX_PERIOD_SAMPLES


def stream_rows(duration_s: float = 4.0) -> NDArray[np.void]:
    """A shaft with encoder and key-phasor that agree."""
    angle = steady_angle(duration_s, SPEED)
    times = np.arange(0, len(angle), PERIOD)
    volts = 5 * train(times, len(angle))
    return table(angle, {'disk_z': signal(angle, [(1.0, 1e-6, 0.4)]), 'keyphasor': volts})


ROWS = stream_rows()


def test_an_encoder_that_works_is_not_helped() -> None:
    rows = ROWS.copy()
    rows['keyphasor'] = np.random.default_rng(1).standard_normal(len(rows))
    monitor = VibrationMonitor(CONFIG)
    assert same(run(monitor, blocks(rows, 256)), run(VibrationMonitor(CONFIG), blocks(ROWS, 256)))
    assert monitor.status()['angle from'] == 'encoder'


@pytest.mark.parametrize('lost', [10_000, 15_001, 20_480])
def test_an_encoder_that_is_lost_and_comes_back(lost: int) -> None:
    rows = stream_rows(6.0)
    back = lost + 25_000
    rows['angle'][lost:back] = math.nan
    results = []
    for size in (64, 256, 3000, len(rows)):
        monitor = VibrationMonitor(CONFIG)
        results.append(run(monitor, blocks(rows, size)))
        assert monitor.status()['angle from'] == 'encoder'
        # the change to the key-phasor and back
        assert monitor.status()['angle faults [1]'] == 2
    assert all(same(result, results[0]) for result in results)
    records = results[0]
    assert [record.window for record in records] == list(range(len(records)))
    for record in records:
        if not record.valid:
            assert record.reason == 'the shaft angle is missing'
            continue
        # no window across a change
        for change in (lost, back):
            assert record.last_sample < change or record.first_sample >= change - PERIOD
        assert abs(record.vector('disk_z', 'order_1') - 1e-6 * np.exp(0.4j)) < 1e-10
    inside = [r for r in records if r.valid and lost <= r.first_sample and r.last_sample < back]
    assert len(inside) >= 5
    assert any(record.valid and record.last_sample > back for record in records)


def test_a_gap_in_the_stream_is_a_gap_with_the_key_phasor_too() -> None:
    rows = ROWS.copy()
    rows['angle'] = math.nan
    monitor = VibrationMonitor(CONFIG)
    records = run(monitor, [*blocks(rows[:15_000], 256), *blocks(rows[15_700:], 256)])
    assert [record.window for record in records] == list(range(len(records)))
    bad = [record for record in records if not record.valid]
    assert bad
    assert all(record.reason == '700 samples before sample 15700 were lost' for record in bad)
    for record in records:
        if record.valid:
            assert record.last_sample < 15_000 or record.first_sample >= 15_700
    assert records[-1].valid


def test_the_alarm_is_stale_when_the_pulses_end() -> None:
    rows = ROWS.copy()
    rows['angle'] = math.nan
    rows['keyphasor'][20_000:] = 0.0
    monitor = VibrationMonitor(CONFIG)
    records = run(monitor, blocks(rows, 256))
    assert all(record.valid and record.last_sample < 20_000 for record in records)
    assert records
    assert monitor.alarm.level is Level.STALE
    assert 'the shaft angle is missing' in monitor.alarm.reasons[0]
    assert monitor.status()['angle from'] == 'none'
    assert monitor.status()['key-phasor lost [1]'] == 1


def test_windows_come_soon_after_their_end() -> None:
    rows = ROWS.copy()
    rows['angle'] = math.nan
    monitor = VibrationMonitor(CONFIG)
    for block in blocks(rows, 256):
        for record in monitor.push(block):
            # two pulses and a choice between two, a chunk, and the block
            late = block.first_sample + 256 - record.last_sample
            assert late < 4 * PERIOD + CHUNK_SAMPLES + 256


def test_revolutions_are_counted_from_the_first_pulses() -> None:
    rows = ROWS.copy()
    rows['angle'] = math.nan
    records = run(VibrationMonitor(CONFIG), blocks(rows, 256))
    assert [record.window for record in records] == list(range(len(records)))
    # sample 0 is in the middle of a pulse, which does not count; the next is one before the first
    assert records[0].first_sample == math.ceil(2 * PERIOD)
    for first, second in pairwise(records):
        assert second.first_sample - first.first_sample == pytest.approx(16 * PERIOD, abs=1.0)
