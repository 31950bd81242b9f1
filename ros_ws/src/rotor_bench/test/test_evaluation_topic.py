# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""What is made of the words of a node of somebody else: levels, stamps, and how long they hold."""

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import spy_rig
from rotor_bench.evaluation import listener_node, topic
from rotor_bench.evaluation.listener_node import dated, worst_level
from rotor_bench.evaluation.pipe_protocol import one_line
from rotor_bench.evaluation.topic import watched
from rotor_recording.reading import Recording


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


@pytest.mark.parametrize(
    ('stamp_ns', 'clock_ns', 'time_ns'),
    [
        (200, 5000, 5000),  # backdated, or late
        (0, 5000, 5000),
        (5000, 5000, 5000),
        (9000, 5000, 9000),
        (-1, 5000, -1),
    ],
)
def test_no_stamp_makes_an_alarm_earlier_than_what_had_been_heard(
    stamp_ns: int, clock_ns: int, time_ns: int
) -> None:
    assert dated(stamp_ns, clock_ns) == time_ns


def test_a_block_is_out_at_its_end(tmp_path: Path) -> None:
    flight = spy_rig.plan()[0].flights[1]
    topic._write(flight, spy_rig.TellingSource(), tmp_path / 'flight.mcap')
    times = [message.log_time_ns for message in Recording(tmp_path / 'flight.mcap').messages()]
    assert times == [round(1e9 * (n + 1) * spy_rig.SAMPLES / 10_240) for n in range(4)]


def test_what_is_kept_of_a_flood_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(listener_node, 'MOST_SAID', 3)
    node: Any = SimpleNamespace(said=[], failure='', _clock_ns=1)
    for number in range(5):
        listener_node.ListenerNode._hear(node, SimpleNamespace(data=float(number)))
        assert bool(node.failure) == (number > 2)
    assert node.said == [(1e-9, 0.0, ''), (1e-9, 1.0, ''), (1e-9, 2.0, '')]
    assert watched(node.said, 10.0, node.failure).failure == node.failure


def test_infinity_is_a_failure() -> None:
    outcome = watched([(1.0, math.inf, '')], 10.0, '')
    assert 'infinite score' in outcome.failure
    assert math.isnan(outcome.score)


def test_words_of_others_are_one_visible_line() -> None:
    assert one_line('2x is 3.1 times, \u03be = 0.01') == '2x is 3.1 times, \u03be = 0.01'
    assert one_line('a\x1b[2J\r\nb\u202e\u2028c\ud800') == 'a\ufffd[2J b\ufffd c\ufffd'
    assert one_line(' x  y\t') == 'x y'
    assert len(one_line('x' * 10_000)) == 500
