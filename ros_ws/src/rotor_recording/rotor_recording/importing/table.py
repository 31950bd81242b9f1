# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Find the numeric table in a text file, and its delimiter."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from rotor_recording.importing.cells import DELIMITERS, Kind, cells_of, kind_of, without_comment

Decimal = Literal['point', 'comma']

STEADY_ROWS = 3
"""This many rows of one shape are a table."""

_WORDY_ROWS = 10
"""The same where a column holds words."""


@dataclass(frozen=True)
class Table:
    """A table in a text: the index of its first line, and the shape of its rows.

    `numbers` and `stamps` are the columns of that kind; `width` counts all columns.
    """

    delimiter: str | None
    decimal: Decimal | None
    first: int
    width: int
    numbers: tuple[int, ...]
    stamps: tuple[int, ...]

    @property
    def ends_empty(self) -> bool:
        """Say whether the last column is empty: a delimiter at the end of each line."""
        return self.width - 1 not in self.numbers + self.stamps

    def cells(self, line: str) -> list[str]:
        """Return the cells of a line, none where it is blank or a comment."""
        content = without_comment(line)
        return self.split(content) if content.strip() else []

    def split(self, content: str) -> list[str]:
        """Return the cells of a line without its comment."""
        return cells_of(content, self.delimiter)

    def is_number(self, cell: str) -> bool:
        """Say whether a cell is a number of this table."""
        return _shown(kind_of(cell), self.decimal).is_number

    def is_row(self, cells: Sequence[str]) -> bool:
        """Say whether the cells are a row: as many as the others, the first number a number."""
        return len(cells) == self.width and self.is_number(cells[self.numbers[0]])

    def from_line(self, first: int) -> 'Table':
        """Return the same table with another first line."""
        return replace(self, first=first)

    def rows(self, lines: Sequence[str]) -> Iterator[tuple[int, list[str]]]:
        """Yield index and cells of each line with content, rows or not, from the first row on."""
        for index in range(self.first, len(lines)):
            cells = self.cells(lines[index])
            if cells:
                yield index, cells


def find_table(lines: Sequence[str], decimal: Decimal | None, first: int = 0) -> Table | None:
    """Return the first table: rows of cells that are all numbers, dates or empty, of one shape.

    Three rows of one shape make a table; if there are none, the longest run does. Only if the text
    has no such table may a column hold words, in ten rows or more.
    """
    return _search(lines, decimal, first, words=False) or _search(lines, decimal, first, words=True)


@dataclass
class _Run:
    """Consecutive rows of one shape, for one delimiter."""

    delimiter: str | None
    decimal: Decimal | None
    words: bool
    first: int = 0
    length: int = 0
    shape: tuple[Kind, ...] = ()
    longest: tuple[int, int, tuple[Kind, ...]] = field(default=(0, 0, ()))
    """Length, first line and shape."""

    def take(self, index: int, content: str) -> None:
        """Take the next line with content."""
        shape = self._shape(content)
        if not shape:
            self.length = 0
            return
        merged = _merge(self.shape, shape) if self.length else ()
        if not merged:
            self.first, self.length = index, 0
        self.shape, self.length = merged or shape, self.length + 1
        if self.length > self.longest[0] or (self.length, self.first) == self.longest[:2]:
            self.longest = self.length, self.first, self.shape

    def _shape(self, content: str) -> tuple[Kind, ...]:
        """Return the types of the cells, POINT for all numbers; () for a line that is no row."""
        if (self.delimiter, self.decimal) == (',', 'comma') and '"' not in content:
            return ()
        kinds = [_shown(kind_of(cell), self.decimal) for cell in cells_of(content, self.delimiter)]
        shape = tuple(Kind.POINT if kind.is_number else kind for kind in kinds)
        numbers = shape.count(Kind.POINT)
        if self.words:
            return shape if 2 * numbers >= len(shape) else ()
        return shape if numbers and Kind.WORD not in shape else ()

    def table(self) -> Table:
        """Return the longest run as a table."""
        _, first, shape = self.longest
        numbers, stamps = (
            tuple(index for index, kind in enumerate(shape) if kind is wanted)
            for wanted in (Kind.POINT, Kind.STAMP)
        )
        return Table(self.delimiter, self.decimal, first, len(shape), numbers, stamps)


def _search(
    lines: Sequence[str], decimal: Decimal | None, first: int, *, words: bool
) -> Table | None:
    needed = _WORDY_ROWS if words else STEADY_ROWS
    runs = [_Run(delimiter, decimal, words) for delimiter in DELIMITERS]
    for index in range(first, len(lines)):
        content = without_comment(lines[index])
        if not content.strip():
            continue
        for run in runs:
            run.take(index, content)
        if any(run.length >= needed for run in runs):
            break
    least = needed if words else 1
    found = [run for run in runs if run.longest[0] >= least]
    # one column looks the same with every delimiter: of equal lengths, several columns win
    best = max(found, key=lambda run: (run.longest[0], len(run.longest[2]) > 1), default=None)
    return best.table() if best else None


def _merge(one: tuple[Kind, ...], other: tuple[Kind, ...]) -> tuple[Kind, ...]:
    """Return the shape of both rows, where an empty cell fits any type; () if they differ."""
    if len(one) != len(other):
        return ()
    merged = []
    for a, b in zip(one, other, strict=True):
        if Kind.EMPTY not in (a, b) and a is not b:
            return ()
        merged.append(b if a is Kind.EMPTY else a)
    return tuple(merged)


def _shown(kind: Kind, decimal: Decimal | None) -> Kind:
    """Return the type of a cell; a number with the other decimal sign is a word."""
    wrong = {'point': Kind.COMMA, 'comma': Kind.POINT}
    return Kind.WORD if decimal and kind is wrong[decimal] else kind
