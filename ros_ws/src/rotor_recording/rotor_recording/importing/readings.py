# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Detect ambiguous text, which is refused with both readings named."""

import re
from collections.abc import Sequence
from itertools import chain, islice

from rotor_recording.errors import ImportFileError
from rotor_recording.importing.cells import Kind, kind_of
from rotor_recording.importing.table import STEADY_ROWS, Decimal, Table

_ONE_COMMA = re.compile(r'[-+]?\d+,\d+(?:[eE][-+]?\d+)?', re.ASCII)
_GROUPS_OF_THREE = re.compile(r'[-+]?[1-9]\d{0,2}(?:,\d{3})+(?:\.\d*)?', re.ASCII)
_PADDED = re.compile(r'0\d+|-0', re.ASCII)
"""Digits that occur after or before a decimal comma, and seldom as a whole number."""

_MANY_COLUMNS = 100
_LONGEST_QUOTE = 60


class TwoReadingsError(ImportFileError):
    """A text can be read in two ways."""


def check_commas(table: Table, lines: Sequence[str], *, named: bool) -> Decimal:
    """Return the decimal sign; `named` says whether there are column names above the table.

    Raises:
        TwoReadingsError: a comma may divide cells, thousands, or whole and decimal part.

    """
    if table.decimal is not None:
        return table.decimal
    if table.delimiter == ',':
        _check_dividing_commas(table, lines, named=named)
        if not any('"' in line for line in lines):
            return 'point'
    return _decimal_sign(table, lines)


def check_beginning(table: Table, lines: Sequence[str], *, named: bool) -> None:
    """Raise TwoReadingsError if the first row may be a heading, or the line above it a sample."""
    _check_line_above(table, lines)
    _check_first_row(table, lines, named=named)


def check_direction(table: Table, lines: Sequence[str]) -> None:
    """Raise TwoReadingsError for a few very long lines: each may be a channel."""
    if table.width <= _MANY_COLUMNS:
        return
    count = sum(1 for _ in islice(table.rows(lines), table.width))
    if count < table.width:
        raise TwoReadingsError(
            f'{count} lines of {table.width} numbers can be a sample or a channel a line, and only '
            'columns are read; transpose the table, one line a sample'
        )


def quoted(line: str) -> str:
    """Return the beginning of a line in quotation marks, for a message."""
    line = line.strip()
    return f"'{line[:_LONGEST_QUOTE]}...'" if len(line) > _LONGEST_QUOTE else f"'{line}'"


def _check_dividing_commas(table: Table, lines: Sequence[str], *, named: bool) -> None:
    """Refuse whole numbers in pairs: each may be one number with a decimal comma."""
    where = f'line {table.first + 1} ({quoted(lines[table.first])})'
    pairs, groups = table.width == 2, True
    whole, padded = True, False
    for index, cells in table.rows(lines):
        if not table.is_row(cells):
            continue
        line = lines[index].strip()
        pairs = pairs and _ONE_COMMA.fullmatch(line) is not None
        groups = groups and _GROUPS_OF_THREE.fullmatch(line) is not None
        whole = whole and all(kind_of(cell) is Kind.WHOLE for cell in cells) and '"' not in line
        if not (pairs or groups or whole):
            return
        padded = padded or any(_PADDED.fullmatch(cell) for cell in cells)
    if whole and padded and not pairs:
        raise TwoReadingsError(
            f'{where} can be {table.width} columns of whole numbers or fewer with decimal commas; '
            'give --decimal point for the first, divide the cells by semicolons for the second'
        )
    if pairs and (padded or not named):
        raise _pair(where)
    if groups and not named:
        raise TwoReadingsError(
            f'{where} can be {table.width} columns or one with thousands separators; give '
            '--decimal point for the first, take the separators out for the second'
        )


def _decimal_sign(table: Table, lines: Sequence[str]) -> Decimal:
    """Return the decimal sign; refuse commas that may divide thousands, or commas beside points."""
    if not any(',' in line for line in lines[table.first :]):
        return 'point'
    comma = point = ''
    groups = True
    for index, cells in table.rows(lines):
        if not table.is_row(cells):
            continue
        for column in table.numbers:
            cell = cells[column]
            if ',' in cell:
                comma = comma or f'{quoted(cell)} in line {index + 1}'
                groups = groups and _GROUPS_OF_THREE.fullmatch(cell) is not None
            elif '.' in cell:
                point = point or f'{quoted(cell)} in line {index + 1}'
    if comma and point:
        raise TwoReadingsError(
            f'{comma} has a comma and {point} a point, so either may be the decimal sign or divide '
            'thousands; take the thousands separators out, or write all decimals alike'
        )
    if comma and table.width == 1 and '"' not in lines[table.first]:
        raise _pair(comma)
    if comma and groups:
        raise TwoReadingsError(
            f'{comma} can have a decimal comma or a comma that divides thousands; give --decimal '
            'comma for the first, take the separators out for the second'
        )
    return 'comma' if comma else 'point'


def _pair(where: str) -> TwoReadingsError:
    return TwoReadingsError(
        f'{where} can be two columns or one with a decimal comma; give --decimal point for the '
        'first, --decimal comma for the second'
    )


def _check_line_above(table: Table, lines: Sequence[str]) -> None:
    """Refuse a line above the first row that may be a sample with a remark or a damaged cell."""
    above = next((i for i in reversed(range(table.first)) if table.cells(lines[i])), None)
    if above is None:
        return
    cells = table.cells(lines[above])
    good = [len(cells) > column and table.is_number(cells[column]) for column in table.numbers]
    if len(cells) == table.width:
        like_a_row = good[0] and len(good) > 1 and good.count(False) <= 1
    else:
        like_a_row = len(cells) > table.width and all(good)
    if like_a_row:
        raise TwoReadingsError(
            f'line {above + 1} ({quoted(lines[above])}) can be a sample or belong to the heading; '
            f'give --first-line {table.first + 1} if it is none, else mend it: a lost sample is '
            'written nan'
        )


def _check_first_row(table: Table, lines: Sequence[str], *, named: bool) -> None:
    """Refuse a first row that may be names or settings: no later row has the same cell types."""
    first = [kind_of(cell) for cell in table.cells(lines[table.first])]
    rows = (cells for _, cells in islice(table.rows(lines), 1, None) if table.is_row(cells))
    following = list(islice(rows, STEADY_ROWS - 1))
    numbers = [first[column] for column in table.numbers]
    if set(numbers) <= {Kind.NOT_FINITE, Kind.EMPTY}:
        suspicious = not named
    elif len(following) == STEADY_ROWS - 1 and set(first) <= {Kind.WHOLE, Kind.EMPTY}:
        never = {column for column in table.numbers if first[column] is Kind.WHOLE}
        empty = {column for column, kind in enumerate(first) if kind is Kind.EMPTY}
        for cells in chain(following, rows):
            never = {column for column in never if kind_of(cells[column]) is not Kind.WHOLE}
            empty = {column for column in empty if cells[column]}
            if not (never or empty):
                break
        suspicious = bool(never or empty)
    else:
        return
    if suspicious:
        number = table.first + 1
        raise TwoReadingsError(
            f'line {number} ({quoted(lines[table.first])}) can be the first sample or part of the '
            f'heading, for no later line is like it; give --first-line {number} for the first, '
            f'{number + 1} for the second'
        )
