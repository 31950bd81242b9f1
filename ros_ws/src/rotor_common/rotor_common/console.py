# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Output of `rotor-rig`: tables of any width, on streams that may be closed or full."""

import contextlib
import errno
import io
import json
import os
import shutil
import sys
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from rich.console import Console
from rich.table import Column, Table

from rotor_common.errors import RigError
from rotor_common.exit_code import ExitCode
from rotor_common.plain_data import without_nan

console = Console(stderr=True)
"""For messages to the user; results go to standard output."""

NARROWEST = 20
NARROWEST_BOX = 80
"""Least columns for a table, and for the boxes of a help page."""


class OutputError(RigError):
    """Standard output cannot be written, as on a full disk."""


class _Output(io.TextIOWrapper):
    """Standard output: a failed write is an error, but a pipe closed by its reader ends quietly."""

    def write(self, text: str) -> int:
        with _written():
            return super().write(text)

    def flush(self) -> None:
        with _written():
            super().flush()


class _Remarks(io.TextIOWrapper):
    """Standard error: a failed write is ignored, so that it never stops the work."""

    def write(self, text: str) -> int:
        with contextlib.suppress(OSError):
            super().write(text)
        return len(text)

    def flush(self) -> None:
        with contextlib.suppress(OSError):
            super().flush()


@contextlib.contextmanager
def _written() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        # what is still in the buffer would be tried again when Python ends
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        if error.errno == errno.EPIPE:
            sys.exit(ExitCode.DONE)  # as `head` leaves after the lines it wants
        raise OutputError(f'the result cannot be written: {error.strerror}') from None


def open_standard_streams() -> None:
    """Give this process writable standard streams; a closed one is opened on /dev/null.

    Otherwise the next file opened would get the closed descriptor, and a character that the
    terminal's encoding lacks would end the command: it is written as an escape.
    """
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free one, which is this
    encodings = [getattr(stream, 'encoding', None) for stream in (sys.stdout, sys.stderr)]
    sys.stdout, sys.stderr = (
        kind(
            open(descriptor, 'wb', closefd=False),  # noqa: SIM115 - for the whole process
            encoding=encoding or 'utf-8',
            errors='backslashreplace',
            line_buffering=os.isatty(descriptor) or kind is _Remarks,
        )
        for kind, descriptor, encoding in zip((_Output, _Remarks), (1, 2), encodings, strict=True)
    )


def allow_any_width() -> None:
    """Let a help page fit the terminal; to be called before typer is imported.

    A width below NARROWEST, such as a script's COLUMNS=0, is ignored. Below NARROWEST_BOX help
    pages have no boxes, which would cut the names of options.
    """
    columns = os.environ.get('COLUMNS', '')
    if columns.isdecimal() and int(columns) < NARROWEST:
        del os.environ['COLUMNS']
    if shutil.get_terminal_size().columns < NARROWEST_BOX:
        os.environ['TYPER_USE_RICH'] = '0'


def printable(text: str) -> str:
    """Return a text whose control characters, as in a file's name, are written as escapes."""
    return ''.join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def folding_table(*headers: str, **style: Any) -> Table:
    """Return a table whose cells are folded, never cut, where the terminal is narrow."""
    return Table(*(Column(header, overflow='fold') for header in headers), **style)


def say(text: str, style: str | None = None) -> None:
    """Print a message to the user as it is: not folded, not highlighted."""
    console.print(text, style=style, soft_wrap=True, highlight=False, markup=False)


def warn(sentences: Iterable[str]) -> None:
    """Print warnings to the user."""
    for sentence in sentences:
        say(f'warning: {printable(sentence)}', 'yellow')


def print_json(data: Mapping[str, Any]) -> None:
    """Print a result for programs; NaN and infinity become null."""
    sys.stdout.write(json.dumps(without_nan(dict(data)), indent=2) + '\n')
