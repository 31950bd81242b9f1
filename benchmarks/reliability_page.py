# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""docs/reliability.md, written from the figures in docs/reliability.json."""

import re
from collections.abc import Iterator, Mapping
from typing import Any

HEAD = """# Reliability

This page lists what the rig guarantees and how each guarantee was tested.

`python benchmarks/reliability.py --page` generates it from [reliability.json](reliability.json),
the results of full runs of `python benchmarks/reliability.py`. A quick version, `--quick`, runs in
CI. To repeat two of the tests on your machine:
`python benchmarks/reliability.py kills signals --out mine.json`.

Measured on {machines}.
Each section states how long its test took and the load average over its last 15 minutes. Times
were measured on a busy machine. "File closed" means a recording with its index and metadata,
"file readable" one that its recorder could not finish.
"""

TAIL = """
## Known limits

- A program that runs as the same user can kill any process, fill the disk, and find the topics of a
  run; [security.md](security.md) describes what SROS 2 adds.
- The recorder keeps the index of the chunks that it has written in memory until it closes the file.
  This is why its memory grows in the table of the hour.
- Viewing a recording whose indicators must be computed, such as an imported one, took 324 MiB for
  20 minutes, and 9 kB more for each further second.
- The rerun viewer keeps what it shows in memory. A screenshot of a long flight is therefore drawn
  from part of the data ([view.md](view.md)).
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
