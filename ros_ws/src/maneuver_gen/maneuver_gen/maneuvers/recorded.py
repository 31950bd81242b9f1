# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A recorded flight from a CSV file: time, load factor and optional lateral load factor."""

import csv
import functools
import io
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any, TextIO

import numpy as np
import pydantic

from maneuver_gen.curves import FloatArray
from maneuver_gen.errors import ManeuverError
from maneuver_gen.maneuver import LATERAL_LOAD_FACTOR_RANGE, LOAD_FACTOR_RANGE, Maneuver
from rotor_common.configuration import quantity
from rotor_common.errors import DataError
from rotor_common.text_file import read_text

_RANGES = {
    'time_s': (-math.inf, math.inf),
    'load_factor': LOAD_FACTOR_RANGE,
    'lateral_load_factor': LATERAL_LOAD_FACTOR_RANGE,
}
_REQUIRED = ('time_s', 'load_factor')
_HEADER_RULE = (
    'the first line names the columns time_s, load_factor and optionally '
    'lateral_load_factor, comma separated'
)
# a flight exactly as long as the run is long enough in spite of rounding in its times
_TIME_TOLERANCE_S = 1e-9
LARGEST_BYTES = 200_000_000
"""Largest flight file: a day at 100 rows a second."""
SHIPPED = 'shipped:'
"""Start of the path of a flight that comes with the rig: the same on every machine."""
_FLIGHTS = files('maneuver_gen') / 'flights'


@dataclass(frozen=True)
class RecordedFlight:
    """Rows of a flight file: increasing times (s) and load factors, float64, shape (n,)."""

    path: Path
    times_s: FloatArray
    load_factors: FloatArray
    lateral_load_factors: FloatArray

    def require(self, start_s: float, duration_s: float) -> None:
        """Raise ManeuverError unless the file covers duration_s from its own time start_s."""
        first, last = float(self.times_s[0]), float(self.times_s[-1])
        if not first <= start_s < last:
            raise ManeuverError(
                f'start_s = {start_s:g} lies outside the flight file {self.path}; '
                f'allowed: {first:.10g} to below {last:.10g} s'
            )
        if start_s + duration_s > last + _TIME_TOLERANCE_S:
            raise ManeuverError(
                f'the flight file {self.path} ends {last - start_s:.10g} s after start_s = '
                f'{start_s:g} s, but {duration_s:.10g} s are needed; shorten the run or give a '
                'longer flight'
            )

    def sample(self, times_s: FloatArray) -> FloatArray:
        """Return (n, 2) load factors at times of the file, linear between rows, held outside."""
        normal = np.interp(times_s, self.times_s, self.load_factors)
        lateral = np.interp(times_s, self.times_s, self.lateral_load_factors)
        return np.column_stack((normal, lateral))


def shipped_flights() -> list[str]:
    """Return the names of the flights that come with the rig."""
    return sorted(entry.name[:-4] for entry in _FLIGHTS.iterdir() if entry.name.endswith('.csv'))


def open_flight(path: str) -> RecordedFlight:
    """Return the flight of a CSV file or, for `shipped:NAME`, one that comes with the rig.

    Raises ManeuverError as `read_flight`, and for a name that is not shipped.
    """
    if not path.startswith(SHIPPED):
        return read_flight(Path(path))
    name = path.removeprefix(SHIPPED)
    if name not in shipped_flights():
        raise ManeuverError(
            f'path = {path!r} is not a flight that comes with the rig; shipped are '
            f'{", ".join(shipped_flights())}'
        )
    return _shipped(name)


@functools.cache
def _shipped(name: str) -> RecordedFlight:
    with as_file(_FLIGHTS / f'{name}.csv') as path:
        return read_flight(path)


def read_flight(path: Path) -> RecordedFlight:
    """Return the flight of a CSV file; raises ManeuverError with the file and line.

    The first line names the columns: time_s, load_factor and optionally lateral_load_factor, in
    any order, comma separated, UTF-8. Signs as in `maneuver`. Empty lines are skipped.
    """
    try:
        columns = _read_columns(path, io.StringIO(read_text(path, LARGEST_BYTES), newline=''))
    except DataError as error:
        raise ManeuverError(f'the flight file {error}') from None
    except csv.Error as error:
        raise ManeuverError(f'the flight file {path} cannot be read: {error}') from None
    times = np.array(columns['time_s'], dtype=np.float64)
    lateral = columns.get('lateral_load_factor', [0.0] * len(times))
    return RecordedFlight(
        path=path,
        times_s=times,
        load_factors=np.array(columns['load_factor'], dtype=np.float64),
        lateral_load_factors=np.array(lateral, dtype=np.float64),
    )


def _read_columns(path: Path, stream: TextIO) -> dict[str, list[float]]:
    reader = csv.reader(stream, strict=True)
    # the reader's own line count, since a quoted value may run over several lines
    lines = ((reader.line_num, [text.strip() for text in row]) for row in reader if row)
    names = _read_header(path, lines)
    columns: dict[str, list[float]] = {name: [] for name in names}
    for number, row in lines:
        where = f'line {number} of the flight file {path}'
        if len(row) != len(names):
            raise ManeuverError(
                f'{where} has {len(row)} values where the first line names {len(names)} columns'
            )
        for name, text in zip(names, row, strict=True):
            columns[name].append(_number(where, name, text))
        times = columns['time_s']
        if len(times) > 1 and times[-1] <= times[-2]:
            raise ManeuverError(
                f'{where}: time_s = {times[-1]:.10g} does not come after {times[-2]:.10g}; '
                'times must increase from row to row'
            )
    if len(columns['time_s']) < 2:
        raise ManeuverError(f'the flight file {path} has fewer than the 2 rows that a flight needs')
    return columns


def _read_header(path: Path, lines: Iterator[tuple[int, list[str]]]) -> list[str]:
    number, names = next(lines, (0, []))
    if not names:
        raise ManeuverError(f'the flight file {path} is empty; {_HEADER_RULE}')
    missing = [name for name in _REQUIRED if name not in names]
    unknown = [name for name in names if name not in _RANGES]
    if missing:
        wrong = f'lacks the column {missing[0]}'
    elif unknown:
        wrong = f'has the unknown column {unknown[0]!r}'
    elif len(set(names)) != len(names):
        wrong = 'names a column twice'
    else:
        return names
    raise ManeuverError(f'line {number} of the flight file {path} {wrong}; {_HEADER_RULE}')


def _number(where: str, name: str, text: str) -> float:
    try:
        # float() would take 1_0 for 10
        value = math.nan if '_' in text else float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ManeuverError(f'{where}: {name} = {text!r} is not a finite number')
    low, high = _RANGES[name]
    if not low <= value <= high:
        raise ManeuverError(
            f'{where}: {name} = {value:g} is out of range; allowed: {low:g} to {high:g}'
        )
    return value


class Recorded(Maneuver):
    """A flight recorded in a CSV file with the columns of `read_flight`."""

    profile: str = 'recorded'
    path: str = pydantic.Field(
        min_length=1,
        description='CSV file, relative to the folder of the scenario file; or shipped:NAME',
    )
    start_s: float = quantity(0.0, unit='s', description='time in the file at which the run starts')

    def load_factors(self, times_s: FloatArray) -> FloatArray:
        """Return the rows of the file, with straight lines between."""
        return open_flight(self.path).sample(self.start_s + times_s)

    def check_duration(self, duration_s: float) -> None:
        """Read the file; raises ManeuverError where it does not cover the run."""
        open_flight(self.path).require(self.start_s, duration_s)

    @classmethod
    def resolve_paths(cls, data: Mapping[str, Any], folder: Path) -> Mapping[str, Any]:
        """Make `path` absolute, unless it is a shipped flight."""
        path = data.get('path')
        if not isinstance(path, str) or not path or path.startswith(SHIPPED):
            return data
        return {**data, 'path': str((folder / path).absolute())}
