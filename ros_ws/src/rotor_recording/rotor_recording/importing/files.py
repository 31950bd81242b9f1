# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Read foreign files as columns of numbers: delimited text and MATLAB."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor_common.errors import DataError
from rotor_common.text_file import require_file
from rotor_recording.errors import ImportFileError
from rotor_recording.importing.foreign import NAMES_SHOWN, Column, ForeignFile, Stated, listed
from rotor_recording.importing.matlab import load_mat
from rotor_recording.importing.table import Decimal
from rotor_recording.importing.text import TextFile

_MOST_FACTS = 100
_LONGEST_FACT = 200


def open_file(
    path: Path, decimal: Decimal | None = None, first_line: int | None = None
) -> ForeignFile:
    """Return the file: MATLAB where the name ends in .mat, else delimited text.

    Args:
        path: the file.
        decimal: decimal sign of a text; None: detected, and refused where it is ambiguous.
        first_line: number of the line of a text with the first sample, from 1; None: detected.

    Raises:
        ImportFileError: it cannot be read, or is not of that kind.

    """
    try:
        require_file(path)
        if path.is_dir():
            raise ImportFileError(f'{path} is a folder; give one file')
        with path.open('rb'):  # raises the system's own error, scipy does not
            pass
        if path.suffix.lower() != '.mat':
            return TextFile(path, decimal, first_line)
        if decimal is not None or first_line is not None:
            raise ImportFileError(f'--decimal and --first-line are for texts, not for {path}')
        return MatFile(path)
    except DataError as error:
        raise ImportFileError(str(error)) from None
    except OSError as error:
        raise ImportFileError(f'{path} cannot be read: {error.strerror or error}') from None


class MatFile:
    """A MATLAB file up to version 7: a column is selected by the path of its variable.

    `bearing.gs` is a field of a struct, `data[:,2]` the second column of a matrix, `data[2,:]` its
    second row. `data[2]` is an element of a struct array, or the column of a matrix with more
    rows than columns. MFPT's layout (struct `bearing`: gs in g, sr and rate in Hz) is known.
    """

    def __init__(self, path: Path) -> None:
        self.format = 'MATLAB'
        self._path = path
        self._variables = load_mat(path)
        leaves = list(_leaves(self._variables))
        self._arrays = [f'{name} {value.shape}' for name, value in leaves if value.ndim]
        self.facts: Mapping[str, str | float] = dict(_facts(leaves))
        self.stated = self._mfpt()
        self.layout: Mapping[str, str | int] = {}
        self.warnings: tuple[str, ...] = ()

    def column(self, key: str) -> Column:
        """Return a column by the path of its variable."""
        value: Any = self._variables
        for part in re.split(r'\.(?![^[]*\])', key):
            match = re.fullmatch(r'(\w+)(?:\[([\d:, ]+)\])?', part, re.ASCII)
            value = _member(value, match[1]) if match else None
            if match and match[2] and isinstance(value, np.ndarray):
                self._check_direction(key, part, value)
                value = _element(value, match[2].replace(' ', '').split(','))
        if not isinstance(value, np.ndarray) or value.dtype.kind not in 'iufb' or value.ndim != 1:
            raise ImportFileError(
                f'{self._path} has no series of numbers {key!r} ({_described(value, key)}); it '
                f'holds {listed(self._arrays) or "no arrays"}'
            )
        return value.astype(np.float64)

    def _check_direction(self, key: str, part: str, value: NDArray[Any]) -> None:
        """Refuse `x[2]` of a matrix that has no more rows than columns: it may be either."""
        name, _, number = part.rstrip(']').partition('[')
        if value.ndim != 2 or value.dtype == object or not number.isdigit():
            return
        rows, columns = value.shape
        if rows > columns:
            return
        path = key.removesuffix(part) + name
        raise ImportFileError(
            f'{self._path} can be read in two ways: {key} of a matrix of {rows} x {columns} can be '
            f'a row of {columns} samples, {path}[{number},:], or a column of {rows}, '
            f'{path}[:,{number}]; write which'
        )

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


def _member(value: Any, name: str) -> Any:
    """Return a variable of a file or a field of a struct, None where there is none."""
    if isinstance(value, Mapping):
        return None if name.startswith('__') else value.get(name)
    return getattr(value, name, None) if name in getattr(value, '_fieldnames', ()) else None


def _element(value: NDArray[Any], index: list[str]) -> Any:
    """Return a part of an array: `2` a column or an element of a struct array, `1,:` a row.

    Indices count from 1 and the colon stands for the samples, as in MATLAB; None where there is no
    such part. A vector is read without its axis of length 1, so `1,:` and `:,1` are all of it.
    """
    if len(index) == 1 and index[0] != ':':
        index = index if value.dtype == object else [*':' * (value.ndim - 1), *index]
    if value.ndim == 1 and sorted(index) == ['1', ':']:
        index = [':']
    if len(index) != value.ndim:
        return None
    places: list[int | slice] = []
    for number, length in zip(index, value.shape, strict=True):
        if number == ':':
            places.append(slice(None))
        elif number.isdigit() and 1 <= int(number) <= length:
            places.append(int(number) - 1)
        else:
            return None
    return value[tuple(places)]


def _described(value: Any, key: str) -> str:
    """Return what the variable holds instead of a series, and how to select one."""
    if not isinstance(value, np.ndarray) or not value.ndim:
        return 'none'
    if value.dtype.kind not in 'iufb':
        return 'complex numbers' if value.dtype.kind == 'c' else 'no numbers'
    size = ' x '.join(map(str, value.shape))
    if value.ndim > 2:
        index = ',1' * (value.ndim - 1)
        return f'{size} numbers; write a colon for the samples, such as {key}[:{index}]'
    ways = [f'one of its columns, {key}[:,1]', f'one of its rows, {key}[1,:]']
    if value.shape[1] > value.shape[0]:
        ways.reverse()
    return f'a matrix of {size}; take {ways[0]}, or {ways[1]}'


def _leaves(value: Any, name: str = '') -> Iterator[tuple[str, NDArray[Any]]]:
    """Yield path and value of everything that is no struct, in the order of the file."""
    fields = value if isinstance(value, Mapping) else getattr(value, '_fieldnames', None)
    if fields is not None:
        for field_name in fields:
            if not field_name.startswith('__'):
                path = f'{name}.{field_name}' if name else field_name
                yield from _leaves(_member(value, field_name), path)
    elif isinstance(value, np.ndarray) and value.dtype == object:
        for number, element in enumerate(value.flat[:NAMES_SHOWN], 1):
            yield from _leaves(element, f'{name}[{number}]')
    else:
        yield name, np.asarray(value)


def _facts(leaves: list[tuple[str, NDArray[Any]]]) -> Iterator[tuple[str, str | float]]:
    """Yield the first scalars and short texts."""
    single = [(name, value) for name, value in leaves if not value.ndim]
    for name, value in single[:_MOST_FACTS]:
        if value.dtype.kind in 'iufb' and np.isfinite(value):
            yield name, float(value)
        elif value.dtype.kind == 'U':
            yield name, str(value)[:_LONGEST_FACT]
