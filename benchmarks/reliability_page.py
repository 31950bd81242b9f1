# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""docs/reliability.md, written from the figures in docs/reliability.json."""

from collections.abc import Iterator, Mapping
from typing import Any

HEAD = """# What the rig promises, and what was measured

`python benchmarks/reliability.py --page` writes this page from
[reliability.json](reliability.json), which holds full runs of `python benchmarks/reliability.py`.
Its quick half, `--quick`, is part of CI. On your machine,
`python benchmarks/reliability.py kills signals --out mine.json` gives the figures of these two.

Measured on {machines}. Each part says how long it took, and its load: how many processes wanted one
of the two cores in its last 15 minutes. Times are those of a busy machine.
"""

TAIL = """
## What is not promised

- A program that runs as the same user can end any process, fill the disk, and find the topics of a
  run; [security.md](security.md) says what SROS 2 adds.
- The recorder keeps an index of the chunks that it has written in memory until it closes the file:
  this is its growth in the table of the hour.
- A view of a recording whose indicators must be computed, as of an imported one, took 324 MiB for
  20 minutes, and 9 kB more for each further second.
- The rerun viewer holds what it shows. A picture of a long flight is therefore drawn from a part of
  the data ([view.md](view.md)).
"""


def page(results: Mapping[str, Any], parts: Mapping[str, Any]) -> str:
    """Return the page; a part without figures is said not to have been run."""
    machines = sorted({result['machine'] for result in results.values()})
    lines = [HEAD.format(machines='; '.join(machines))]
    for name, part in parts.items():
        lines += [f'\n## {part.title}\n', part.promise, '']
        lines += _part(name, results[name]) if name in results else ['Not run in full.']
    return '\n'.join([*lines, TAIL])


def _part(name: str, result: Mapping[str, Any]) -> Iterator[str]:
    held = f'**Did not hold:** {result["broken"]}.' if result['broken'] else 'It held.'
    minutes = max(round(result['seconds'] / 60), 1)
    yield f'{held} (`{name}`, {minutes} min, load {result["load"]})'
    rows = list(_rows(result.get('figures', {})))
    if rows:
        yield from ('', '| figure | measured |', '| --- | --- |', *rows)


def _rows(figures: Mapping[str, Any]) -> Iterator[str]:
    for what, value in figures.items():
        if isinstance(value, Mapping):  # of processes and signals
            for process, outcomes in value.items():
                text = '; '.join(f'{signal}: {outcome}' for signal, outcome in outcomes.items())
                yield f'| {process} | {text} |'
        else:
            text = ', '.join(map(str, value)) if isinstance(value, list) else str(value)
            yield f'| {what} | {text or "nothing"} |'
