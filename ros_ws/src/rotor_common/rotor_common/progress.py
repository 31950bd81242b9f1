# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A progress bar, and a clear message on Ctrl-C."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import typer
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)

from rotor_common import interrupt
from rotor_common.console import console, say
from rotor_common.exit_code import ExitCode

OnProgress = Callable[[int, int], None]
"""Takes the points done and the points in total."""


def progress_bar(*columns: ProgressColumn, quiet: bool) -> Progress:
    """Return a bar on the console; hidden if `quiet` or if that is no terminal."""
    is_hidden = quiet or not console.is_terminal
    return Progress(*columns, console=console, disable=is_hidden, transient=True)


@contextmanager
def interruptible(
    what: str,
    cache: Path | None,
    *,
    quiet: bool,
    what_is_done: str = 'points',
) -> Iterator[OnProgress]:
    """Show the progress of `what` with the remaining time; on Ctrl-C say what is done, exit 130.

    Nothing is shown if `quiet` or if the console is no terminal.
    """
    done = total = 0
    bar = progress_bar(
        TextColumn('{task.description}'),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn(f'{what_is_done},'),
        TimeRemainingColumn(),
        TextColumn('left'),
        quiet=quiet,
    )

    def advance(points_done: int, points_in_total: int) -> None:
        nonlocal done, total
        done, total = points_done, points_in_total
        bar.update(task, completed=done, total=total)

    try:
        with bar, interrupt.interruptible(signal.SIGINT):
            task = bar.add_task(what, total=None)
            yield advance
    except interrupt.Interrupted:
        kept = (
            'give --cache DIR to keep them the next time'
            if cache is None
            else f'they are kept in {cache}, and the same command goes on from there'
        )
        so_far = 'nothing is done yet'
        if done:
            so_far = f'{done} of {total} {what_is_done} are done; {kept}'
        say(f'stopped: {so_far}')
        raise typer.Exit(ExitCode.INTERRUPTED) from None
