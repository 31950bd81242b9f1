# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Properties of piecewise linear quantities and of the angle that a speed turns."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rotor_sim.stream.schedule import Ramp, RampSchedule

RATE_HZ = 10_240
ramps = st.lists(
    st.builds(
        Ramp,
        start_sample=st.integers(0, 5000),
        target=st.floats(10.0, 1200.0),
        rate_per_s=st.one_of(st.none(), st.floats(1.0, 2000.0)),
        duration_s=st.sampled_from([0.0, 0.01, 0.2]),
    ),
    max_size=5,
)


def schedule(ramp_list: list[Ramp], initial: float = 352.0) -> RampSchedule:
    result = RampSchedule(initial, RATE_HZ)
    for ramp in ramp_list:
        result.add(ramp)
    return result


def test_ramp_reaches_its_target_at_a_whole_sample() -> None:
    s = schedule([Ramp(100, 400.0, rate_per_s=48.0)])
    values, increments = s.values(0, 12_000)
    assert set(values[:101]) == {352.0}
    assert not increments[:100].any()
    end = 100 + RATE_HZ
    assert values[end - 1] < 400.0
    assert set(values[end:]) == {400.0}
    np.testing.assert_allclose(increments[100:end], 48.0 / RATE_HZ, rtol=1e-12)
    assert s.target(99) == 352.0
    assert s.target(100) == 400.0
    assert s.highest() == 400.0


def test_step_changes_at_its_sample_and_not_before() -> None:
    s = RampSchedule(0.1, RATE_HZ)
    s.add(Ramp(7, 0.2))
    values, increments = s.values(0, 10)
    assert list(values) == [0.1] * 7 + [0.2] * 3
    assert not increments.any()  # the sample before the step ends at 0.1


def test_later_ramp_cuts_the_one_under_way() -> None:
    s = schedule([Ramp(0, 452.0, rate_per_s=100.0), Ramp(RATE_HZ // 2, 352.0, rate_per_s=50.0)])
    assert s.value(RATE_HZ // 2) == pytest.approx(402.0, rel=1e-12)
    assert s.value(RATE_HZ // 2 + RATE_HZ) == 352.0
    assert s.highest() == pytest.approx(402.0, rel=1e-12)


def test_last_of_two_at_one_sample_holds() -> None:
    s = RampSchedule(0.0, RATE_HZ)
    s.add(Ramp(5, 1.0))
    s.add(Ramp(5, 2.0))
    assert list(s.values(3, 4)[0]) == [0.0, 0.0, 2.0, 2.0]


def test_before_time_zero_the_initial_value_turns_backwards() -> None:
    s = schedule([Ramp(0, 500.0)])
    values, _ = s.values(-20, 20)
    assert set(values) == {352.0}
    turns, angles = s.angles(-3000, 3000)
    unwrapped = turns * 2 * math.pi + angles
    np.testing.assert_allclose(unwrapped, 352.0 * np.arange(-3000, 0) / RATE_HZ, rtol=0, atol=1e-12)


@given(ramp_list=ramps, cut=st.integers(1, 6999))
def test_values_and_angles_do_not_depend_on_blocks(ramp_list: list[Ramp], cut: int) -> None:
    s = schedule(ramp_list)
    whole = [*s.values(0, 7000), *s.angles(0, 7000)]
    first = [*s.values(0, cut), *s.angles(0, cut)]
    second = [*s.values(cut, 7000 - cut), *s.angles(cut, 7000 - cut)]
    for all_of_it, a, b in zip(whole, first, second, strict=True):
        assert all_of_it.tobytes() == np.concatenate([a, b]).tobytes()


@given(ramp_list=ramps, late=st.integers(5000, 6000))
def test_adding_late_changes_nothing_before(ramp_list: list[Ramp], late: int) -> None:
    s = schedule(ramp_list)
    before = [*s.values(0, late), *s.angles(0, late)]
    s.add(Ramp(late, 77.0, rate_per_s=500.0))
    after = [*s.values(0, late), *s.angles(0, late)]
    # the increment over the last sample before a step is a left limit and stays too
    for a, b in zip(before, after, strict=True):
        assert a.tobytes() == b.tobytes()


@given(ramp_list=ramps)
def test_order_of_adding_does_not_matter(ramp_list: list[Ramp]) -> None:
    starts = [r.start_sample for r in ramp_list]
    if len(set(starts)) < len(starts):
        return
    a = schedule(ramp_list).angles(0, 7000)
    b = schedule(ramp_list[::-1]).angles(0, 7000)
    assert a[0].tobytes() == b[0].tobytes()
    assert a[1].tobytes() == b[1].tobytes()


@given(ramp_list=ramps)
def test_angle_is_the_integral_of_the_speed(ramp_list: list[Ramp]) -> None:
    s = schedule(ramp_list)
    values, increments = s.values(0, 7000)
    turns, angles = s.angles(0, 7000)
    assert (turns[0], angles[0]) == (0, 0.0)
    assert ((angles >= 0.0) & (angles <= 2 * math.pi)).all()
    # linear over a sample: the trapezoid between left and right limit is exact
    steps = (values + 0.5 * increments) / RATE_HZ
    expected = np.concatenate([[0.0], np.cumsum(steps)[:-1]])
    # 7000 roundings of numbers up to 1e3
    np.testing.assert_allclose(turns * 2 * math.pi + angles, expected, rtol=0, atol=1e-9)


def test_angle_is_exact_after_a_day() -> None:
    """Whole turns apart: the rest keeps its digits, by rational arithmetic with 40 digits of pi."""
    s = schedule([Ramp(1000, 400.0, rate_per_s=50.0)])
    sample = 24 * 3600 * RATE_HZ + 123
    ramp = math.ceil(48 / 50 * RATE_HZ)
    exact = Fraction(352) * 1000 + Fraction(376) * ramp + 400 * Fraction(sample - 1000 - ramp)
    turn = Fraction('6.283185307179586476925286766559005768394')
    turns = math.floor(exact / RATE_HZ / turn)
    got_turns, got = s.angles(sample, 1)
    assert got_turns[0] == turns
    assert got[0] == pytest.approx(float(exact / RATE_HZ - turns * turn), abs=1e-12)
