# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""What is made of the words of a node of somebody else: levels, stamps, and how long they hold."""

import math
from types import SimpleNamespace

import pytest

from rotor_bringup.evaluation.listener_node import worst_level
from rotor_bringup.evaluation.topic import watched


@pytest.mark.parametrize(
    ('levels', 'worst'),
    [
        ((b'\x03', b'\x02'), 2.0),
        ((b'\x02', b'\x03'), 2.0),
        ((0, 3, 1), 1.0),
        ((3, 3), math.nan),
        ((), math.nan),
    ],
)
def test_what_is_stale_hides_no_error(levels: tuple[bytes | int, ...], worst: float) -> None:
    found = worst_level([SimpleNamespace(level=level) for level in levels])
    assert found == pytest.approx(worst, nan_ok=True)


def test_a_score_holds_from_its_stamp_until_the_next_and_the_last_until_the_end() -> None:
    said = [(2.0, 0.0, 'quiet'), (5.0, 1.0, 'alarm'), (6.0, math.nan, 'stale'), (8.0, 2.0, 'error')]
    outcome = watched(said, 10.0, '')
    assert outcome.failure == ''
    assert outcome.judged_s == pytest.approx((5 - 2) + (6 - 5) + (10 - 8))
    assert (outcome.first_alarm_s, outcome.score_s, outcome.evidence) == (5.0, 8.0, 'error')
    assert outcome.rises == ((2.0, 0.0), (5.0, 1.0), (8.0, 2.0))


def test_stamps_out_of_order_are_put_in_order() -> None:
    outcome = watched([(5.0, 1.0, 'b'), (2.0, 0.0, 'a')], 10.0, '')
    assert (outcome.first_alarm_s, outcome.judged_s) == (5.0, 8.0)


@pytest.mark.parametrize('stamp_s', [1_760_000_000.25, -0.1, 10.3])
def test_a_stamp_outside_the_flight_is_a_failure_in_one_sentence(stamp_s: float) -> None:
    outcome = watched([(1.0, 0.0, ''), (stamp_s, 2.0, 'error')], 10.0, '')
    assert outcome.failure == (
        f'it stamped a message {stamp_s:.9g} s, outside its flight of 10 s; stamps must follow '
        'those of the waveform'
    )
    assert math.isnan(outcome.score)


def test_a_stamp_may_lie_a_little_behind_the_end() -> None:
    outcome = watched([(10.1, 2.0, 'error')], 10.0, '')
    assert (outcome.failure, outcome.score, outcome.score_s, outcome.judged_s) == ('', 2.0, 10.0, 0)


def test_silence_and_death_are_failures() -> None:
    assert watched([], 10.0, '').failure == 'it said nothing'
    assert watched([(1.0, 0.0, '')], 10.0, 'its node ended').failure == 'its node ended'
