# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Flights past detectors: what remains of them, on one process and on several."""

import dataclasses
import json
import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import cast

import pytest

import spy_rig
from faulty_detectors import Sound
from rotor_bench.dataset.suite import Flight, Machine
from rotor_bench.evaluation import runner
from rotor_bench.evaluation.anonymous import Anonymiser
from rotor_bench.evaluation.outcome import FlightResult, Outcome, Watch
from rotor_common.errors import ConfigError
from rotor_rig.scenario_model import load_scenario

RATE_HZ = 10_240
NAMES = ['faulty_detectors:Sound', 'faulty_detectors:RaisesLater', 'faulty_detectors:RaisesInFit']


@pytest.fixture
def here() -> Iterator[None]:
    """Stand where the modules of the tests lie, as their user would."""
    before = Path.cwd()
    os.chdir(Path(__file__).parent)
    yield
    os.chdir(before)


def plan() -> tuple[Machine, ...]:
    """Return machines of two lengths, so of two batches."""

    def lengthened(flight: Flight) -> Flight:
        seconds = 0.2 if flight.machine < 2 else 0.3
        plain = cast('spy_rig.PlainFlight', flight)
        return cast('Flight', dataclasses.replace(plain, duration_s=seconds))

    return tuple(
        Machine(m.number, 'test', tuple(lengthened(f) for f in m.flights[:4]))
        for m in spy_rig.plan()[:3]
    )


def by_hand(machine: Machine) -> list[list[tuple[float, float, str]]]:
    """Return (time, score, evidence) of the detector Sound in this process."""
    reference, *tests = [
        [block for (block,) in spy_rig.TellingSource().fly([flight])] for flight in machine.flights
    ]
    detector = Sound()
    anonymiser = Anonymiser(RATE_HZ)
    detector.fit([[anonymiser.copy(block) for block in reference]])
    results = []
    for test in tests:
        detector.blocks = 0
        verdicts = [detector.push(block) for block in test]
        results.append(
            [
                ((n + 1) * spy_rig.SAMPLES / RATE_HZ, verdict.score, verdict.evidence)
                for n, verdict in enumerate(verdicts)
            ]
        )
    return results


@pytest.mark.slow
@pytest.mark.usefixtures('here')
def test_what_remains_is_what_the_detector_says_whatever_the_number_of_processes() -> None:
    machines = plan()
    flown: list[tuple[int, float]] = []
    one, two = (
        runner.evaluate(
            machines,
            NAMES,
            spy_rig.TellingSource(),
            jobs=jobs,
            on_flights=lambda flights, seconds: flown.append((flights, seconds)),
        )
        for jobs in (1, 2)
    )
    assert [str(f) for f in one.flights] == [str(f) for f in two.flights]
    assert one.isolation == two.isolation
    assert sum(flights for flights, _ in flown) == 2 * 3 * 4
    assert [(f.machine, f.number) for f in one.flights] == [
        (m, n) for m in range(3) for n in (1, 2, 3)
    ]
    for machine in machines:
        for flight, told in zip(
            [f for f in one.flights if f.machine == machine.number], by_hand(machine), strict=True
        ):
            outcome = flight.outcomes[NAMES[0]]
            score_s, score, evidence = max(told, key=lambda verdict: verdict[1])
            assert (outcome.score, outcome.score_s, outcome.failure) == (score, score_s, '')
            # `fitted on` counts blocks: the evidence is word for word that of this process
            assert outcome.evidence == evidence
            assert outcome.judged_s == pytest.approx(4 * spy_rig.SAMPLES / RATE_HZ)
            assert 'third block' in flight.outcomes[NAMES[1]].failure
            assert flight.outcomes[NAMES[2]].failure.startswith('in fit: ZeroDivisionError')


@pytest.mark.slow
def test_a_suite_in_reach_of_the_detectors_is_refused() -> None:
    with pytest.raises(ConfigError, match='move it elsewhere'):
        runner.evaluate(
            spy_rig.plan()[:1],
            ['ratios'],
            spy_rig.TellingSource(),
            secret=Path(runner.__file__).parents[3] / 'vibration_monitor' / 'vibration_monitor',
        )


def test_a_watch_counts_alarms_and_keeps_the_largest() -> None:
    watch = Watch(alarm_score=1.0)
    said = [math.nan, 0.5, 1.0, math.nan, 1.2, 0.9, 1.1, 1.1]
    for second, score in enumerate(said):
        watch.take(second + 1.0, 1.0, score, f'at {second}')
    assert watch.outcome() == Outcome(
        score=1.2,
        score_s=5.0,
        evidence='at 4',
        first_alarm_s=3.0,
        alarms=2,  # the NaN between 1.0 and 1.2 is no end of the alarm
        judged_s=6.0,
        rises=((2.0, 0.5), (3.0, 1.0), (5.0, 1.2)),
    )
    assert watch.outcome().first_at(0.8) == 3.0
    assert math.isnan(watch.outcome().first_at(1.3))
    assert math.isnan(Watch(1.0).outcome().score)


def test_rises_are_thinned_to_later_times_only() -> None:
    watch = Watch(alarm_score=1.0)
    every = [(k / 10, k / 100) for k in range(1, 101)]
    for time_s, score in every:
        watch.take(time_s, 0.1, score, '')
    rises = watch.outcome().rises
    assert len(rises) <= 22
    assert set(rises) <= set(every)
    assert rises[-1] == every[-1]
    for threshold in (0.05, 0.5, 0.93):
        exact = next(time for time, score in every if score >= threshold)
        assert exact <= watch.outcome().first_at(threshold) <= exact + 1.0


def test_results_survive_json() -> None:
    flight = FlightResult(
        1, 2, 3.0, {'crack': 'growing'}, ((0.0, 0.0), (3.0, 0.1)),
        {'a': Outcome(rises=((1.0, 2.0),)), 'b': Outcome(score=1.0)},
    )  # fmt: skip
    plain = json.loads(json.dumps(flight.plain()))
    plain['outcomes']['a']['score'] = None
    assert str(FlightResult.from_plain(plain)) == str(flight)


def test_the_course_of_a_crack_is_that_of_its_scenario() -> None:
    growth = [{'at_s': 1.0, 'to': 0.02, 'over_s': 2.0}, {'at_s': 4.0, 'to': 0.05, 'over_s': 0.0}]
    scenario = load_scenario('level_healthy', duration_s=5.0, crack_growth=growth)
    flight = cast('Flight', spy_rig.PlainFlight(0, 0, 'test', scenario, {}, 5.0))
    result = FlightResult(0, 0, 5.0, {}, runner.crack_course(flight))
    schedule = scenario.rotor_sim().schedules()['crack_stiffness_ratio']
    for time_s in (0.0, 0.9, 1.5, 2.0, 3.0, 3.9, 4.0, 4.5, 5.0):
        expected = schedule.value(round(time_s * scenario.rate_hz))
        assert result.crack_at(time_s) == pytest.approx(expected, abs=1e-9)
    assert math.isnan(result.crack_at(math.nan))
