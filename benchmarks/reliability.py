# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Measure what docs/reliability.md promises; write the figures, and the page from them.

    python benchmarks/reliability.py --quick          small, what no test does: two minutes
    python benchmarks/reliability.py kills signals    these parts in full
    python benchmarks/reliability.py                  all of it: half a day

Every part puts its figures into --out (default: reliability.json here) and is judged; the exit code
is 1 if a promise did not hold. --page writes docs/reliability.md from docs/reliability.json.
"""

import argparse
import functools
import json
import os
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import reliability_flights as flights
import reliability_messages as talk
from reliability_page import page
from report import machine
from rich.console import Console

DOCS = Path(__file__).resolve().parent.parent / 'docs'


@dataclass(frozen=True)
class Part:
    """One promise and how it is put to the test."""

    title: str
    promise: str
    run: Callable[..., dict[str, Any]]


FUZZED = {
    'blocks': 'messages on the wire, taken by the monitor and the recorder',
    'views': 'the same, taken by the view',
    'recordings': 'files read, analyzed, verified and recovered',
    'scenarios': 'YAML files',
    'repeats': 'recordings whose scenario is simulated again',
    'sqlite': '.db3 bags',
    'texts': 'text files to import',
    'matlab': '.mat files to import',
}
PARTS = {
    'kills': Part(
        'Kill -9 of the recorder',
        'A recording survives a killed recorder: it loses at most the last quarter second and one '
        'block, has no gap and can be read directly; `rotor-rig recover` turns it into a complete '
        'file.',
        flights.kills,
    ),
    'signals': Part(
        'Every process, every signal',
        'Whatever ends one process, the rig shuts down cleanly: no process is left behind, no '
        'traceback is shown, and the recording is readable. A process that is stopped and '
        'continued ends nothing.',
        flights.signals,
    ),
    'rogue_blocks': Part(
        'Malformed blocks',
        'No malformed block ends the monitor or the recorder: it is refused and counted, and the '
        'next valid block is accepted.',
        talk.rogue_blocks,
    ),
    'rogue_stranger': Part(
        'Foreign messages on every topic',
        'Nothing that another node publishes on the topics of a running rig, including the hidden '
        'topics of the run, ends the run or changes a block of its recording; messages that '
        'cannot belong to the run are refused and counted.',
        talk.rogue_stranger,
    ),
    **{
        f'fuzz_{kind}': Part(
            f'Fuzz: {kind}',
            f'No hostile input ({what}) raises an unexpected exception, takes more than 2 s of CPU '
            'time, or takes memory without bound.',
            functools.partial(talk.fuzz, kind),
        )
        for kind, what in FUZZED.items()
    },
    'two_rigs': Part(
        'Two rigs in one domain',
        'Of two rigs in one ROS domain, one runs and the other is refused with an error message, '
        'or they run one after the other; neither affects the run of the other.',
        flights.two_rigs,
    ),
    'sockets': Part(
        'Sockets',
        'Every UDP socket and every listening socket of a rig is bound to the loopback interface.',
        flights.sockets,
    ),
    'cheats': Part(
        'Detectors that cheat',
        'A detector under test only ever receives anonymised blocks; every way of cheating that '
        'the test detector tries fails.',
        talk.cheats,
    ),
    'hour': Part(
        'An hour at rate 1',
        'In an hour of wall time nothing is lost, no process opens more files or threads, and '
        'none grows by more than 24 MiB; the commands that read the recording take at most '
        '300 MiB.',
        flights.hour,
    ),
}


QUICK = ('rogue_blocks', 'rogue_stranger', 'hour')
"""Tests are the quick half of the others: test_signals.py, test_fuzz.py, test_two_rigs.py."""


def main() -> int:
    """Run the parts asked for and return the exit code."""
    parser = argparse.ArgumentParser(description='Measure what docs/reliability.md promises.')
    parser.add_argument('parts', nargs='*', help=f'{", ".join(PARTS)}; default: all')
    parser.add_argument('--quick', action='store_true', help='everything small')
    parser.add_argument('--out', type=Path, default=Path('reliability.json'))
    parser.add_argument('--page', action='store_true', help='write the page of the docs, no more')
    parser.add_argument('--inputs', type=int, default=100_000, help='of each kind of fuzz')
    asked = parser.parse_args()
    if unknown := set(asked.parts) - set(PARTS):
        parser.error(f'{unknown.pop()} is no part; known: {", ".join(PARTS)}')
    if asked.page:
        results = json.loads((DOCS / 'reliability.json').read_text('utf-8'))
        (DOCS / 'reliability.md').write_text(page(results, PARTS), 'utf-8')
        return 0
    console = Console()
    results = json.loads(asked.out.read_text('utf-8')) if asked.out.exists() else {}
    good = True
    for name in asked.parts or (QUICK if asked.quick else PARTS):
        with tempfile.TemporaryDirectory(prefix='rotor-rig-reliability-') as folder:
            began = time.monotonic()
            result: dict[str, Any] = {'broken': ''}
            try:
                extra = {'inputs': asked.inputs} if name.startswith('fuzz_') else {}
                result['figures'] = PARTS[name].run(Path(folder), quick=asked.quick, **extra)
            except flights.BrokenPromise as broken:
                result |= {'broken': str(broken), 'figures': broken.figures}
            except Exception:  # noqa: BLE001 - a part that fails must not end the others
                result['broken'] = traceback.format_exc()
            result |= {
                'quick': asked.quick,
                'seconds': round(time.monotonic() - began),
                'load': round(os.getloadavg()[2], 1),
                'machine': machine(),
            }
        good &= not result['broken']
        console.print({name: result})
        results[name] = result
        asked.out.write_text(json.dumps(results, indent=1) + '\n', 'utf-8')
    return 0 if good else 1


if __name__ == '__main__':
    sys.exit(main())
