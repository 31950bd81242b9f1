# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The crack estimate on motions made from the disk's equation of motion, solved by hand.

Order n of eq. (5a-b) over k, with W = 2k/m: (1 + 4 i xi n w^2/W) b - (2 n^2 w^2/W) x = q. Bearings
move as they like; the disk's x follows from q; the probes then add their runout.
"""

import cmath
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from vibration_monitor.crack import CrackEstimate, CrackEstimator
from vibration_monitor.crack_baseline import learn_baseline
from vibration_monitor.crack_model import (
    ORBIT_ORDERS,
    CrackBaseline,
    CrackConfig,
    CrackWindow,
    unit_crack,
)
from vibration_monitor.errors import MonitorError

CONFIG = CrackConfig()
BALL_PASS = 8 * 40.1 / 104.0
Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
BEND_PER_G_M = 2 * 9.81 / CONFIG.rigid_critical_speed_rad_s**2
ALPHA = math.pi / 6
TURN = 2 * np.pi * np.arange(360) / 360


def breathing(theta: Array) -> Array:
    """Return f of eq. (4), written out as the paper does."""
    wrapped = (theta - ALPHA + math.pi / 2) % (2 * math.pi) + ALPHA - math.pi / 2
    closing = 0.5 * (1 + np.cos((wrapped - math.pi / 2 + ALPHA) * math.pi / (2 * ALPHA)))
    opening = 0.5 * (1 + np.cos((wrapped - 3 * math.pi / 2 - ALPHA) * math.pi / (2 * ALPHA)))
    return np.select(
        [
            wrapped <= math.pi / 2 - ALPHA,
            wrapped <= math.pi / 2 + ALPHA,
            wrapped <= 3 * math.pi / 2 - ALPHA,
        ],
        [np.ones_like(wrapped), closing, np.zeros_like(wrapped)],
        opening,
    )


def crack_load(motion: Array, ratio: float, beta: float) -> Array:
    """Return K f (cos^2, sin cos; sin cos, sin^2) b over one turn, (2, 360), eq. (3)."""
    bend = 2 * motion[:2] - motion[2:4] - motion[4:]
    psi = TURN + beta
    f = breathing(psi - np.arctan2(motion[1], motion[0]))
    c, s = np.cos(psi), np.sin(psi)
    along = c * bend[0] + s * bend[1]
    return np.asarray(ratio * f * along * np.stack([c, s]))


def windows(
    *,
    ratio: float = 0.0,
    beta: float = 0.7,
    loads: Sequence[float] = (1.0, 1.5, 2.5, 4.0, 3.0),
    speeds: Sequence[float] = (352.0,),
    misalignment: complex = 0.0,
    runout: float = 0.0,
    noise: float = 0.0,
    rigid: float = CONFIG.rigid_critical_speed_rad_s,
    damping: float = CONFIG.damping_ratio,
    seed: int = 0,
    count: int = 60,
    following: float = 0.0,
) -> list[CrackWindow]:
    """Return windows of a flight; the load goes through `loads` (g), speed through `speeds`.

    The bearings move at random, and by `following` in m per g with the load.
    """
    rng = np.random.default_rng(seed)
    direction = np.random.default_rng((seed, 1)).normal(size=(2, 6, 4))
    with_load = following * (direction[0] + 1j * direction[1])
    runouts = runout * (rng.normal(size=(6, 3)) + 1j * rng.normal(size=(6, 3)))
    made = []
    for number in range(count):
        load, speed = loads[number % len(loads)], speeds[number % len(speeds)]
        mean = np.array([0.5 * load * BEND_PER_G_M, 0, 0, 0, 0, 0])
        random = rng.normal(size=(6, 4)) + 1j * rng.normal(size=(6, 4))
        vectors: Complex = np.asarray(5e-7 * random + load * with_load, np.complex128)
        # the disk's 1x is anything (the unbalance); at the other orders eq. (5a-b) decides
        for _ in range(25):
            waves = np.exp(1j * np.outer(ORBIT_ORDERS, TURN))
            motion = mean[:, None] + (vectors[:, :3] @ waves).real
            load_of_crack = crack_load(motion, ratio, beta)
            for place, order in ((1, 2.0), (2, 3.0), (3, BALL_PASS)):
                stiff = 1 + 4j * damping * order * speed**2 / rigid**2
                inertia = 2 * order**2 * speed**2 / rigid**2
                q = np.zeros(2, complex)
                if order != BALL_PASS:
                    q = 2 * (load_of_crack * np.exp(-1j * order * TURN)).mean(axis=1)
                if order == 2.0:
                    q = q + misalignment * np.array([1.0, -1j])
                sums = vectors[2:4, place] + vectors[4:, place]
                vectors[:2, place] = (q + stiff * sums) / (2 * stiff - inertia)
            if not ratio:
                break
        measured = vectors + noise * (rng.normal(size=(6, 4)) + 1j * rng.normal(size=(6, 4)))
        measured[:, :3] += runouts
        made.append(CrackWindow(speed, 0.57, mean, measured[:, :3].copy(), measured[:, 3].copy()))
    return made


def estimator(config: CrackConfig) -> CrackEstimator:
    """Return an estimator of windows that do not overlap, as `windows` makes them."""
    return CrackEstimator(config, window_revolutions=32, hop_revolutions=32)


def final(of: CrackEstimator, flight: list[CrackWindow]) -> CrackEstimate:
    """Return what the change with the load says at the end."""
    return [of.update(window) for window in flight][-1].by_load


def against_reference(of: CrackEstimator, flight: list[CrackWindow]) -> CrackEstimate:
    """Return what the difference from the reference says at the end."""
    return [of.update(window) for window in flight][-1].by_reference


@pytest.mark.slow
@settings(deadline=None, max_examples=10)
@given(
    ratio=st.floats(0.005, 0.1),
    beta=st.floats(-3.1, 3.1),
    speed=st.sampled_from([150.0, 260.0, 352.0, 440.0, 480.0, 600.0, 650.0]),
    misalignment=st.complex_numbers(max_magnitude=2e-6),
    seed=st.integers(0, 1000),
)
def test_without_noise_the_estimate_is_exact_whatever_the_bearings_do(
    ratio: float, beta: float, speed: float, misalignment: complex, seed: int
) -> None:
    flight = windows(ratio=ratio, beta=beta, speeds=(speed,), misalignment=misalignment, seed=seed)
    estimate = final(estimator(CONFIG), flight)
    # cracks at every 10 degrees: cos(3 x 5 degrees) = 0.966 at 3x; 48 points a turn round the rest
    # (of 213 random cases the worst was 4.9 % low, at 650 rad/s)
    assert estimate.ratio == pytest.approx(ratio, rel=0.07)
    assert cmath.phase(cmath.exp(1j * (estimate.angle_rad - beta))) == pytest.approx(0, abs=0.05)


def test_changing_speed_is_told_from_changing_load() -> None:
    speeds = tuple(np.linspace(300.0, 600.0, 31))
    flight = windows(ratio=0.04, speeds=speeds, misalignment=1e-6, runout=2e-6)
    # the runout bends the measured orbit
    assert final(estimator(CONFIG), flight).ratio == pytest.approx(0.04, rel=0.05)
    sound = windows(ratio=0.0, speeds=speeds, misalignment=1e-6, runout=2e-6)
    assert final(estimator(CONFIG), sound).lowest < 1e-4


@pytest.mark.slow
def test_the_lower_bound_holds_for_sound_rotors_and_lies_below_the_truth() -> None:
    # 4 standard errors: of 24 flights of 60 windows none may be above by chance (p < 1e-4 each)
    for seed in range(12):
        sound = windows(noise=3e-8, misalignment=1e-6, runout=1e-6, seed=seed)
        assert final(estimator(CONFIG), sound).lowest < 0.0
        cracked = windows(ratio=0.03, noise=3e-8, seed=seed)
        assert 0.0 < final(estimator(CONFIG), cracked).lowest < 0.03


def test_at_constant_load_only_reference_flights_can_tell() -> None:
    reference = windows(runout=2e-7, misalignment=1e-6, noise=1e-8, speeds=(340.0, 352.0, 365.0))
    level: dict[str, Any] = {'loads': [1.0], 'runout': 2e-7, 'noise': 1e-8}
    cracked = windows(ratio=0.2, misalignment=1e-6, **level)
    # the same window again and again: nothing changes that could tell
    assert not final(estimator(CONFIG), cracked[:1] * 60).lowest > 0.0
    config = CrackConfig(baseline=learn_baseline(reference, CONFIG, BALL_PASS))
    taught = against_reference(estimator(config), cracked)
    assert taught.ratio == pytest.approx(0.2, rel=0.1)
    assert taught.lowest > 0.1
    # a misalignment that came after the reference changes 2x alone: no crack
    displaced = windows(misalignment=3e-6, **level)
    assert against_reference(estimator(config), displaced).lowest < 0.0


def test_the_ball_pass_line_gives_the_stiffness_of_the_machine() -> None:
    softer = 0.97 * CONFIG.rigid_critical_speed_rad_s
    reference = windows(rigid=softer, noise=1e-8, speeds=(250.0, 352.0, 420.0))
    learnt = learn_baseline(reference, CONFIG, BALL_PASS)
    assert learnt.rigid_critical_speeds_rad_s == pytest.approx((softer, softer), rel=1e-3)


DAMPED: dict[str, Any] = {'damping': 0.013, 'following': 2e-6, 'noise': 1e-8}
"""A machine of another damping whose 2x follows the load, as with clearance."""


def damped_baseline(softer: float = 1.0) -> CrackBaseline:
    rigid = softer * CONFIG.rigid_critical_speed_rad_s
    reference = windows(**DAMPED, rigid=rigid, speeds=(500.0, 536.0, 560.0), count=600)
    return learn_baseline(reference, CONFIG, BALL_PASS)


@pytest.mark.parametrize('softer', [1.0, 0.95])
def test_reference_flights_near_half_the_critical_speed_give_the_damping(softer: float) -> None:
    # the prior pulls towards 0.01 in the direction that moves less
    assert damped_baseline(softer).damping_ratios == pytest.approx((0.013, 0.013), abs=7e-4)


@pytest.mark.slow
def test_another_damping_is_no_crack() -> None:
    taught = damped_baseline()
    untaught = taught.model_copy(update={'damping_ratios': (0.01, 0.01)})
    lowest = []
    for seed in range(1, 7):  # bearings that move otherwise with the load
        sound = windows(**DAMPED, speeds=(560.0,), seed=seed)
        assert final(estimator(CrackConfig(baseline=taught)), sound).lowest < 0.0
        lowest.append(final(estimator(CrackConfig(baseline=untaught)), sound).lowest)
    # it would be: the cause of false alarms before it was learnt
    assert max(lowest) > 0.005


def test_a_wrong_critical_speed_is_repaired_by_the_flight_and_by_the_references() -> None:
    softer = 0.95 * CONFIG.rigid_critical_speed_rad_s
    flight: dict[str, Any] = {'rigid': softer, 'noise': 1e-8, 'speeds': (500.0,)}
    baseline = learn_baseline(windows(**flight, seed=1), CONFIG, BALL_PASS)
    cracked = windows(ratio=0.05, **flight, seed=2)
    taught = final(estimator(CrackConfig(baseline=baseline)), cracked)
    untaught = final(estimator(CONFIG), cracked)
    assert taught.ratio == pytest.approx(0.05, rel=0.15)
    # at steady speed it acts like a scale error, which the fit allows for, at a price
    assert untaught.ratio == pytest.approx(0.05, rel=0.15)
    assert untaught.lowest < taught.lowest < 0.05


@pytest.mark.slow
@pytest.mark.parametrize('speed', [260.0, 536.0])
@pytest.mark.parametrize(
    ('probe', 'gain', 'seed'),
    [(0, 0.15, 12), (1, 0.15, 13), (0, 0.15, 24), (0, -0.15, 30), (1, -0.15, 31), (0, 0.15, 36)],
)
def test_a_disk_probe_whose_gain_changed_is_not_a_crack_and_hides_none(
    probe: int, gain: float, seed: int, speed: float
) -> None:
    scale = np.ones(6)
    scale[probe] += gain
    lowest = []
    for ratio in (0.0, 0.03):
        flight = windows(ratio=ratio, speeds=(speed,), misalignment=1e-6, following=3e-7, seed=seed)
        changed = [
            replace(
                window,
                mean=window.mean * scale,
                vectors=window.vectors * scale[:, None],
                ball_pass=window.ball_pass * scale,
            )
            for window in flight
        ]
        lowest.append(final(estimator(CONFIG), changed).lowest)
    # the seeds are such that each case failed before the fit allowed for gains: a sound rotor at
    # 0.003 to 0.012 (an alarm is 0.005), or a crack below 0
    assert lowest[0] < 0.0
    assert lowest[1] > 0.015


@pytest.mark.parametrize('seed', range(4))
def test_noise_in_level_flight_is_no_evidence(seed: int) -> None:
    following = estimator(CONFIG)
    for window in windows(loads=[1.0], noise=3e-7, speeds=(236.0,), count=100, seed=seed):
        # q and p share the noise: without the rule that the bend must change it is above 0
        assert not following.update(window).by_load.lowest > 0.0


def doubts(flight: list[CrackWindow]) -> list[str]:
    """Return of each window why the estimate cannot call the shaft sound."""
    following = estimator(CONFIG)
    return [following.update(window).doubt for window in flight]


@pytest.mark.slow
@settings(deadline=None, max_examples=10)
@given(
    ratio=st.floats(0.0, 0.3),
    speed=st.floats(200.0, 640.0),
    load=st.floats(-2.0, 9.0),
    noise=st.sampled_from([0.0, 1e-8, 1e-7]),
    seed=st.integers(0, 1000),
)
def test_a_load_that_stays_never_vouches_for_a_sound_shaft(
    ratio: float, speed: float, load: float, noise: float, seed: int
) -> None:
    steady: dict[str, Any] = {'loads': [load], 'speeds': [speed], 'misalignment': 1e-6}
    said = doubts(windows(ratio=ratio, noise=noise, seed=seed, **steady))
    assert all(said)
    assert said[-1] == 'the load has not changed by 0.079 g in the last minute'


@pytest.mark.slow
def test_a_load_that_changes_vouches_for_a_sound_shaft_and_no_other() -> None:
    for seed in range(6):
        settled = doubts(windows(noise=1e-8, misalignment=1e-6, runout=1e-6, seed=seed))
        # 10 s and 160 revolutions of windows of 0.57 s and 32 revolutions
        assert all(settled[:21])
        assert not any(settled[21:])
        for ratio in (0.06, 0.3):
            cracked = doubts(windows(ratio=ratio, noise=3e-8, seed=seed))
            assert all(cracked)
            assert 'is not ruled out' in cracked[-1]


def test_noise_that_hides_a_crack_does_not_vouch_for_a_sound_shaft() -> None:
    small, large = (
        doubts(windows(loads=[1.0, 1.3], noise=noise, seed=3))[-1] for noise in (1e-8, 5e-7)
    )
    assert small == ''
    assert 'is not ruled out' in large


def test_beyond_half_the_critical_speed_no_shaft_is_called_sound() -> None:
    assert doubts(windows(speeds=(650.0,), noise=1e-8))[-1] == ''
    assert doubts(windows(speeds=(660.0,), noise=1e-8))[-1] == (
        'at 660 rad/s a crack may be missed; the crack estimate can call a shaft sound up to '
        '655 rad/s'
    )
    fast = windows(ratio=0.1, speeds=(760.0,), noise=1e-8)
    assert math.isnan(final(estimator(CONFIG), fast).lowest)
    assert doubts(fast)[-1].startswith('at 760 rad/s a crack may be missed')


def test_the_load_that_is_asked_for_is_that_of_the_rotor() -> None:
    # half the critical speed: four times the bend of each g, so a quarter of the change does
    soft = CrackConfig(rigid_critical_speed_rad_s=0.5 * CONFIG.rigid_critical_speed_rad_s)
    following = CrackEstimator(soft, window_revolutions=32, hop_revolutions=32)
    flight = windows(loads=[1.0], speeds=(150.0,), rigid=soft.rigid_critical_speed_rad_s)
    said = [following.update(window).doubt for window in flight]
    assert said[-1] == 'the load has not changed by 0.02 g in the last minute'


@pytest.mark.slow
def test_growth_is_followed_with_the_memory() -> None:
    following = estimator(CONFIG)
    for step in range(10):
        estimate = final(following, windows(ratio=0.01 * step, count=30, noise=1e-8, seed=step))
    # the short memory of 15 s lags by about one step of 17 s
    assert 0.065 < estimate.ratio < 0.09


def test_nothing_is_said_early_and_without_a_probe() -> None:
    following = estimator(CONFIG)
    first = windows(ratio=0.1)[0]
    assert math.isnan(following.update(first).by_load.ratio)
    broken = CrackWindow(352.0, 0.57, np.full(6, math.nan), first.vectors, first.ball_pass)
    silent = following.update(broken)
    assert math.isnan(silent.by_load.ratio)
    assert silent.doubt == 'no valid value of disk_y, disk_z, brg1_y, brg1_z, brg2_y, brg2_z'
    with pytest.raises(MonitorError, match='disk_y'):
        learn_baseline([broken], CONFIG, BALL_PASS)
    # an order that the samples do not resolve is NaN: no stiffness can come from it
    unresolved = CrackWindow(352.0, 0.57, first.mean, first.vectors, np.full(6, complex(math.nan)))
    with pytest.raises(MonitorError, match='no whole window'):
        learn_baseline([unresolved], CONFIG, BALL_PASS)


@pytest.mark.parametrize('half_angle', [0.2, math.pi / 6, 1.5])
def test_a_slow_crack_has_the_shares_of_the_static_bend(half_angle: float) -> None:
    mean = np.array([0.5e-5, 0, 0, 0, 0, 0])
    still = CrackWindow(100.0, 0.57, mean, np.zeros((6, 3), complex), np.zeros(6, complex))
    unit = unit_crack(still, half_angle)[:, 0]
    # 2x: a quarter of the bend whatever the half angle; 3x: see docs/crack.md
    assert unit[0] == pytest.approx(0.25e-5, rel=1e-3)
    expected = {0.2: 0.1074, math.pi / 6: 0.1134, 1.5: 0.125}[half_angle]
    assert unit[1] == pytest.approx(expected * 1e-5, rel=0.01)
