# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The shaft angle from a tachometer against the angle that made it."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rotor_recording.errors import ImportFileError
from rotor_recording.importing.shaft import constant_speed, from_tacho, pulse_times

RATE_HZ = 1280
TIME = np.arange(30 * RATE_HZ) / RATE_HZ


def chirp(start_hz: float, rise_hz_s: float) -> NDArray[np.float64]:
    """Return the angle in rad of a speed that rises steadily, 0 at the first sample."""
    angle: NDArray[np.float64] = 2 * np.pi * (start_hz * TIME + rise_hz_s * TIME**2 / 2)
    return angle


def pulses(angle: NDArray[np.float64], per_revolution: int, width: float) -> NDArray[np.float64]:
    """Return pulses of 5 V that rise at angle 0 and last `width` of their period."""
    inside = ((per_revolution * angle / (2 * np.pi)) % 1.0) < width
    return np.where(inside, 5.0, 0.0)


def error(signal: NDArray[np.float64], angle: NDArray[np.float64], count: int = 1) -> float:
    """Return the largest error in rad, whole pulses at the start aside."""
    found = from_tacho(signal, RATE_HZ, count, '2').angle_rad
    known = np.isfinite(found)
    difference = found[known] - angle[known]
    period = 2 * np.pi / count
    return float(np.abs(difference - period * np.round(difference[0] / period)).max())


@settings(deadline=None, max_examples=40)
@given(st.floats(2.0, 40.0), st.floats(0.0, 1.2), st.floats(-3.0, 3.0), st.floats(0.1, 100.0))
def test_a_sine_a_revolution_gives_the_angle(
    start_hz: float, rise_hz_s: float, phase: float, amplitude: float
) -> None:
    angle = chirp(start_hz, rise_hz_s) + phase
    # Linear interpolation of a sine of n samples a period between +-h/2 about its zero, h = 2 pi/n:
    # x - sin x <= (h/2)^3 / 6 < 0.01 rad at n = 16. The middle of the range is off by as much as
    # the samples miss the peaks, 1 - cos(h/2) < 0.02. PCHIP on a parabola: its slopes at the
    # pulses are good to the second order, (rise T)^2 / speed: below 0.02 rad at 2 Hz.
    assert error(amplitude * np.sin(angle) + 7.0, angle) < 0.03


def test_the_sweep_of_ota_mle_is_followed() -> None:
    angle = chirp(5.0, 1.396)
    assert error(2.0 * np.sin(angle), angle) < 0.02


@pytest.mark.parametrize('count', [1, 2, 20])
def test_narrow_pulses_give_the_angle_to_a_sample(count: int) -> None:
    angle = chirp(8.0, 0.1)
    # a step is seen within one sample: at most 11 Hz / 1280 Hz of a revolution, half of it mean
    worst = 2 * np.pi * 11.0 / RATE_HZ
    assert error(pulses(angle, count, 0.2), angle, count) < worst


def test_speeds_and_revolutions_are_reported() -> None:
    shaft = from_tacho(np.sin(chirp(10.0, 0.0) + 1.0), RATE_HZ, 1, '2')
    # timing as above, 1e-4 of a period of 128 samples
    assert shaft.slowest_hz == pytest.approx(10.0, rel=1e-3)
    assert shaft.fastest_hz == pytest.approx(10.0, rel=1e-3)
    assert shaft.revolutions == 299
    assert shaft.doubtful_intervals == 0
    assert 0 < np.isnan(shaft.angle_rad).sum() < 2 * 128


@pytest.mark.parametrize('extra', [False, True])
def test_a_lost_or_doubled_pulse_leaves_a_hole_and_nothing_wrong(extra: bool) -> None:
    angle = chirp(10.0, 0.0) + 1.0
    signal = pulses(angle, 1, 0.1)
    rises = np.flatnonzero(np.diff(signal) > 0) + 1
    if extra:
        signal[rises[100] + 50 : rises[100] + 60] = 5.0
    else:
        signal[rises[100] : rises[100] + 20] = 0.0
    shaft = from_tacho(signal, RATE_HZ, 1, '2')
    hole = np.isnan(shaft.angle_rad)
    assert shaft.doubtful_intervals == (4 if extra else 3)
    known = np.flatnonzero(~hole)
    turns = (shaft.angle_rad[known] - angle[known]) / (2 * np.pi)
    # behind the hole the angle may be off by whole revolutions, never by a part; one sample
    assert np.abs(turns - np.round(turns)).max() < 10.0 / RATE_HZ
    assert len(np.unique(np.round(turns))) == 2
    inside = known[0] + np.flatnonzero(hole[known[0] : known[-1]])
    assert inside[0] <= rises[100]
    assert np.array_equal(np.diff(inside), np.ones(len(inside) - 1))


def test_noise_below_the_hysteresis_makes_no_pulse() -> None:
    angle = chirp(3.0, 0.0)
    noise = 0.1 * np.random.default_rng(1).standard_normal(len(angle))
    # 0.2 of a range of about 2.6 is 5 sigma to each side of the middle
    assert len(pulse_times(np.sin(angle + 1.5) + noise)) == 90
    assert len(pulse_times(np.sin(angle + 1.5))) == 90


def pickup(angle: NDArray[np.float64], kind: str) -> NDArray[np.float64]:
    """Return pulses of a magnetic pick-up, whose height is in proportion to the speed."""
    turns = (angle / (2 * np.pi) + 0.5) % 1.0 - 0.5
    if kind == 'one-sided':
        shape = np.exp(-((turns / 0.06) ** 2))
    else:
        shape = (-1 if kind == 'up then down' else 1) * turns * np.exp(-((turns / 0.06) ** 2))
    noise = 2e-4 * np.random.default_rng(2).standard_normal(len(angle))
    return np.gradient(angle) * shape + (noise if kind == 'one-sided' else 0.02 * noise)


@pytest.mark.parametrize('kind', ['one-sided', 'up then down', 'down then up'])
@pytest.mark.parametrize('backwards', [False, True])
def test_pulses_that_grow_with_the_speed_are_followed(kind: str, backwards: bool) -> None:
    angle = chirp(4.0, 1.2)
    if backwards:
        angle = (angle[-1] - angle)[::-1]
    shaft = from_tacho(pickup(angle, kind), RATE_HZ, 1, '2')
    assert shaft.follows_height
    assert shaft.doubtful_intervals == 0
    assert shaft.slowest_hz == pytest.approx(4.2, abs=0.25)  # the first interval is a second long
    assert shaft.fastest_hz == pytest.approx(40.0, rel=0.05)
    known = np.isfinite(shaft.angle_rad)
    assert np.count_nonzero(~known) < 2 * RATE_HZ / 4.0
    turns = (shaft.angle_rad - angle)[known] / (2 * np.pi)
    # a place on the pulse, the same on all: 1 % of a revolution and, at 32 samples a
    # revolution, a fifth of a sample
    assert np.ptp(turns) < 0.02


@pytest.mark.parametrize('rest', [0.0, 0.02, 0.2])
def test_what_a_tacho_at_rest_picks_up_is_no_pulse(rest: float) -> None:
    angle = 2 * np.pi * 25.0 * TIME
    turning = TIME > 15.0
    hum = rest * np.sin(2 * np.pi * 50.0 * TIME)
    noise = rest / 4 * np.random.default_rng(3).standard_normal(len(TIME))
    shaft = from_tacho(np.where(turning, pulses(angle, 1, 0.1), hum + noise), RATE_HZ, 1, '2')
    assert not shaft.follows_height
    assert shaft.slowest_hz > 24.0
    assert shaft.fastest_hz < 26.0
    assert np.isnan(shaft.angle_rad[~turning]).all()
    assert np.isfinite(shaft.angle_rad[TIME > 15.1]).mean() > 0.99


def test_one_outlier_hides_no_pulse() -> None:
    angle = chirp(20.0, 0.0)
    signal = pulses(angle, 1, 0.1)
    signal[20_003] = 40.0
    shaft = from_tacho(signal, RATE_HZ, 1, '2')
    assert np.isfinite(shaft.angle_rad).mean() > 0.98
    turns = (shaft.angle_rad - angle)[np.abs(np.arange(len(angle)) - 20_003) > RATE_HZ] / (
        2 * np.pi
    )
    turns = turns[np.isfinite(turns)]
    assert np.abs(turns - np.round(turns)).max() < 20.0 / RATE_HZ


def test_too_many_pulses_for_one_a_revolution_are_refused() -> None:
    teeth = np.sin(60 * chirp(5.0, 0.0))
    assert from_tacho(teeth, RATE_HZ, 60, '2').fastest_hz == pytest.approx(5.0, rel=0.02)
    with pytest.raises(
        ImportFileError, match=r'gives 30\d\.?\d* Hz, more than a sixth .* 213\.333 Hz'
    ):
        from_tacho(teeth, RATE_HZ, 1, '2')


@pytest.mark.parametrize(
    ('signal', 'words'),
    [
        (np.zeros(100), 'passes 0 times'),
        (np.sin(np.arange(20) / 2), 'passes 1 times'),
        (np.append(np.sin(np.arange(100)), math.nan), '1 samples without a number'),
        (np.repeat([0, 1] * 4, [1, 1, 3, 1, 20, 1, 90, 1]), 'no steady pace'),
        (np.empty(0), 'passes 0 times'),
    ],
)
def test_what_is_no_tacho_is_refused(signal: NDArray[np.float64], words: str) -> None:
    with pytest.raises(ImportFileError, match=words):
        from_tacho(signal.astype(np.float64), RATE_HZ, 1, '2')


def test_a_constant_speed_gives_its_angle() -> None:
    shaft = constant_speed(48_829, 48_828, 24.7)
    assert shaft.angle_rad[0] == 0.0
    assert shaft.angle_rad[-1] == pytest.approx(2 * np.pi * 24.7, rel=1e-15)
