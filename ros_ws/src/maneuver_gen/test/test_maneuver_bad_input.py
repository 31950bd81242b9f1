# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Wrong maneuvers and flight files, each with the sentence that it must get."""

from pathlib import Path
from typing import Any

import pytest

from maneuver_gen import ManeuverError, load_grid, parse_maneuver
from maneuver_gen.maneuvers.recorded import read_flight
from rotor_common.errors import ConfigError, RigError

LEVEL = {'profile': 'constant'}


def part(maneuver: Any, duration_s: Any = 2.0) -> dict[str, Any]:
    return {'duration_s': duration_s, 'maneuver': maneuver}


def sequence(*segments: Any, **changes: Any) -> dict[str, Any]:
    return {'profile': 'sequence', 'segments': list(segments), **changes}


BAD_MANEUVERS: list[tuple[Any, str]] = [
    (
        None,
        'a maneuver is a mapping with the key profile; choose one of climb_dive, constant, gusts',
    ),
    ([], 'a maneuver is a mapping with the key profile'),
    ({}, 'profile is missing; choose one of climb_dive, constant'),
    (
        {'profile': 'climbdive'},
        "profile = 'climbdive' is not known here; did you mean 'climb_dive'",
    ),
    (
        {'profile': 'hover'},
        "profile = 'hover' is not known here; choose one of climb_dive, constant",
    ),
    ({'profile': 3}, 'profile = 3 is not known here; choose one of climb_dive'),
    ({**LEVEL, 'load_factor': 12.1}, 'load_factor = 12.1 is out of range; allowed: -3 to 12'),
    ({**LEVEL, 'load_factor': -3.1}, 'load_factor = -3.1 is out of range; allowed: -3 to 12'),
    ({**LEVEL, 'load_factor': float('nan')}, 'load_factor = nan is out of range'),
    ({**LEVEL, 'load_factor': float('inf')}, 'load_factor = inf is out of range'),
    ({**LEVEL, 'load_factor': '1'}, "load_factor = '1' is not allowed; it must be a valid number"),
    (
        {**LEVEL, 'load_factor': True},
        'load_factor = True is not allowed; it must be a valid',
    ),
    ({**LEVEL, 'load_factor': None}, 'load_factor = None is not allowed'),
    ({**LEVEL, 'lateral_load_factor': 3.5}, 'lateral_load_factor = 3.5 is out of range; allowed'),
    ({**LEVEL, 'loadfactor': 1.0}, "loadfactor is not a known key; did you mean 'load_factor'?"),
    ({'profile': 'step', 'after': 2.0}, 'at_s is missing; it is: time of the step'),
    ({'profile': 'step', 'after': 2.0, 'at_s': -1.0}, 'at_s = -1.0 is out of range; allowed: 0 to'),
    (
        {'profile': 'ramp', 'after': 2.0, 'duration_s': 0.0},
        'duration_s = 0.0 is out of range; allowed: 0.01 to 86400 s',
    ),
    (
        {'profile': 'sinusoid', 'amplitude': -1.0, 'frequency_hz': 1.0},
        'amplitude = -1.0 is out of range; allowed: 0 to 7.5',
    ),
    (
        {'profile': 'sinusoid', 'amplitude': 1.0, 'frequency_hz': 5.5},
        'frequency_hz = 5.5 is out of range; allowed: above 0 to 5 Hz',
    ),
    ({'profile': 'gusts', 'rms': -0.1}, 'rms = -0.1 is out of range; allowed: 0 to 1'),
    ({'profile': 'gusts', 'rms': 0.9}, 'so lower mean or rms'),
    ({'profile': 'gusts', 'seed': -1}, 'seed = -1 is out of range'),
    (
        {'profile': 'sinusoid', 'mean': 10.0, 'amplitude': 3.0, 'frequency_hz': 1.0},
        'the load factor could run from 7 to 13; allowed: -3 to 12, so lower mean or amplitude',
    ),
    (
        {'profile': 'turn', 'bank_rad': 1.5},
        'bank_rad = 1.5 is out of range; allowed: -1.48 to',
    ),
    ({'profile': 'turn', 'bank_rad': 1.0, 'roll_s': 0.0}, 'roll_s = 0.0 is out of range'),
    ({'profile': 'climb_dive', 'speed_m_s': 20.0}, 'speed_m_s = 20.0 is out of range; allowed: 30'),
    (
        {'profile': 'climb_dive', 'weight': 1},
        'weight = 1 is not allowed; it must be a valid bool',
    ),
    (
        {'profile': 'climb_dive', 'speed_m_s': 600.0, 'pull_rate_rad_s': 0.3},
        '19.35; allowed: -3 to 12, so lower speed_m_s, pull_rate_rad_s or push_rate_rad_s',
    ),
    # 600 m/s: 1 + 10 in the pull, cos(0.36) - 4.502 in the push
    ({'profile': 'climb_dive', 'speed_m_s': 600.0}, 'could run from -3.566 to 11; allowed: -3 to'),
    (
        {'profile': 'climb_dive', 'climb_angle_rad': 0.09},
        'climb_angle_rad = 0.09 rad is passed before the flight-path rate reaches 0.1635 rad/s',
    ),
    (
        {
            'profile': 'climb_dive',
            'onset_per_s': 1.0,
            'dive_angle_rad': 0.4,
            'climb_angle_rad': 1.0,
        },
        'dive_angle_rad = 0.4 rad is passed before',
    ),
    ({'profile': 'recorded'}, 'path is missing; it is: CSV file, relative to the folder'),
    ({'profile': 'recorded', 'path': ''}, "path = '' is not allowed"),
    ({'profile': 'sequence'}, 'segments is missing'),
    (sequence(), 'segments is empty; a sequence has at least one segment'),
    ({'profile': 'sequence', 'segments': 'climb'}, "segments = 'climb' is not allowed"),
    (sequence(part(LEVEL, 0.0)), 'segments[0].duration_s = 0.0 is out of range'),
    (sequence(part({**LEVEL, 'load_factor': 13.0})), 'segments[0].maneuver.load_factor = 13.0 is'),
    (sequence(part(LEVEL), {'maneuver': LEVEL}), 'segments[1].duration_s is missing'),
    (
        sequence(part(LEVEL), part(LEVEL, 0.2)),
        'segments[1].duration_s = 0.2 is shorter than blend_s = 0.5; lengthen the segment',
    ),
    (
        sequence(part(sequence(part(LEVEL)))),
        "segments[0].maneuver: profile = 'sequence' is not known here; choose one of climb_dive",
    ),
    (sequence(part(LEVEL), blend_s=0.0), 'blend_s = 0.0 is out of range; allowed: 0.05 to 60 s'),
    ('{', 'the maneuver is not valid JSON'),
    ('', 'the maneuver is not valid JSON'),
]


@pytest.mark.parametrize(('data', 'sentence'), BAD_MANEUVERS)
def test_wrong_maneuver_gets_its_sentence(data: Any, sentence: str) -> None:
    with pytest.raises(RigError) as caught:
        parse_maneuver(data)
    assert sentence in str(caught.value)
    assert '\n' not in str(caught.value)
    assert str(caught.value).startswith(('maneuver', 'the maneuver'))


def test_no_number_is_too_large_for_a_sentence() -> None:
    with pytest.raises(ConfigError, match='load_factor'):
        parse_maneuver({**LEVEL, 'load_factor': 10**400})


GOOD = 'time_s,load_factor\n0,1\n1,2\n'

BAD_FLIGHTS: list[tuple[str | bytes, str]] = [
    ('', 'is empty; the first line names the columns time_s, load_factor'),
    ('\n\n', 'is empty'),
    ('0,1\n1,2\n', 'line 1 of the flight file {path} lacks the column time_s'),
    ('time_s,g\n0,1\n1,2\n', 'line 1 of the flight file {path} lacks the column load_factor'),
    ('time_s;load_factor\n0;1\n1;2\n', 'lacks the column time_s; the first line names'),
    ('time_s,load_factor,lateral\n0,1,0\n', "has the unknown column 'lateral'"),
    ('time_s,load_factor,time_s\n0,1,0\n', 'names a column twice'),
    ('time_s,load_factor\n', 'has fewer than the 2 rows that a flight needs'),
    ('time_s,load_factor\n0,1\n', 'has fewer than the 2 rows that a flight needs'),
    ('time_s,load_factor\n0,1\n1\n', 'line 3 of the flight file {path} has 1 values where the'),
    ('time_s,load_factor\n0,1\n1,2,5\n', 'line 3 of the flight file {path} has 3 values where'),
    (
        'time_s,load_factor\n0,1\n\n\n1,x\n',
        "line 5 of the flight file {path}: load_factor = 'x'",
    ),
    ('time_s,load_factor\n0,1\n1,\n', "line 3 of the flight file {path}: load_factor = '' is not"),
    (
        'time_s,load_factor\n0,nan\n1,1\n',
        "line 2 of the flight file {path}: load_factor = 'nan'",
    ),
    ('time_s,load_factor\n0,1\ninf,1\n', "line 3 of the flight file {path}: time_s = 'inf' is not"),
    ('time_s,load_factor\n0,1\n1_0,1\n', "time_s = '1_0' is not a finite number"),
    ('time_s,load_factor\n0,1\n1,12.5\n', 'load_factor = 12.5 is out of range; allowed: -3 to 12'),
    ('time_s,load_factor\n0,9.81\n1,29.43\n', 'load_factor = 29.43 is out of range'),
    (
        'time_s,load_factor,lateral_load_factor\n0,1,-4\n1,1,0\n',
        'line 2 of the flight file {path}: lateral_load_factor = -4 is out of range; allowed: -3',
    ),
    (
        'time_s,load_factor\n0,1\n0,1\n',
        'line 3 of the flight file {path}: time_s = 0 does not',
    ),
    ('time_s,load_factor\n5,1\n4,1\n', 'time_s = 4 does not come after 5; times must increase'),
    (b'time_s,load_factor\n0,\xff\n', 'is not a UTF-8 text file'),
    ('time_s,load_factor\n0,"1\n', 'cannot be read: unexpected end of data'),
]


@pytest.mark.parametrize(('content', 'sentence'), BAD_FLIGHTS)
def test_wrong_flight_file_gets_its_sentence(
    tmp_path: Path, content: str | bytes, sentence: str
) -> None:
    path = tmp_path / 'flight.csv'
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(ManeuverError) as caught:
        read_flight(path)
    assert sentence.format(path=path) in str(caught.value)
    assert str(path) in str(caught.value)
    assert '\n' not in str(caught.value)


def test_missing_file_folder_and_impossible_name(tmp_path: Path) -> None:
    with pytest.raises(ManeuverError, match='cannot be read: No such file'):
        read_flight(tmp_path / 'nowhere.csv')
    with pytest.raises(ManeuverError, match='cannot be read: Is a directory'):
        read_flight(tmp_path)
    with pytest.raises(ManeuverError, match='cannot be read: embedded null'):
        read_flight(Path('a\0b'))


@pytest.mark.parametrize(
    'content',
    [
        GOOD,
        GOOD.replace('\n', '\r\n'),
        '\ufeff' + GOOD,
        '\n' + GOOD + '\n\n',
        'load_factor , time_s\n1, 0\n"2",1.0e0\n',
        'time_s,load_factor,lateral_load_factor\n0,1,0\n1,2,0\n',
    ],
)
def test_ordinary_variations_of_a_flight_file_are_read(tmp_path: Path, content: str) -> None:
    path = tmp_path / 'flight.csv'
    path.write_bytes(content.encode())
    flight = read_flight(path)
    assert flight.times_s.tolist() == [0.0, 1.0]
    assert flight.load_factors.tolist() == [1.0, 2.0]
    assert flight.lateral_load_factors.tolist() == [0.0, 0.0]


def test_a_flight_that_is_not_shipped_is_named_with_those_that_are() -> None:
    config = parse_maneuver({'profile': 'recorded', 'path': 'shipped:concorde'})
    with pytest.raises(ManeuverError, match=r"'shipped:concorde' is not .* synthetic_record"):
        load_grid(config, 1.0)
