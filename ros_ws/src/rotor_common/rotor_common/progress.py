# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A progress bar, and a clear message on Ctrl-C."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from rotor_common import interrupt
from rotor_common.exit_code import ExitCode

OnProgress = Callable[[int, int], None]
"""Takes the points done and the points in total."""


@contextmanager
def interruptible(
    console: Console,
    what: str,
    cache: Path | None,
    *,
    quiet: bool,
    what_is_done: str = 'points',
) -> Iterator[OnProgress]:
    """Show the progress of `what` with the remaining time; on Ctrl-C say what is done, exit 130.

    Nothing is shown where `quiet` or where the console is no terminal.
    """
    done = total = 0
    bar = Progress(
        TextColumn('{task.description}'),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn(f'{what_is_done},'),
        TimeRemainingColumn(),
        TextColumn('left'),
        console=console,
        disable=quiet or not console.is_terminal,
        transient=True,
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
        console.print(f'stopped: {so_far}', soft_wrap=True, highlight=False, markup=False)
        raise typer.Exit(ExitCode.INTERRUPTED) from None
