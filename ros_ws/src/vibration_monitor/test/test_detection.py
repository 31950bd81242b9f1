# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Levels of the alarm: N of M, hysteresis, NaN; tables by hand, then properties."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vibration_monitor import AlarmConfig, AlarmRule, AlarmState, Level, RuleJudge

NAN = math.nan
NAME = 'disk_z/ratio_3_1'
LETTERS = {'O': Level.OK, 'W': Level.WARN, 'E': Level.ERROR, 'S': Level.STALE}


def config(required: int, out_of: int, release_ratio: float = 0.8) -> AlarmConfig:
    rule = AlarmRule(indicator=NAME, warn=1.0, error=10.0)
    return AlarmConfig(rules=(rule,), required=required, out_of=out_of, release_ratio=release_ratio)


def levels(settings: AlarmConfig, values: list[float]) -> list[Level]:
    judge = RuleJudge(settings)
    return [judge.update({NAME: value}).level for value in values]


@pytest.mark.parametrize(
    ('required', 'out_of', 'values', 'expected'),
    [
        # at the limit counts; one window is enough for 1 of 1
        (1, 1, [0.0, 1.0, 10.0, 0.0], 'OWEO'),
        # hysteresis: 0.8 is not yet below 0.8 x the limit, 0.79 is
        (1, 1, [1.0, 0.9, 0.8, 0.79, 0.9], 'WWWOO'),
        (1, 1, [10.0, 9.0, 8.0, 7.9, 0.9, 0.79], 'EEEWWO'),
        # straight to ERROR and straight back
        (1, 1, [0.0, 99.0, 0.0], 'OEO'),
        # OK too takes N windows, and a gap of less than M does not take it away
        (2, 3, [0.0, 0.0, NAN, NAN, 2.0, 0.0], 'SOOOOO'),
        (2, 3, [0.0, 0.0, NAN, NAN, NAN, 0.0, 0.0], 'SOOOSSO'),
        # 2 of 3: one spike in any three windows is nothing
        (2, 3, [2.0, 0.0, 0.0, 2.0, 0.0, 0.0], 'SSOOOO'),
        (2, 3, [2.0, 0.0, 2.0, 0.0, 0.0], 'SSWOO'),
        # released by two low windows only
        (2, 3, [2.0, 2.0, 0.0, 0.9, 0.9, 0.0, 0.9, 0.0], 'SWWWWWWO'),
        # warnings and errors are counted apart: two high windows, one of them very high
        (2, 3, [2.0, 20.0, 20.0], 'SWE'),
        (3, 5, [20.0, 2.0, 20.0, 2.0, 20.0], 'SSWWE'),
        # NaN counts as neither, takes a place, and alone is STALE
        (1, 1, [NAN, 0.0, NAN, 2.0], 'SOSW'),
        (2, 3, [2.0, NAN, 2.0], 'SSW'),
        (2, 3, [2.0, NAN, NAN, 2.0], 'SSSS'),
        (2, 3, [NAN, NAN, NAN, 0.0, 0.0], 'SSSSO'),
        # what was found comes back with the numbers, until they speak against it
        (2, 3, [2.0, 2.0, NAN, NAN, NAN, 0.9, 0.0, 0.0], 'SWWWSWWO'),
    ],
)
def test_levels_by_hand(required: int, out_of: int, values: list[float], expected: str) -> None:
    assert levels(config(required, out_of), values) == [LETTERS[letter] for letter in expected]


def test_before_the_first_window_nothing_is_known() -> None:
    state = RuleJudge(config(1, 1)).state
    assert state.level is Level.STALE
    assert state.reasons == ('cannot judge: no window is complete yet',)


def test_levels_have_the_numbers_of_diagnostic_status() -> None:
    assert [int(level) for level in Level] == [0, 1, 2, 3]
    assert [level.name for level in Level] == ['OK', 'WARN', 'ERROR', 'STALE']


def two_rules() -> AlarmConfig:
    other = AlarmRule(indicator='disk_y/rms', warn=1e-6, error=2e-6)
    return AlarmConfig(
        rules=(AlarmRule(indicator=NAME, warn=1.0, error=10.0), other), required=1, out_of=2
    )


@pytest.mark.parametrize(
    ('ratio', 'rms', 'expected'),
    [
        (0.0, 0.0, Level.OK),
        (0.0, 1.5e-6, Level.WARN),
        (20.0, 1.5e-6, Level.ERROR),
        (NAN, 0.0, Level.STALE),
        (NAN, 1.5e-6, Level.WARN),
        (NAN, NAN, Level.STALE),
    ],
)
def test_the_worst_rule_gives_the_level(ratio: float, rms: float, expected: Level) -> None:
    state = RuleJudge(two_rules()).update({NAME: ratio, 'disk_y/rms': rms})
    assert state.level is expected


def test_reasons_name_value_limit_and_unit() -> None:
    judge = RuleJudge(two_rules())
    state = judge.update({NAME: 0.5, 'disk_y/rms': 1.5e-6})
    assert state.reasons == (
        'disk_y/rms = 1.5e-06 m: 1 of the last 1 windows reach the WARN limit 1e-06 m',
    )
    judge.update({NAME: 0.5, 'disk_y/rms': 0.9e-6})
    state = judge.update({NAME: 0.5, 'disk_y/rms': 0.9e-6})
    assert state.level is Level.WARN
    assert state.reasons == (
        'disk_y/rms = 9e-07 m: WARN stays until 1 of 2 windows are below 8e-07 m',
    )
    judge.update({NAME: 0.5, 'disk_y/rms': NAN})
    state = judge.update({NAME: 0.5, 'disk_y/rms': NAN})
    assert state.level is Level.STALE
    assert '; '.join(state.reasons) == (
        'cannot judge: disk_y/rms: no valid value in the last 2 windows; WARN was found before and '
        'is not refuted'
    )
    state = judge.update({NAME: 0.5})
    assert state.reasons[0].startswith('cannot judge: disk_y/rms: the stream does not have it')
    judge.update({NAME: 0.5, 'disk_y/rms': 0.0})
    state = judge.update({NAME: 0.5, 'disk_y/rms': 0.0})
    assert state == AlarmState(Level.OK)


VALUES = st.lists(st.one_of(st.floats(0.0, 30.0), st.just(NAN)), max_size=40)


@st.composite
def n_of_m(draw: st.DrawFn) -> AlarmConfig:
    out_of = draw(st.integers(1, 6))
    return config(draw(st.integers(1, out_of)), out_of, draw(st.floats(0.01, 1.0)))


@settings(deadline=None)
@given(n_of_m(), VALUES)
def test_a_level_is_reached_only_by_n_of_the_last_m_windows(
    settings: AlarmConfig, values: list[float]
) -> None:
    before, vouched = Level.OK, False
    for index, level in enumerate(levels(settings, values)):
        last = values[max(0, index + 1 - settings.out_of) : index + 1]
        numbers = [value for value in last if not math.isnan(value)]
        if not numbers:
            assert level is Level.STALE
            vouched = False
            continue
        vouched |= sum(value < 1.0 for value in numbers) >= settings.required
        if level is Level.STALE:
            assert not vouched
            level = Level.OK  # noqa: PLW2901 - without a finding, which is what follows
        elif level is Level.OK:
            assert vouched
        for limit, reached in ((1.0, Level.WARN), (10.0, Level.ERROR)):
            high = sum(value >= limit for value in numbers)
            low = sum(value < settings.release_ratio * limit for value in numbers)
            if high >= settings.required:
                assert level >= reached
            elif low >= settings.required or before < reached:
                assert level < reached
            else:
                assert level >= reached
        before = level


@settings(deadline=None)
@given(n_of_m(), VALUES)
def test_the_past_is_forgotten_after_m_quiet_windows(
    settings: AlarmConfig, values: list[float]
) -> None:
    assert levels(settings, [*values, *[0.0] * settings.out_of])[-1] is Level.OK
    assert levels(settings, [*values, *[20.0] * settings.out_of])[-1] is Level.ERROR
    assert levels(settings, [*values, *[NAN] * settings.out_of])[-1] is Level.STALE


@settings(deadline=None)
@given(st.integers(2, 5), st.lists(st.floats(0.0, 0.99), min_size=1, max_size=30), st.data())
def test_a_single_spike_never_alarms(
    required: int, values: list[float], data: st.DataObject
) -> None:
    place = data.draw(st.integers(0, len(values) - 1))
    values[place] = 1e9
    found = levels(config(required, 6), values)
    assert set(found) <= {Level.OK, Level.STALE}
    assert found[-1] is (Level.OK if len(values) > required else Level.STALE)


@settings(deadline=None)
@given(n_of_m(), st.lists(st.tuples(st.floats(0.0, 30.0), st.booleans()), max_size=40))
def test_a_doubt_silences_the_all_clear_and_nothing_else(
    settings: AlarmConfig, windows: list[tuple[float, bool]]
) -> None:
    judge = RuleJudge(settings)
    found = [
        judge.update({NAME: value}, {NAME: 'no test signal'} if doubted else {})
        for value, doubted in windows
    ]
    heard = [NAN if doubted and value < 1.0 else value for value, doubted in windows]
    assert [state.level for state in found] == levels(settings, heard)
    for state, (value, doubted) in zip(found, windows, strict=True):
        if state.level is Level.STALE and settings.out_of == 1 and doubted and value < 1.0:
            assert state.reasons[0].startswith(f'cannot judge: {NAME}: no test signal')


def test_doubt_alone_never_gives_ok() -> None:
    judge = RuleJudge(config(3, 5))
    for _ in range(20):
        state = judge.update({NAME: 0.0}, {NAME: 'the load has not changed'})
        assert state.level is Level.STALE
        assert state.reasons == (f'cannot judge: {NAME}: the load has not changed',)
    # one number is not yet an all-clear
    state = judge.update({NAME: 0.0})
    assert state.reasons == (f'cannot judge: {NAME}: 1 of the 3 windows that it takes',)
