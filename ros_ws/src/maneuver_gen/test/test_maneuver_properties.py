# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Properties that every maneuver has: finite, in range, smooth, the same bits for each point."""

from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from maneuver_gen import Maneuver, curves, flight_path_angle, load_grid, parse_maneuver
from maneuver_gen.maneuvers.climb_dive import ClimbDive
from rotor_common.errors import ConfigError

# how long a test takes on a busy machine is not its subject
UNHURRIED = settings(deadline=None)

LOADS = st.floats(-3.0, 12.0)
LATERAL = st.floats(-3.0, 3.0)


def _angle_covers_the_rate(config: dict[str, Any]) -> bool:
    per_rate = 1.5 * config['speed_m_s'] / 9.81 / config['onset_per_s']
    pull, push = config['pull_rate_rad_s'], config['push_rate_rad_s']
    climb, dive = config['climb_angle_rad'], config['dive_angle_rad']
    room = min(climb, dive) >= pull**2 * per_rate and climb + dive >= push**2 * per_rate
    return bool(room)


CLIMB_DIVES: st.SearchStrategy[dict[str, Any]] = st.fixed_dictionaries(
    {
        'profile': st.just('climb_dive'),
        'speed_m_s': st.floats(30.0, 300.0),
        'pull_rate_rad_s': st.floats(0.01, 0.35),
        'push_rate_rad_s': st.floats(0.01, 0.08),
        'climb_angle_rad': st.floats(0.05, 1.5),
        'dive_angle_rad': st.floats(0.05, 1.5),
        'onset_per_s': st.floats(1.0, 20.0),
        'level_s': st.floats(0.0, 5.0),
        'climb_s': st.floats(0.0, 5.0),
        'dive_s': st.floats(0.0, 5.0),
        'weight': st.booleans(),
    }
).filter(_angle_covers_the_rate)

SINGLE = st.one_of(
    st.fixed_dictionaries(
        {'profile': st.just('constant'), 'load_factor': LOADS, 'lateral_load_factor': LATERAL}
    ),
    st.fixed_dictionaries(
        {
            'profile': st.just('step'),
            'before': LOADS,
            'after': LOADS,
            'at_s': st.floats(0.0, 30.0),
        }
    ),
    st.fixed_dictionaries(
        {
            'profile': st.just('ramp'),
            'before': LOADS,
            'after': LOADS,
            'start_s': st.floats(0.0, 30.0),
            'duration_s': st.floats(0.01, 30.0),
        }
    ),
    st.fixed_dictionaries(
        {
            'profile': st.just('sinusoid'),
            'mean': st.floats(0.0, 9.0),
            'amplitude': st.floats(0.0, 3.0),
            'frequency_hz': st.floats(0.01, 5.0),
            'phase_rad': st.floats(-6.3, 6.3),
        }
    ),
    st.fixed_dictionaries(
        {
            'profile': st.just('turn'),
            'bank_rad': st.floats(-1.48, 1.48),
            'level_s': st.floats(0.0, 5.0),
            'roll_s': st.floats(0.1, 5.0),
            'turn_s': st.floats(0.0, 20.0),
            'slip_load_factor': LATERAL,
        }
    ),
    st.fixed_dictionaries(
        {
            'profile': st.just('gusts'),
            'mean': st.floats(0.0, 9.0),
            'rms': st.floats(0.0, 1.0),
            'speed_m_s': st.floats(30.0, 600.0),
            'scale_m': st.floats(10.0, 2000.0),
            'seed': st.integers(0, 2**62),
        }
    ),
    CLIMB_DIVES,
)

SEQUENCES = st.fixed_dictionaries(
    {
        'profile': st.just('sequence'),
        'blend_s': st.floats(0.05, 1.0),
        'segments': st.lists(
            st.fixed_dictionaries({'duration_s': st.floats(1.0, 10.0), 'maneuver': SINGLE}),
            min_size=1,
            max_size=4,
        ),
    }
)


def _parse(data: dict[str, Any]) -> Maneuver:
    try:
        return parse_maneuver(data)
    except ConfigError as error:
        # the strategies keep every other rule
        assert 'the load factor could run from' in str(error)  # noqa: PT017
        assume(False)
        raise


@UNHURRIED
@given(st.one_of(SINGLE, SEQUENCES), st.floats(0.001, 60.0))
def test_every_maneuver_is_finite_in_range_and_long_enough(
    data: dict[str, Any], duration_s: float
) -> None:
    grid = load_grid(_parse(data), duration_s)
    assert grid.dtype == np.float64
    # the first point at or after the end, and one more; ends are whole nanoseconds
    assert (len(grid) - 2) / 100.0 >= duration_s - 1e-9
    assert (len(grid) - 3) / 100.0 < duration_s
    factors = grid / 9.81
    # round-off of a limit that is met exactly
    assert factors[:, 0].min() >= -3.0 - 1e-9
    assert factors[:, 0].max() <= 12.0 + 1e-9
    assert np.abs(factors[:, 1]).max() <= 3.0 + 1e-9


@UNHURRIED
@given(st.one_of(SINGLE, SEQUENCES), st.floats(0.001, 30.0), st.floats(0.001, 30.0))
def test_a_longer_run_has_the_same_first_points(
    data: dict[str, Any], one_s: float, other_s: float
) -> None:
    config = _parse(data)
    one, other = load_grid(config, one_s), load_grid(config, other_s)
    common = min(len(one), len(other))
    assert one[:common].tobytes() == other[:common].tobytes()
    assert load_grid(config, one_s).tobytes() == one.tobytes()


@UNHURRIED
@given(st.one_of(SINGLE, SEQUENCES))
def test_the_configuration_survives_json(data: dict[str, Any]) -> None:
    config = _parse(data)
    assert parse_maneuver(config.model_dump_json()) == config
    assert parse_maneuver(config.model_dump(mode='json')) == config


@UNHURRIED
@given(CLIMB_DIVES)
def test_climb_dive_is_smooth_and_returns_to_level(data: dict[str, Any]) -> None:
    config = _parse(data)
    assert isinstance(config, ClimbDive)
    end_s = config.pulses()[-1].end_s
    load = load_grid(config, end_s + 1.0)[:, 0] / 9.81
    # the pull changes by the onset at most, cos(angle) by the rate times the steepest sine, 1
    turning = max(config.pull_rate_rad_s, config.push_rate_rad_s)
    steepest = config.onset_per_s + (turning if config.weight else 0.0)
    assert np.abs(np.diff(load)).max() <= 0.01 * steepest + 1e-12
    level = 1.0 if config.weight else 0.0
    assert load[0] == level
    assert load[-1] == pytest.approx(level, abs=1e-15)
    times = np.arange(0.0, end_s, 0.01)
    angle = flight_path_angle(config, times)
    assert np.abs(np.diff(angle)).max() <= 0.01 * turning + 1e-12
    assert angle.max() <= config.climb_angle_rad + 1e-12
    assert angle.min() >= -config.dive_angle_rad - 1e-12
    after = flight_path_angle(config, np.array([end_s, end_s + 1.0, 1e5]))
    # three sums of angles of up to 3 rad, each rounded to 4e-16 a few times
    assert np.abs(after).max() < 1e-14


@UNHURRIED
@given(CLIMB_DIVES)
def test_the_pull_keeps_the_onset_and_reaches_its_rate(data: dict[str, Any]) -> None:
    config = _parse(data)
    assert isinstance(config, ClimbDive)
    pull_up = config.pulses()[0]
    # the middle of the rise, where the smooth step is steepest: 3/2 over the transition
    middle, half = pull_up.start_s + pull_up.transition_s / 2.0, pull_up.transition_s * 1e-4
    rate = pull_up.rate(np.array([middle - half, middle + half]))
    onset = (rate[1] - rate[0]) / (2.0 * half) * config.speed_m_s / 9.81
    # the chord of a cubic over 2e-4 of it is flatter by (1e-4)^2 * 4/3
    assert onset == pytest.approx(config.onset_per_s, rel=1e-6)
    top = pull_up.rate(np.array([pull_up.start_s + pull_up.transition_s]))
    assert top[0] == pytest.approx(config.pull_rate_rad_s, rel=1e-12)


@UNHURRIED
@given(
    st.lists(st.tuples(LOADS, st.floats(1.1, 5.0)), min_size=2, max_size=5), st.floats(0.05, 1.0)
)
def test_joins_lie_between_the_two_segments_and_do_not_jump(
    parts: list[tuple[float, float]], blend_s: float
) -> None:
    config = parse_maneuver(
        {
            'profile': 'sequence',
            'blend_s': blend_s,
            'segments': [
                {
                    'duration_s': duration_s,
                    'maneuver': {'profile': 'constant', 'load_factor': load_factor},
                }
                for load_factor, duration_s in parts
            ],
        }
    )
    grid = load_grid(config, 30.0)[:, 0] / 9.81
    times = np.arange(len(grid)) / 100.0
    joins = np.cumsum([duration_s for _, duration_s in parts[:-1]])
    for join_s, (old, _), (new, _) in zip(joins, parts, parts[1:], strict=False):
        blend = grid[(times >= join_s) & (times <= join_s + blend_s)]
        assert blend.min() >= min(old, new) - 1e-12
        assert blend.max() <= max(old, new) + 1e-12
        # a smooth step is at most 3/2 as steep as a straight line
        around = grid[(times > join_s - 0.015) & (times < join_s + blend_s + 0.015)]
        assert np.abs(np.diff(around)).max() <= 1.5 * abs(new - old) * 0.01 / blend_s + 1e-12
    settled = grid[times >= joins[-1] + blend_s]
    np.testing.assert_allclose(settled, parts[-1][0], atol=1e-12)


@UNHURRIED
@given(st.one_of(SINGLE, SEQUENCES), st.lists(st.floats(0.0, 100.0), min_size=1, max_size=40))
def test_a_value_depends_on_its_own_time_only(data: dict[str, Any], times: list[float]) -> None:
    config, forward = _parse(data), np.array(times)
    alone = np.concatenate([config.sample(forward[k : k + 1]) for k in range(len(forward))])
    assert config.sample(forward).tobytes() == alone.tobytes()


@UNHURRIED
@given(st.floats(-2.0, 3.0), st.floats(-2.0, 3.0))
def test_smooth_step_rises_from_0_to_1_and_is_symmetric(one: float, other: float) -> None:
    low, high = curves.smooth_step(np.array([min(one, other), max(one, other)]))
    assert 0.0 <= low <= high + 1e-15  # rounding of nearly equal arguments
    assert high <= 1.0
    mirrored = curves.smooth_step(np.array([one, 1.0 - one]))
    assert mirrored.sum() == pytest.approx(1.0, abs=1e-14)
    slope = abs(high - low)
    assert slope <= curves.SMOOTH_STEP_PEAK_SLOPE * abs(one - other) + 1e-14
