# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""From flights to numbers: what counts where, and that failing never pays."""

import dataclasses
import json
import math
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from rotor_bench.evaluation import pictures, report, results_page, summary
from rotor_bench.evaluation.outcome import Evaluated, FlightResult, Outcome

HOUR_S = 3600.0


def flight(number: int, score: float, crack: float = 0.0, **changes: Any) -> FlightResult:
    labels = {
        'crack': 'constant' if crack else 'healthy',
        'crack_stiffness_ratio': crack,
        'decoy': False,
        'maneuver': 'pulls_3g',
        'held_out_family': False,
        'confounder': 'none',
        'speed_program': 'steady',
        'speed_rad_s': 352.0,
        'load_factor_range': 2.0,
        'noise': 'realistic',
        'encoder': True,
        **{key: value for key, value in changes.items() if key not in ('alarms', 'failure')},
    }
    alarms = changes.get('alarms', int(score >= 1.0))
    outcome = Outcome(
        score=score, alarms=alarms, judged_s=HOUR_S / 2, failure=changes.get('failure', '')
    )
    return FlightResult(number // 4, number, HOUR_S, labels, (), {'d': outcome})


def growing(number: int, rises: tuple[tuple[float, float], ...], failure: str = '') -> FlightResult:
    base = flight(number, rises[-1][1] if rises else math.nan, 0.1)
    outcome = Outcome(score=base.outcomes['d'].score, rises=rises, failure=failure)
    labels = {**base.labels, 'crack': 'growing', 'maneuver': 'mixed'}
    return FlightResult(
        base.machine, number, 600.0, labels, ((0.0, 0.0), (600.0, 0.1)), {'d': outcome}
    )


def numbers(flights: list[FlightResult]) -> dict[str, Any]:
    found: dict[str, Any] = summary.summary(flights, {'d': 1.0}, replicates=50)['d']
    return found


HEALTHY = [flight(k, k / 10) for k in range(8)]


def test_only_varying_flights_of_some_depth_count_for_the_goal() -> None:
    cracked = [
        flight(8, 0.65, 0.05),
        flight(9, 0.0, 0.02),
        flight(10, 9.0, 0.1, load_factor_range=0.1),
    ]
    found = numbers([*HEALTHY, *cracked])
    # 0.65 is above 7 of the 8 healthy scores
    assert found['auc']['goal']['value'] == 7 / 8
    assert found['auc']['all depths']['value'] == pytest.approx((7 + 0.5) / 16)
    assert found['auc']['all flights']['value'] == pytest.approx((7 + 8) / 16)
    assert math.isnan(found['auc']['steady level flight']['value'])
    assert found['auc']['steady level flight']['positives'] == 1
    by_depth = found['auc_by']['crack_stiffness_ratio']
    assert {k: area['value'] for k, area in by_depth.items()} == {'0.02': 0.5 / 8, '0.05': 7 / 8}


def test_other_noise_is_apart() -> None:
    found = numbers([*HEALTHY, flight(8, 9.0, 0.1), flight(9, -9.0, 0.1, noise='noisy')])
    assert found['auc']['goal']['value'] == 1.0
    assert set(found['auc_by']['noise']) == {'noisy', 'realistic'}
    none_usual = numbers([flight(1, 0.0, noise='none'), flight(2, 1.0, 0.1, noise='none')])
    assert none_usual['auc']['goal']['value'] == 1.0


def test_failing_counts_against_the_detector_and_never_for_it() -> None:
    sound = numbers([*HEALTHY, flight(8, 9.0, 0.1)])
    failed = numbers([
        *HEALTHY, flight(8, 9.0, 0.1, failure='broke'), flight(9, 0.0, alarms=0, failure='broke'),
    ])  # fmt: skip
    assert sound['auc']['goal']['value'] == 1.0
    assert failed['auc']['goal']['value'] == 0.0
    assert failed['failed'] == 2
    assert failed['failures'] == {'broke': 2}
    assert failed['false_alarms']['all']['events'] == sound['false_alarms']['all']['events'] + 1
    assert failed['false_alarms']['all']['hours'] == sound['false_alarms']['all']['hours'] == 4.0
    assert failed['thresholds']['0 false alarms per hour'] == math.inf


def test_silence_is_counted_and_is_the_lowest_score() -> None:
    found = numbers([*HEALTHY, flight(8, math.nan, 0.1)])
    assert found['silent'] == 1
    assert found['failed'] == 0
    assert found['auc']['goal']['value'] == 0.0


def test_false_alarms_count_episodes_over_judged_hours() -> None:
    found = numbers([*HEALTHY, flight(8, 2.0, alarms=3), flight(9, 2.0, 0.1, alarms=5)])
    rate = found['false_alarms']['all']
    assert (rate['events'], rate['hours'], rate['flights'], rate['of']) == (3, 4.5, 1, 9)
    assert rate['upper_per_hour'] == pytest.approx(7.754 / 4.5, abs=1e-3)  # Garwood (1936)


def test_smallest_crack_at_thresholds_that_healthy_flights_set() -> None:
    cracked = [flight(8 + k, 0.3 * (k + 1), depth) for k, depth in enumerate((0.02, 0.05, 0.1))]
    found = numbers([*HEALTHY, *cracked])
    # 8 healthy hours: no alarm at all needs more than 0.7, the highest of them
    assert found['thresholds']['0 false alarms per hour'] == math.nextafter(0.7, 1.0)
    smallest = found['smallest_crack']
    assert smallest['0 false alarms per hour']['crack_stiffness_ratio'] == 0.1
    assert math.isnan(smallest['own alarm']['crack_stiffness_ratio'])


def test_without_healthy_flights_nothing_is_said_about_finds() -> None:
    flights = [
        flight(8, math.nan, 0.05),
        flight(9, 0.0, 0.1, failure='broke'),
        growing(100, ((60.0, 0.5),)),
    ]
    found = numbers(flights)
    for name in ('0 false alarms per hour', '0.1 false alarms per hour'):
        assert math.isnan(found['thresholds'][name])
        assert math.isnan(found['smallest_crack'][name]['crack_stiffness_ratio'])
        assert found['smallest_crack'][name]['found'] == []
        assert math.isnan(found['growth'][name]['time_s']['median'])
        assert found['growth'][name]['each'] == []
    # the detector's own alarm is known, and was not reached
    assert found['smallest_crack']['own alarm']['found'] == [(0.05, 1, 0.0), (0.1, 1, 0.0)]
    assert found['growth']['own alarm']['time_s']['flights'] == 1


def test_silence_and_failure_find_nothing_where_every_threshold_will_do() -> None:
    day = dataclasses.replace(flight(0, 0.5), duration_s=20 * HOUR_S)
    outcome = dataclasses.replace(day.outcomes['d'], judged_s=20 * HOUR_S)
    healthy = dataclasses.replace(day, outcomes={'d': outcome})  # two alarms are allowed in 20 h
    cracked = [
        flight(8, math.nan, 0.02),
        flight(9, 9.0, 0.05, failure='broke'),
        flight(10, -5.0, 0.1),
        growing(100, ()),
        growing(101, ((60.0, -7.0),)),
    ]
    found = numbers([healthy, *cracked])
    name = '0.1 false alarms per hour'
    assert found['smallest_crack'][name]['found'] == [(0.02, 1, 0.0), (0.05, 1, 0.0), (0.1, 1, 1.0)]
    assert found['growth'][name]['time_s']['reached'] == 1


def test_both_rates_are_over_judged_hours_and_flown_hours_are_told() -> None:
    # 20 h flown, of which 9 judged: 0.1 per hour allow no alarm, while 20 h would allow two
    flights = [dataclasses.replace(flight(k, k / 10), duration_s=10 * HOUR_S) for k in range(2)]
    judged = [
        dataclasses.replace(
            f, outcomes={'d': dataclasses.replace(f.outcomes['d'], judged_s=4.5 * HOUR_S)}
        )
        for f in flights
    ]
    found = numbers(judged)
    assert found['thresholds']['0.1 false alarms per hour'] == math.nextafter(0.1, 1.0)
    assert found['false_alarms']['all']['hours'] == 9.0
    assert found['false_alarms']['all']['flown_hours'] == 20.0
    assert '(0 in 9.0 h judged of 20.0 h flown)' in str(report.cells(found))


def test_a_detector_that_could_not_be_made_found_nothing() -> None:
    flights = [*HEALTHY, flight(8, 0.0, 0.1), growing(100, ())]
    failed = [
        dataclasses.replace(f, outcomes={'d': Outcome(failure='cannot be loaded')}) for f in flights
    ]
    found = summary.summary(failed, {'d': math.nan}, replicates=50)['d']
    assert found['smallest_crack']['own alarm']['found'] == [(0.1, 1, 0.0)]
    assert found['growth']['own alarm']['time_s']['flights'] == 1
    assert found['growth']['0 false alarms per hour']['time_s']['reached'] == 0


def test_growing_cracks_are_followed_by_time_and_depth() -> None:
    found = numbers([
        *HEALTHY,
        growing(100, ((60.0, 0.5), (120.0, 1.5))),
        growing(101, ((60.0, 0.5), (480.0, 2.0))),
        growing(102, ((60.0, 0.5),)),
        growing(103, ((60.0, 9.0),), failure='broke'),
    ])  # fmt: skip
    own = found['growth']['own alarm']
    assert own['time_s']['flights'] == 4
    assert own['time_s']['reached'] == 2
    assert own['crack_stiffness_ratio']['quantile_10'] == pytest.approx(0.02)
    assert own['found_before_goal'] == 1
    assert own['each'][1] == (480.0, pytest.approx(0.08))
    assert found['auc']['goal']['positives'] == 0
    assert found['flights'] == 12


def test_decoys_count_for_false_alarms_and_in_no_area() -> None:
    decoys = [
        flight(100, 0.9, decoy=True, maneuver='mixed'),
        flight(101, 1.5, alarms=2, decoy=True, maneuver='mixed'),
        flight(102, 0.0, alarms=0, decoy=True, maneuver='mixed', failure='broke'),
        flight(103, math.nan, alarms=0, decoy=True, maneuver='mixed'),
    ]
    usual = [*HEALTHY, flight(8, 0.65, 0.05), growing(100, ((60.0, 0.5), (120.0, 1.5)))]
    without, found = numbers(usual), numbers([*usual, *decoys])
    for name in ('auc', 'auc_by', 'roc'):
        assert str(found[name]) == str(without[name])
    alarms = found['false_alarms']
    assert alarms['all']['events'] == without['false_alarms']['all']['events'] + 3
    assert alarms['decoys of growing cracks']['events'] == 3  # a failure is an alarm
    assert alarms['decoys of growing cracks']['of'] == 4
    assert found['false_alarms_by']['maneuver']['mixed']['events'] == 3
    assert found['growth']['own alarm']['decoys'] == {'alarmed': 2, 'flights': 4}
    # the failure stands above every threshold that can be asked for
    assert found['growth']['0 false alarms per hour']['decoys']['alarmed'] == 1
    assert without['growth']['own alarm']['decoys'] == {'alarmed': 0, 'flights': 0}


@pytest.mark.parametrize(
    ('speed', 'band'),
    [(220.0, 'below 300 rad/s'), (300.0, '300 to 400 rad/s'), (499.9, '400 to 500 rad/s'),
     (500.0, 'from 500 rad/s')],
)  # fmt: skip
def test_bands_of_speed(speed: float, band: str) -> None:
    assert summary.speed_band(speed) == band


def content() -> dict[str, Any]:
    flights = [
        *HEALTHY,
        *(flight(8 + k, 0.3 * k, 0.05) for k in range(5)),
        growing(100, ((60.0, 0.5), (120.0, 2.5))),
        flight(101, 1.5, decoy=True, maneuver='mixed'),
    ]
    done = Evaluated(flights, 'process and Landlock 7', {'d': 1.0})
    return report.report(done, suite='s', seed=1, split='test', stored=False, wall_s=2.0)


def test_the_report_is_complete_json_and_repeats_the_flights(tmp_path: Path) -> None:
    made = content()
    report.save(made, tmp_path)
    text = (tmp_path / 'evaluation.json').read_text('utf-8')
    read = json.loads(text)
    assert set(read) == set(made)
    assert len(read['flights']) == 15
    again = [FlightResult.from_plain(plain) for plain in read['flights']]
    first, *_ = summary.summary(again, {'d': 1.0}, seed=1).values()
    assert first['auc'] == made['detectors']['d']['auc']
    assert first['growth'] == made['detectors']['d']['growth']
    assert 'NaN' not in text


def test_tables_pictures_and_page_are_made_from_the_file(tmp_path: Path) -> None:
    report.save(content(), tmp_path)
    read = json.loads((tmp_path / 'evaluation.json').read_text('utf-8'))
    console = Console(record=True, width=120)
    for table in report.tables(read):
        console.print(table)
    shown = console.export_text()
    assert 'K = 0.05' in shown
    (row,) = (line for line in shown.splitlines() if 'as long with an alarm' in line)
    assert '1 of 1' in row
    for name in pictures.save_pictures(read, tmp_path):
        assert (tmp_path / name).read_bytes().startswith(b'\x89PNG')
    text = results_page.tables(read)
    assert '| `d` |' in text or '`d`' in text
    assert 'alarm in 1 of 1 decoys' in text
    assert 'nan' not in text.lower().replace('maneuver', '')


def test_tables_and_pictures_leave_out_what_is_not_known(tmp_path: Path) -> None:
    flights = [flight(8, 0.5, 0.05), growing(100, ((60.0, 0.5),))]
    done = Evaluated(flights, 'process', {'d': 1.0})
    report.save(report.report(done, suite='s', seed=1, split='test', stored=False, wall_s=2.0),
                tmp_path)  # fmt: skip
    read = json.loads((tmp_path / 'evaluation.json').read_text('utf-8'))
    assert report.cells(read['detectors']['d'])['smallest crack found, no false alarm'] == '-'
    text = results_page.tables(read)
    assert '| 0 false alarms per hour | - |' in text
    assert '0 of 0 found' not in text
    assert pictures.save_pictures(read, tmp_path)
