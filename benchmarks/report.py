# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""What the benchmarks share: one core, CPU time, tables on the screen and in a page."""

import gc
import importlib.metadata
import os
import platform
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

TableRows = Sequence[Sequence[str]]
"""Texts of a table, the headings first."""


def use_one_core() -> None:
    """Keep this process, and threads that it starts from here on, on one core."""
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def timed(run: Callable[[], Any]) -> tuple[float, Any]:
    """Return the CPU seconds that this process took, and the result."""
    gc.collect()
    started = time.process_time()
    result = run()
    return time.process_time() - started, result


def machine() -> str:
    """Return processor, versions and day in one line."""
    information = Path('/proc/cpuinfo').read_text('utf-8').splitlines()
    named = [line.split(':', 1)[1].strip() for line in information if line.startswith('model name')]
    wide = ['AVX-512'] if any('avx512f' in line for line in information) else []
    packages = ('numpy', 'numba', 'llvmlite')
    versions = [f'{name} {importlib.metadata.version(name)}' for name in packages]
    python = f'Python {platform.python_version()}'
    processor = ' '.join([*named[:1], *wide]) or platform.machine()
    cores = f'one core of {os.cpu_count()}'
    return ', '.join([processor, cores, python, *versions, time.strftime('%Y-%m-%d')])


def wide_console() -> Console:
    """Return a console that does not squeeze a table of many columns."""
    return Console(width=max(Console().width, 180))


def show(console: Console, rows: TableRows) -> None:
    """Print a table under the machine."""
    table = Table(*rows[0], title=machine(), box=None)
    for row in rows[1:]:
        table.add_row(*row)
    console.print(table)


def write_markdown(page: Path, mark: str, rows: TableRows) -> None:
    """Put the table between the comments `mark: begin` and `mark: end` of a page."""
    begin, end = f'<!-- {mark}: begin -->', f'<!-- {mark}: end -->'
    before, rest = page.read_text('utf-8').split(begin)
    after = rest.split(end)[1]
    lines = [rows[0], ['---'] * len(rows[0]), *rows[1:]]
    table = ['| ' + ' | '.join(line) + ' |' for line in lines]
    text = '\n'.join([before + begin, f'{machine()}.', '', *table, end + after])
    page.write_text(text, 'utf-8')
