# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""docs/reliability.md, written from the figures in docs/reliability.json."""

import re
from collections.abc import Iterator, Mapping
from typing import Any

HEAD = """# What the rig promises, and what was measured

`python benchmarks/reliability.py --page` writes this page from
[reliability.json](reliability.json), which holds full runs of `python benchmarks/reliability.py`.
Its quick half, `--quick`, is part of CI. On your machine,
`python benchmarks/reliability.py kills signals --out mine.json` gives the figures of these two.

Measured on {machines}.
Each part says how long it took, and its load: how many processes wanted one of the two cores in its
last 15 minutes. Times are those of a busy machine. "File closed" is a recording with its index and
metadata, "file readable" one that its recorder could not finish.
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
    found = {result['machine'] for result in results.values()}
    machines = sorted(re.sub(r'one core of (\d+)', r'\1 cores', each) for each in found)
    lines = [HEAD.format(machines='; '.join(machines))]
    for name, part in parts.items():
        lines += [f'\n## {part.title}\n', part.promise, '']
        lines += _part(name, results[name]) if name in results else ['Not run in full.']
    return '\n'.join([*lines, TAIL])


def _part(name: str, result: Mapping[str, Any]) -> Iterator[str]:
    held = f'**Did not hold:** {result["broken"]}.' if result['broken'] else 'It held.'
    minutes = max(round(result['seconds'] / 60), 1)
    yield f'{held} (`{name}`, {minutes} min, load {result["load"]})'
    figures = result.get('figures', {})
    plain = {what: value for what, value in figures.items() if not isinstance(value, Mapping)}
    if plain:
        yield from ('', '| figure | measured |', '| --- | --- |')
        for what, value in plain.items():
            text = ', '.join(map(str, value)) if isinstance(value, list) else str(value)
            yield f'| {what} | {text or "nothing"} |'
    for value in figures.values():
        if isinstance(value, Mapping):
            yield from ('', *_table(value))


def _table(outcomes: Mapping[str, Mapping[str, str]]) -> Iterator[str]:
    """Yield the table of what became of the run, by signal and process."""
    signals = list(dict.fromkeys(signal for found in outcomes.values() for signal in found))
    yield f'| sent to | {" | ".join(signals)} |'
    yield f'| --- {"| --- " * len(signals)}|'
    for process, found in outcomes.items():
        cells = [found.get(signal, '-') for signal in signals]
        yield f'| {process} | {" | ".join(cells)} |'
