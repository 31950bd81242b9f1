# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Files of other systems as columns of numbers: delimited text and MATLAB files."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from rotor_bringup.errors import ImportFileError
from rotor_bringup.importing.matlab import load_mat

Column = NDArray[np.float64]

_DELIMITERS = ('\t', ';', ',', None)
"""None is any run of blanks."""

_DECIMAL_COMMA = re.compile(r'\s*\d+[;\s]+[-+]?\d+\s*')
"""What stands between the commas of 0,5;0,7."""

_HEADER_LINES = 100
_NAMES_SHOWN = 12
_MOST_FACTS = 100
_LONGEST_FACT = 200


@dataclass(frozen=True)
class Stated:
    """What a file of a known layout says about itself; options of the command go before it."""

    channels: Mapping[str, str] = field(default_factory=dict)
    unit: str | None = None
    rate_hz: float | None = None
    speed_hz: float | None = None


class ForeignFile(Protocol):
    """A file whose columns can be asked for."""

    format: str
    stated: Stated
    facts: Mapping[str, str | float]
    """Single numbers and words that stand in the file, for the record."""

    def column(self, key: str) -> Column:
        """Return a column (samples,); raises ImportFileError if there is none of that name."""


def open_file(path: Path) -> ForeignFile:
    """Return the file: MATLAB where the name ends in .mat, else delimited text.

    Raises:
        ImportFileError: it cannot be read, or is not of that kind.

    """
    if path.is_dir():
        raise ImportFileError(f'{path} is a folder; give one file')
    try:
        with path.open('rb'):  # says what the system says, scipy does not
            pass
        return MatFile(path) if path.suffix.lower() == '.mat' else TextFile(path)
    except OSError as error:
        raise ImportFileError(f'{path} cannot be read: {error.strerror or error}') from None


class TextFile:
    """Delimited text: the delimiter is found, lines before the first one of numbers are left out.

    The last of those gives the names if it has as many cells; # and % start comments. A column
    is asked for by its number from 1 or by its name. A lost sample is written nan.
    """

    def __init__(self, path: Path) -> None:
        self.format = 'delimited text'
        self.stated = Stated()
        self.facts: Mapping[str, str | float] = {}
        self._path = path
        data = path.read_bytes()
        if b'\0' in data:
            raise ImportFileError(f'{path} is no text; of binary files only .mat is read')
        self._lines = data.decode('utf-8-sig', 'replace').splitlines()
        self._start, self._delimiter, self._width = self._first_line_of_numbers()
        self.names = self._header()

    def column(self, key: str) -> Column:
        """Return a column by number from 1 or by name."""
        index = self._index(key)
        try:
            return np.loadtxt(
                self._lines[self._start :],
                delimiter=self._delimiter,
                comments='#',
                usecols=index,
                quotechar='"',
                ndmin=1,
            )
        except ValueError as error:
            raise ImportFileError(
                f'column {key} of {self._path} is not all numbers: {str(error).rstrip(".;")} '
                f'(rows count from 0 at line {self._start + 1}; a lost sample is written nan)'
            ) from None

    def _index(self, key: str) -> int:
        if self.names.count(key) == 1:
            return self.names.index(key)
        if key.isascii() and key.isdigit() and 1 <= int(key) <= self._width:
            return int(key) - 1
        twice = ' more than one column of the name' if key in self.names else ' no column'
        named = f', named {_listed(self.names)}' if self.names else ', without names'
        raise ImportFileError(f'{self._path} has{twice} {key!r}; it has 1 to {self._width}{named}')

    def _first_line_of_numbers(self) -> tuple[int, str | None, int]:
        """Return number of the line, delimiter, number of cells."""
        for number, line in enumerate(self._lines[:_HEADER_LINES]):
            if not line.strip() or line.lstrip()[0] in '#%':
                continue
            found = [(_numbers(cells), len(cells), delimiter) for delimiter in _DELIMITERS
                     for cells in [line.strip(' \r\n').split(delimiter)]]  # fmt: skip
            numbers, width, delimiter = max(found, key=lambda split: split[0])
            if delimiter == ',' and any(map(_DECIMAL_COMMA.fullmatch, line.split(','))):
                break
            if 2 * numbers >= width:
                return number, delimiter, width
        raise ImportFileError(
            f'{self._path} holds no line of numbers among its first {_HEADER_LINES}; cells are '
            'divided by tab, semicolon, comma or blanks, decimals by a point'
        )

    def _header(self) -> list[str]:
        above = [line.strip(' #%\r\n') for line in self._lines[: self._start] if line.strip(' #%')]
        cells = above[-1].split(self._delimiter) if above else []
        return [cell.strip(' "\'') for cell in cells] if len(cells) == self._width else []


class MatFile:
    """A MATLAB file up to version 7: a column is asked for by the path of its variable.

    `bearing.gs` is a field of a struct, `data[2]` the second column of a matrix or element of a
    struct array. The layout of MFPT (struct `bearing` with gs in g, sr and rate in Hz) is known.
    """

    def __init__(self, path: Path) -> None:
        self.format = 'MATLAB'
        self._path = path
        self._variables = load_mat(path)
        leaves = list(_leaves(self._variables))
        self._arrays = [f'{name} {value.shape}' for name, value in leaves if value.ndim]
        self.facts: Mapping[str, str | float] = dict(_facts(leaves))
        self.stated = self._mfpt()

    def column(self, key: str) -> Column:
        """Return a column by the path of its variable."""
        value: Any = self._variables
        for part in key.split('.'):
            match = re.fullmatch(r'(\w+)(?:\[(\d+)\])?', part, re.ASCII)
            value = _member(value, match[1]) if match else None
            if match and match[2] and isinstance(value, np.ndarray):
                value = _element(value, int(match[2]))
        if not isinstance(value, np.ndarray) or value.dtype.kind not in 'iufb' or value.ndim != 1:
            what = f'a matrix of shape {value.shape}' if getattr(value, 'ndim', 0) == 2 else 'none'
            hint = f'; take one of its columns, {key}[1]' if what != 'none' else ''
            raise ImportFileError(
                f'{self._path} has no series of numbers {key!r} ({what}{hint}); it holds '
                f'{_listed(self._arrays) or "no arrays"}'
            )
        return value.astype(np.float64)

    def _mfpt(self) -> Stated:
        bearing = self._variables.get('bearing')
        if any(_member(bearing, name) is None for name in ('gs', 'sr', 'rate')):
            return Stated()
        rate_hz, speed_hz = (self.facts.get(f'bearing.{name}') for name in ('sr', 'rate'))
        return Stated(
            {'brg1_ay': 'bearing.gs'},
            'g',
            rate_hz if isinstance(rate_hz, float) else None,
            speed_hz if isinstance(speed_hz, float) else None,
        )


def _numbers(cells: list[str]) -> int:
    return sum(_is_number(cell) for cell in cells)


def _is_number(cell: str) -> bool:
    try:
        float(cell.strip(' "'))
    except ValueError:
        return False
    return True


def _member(value: Any, name: str) -> Any:
    """Return a variable of a file or a field of a struct, None where there is none."""
    if isinstance(value, Mapping):
        return None if name.startswith('__') else value.get(name)
    return getattr(value, name, None) if name in getattr(value, '_fieldnames', ()) else None


def _element(value: NDArray[Any], number: int) -> Any:
    """Return a column of a matrix or an element of a struct array by its number from 1."""
    count = value.shape[-1] if value.ndim else 0
    if not 1 <= number <= count:
        return None
    return value[number - 1] if value.dtype == object else value[..., number - 1]


def _leaves(value: Any, name: str = '') -> Iterator[tuple[str, NDArray[Any]]]:
    """Yield path and value of everything that is no struct, in the order of the file."""
    fields = value if isinstance(value, Mapping) else getattr(value, '_fieldnames', None)
    if fields is not None:
        for field_name in fields:
            if not field_name.startswith('__'):
                path = f'{name}.{field_name}' if name else field_name
                yield from _leaves(_member(value, field_name), path)
    elif isinstance(value, np.ndarray) and value.dtype == object:
        for number, element in enumerate(value.flat[:_NAMES_SHOWN], 1):
            yield from _leaves(element, f'{name}[{number}]')
    else:
        yield name, np.asarray(value)


def _facts(leaves: list[tuple[str, NDArray[Any]]]) -> Iterator[tuple[str, str | float]]:
    """Yield the first single numbers and short words."""
    single = [(name, value) for name, value in leaves if not value.ndim]
    for name, value in single[:_MOST_FACTS]:
        if value.dtype.kind in 'iufb' and np.isfinite(value):
            yield name, float(value)
        elif value.dtype.kind == 'U':
            yield name, str(value)[:_LONGEST_FACT]


def _listed(names: list[str]) -> str:
    more = f' and {len(names) - _NAMES_SHOWN} more' if len(names) > _NAMES_SHOWN else ''
    return ', '.join(names[:_NAMES_SHOWN]) + more
