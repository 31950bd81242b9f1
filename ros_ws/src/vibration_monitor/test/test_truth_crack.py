# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The crack estimate on motions made from the disk's equation of motion, solved by hand.

Order n of eq. (5a-b) over k, with W = 2k/m: (1 + 4 i xi n w^2/W) b - (2 n^2 w^2/W) x = q. Bearings
move as they like; the disk's x follows from q; the probes then add their runout.
"""

import cmath
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vibration_monitor.crack import (
    CRACK_ORDERS,
    CrackConfig,
    CrackEstimate,
    CrackEstimator,
    CrackFindings,
    CrackWindow,
    learn_baseline,
)
from vibration_monitor.errors import MonitorError

CONFIG = CrackConfig()
BALL_PASS = 8 * 40.1 / 104.0
BEND_PER_G_M = 2 * 9.81 / CONFIG.rigid_critical_speed_rad_s**2
SHARES = {2.0: 0.25, 3.0: 0.1134}


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
    seed: int = 0,
    count: int = 120,
) -> list[CrackWindow]:
    """Return windows of a flight; the load goes through `loads` (g), speed through `speeds`."""
    rng = np.random.default_rng(seed)
    runouts = runout * (rng.normal(size=(6, 2)) + 1j * rng.normal(size=(6, 2)))
    made = []
    for number in range(count):
        load, speed = loads[number % len(loads)], speeds[number % len(speeds)]
        bearings = 1e-6 * (rng.normal(size=(4, 3)) + 1j * rng.normal(size=(4, 3)))
        vectors = np.zeros((6, 3), complex)
        for place, order in enumerate((*CRACK_ORDERS, BALL_PASS)):
            stiff = 1 + 4j * CONFIG.damping_ratio * order * speed**2 / rigid**2
            inertia = 2 * order**2 * speed**2 / rigid**2
            forward: complex = 0.0
            if order in SHARES:
                turned = cmath.exp(1j * order * beta)
                forward = ratio * SHARES[order] * turned * load * BEND_PER_G_M
            if order == 2.0:
                forward += misalignment
            q = np.array([forward, -1j * forward])
            sums = bearings[:2, place] + bearings[2:, place]
            vectors[:2, place] = (q + stiff * sums) / (2 * stiff - inertia)
            vectors[2:, place] = bearings[:, place]
        vectors[:, :2] += runouts
        vectors += noise * (rng.normal(size=(6, 3)) + 1j * rng.normal(size=(6, 3))) / math.sqrt(2)
        mean = np.array([0.5 * load * BEND_PER_G_M, 0, 0, 0, 0, 0])
        made.append(CrackWindow(speed, 0.57, mean, vectors[:, :2].copy(), vectors[:, 2].copy()))
    return made


def final(estimator: CrackEstimator, flight: list[CrackWindow]) -> CrackEstimate:
    """Return what the change with the load says at the end."""
    return [estimator.update(window) for window in flight][-1].by_load


def against_reference(estimator: CrackEstimator, flight: list[CrackWindow]) -> CrackEstimate:
    """Return what the difference from the reference says at the end."""
    return [estimator.update(window) for window in flight][-1].by_reference


@settings(deadline=None, max_examples=40)
@given(
    ratio=st.floats(0.005, 0.3),
    beta=st.floats(-3.1, 3.1),
    speed=st.floats(150.0, 650.0),
    misalignment=st.complex_numbers(max_magnitude=2e-6),
    seed=st.integers(0, 1000),
)
def test_without_noise_the_estimate_is_exact_whatever_the_bearings_do(
    ratio: float, beta: float, speed: float, misalignment: complex, seed: int
) -> None:
    flight = windows(
        ratio=ratio, beta=beta, speeds=(speed,), misalignment=misalignment, runout=1e-6, seed=seed
    )
    estimate = final(CrackEstimator(CONFIG), flight)
    # the ridges of the fit pull by less than one part in a million
    assert estimate.ratio == pytest.approx(ratio, rel=1e-5)
    assert cmath.phase(cmath.exp(1j * (estimate.angle_rad - beta))) == pytest.approx(0, abs=1e-4)


def test_changing_speed_is_told_from_changing_load() -> None:
    speeds = tuple(np.linspace(300.0, 600.0, 31))
    flight = windows(ratio=0.04, speeds=speeds, misalignment=1e-6, runout=2e-6)
    assert final(CrackEstimator(CONFIG), flight).ratio == pytest.approx(0.04, rel=1e-4)
    sound = windows(ratio=0.0, speeds=speeds, misalignment=1e-6, runout=2e-6)
    assert final(CrackEstimator(CONFIG), sound).ratio < 1e-5


def test_the_lower_bound_holds_for_sound_rotors_and_lies_below_the_truth() -> None:
    # 4 standard errors: of 80 flights of 120 windows none may be above by chance (p < 1e-4 each)
    for seed in range(40):
        sound = windows(noise=3e-8, misalignment=1e-6, runout=1e-6, seed=seed)
        assert final(CrackEstimator(CONFIG), sound).lowest < 0.0
        cracked = windows(ratio=0.03, noise=3e-8, seed=seed)
        assert 0.0 < final(CrackEstimator(CONFIG), cracked).lowest < 0.03


def test_at_constant_load_only_reference_flights_can_tell() -> None:
    reference = windows(runout=1e-6, misalignment=1e-6, noise=1e-8, speeds=(340.0, 352.0, 365.0))
    level: dict[str, Any] = {'loads': [1.0], 'runout': 1e-6, 'noise': 1e-8}
    cracked = windows(ratio=0.2, misalignment=1e-6, **level)
    alone = final(CrackEstimator(CONFIG), cracked)
    assert not alone.lowest > 0.0
    config = CrackConfig(baseline=learn_baseline(reference, CONFIG, BALL_PASS))
    taught = against_reference(CrackEstimator(config), cracked)
    assert taught.ratio == pytest.approx(0.2, rel=0.1)
    assert taught.lowest > 0.1
    # a misalignment that came after the reference changes 2x alone: no crack
    displaced = windows(misalignment=3e-6, **level)
    assert against_reference(CrackEstimator(config), displaced).lowest < 0.0


def test_the_ball_pass_line_gives_the_stiffness_of_the_machine() -> None:
    softer = 0.97 * CONFIG.rigid_critical_speed_rad_s
    reference = windows(rigid=softer, noise=1e-8, speeds=(250.0, 352.0, 420.0))
    learnt = learn_baseline(reference, CONFIG, BALL_PASS)
    assert learnt.rigid_critical_speeds_rad_s == pytest.approx((softer, softer), rel=1e-3)


def test_a_wrong_critical_speed_is_repaired_by_the_references() -> None:
    softer = 0.95 * CONFIG.rigid_critical_speed_rad_s
    flight: dict[str, Any] = {'rigid': softer, 'noise': 1e-8, 'speeds': (500.0,)}
    baseline = learn_baseline(windows(**flight, seed=1), CONFIG, BALL_PASS)
    cracked = windows(ratio=0.05, **flight, seed=2)
    taught = final(CrackEstimator(CrackConfig(baseline=baseline)), cracked)
    untaught = final(CrackEstimator(CONFIG), cracked)
    assert taught.ratio == pytest.approx(0.05, rel=0.15)
    assert abs(untaught.ratio - 0.05) > abs(taught.ratio - 0.05)


def test_growth_is_followed_with_the_memory() -> None:
    estimator = CrackEstimator(CONFIG)
    for step in range(10):
        estimate = final(estimator, windows(ratio=0.01 * step, count=105, noise=1e-8, seed=step))
    # 60 s of memory: the estimate lags by about one step of 60 s
    assert 0.07 < estimate.ratio < 0.09


def test_nothing_is_said_early_and_without_a_probe() -> None:
    estimator = CrackEstimator(CONFIG)
    first = windows(ratio=0.1)[0]
    assert math.isnan(estimator.update(first).by_load.ratio)
    broken = CrackWindow(352.0, 0.57, np.full(6, math.nan), first.vectors, first.ball_pass)
    assert estimator.update(broken) == CrackFindings()
    with pytest.raises(MonitorError, match='disk_y'):
        learn_baseline([broken], CONFIG, BALL_PASS)


def test_the_shares_are_those_of_the_breathing_function() -> None:
    # f cos^2 and f sin cos of eq. (4) for alpha = 30 degrees and phi = 0, forward part
    alpha = math.pi / 6
    psi = 2 * np.pi * np.arange(36_000) / 36_000
    u = np.arcsin(np.cos(psi))
    f = np.where(np.abs(u) >= alpha, u > 0, 0.5 * (1 + np.sin(0.5 * np.pi * u / alpha)))
    for order, share in SHARES.items():
        wave = np.exp(-1j * order * psi)
        along = 2 * np.mean(f * np.cos(psi) ** 2 * wave)
        across = 2 * np.mean(f * np.sin(psi) * np.cos(psi) * wave)
        assert 0.5 * (along + 1j * across) == pytest.approx(share, abs=1e-4)
