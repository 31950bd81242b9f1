# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The load grid: its points, its limits and the flights that must cover a run."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from maneuver_gen import (
    ManeuverError,
    check_duration,
    flight_path_angle,
    load_grid,
    parse_maneuver,
    resolve_paths,
)

LEVEL = parse_maneuver({'profile': 'constant'})


def flight(folder: Path, name: str, end_s: int) -> dict[str, Any]:
    rows = [f'{second},{1.0 + second / 100.0}' for second in range(end_s + 1)]
    path = folder / name
    path.write_text('\n'.join(['time_s,load_factor', *rows]), 'utf-8')
    return {'profile': 'recorded', 'path': str(path)}


@pytest.mark.parametrize(
    ('duration_s', 'points'),
    [
        (20.0, 2002),
        (0.01, 3),
        (0.07, 9),  # 0.07 * 100 is a little more than 7 in binary
        (0.29, 31),
        (0.011, 4),
        (1.0 / 3.0, 36),
        (1e-9, 3),
        pytest.param(86400.0, 8_640_002, marks=pytest.mark.slow),
    ],
)
def test_grid_runs_through_the_end_and_one_point_more(duration_s: float, points: int) -> None:
    assert load_grid(LEVEL, duration_s).shape == (points, 2)


@pytest.mark.parametrize('duration_s', [0.0, -1.0, float('nan'), float('inf'), 86400.1])
def test_impossible_durations_are_refused(duration_s: float) -> None:
    with pytest.raises(ManeuverError, match=r'^duration_s = .* allowed: above 0 to 86400 s$'):
        load_grid(LEVEL, duration_s)


def test_points_stand_at_multiples_of_10_ms(tmp_path: Path) -> None:
    config = parse_maneuver(flight(tmp_path, 'a.csv', 10))
    expected = 9.81 * (1.0 + np.arange(802) / 10000.0)
    # rounding of the interpolation
    np.testing.assert_allclose(load_grid(config, 8.0)[:, 0], expected, rtol=1e-14)


def test_a_flight_as_long_as_the_run_is_enough(tmp_path: Path) -> None:
    config = parse_maneuver(flight(tmp_path, 'a.csv', 10))
    grid = load_grid(config, 10.0)
    assert grid[-1, 0] == grid[-2, 0] == 9.81 * 1.1
    with pytest.raises(
        ManeuverError, match=r'a.csv ends 10 s after start_s = 0 s, but 10.01 s are'
    ):
        check_duration(config, 10.01)


def test_start_s_moves_into_the_flight(tmp_path: Path) -> None:
    data = flight(tmp_path, 'a.csv', 10)
    config = parse_maneuver({**data, 'start_s': 4.0})
    assert load_grid(config, 6.0)[0, 0] == pytest.approx(9.81 * 1.04, rel=1e-14)
    with pytest.raises(ManeuverError, match=r'ends 6 s after start_s = 4 s, but 6.5 s are needed'):
        load_grid(config, 6.5)
    for start_s in (-0.5, 10.0, 11.0):
        outside = parse_maneuver({**data, 'start_s': start_s})
        with pytest.raises(ManeuverError, match=r'lies outside the flight file .*0 to below 10 s'):
            check_duration(outside, 1.0)


def test_lateral_column_is_the_load_along_z(tmp_path: Path) -> None:
    path = tmp_path / 'a.csv'
    path.write_text('lateral_load_factor,time_s,load_factor\n0.1,0,1\n-0.3,1,2\n', 'utf-8')
    grid = load_grid(parse_maneuver({'profile': 'recorded', 'path': str(path)}), 1.0)
    np.testing.assert_allclose(grid[[0, 50, 100]] / 9.81, [[1, 0.1], [1.5, -0.1], [2, -0.3]])


def test_sequence_with_a_flight_that_covers_it(tmp_path: Path) -> None:
    """Its part starts at 5 s and is used for 4 s and for 1 s of blending out of it."""
    config = parse_maneuver(_sequence(flight(tmp_path, 'a.csv', 5)))
    load = load_grid(config, 20.0)[:, 0] / 9.81
    # 1 + 0.01 per second in the flight; halfway out of it, half of what it says then
    np.testing.assert_allclose(
        load[[500, 800, 900, 950, 1000, 2000]], [1, 1.03, 1.04, 1.0225, 1, 1], rtol=1e-14
    )


def _sequence(part: dict[str, Any]) -> dict[str, Any]:
    level = {'profile': 'constant'}
    return {
        'profile': 'sequence',
        'blend_s': 1.0,
        'segments': [
            {'duration_s': 5.0, 'maneuver': level},
            {'duration_s': 4.0, 'maneuver': part},
            {'duration_s': 2.0, 'maneuver': level},
        ],
    }


def test_sequence_needs_each_flight_through_its_blend(tmp_path: Path) -> None:
    config = parse_maneuver(_sequence(flight(tmp_path, 'a.csv', 4)))
    check_duration(config, 9.0)  # ends before the blend out of the flight
    with pytest.raises(ManeuverError, match=r'ends 4 s after start_s = 0 s, but 4.5 s are needed'):
        check_duration(config, 9.5)
    with pytest.raises(ManeuverError, match='but 5 s are needed'):
        check_duration(config, 100.0)


def test_last_segment_needs_its_flight_to_the_end_of_the_run(tmp_path: Path) -> None:
    data = _sequence(flight(tmp_path, 'a.csv', 4))
    data['segments'].pop()
    config = parse_maneuver(data)
    check_duration(config, 9.0)
    with pytest.raises(ManeuverError, match='but 5 s are needed'):
        check_duration(config, 10.0)


def test_a_flight_that_the_run_does_not_reach_is_not_read() -> None:
    config = parse_maneuver(_sequence({'profile': 'recorded', 'path': 'nowhere.csv'}))
    check_duration(config, 5.0)
    with pytest.raises(ManeuverError, match=r'nowhere.csv cannot be read: No such file'):
        check_duration(config, 5.1)


def test_paths_are_relative_to_the_folder_given(tmp_path: Path) -> None:
    recorded = {'profile': 'recorded', 'path': 'flights/a.csv'}
    assert resolve_paths(recorded, tmp_path)['path'] == str(tmp_path / 'flights/a.csv')
    assert recorded['path'] == 'flights/a.csv'  # the data given stay as they were
    resolved = resolve_paths(_sequence(recorded), tmp_path)
    assert resolved['segments'][1]['maneuver']['path'] == str(tmp_path / 'flights/a.csv')
    absolute = {'profile': 'recorded', 'path': str(tmp_path / 'b.csv')}
    assert resolve_paths(absolute, Path('elsewhere')) == absolute


@pytest.mark.parametrize('data', [None, 3, [], {'profile': 'recorded', 'path': 5}, {'path': 'a'}])
def test_wrong_data_pass_through_the_path_resolution(data: object) -> None:
    assert resolve_paths(data, Path('/x')) == data


def test_only_a_climb_dive_has_a_flight_path_angle() -> None:
    times = np.array([0.0, 4.5])
    assert np.isnan(flight_path_angle(LEVEL, times)).all()
    angle = flight_path_angle(parse_maneuver({'profile': 'climb_dive'}), times)
    assert angle[0] == 0.0
    assert angle[1] == pytest.approx(0.36, rel=1e-15)  # the straight climb
