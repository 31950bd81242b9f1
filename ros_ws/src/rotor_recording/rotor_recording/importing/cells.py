# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Split delimited text into cells, and tell the type of each cell."""

import codecs
import csv
import re
from enum import Enum
from pathlib import Path

from rotor_recording.errors import ImportFileError

DELIMITERS = {'\t': 'tab', ';': 'semicolon', ',': 'comma', None: 'blanks'}
"""In the order in which they are tried; None is any run of blanks."""

_COMMENT = re.compile(r'(?:^|\s)#.*|^\s*%.*')
_EXPONENT = r'(?:[eE][-+]?\d+)?'
_WHOLE = re.compile(rf'[-+]?\d+{_EXPONENT}', re.ASCII)
# possessive quantifiers: otherwise digits beside a point would be tried on either side of it
_POINT = re.compile(rf'[-+]?(?:\d++(?:\.\d*+)?|\.\d++){_EXPONENT}', re.ASCII)
_COMMA = re.compile(rf'[-+]?\d*,\d+{_EXPONENT}', re.ASCII)
_NOT_FINITE = re.compile(r'[-+]?(?:nan|inf|infinity)', re.IGNORECASE | re.ASCII)
_CLOCK = r'\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d+)?)?(?:\s?[AaPp][Mm])?(?:Z|[-+]\d{2}:?\d{2})?'
_STAMP = re.compile(
    rf'\d{{1,4}}[-/.]\d{{1,2}}[-/.]\d{{1,4}}(?:(?:T|\s+){_CLOCK})?|{_CLOCK}', re.ASCII
)

_ENCODINGS = (
    (codecs.BOM_UTF8, 'utf-8-sig'),
    (codecs.BOM_UTF16_LE, 'utf-16'),
    (codecs.BOM_UTF16_BE, 'utf-16'),
)


class Kind(Enum):
    """Type of a cell; of numbers, the way they are written."""

    EMPTY = 'empty'
    WHOLE = 'whole number'
    POINT = 'number with a point'
    COMMA = 'number with a comma'
    NOT_FINITE = 'nan or inf'
    STAMP = 'date or time of day'
    WORD = 'word'

    @property
    def is_number(self) -> bool:
        """Say whether the cell is a sample; nan is a lost one."""
        return self in _NUMBERS


_NUMBERS = frozenset((Kind.WHOLE, Kind.POINT, Kind.COMMA, Kind.NOT_FINITE))

_PATTERNS = (
    (_WHOLE, Kind.WHOLE),
    (_POINT, Kind.POINT),
    (_COMMA, Kind.COMMA),
    (_NOT_FINITE, Kind.NOT_FINITE),
    (_STAMP, Kind.STAMP),
)


def kind_of(cell: str) -> Kind:
    """Return the type of a cell."""
    if not cell:
        return Kind.EMPTY
    return next((kind for pattern, kind in _PATTERNS if pattern.fullmatch(cell)), Kind.WORD)


def read_lines(path: Path) -> list[str]:
    """Return the lines of a text in UTF-8, UTF-16 with its mark, or else Latin-1.

    Raises:
        ImportFileError: it is no text.
        OSError: it cannot be read.

    """
    data = path.read_bytes()
    encoding = next((name for mark, name in _ENCODINGS if data.startswith(mark)), 'utf-8')
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError:
        text = data.decode('latin-1')
    if '\0' in text:
        raise ImportFileError(f'{path} is no text; of binary files only .mat is read')
    return re.split(r'\r\n|\r|\n', text)


def without_comment(line: str) -> str:
    """Return the line up to a # that starts a comment; '' for a line that starts with %."""
    if '#' in line or '%' in line:
        line = _COMMENT.sub('', line)
    return line.strip(' ')


def cells_of(line: str, delimiter: str | None) -> list[str]:
    """Return the cells of a line; a cell in quotation marks may hold the delimiter."""
    if '"' in line:
        if delimiter is None:
            line = line.replace('\t', ' ')
        try:
            cells = next(csv.reader([line], delimiter=delimiter or ' ', skipinitialspace=True), [])
        except csv.Error:
            cells = [line]
    else:
        cells = line.split(delimiter)
    return [cell.strip() for cell in cells]
