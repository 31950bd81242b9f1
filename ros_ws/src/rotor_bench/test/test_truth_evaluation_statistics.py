# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The statistics against closed forms, published tables and their own definition."""

import math
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm, poisson

from rotor_bench.evaluation import statistics


def separate(count: int) -> np.ndarray:
    return np.arange(count)


@pytest.mark.parametrize('shift', [0.0, 0.5, 1.0, 2.0])
def test_area_of_shifted_normals_is_phi_of_shift_over_root_two(shift: float) -> None:
    generator = np.random.default_rng(5)
    count = 2000
    scores = np.concatenate([generator.normal(shift, 1, count), generator.normal(0, 1, count)])
    positive = np.arange(2 * count) < count
    found = statistics.auc(scores, positive, separate(2 * count), replicates=50)
    # the standard error of an area over 2000 + 2000 is at most sqrt(1 / (12 * 1000)) = 0.009
    assert found.value == pytest.approx(norm.cdf(shift / math.sqrt(2)), abs=0.027)
    assert (found.positives, found.negatives) == (count, count)


def test_area_of_two_exponentials() -> None:
    # P(X > Y) of rates a and b is b / (a + b)
    generator = np.random.default_rng(6)
    scores = np.concatenate(
        [generator.exponential(1 / 1, 3000), generator.exponential(1 / 3, 3000)]
    )
    found = statistics.auc(scores, np.arange(6000) < 3000, separate(6000), replicates=50)
    assert found.value == pytest.approx(3 / 4, abs=0.02)  # three standard errors


scores_of = st.lists(st.sampled_from([0.0, 1.0, 2.0, 3.0, math.nan]), min_size=1, max_size=12)


@given(scores_of, scores_of)
def test_area_is_the_share_of_pairs_won_and_the_area_under_the_curve(
    cracked: list[float], healthy: list[float]
) -> None:
    scores = np.array(cracked + healthy)
    positive = np.arange(len(scores)) < len(cracked)
    low = [-1.0 if math.isnan(s) else s for s in cracked]
    other = [-1.0 if math.isnan(s) else s for s in healthy]
    won = sum((a > b) + 0.5 * (a == b) for a in low for b in other)
    found = statistics.auc(scores, positive, separate(len(scores)), replicates=1)
    assert found.value == pytest.approx(won / (len(low) * len(other)), abs=1e-12)
    curve = statistics.roc(scores, positive)
    under = np.trapezoid(curve.true_positive_rate, curve.false_positive_rate)
    assert under == pytest.approx(found.value, abs=1e-12)
    assert curve.true_positive_rate[[0, -1]].tolist() == [0.0, 1.0]
    assert (np.diff(curve.thresholds) < 0).all()


@pytest.mark.parametrize('positive', [True, False])
def test_no_area_of_one_kind_alone(positive: bool) -> None:
    for count in (0, 4):
        found = statistics.auc(np.zeros(count), np.full(count, positive), separate(count))
        assert math.isnan(found.value)
        assert math.isnan(found.low)


@pytest.mark.slow
def test_the_interval_covers_the_truth_as_often_as_it_says() -> None:
    # machines with an offset of their own: 60 machines of 2 cracked and 2 healthy flights. The
    # offset is shared by both kinds of a machine and independent between machines, so the area
    # is that of normals of variance 1 + 1 each: Phi(1 / sqrt(4)) up to the pairs within machines
    generator = np.random.default_rng(7)
    machines = np.repeat(np.arange(60), 4)
    positive = np.tile([True, True, False, False], 60)
    truth = norm.cdf(1.0 / 2.0) + (norm.cdf(1.0 / math.sqrt(2)) - norm.cdf(0.5)) / 60
    covered = 0
    for run in range(300):
        scores = generator.normal(0, 1, 60)[machines] + generator.normal(0, 1, 240) + positive
        found = statistics.auc(scores, positive, machines, seed=run, replicates=300)
        covered += found.low <= truth <= found.high
    # binomial: 0.95 +- 3 * 0.0126, and a percentile bootstrap of 60 units is 1 to 2 % narrow
    assert 0.89 <= covered / 300 <= 0.99


def test_flights_of_one_machine_do_not_count_as_independent() -> None:
    generator = np.random.default_rng(8)
    machines = np.repeat(np.arange(20), 10)
    positive = np.repeat(np.arange(20) % 2 == 0, 10)
    scores = generator.normal(0, 1, 20)[machines] + 0.5 * positive
    as_machines = statistics.auc(scores, positive, machines)
    as_flights = statistics.auc(scores, positive, separate(200))
    # ten equal flights a machine: the right interval is sqrt(10) = 3.2 times as wide
    widths = (as_machines.high - as_machines.low) / (as_flights.high - as_flights.low)
    assert 2.2 < widths < 4.5


def test_the_interval_repeats_with_its_seed() -> None:
    scores = np.random.default_rng(9).normal(size=40)
    arguments = (scores, np.arange(40) % 2 == 0, np.arange(40) // 4)
    assert statistics.auc(*arguments, seed=3) == statistics.auc(*arguments, seed=3)
    assert statistics.auc(*arguments, seed=3) != statistics.auc(*arguments, seed=4)


@pytest.mark.parametrize(('events', 'upper'), [(0, 2.996), (1, 4.744), (2, 6.296), (10, 16.962)])
def test_upper_bound_is_that_of_the_tables(events: int, upper: float) -> None:
    # Garwood (1936), one-sided 95 %; printed with three decimals
    found = statistics.poisson_rate(events, 1.0)
    assert found.upper_per_hour == pytest.approx(upper, abs=5e-4)


@given(st.integers(0, 60), st.floats(0.1, 1000))
def test_at_the_upper_bound_so_few_events_come_in_5_percent(events: int, hours: float) -> None:
    rate = statistics.poisson_rate(events, hours)
    assert poisson.cdf(events, rate.upper_per_hour * hours) == pytest.approx(0.05, abs=1e-9)
    assert rate.per_hour == events / hours


def test_no_rate_without_time() -> None:
    assert math.isnan(statistics.poisson_rate(0, 0.0).upper_per_hour)


@given(
    st.lists(st.sampled_from([0.0, 1.0, 2.0, 5.0, math.nan, math.inf]), min_size=1, max_size=20),
    st.floats(0, 30),
)
def test_threshold_is_the_lowest_that_keeps_the_rate(scores: list[float], rate: float) -> None:
    hours = 2.0
    threshold = statistics.threshold_at_rate(np.array(scores), hours, rate)
    if all(math.isnan(score) for score in scores):
        assert math.isnan(threshold)
        return
    assert threshold > -math.inf  # so silence never reaches it
    allowed = rate * hours + 1e-6
    if threshold == math.inf:  # more failures than allowed, which are above every number
        assert scores.count(math.inf) > allowed - 2e-6
        return
    assert sum(score >= threshold for score in scores) <= allowed
    with np.errstate(over='ignore'):  # the lowest number there is
        lower = np.nextafter(threshold, -math.inf)
    heard = [score for score in scores if not math.isnan(score)]
    assert lower == -math.inf or sum(score >= lower for score in heard) > allowed - 2e-6


def test_no_threshold_without_a_healthy_flight_that_has_a_score() -> None:
    assert math.isnan(statistics.threshold_at_rate(np.array([]), 0.0, 0.1))
    assert math.isnan(statistics.threshold_at_rate(np.array([math.nan]), 20.0, 0.1))
    assert statistics.threshold_at_rate(np.array([math.inf]), 0.0, 0.1) == math.inf
    # one alarm is allowed and there is one flight: every number will do, silence will not
    assert statistics.threshold_at_rate(np.array([2.0]), 10.0, 0.1) == -sys.float_info.max


def test_smallest_found_counts_only_levels_with_all_above_found() -> None:
    levels = np.repeat([0.02, 0.03, 0.05, 0.1], 10)
    found = np.array([True] * 10 + [True] * 5 + [False] * 5 + [True] * 9 + [False] + [True] * 10)
    smallest, table = statistics.smallest_found(levels, found)
    assert smallest == 0.05  # 0.02 is found, but 0.03 above it is not
    assert table == [(0.02, 10, 1.0), (0.03, 10, 0.5), (0.05, 10, 0.9), (0.1, 10, 1.0)]
    assert math.isnan(statistics.smallest_found(levels, np.zeros(40, bool))[0])


def test_delays_count_those_never_reached_as_later() -> None:
    found = statistics.delays([3.0, 1.0, math.nan, 2.0])
    assert (found.flights, found.reached) == (4, 3)
    assert (found.quantile_10, found.median, found.quantile_90) == (1.0, 2.0, math.inf)
    assert math.isnan(statistics.delays([]).median)
