# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Read delimited text as columns of numbers."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from rotor_recording.errors import ImportFileError
from rotor_recording.importing.cells import DELIMITERS, read_lines
from rotor_recording.importing.foreign import Column, Stated, listed
from rotor_recording.importing.readings import (
    TwoReadingsError,
    check_beginning,
    check_commas,
    check_direction,
    quoted,
)
from rotor_recording.importing.table import Decimal, Table, find_table

_LINES_OF_NAMES = 2


class TextFile:
    """Delimited text: the table is the first stretch of lines whose cells are all numbers.

    Dates and times of day may be among them; # and % start comments. A column is selected by its
    number from 1 or by its name in one of the two lines above the table, the second of which may
    hold units. A lost sample is written nan. A text that can be read in two ways is refused.
    """

    def __init__(
        self, path: Path, decimal: Decimal | None = None, first_line: int | None = None
    ) -> None:
        self.format = 'delimited text'
        self.stated = Stated()
        self.facts: Mapping[str, str | float] = {}
        self._path = path
        self._lines = read_lines(path)
        self._table = self._found(decimal, first_line)
        self._names = self._names_above()
        named = bool(self._names)
        try:
            decimal = check_commas(self._table, self._lines, named=named)
            if first_line is None:
                check_beginning(self._table, self._lines, named=named)
            check_direction(self._table, self._lines)
        except TwoReadingsError as error:
            raise TwoReadingsError(f'{path} can be read in two ways: {error}') from None
        self._end, left_out = self._end_of_table(one_block=first_line is None)
        above = self._contents(0, self._table.first)
        self.layout: Mapping[str, str | int] = {
            'delimiter': DELIMITERS[self._table.delimiter] if self._table.width > 1 else 'none',
            'decimal': decimal,
            'first_line': self._table.first + 1,
            'last_line': self._end,
            'lines_left_out_above': above,
            'lines_left_out_below': left_out,
        }
        self.warnings = tuple(self._losses(left_out))

    def column(self, key: str) -> Column:
        """Return a column by number from 1 or by name."""
        column = self._index(key)
        values = []
        for index, cells in self._table.rows(self._lines):
            if index >= self._end:
                break
            cell = cells[column]
            if not self._table.is_number(cell):
                raise ImportFileError(
                    f'column {key} of {self._path} is not all numbers: line {index + 1} holds '
                    f'{quoted(cell)}, which is no number; a lost sample is written nan'
                )
            values.append(float(cell.replace(',', '.')))
        return np.array(values)

    def _losses(self, left_out: int) -> Iterator[str]:
        """Yield warnings about lines left out after the samples, and blank lines among them."""
        if left_out:
            first = next(line for line in self._lines[self._end :] if self._table.cells(line))
            yield (
                f'the last {left_out} lines ({quoted(first)} is the first of them) are no samples '
                'of this table and were left out'
            )
        between = self._lines[self._table.first : self._end]
        blank = sum(1 for line in between if not line.strip())
        if 0 < blank < len(between) // 3:  # more of them are doubled line ends
            yield (
                f'{blank} blank lines stand between the samples, which are taken to follow one '
                'another'
            )

    def _found(self, decimal: Decimal | None, first_line: int | None) -> Table:
        if first_line is None:
            table = find_table(self._lines, decimal)
            if table is None:
                sign = f' with a decimal {decimal}' if decimal else ''
                raise ImportFileError(
                    f'{self._path} holds no line of numbers{sign}; cells are divided by tab, '
                    'semicolon, comma or blanks, and thousands are not divided'
                )
            return table
        if not 1 <= first_line <= len(self._lines):
            raise ImportFileError(
                f'--first-line {first_line} is out of range; {self._path} has lines 1 to '
                f'{len(self._lines)}'
            )
        first = first_line - 1
        table = find_table(self._lines, decimal, first)
        if table is None or not table.is_row(table.cells(self._lines[first])):
            raise ImportFileError(
                f'line {first_line} of {self._path} ({quoted(self._lines[first])}) is no row of '
                'the numbers that follow; --first-line names the line of the first sample'
            )
        return table.from_line(first)

    def _index(self, key: str) -> int:
        named = {index for names in self._names for index, name in enumerate(names) if name == key}
        numbered = set()
        if key.isascii() and key.isdigit() and 1 <= int(key) <= self._table.width:
            numbered = {int(key) - 1}
        found = named | numbered
        if len(found) == 1:
            return found.pop()
        what = f'no column {key!r}'
        if found:
            places = ', '.join(str(index + 1) for index in sorted(found))
            what = f'more than one column of the name {key!r} ({places})'
            if numbered:
                what = f'a column {key} and another named {key!r} ({places}), so rename it there'
        names = ', without names'
        if self._names:
            names = ', named ' + ' or '.join(listed(names) for names in self._names)
        raise ImportFileError(f'{self._path} has {what}; it has 1 to {self._table.width}{names}')

    def _names_above(self) -> list[list[str]]:
        """Return the lines above the table that can be names of its columns, or units."""
        found: list[list[str]] = []
        for line in reversed(self._lines[: self._table.first]):
            content = line.strip(' #%')
            if not content.strip():
                continue
            cells = [cell.strip(' "\'') for cell in self._table.split(content)]
            if cells[-1] in {'', 'Comment'} and len(cells) == self._table.width + 1:
                cells = cells[:-1]  # LabVIEW's column of remarks, which its rows may lack
            if len(cells) == self._table.width - 1 and self._table.ends_empty:
                cells.append('')
            words = [not self._table.is_number(cell) for cell in cells]
            numbered = len(cells) > 2 and words[0] and not any(words[1:])
            if len(cells) != self._table.width or not (all(words) or numbered) or not any(cells):
                break
            found.insert(0, cells)
            if len(found) == _LINES_OF_NAMES:
                break
        return found

    def _end_of_table(self, *, one_block: bool) -> tuple[int, int]:
        """Return the index after the last row, and the number of lines with content after it.

        Raises:
            ImportFileError: a row has more or fewer cells, or rows follow a line that is no row.

        """
        last = self._table.first
        stop: int | None = None
        for index, cells in self._table.rows(self._lines):
            row = self._table.is_row(cells)
            if stop is None and row:
                last = index
            elif stop is None:
                stop = index
            elif row and one_block:
                raise ImportFileError(
                    f'line {stop + 1} of {self._path} ({quoted(self._lines[stop])}) is no row of '
                    f'{self._table.width} cells with numbers, and more rows follow from line '
                    f'{index + 1} on; a lost sample is written nan, and of several tables '
                    f'--first-line {self._table.first + 1} or {index + 1} reads one'
                )
            ragged = len(cells) != self._table.width and self._starts_with_number(cells)
            if ragged and (one_block or index == stop):
                raise ImportFileError(
                    f'line {index + 1} of {self._path} ({quoted(self._lines[index])}) has '
                    f'{len(cells)} cells, the rows above {self._table.width}'
                )
        return last + 1, 0 if stop is None else self._contents(stop, len(self._lines))

    def _starts_with_number(self, cells: list[str]) -> bool:
        place = self._table.numbers[0]
        return len(cells) > place and self._table.is_number(cells[place])

    def _contents(self, first: int, stop: int) -> int:
        return sum(1 for line in self._lines[first:stop] if line.strip())
