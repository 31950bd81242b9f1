# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Feed the rig with what nobody should send: blocks, views, recordings, scenarios, foreign files.

    python benchmarks/fuzz.py                        10 000 inputs of each kind
    python benchmarks/fuzz.py blocks --inputs 100000 --seed 7

Every input follows from seed, kind and number, so that a finding can be made again by --first.
It ends with exit code 1 if an input raised what is not the rig's own, took more than 2 s of CPU
time, or the process grew beyond 1.5 GiB.
"""

import argparse
import collections
import json
import logging
import signal
import sys
import time
import traceback
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import fuzz_blocks
import fuzz_files
import fuzz_foreign
import numpy as np
from numpy.random import Generator, default_rng
from rich.console import Console
from rich.table import Table

LONGEST_S = 2.0
"""CPU time of one input."""
GIVEN_UP_S = 20.0
LARGEST_MIB = 1536.0
RUN_LENGTH = 100


class Consumer(Protocol):
    """What takes the inputs of one kind."""

    def start(self) -> None:
        """Begin anew; called before every hundredth input."""

    def feed(self, rng: Generator) -> None:
        """Make one input and take it; raises whatever the rig lets through."""


class HangError(BaseException):
    """An input that was given up, raised by the timer wherever the program is."""


def peak_mib() -> float:
    """Return the most memory that this process had; getrusage begins with its parent's."""
    status = Path('/proc/self/status').read_text()
    return int(status.partition('VmHWM:')[2].split()[0]) / 1024


@dataclass
class Findings:
    """What a kind of input has brought to light."""

    inputs: int = 0
    foreign: collections.Counter[str] = field(default_factory=collections.Counter)
    examples: dict[str, tuple[int, str]] = field(default_factory=dict)
    slow: list[int] = field(default_factory=list)
    slowest: tuple[float, int] = (0.0, -1)
    peak_mib: float = 0.0

    @property
    def is_good(self) -> bool:
        """Whether nothing was found."""
        return not self.foreign and not self.slow and self.peak_mib < LARGEST_MIB


KINDS: dict[str, Callable[[], Consumer]] = {
    'blocks': fuzz_blocks.Blocks,
    'views': fuzz_blocks.Views,
    'recordings': fuzz_files.Recordings,
    'repeats': fuzz_files.Repeats,
    'sqlite': fuzz_foreign.Sqlite,
    'texts': fuzz_foreign.Texts,
    'matlab': fuzz_foreign.Matlab,
    'scenarios': fuzz_files.Scenarios,
}


def fuzz(kind: str, consumer: Consumer, *, first: int, inputs: int, seed: int) -> Findings:
    """Feed a consumer with the inputs `first` to `first + inputs` of a kind."""
    findings = Findings()
    start = first - first % RUN_LENGTH
    for number in range(start, first + inputs):
        if number % RUN_LENGTH == 0:
            consumer.start()
        rng = default_rng([seed, *kind.encode(), number])
        begun_s = time.process_time()
        signal.setitimer(signal.ITIMER_PROF, GIVEN_UP_S)
        try:
            consumer.feed(rng)
        except (HangError, Exception) as error:  # noqa: BLE001 - whatever it is, it is a finding
            frames = traceback.extract_tb(error.__traceback__)
            place = next((f for f in reversed(frames) if 'ros_ws' in f.filename), frames[-1])
            where = f'{type(error).__name__} at {place.filename.rpartition("/")[2]}:{place.lineno}'
            findings.foreign[where] += 1
            findings.examples.setdefault(where, (number, traceback.format_exc(limit=-6)))
            consumer.start()  # it is in an unknown state
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0.0)
        taken_s = time.process_time() - begun_s
        findings.slowest = max(findings.slowest, (taken_s, number))
        if taken_s > LONGEST_S:
            findings.slow.append(number)
        findings.inputs += number >= first
    findings.peak_mib = peak_mib()
    return findings


def _give_up(*_: object) -> None:
    raise HangError


def main() -> int:
    """Feed, print what was found, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0] if __doc__ else None)
    parser.add_argument('kinds', nargs='*', help=f'{", ".join(KINDS)}; default: all')
    parser.add_argument('--inputs', type=int, default=10_000, help='inputs of each kind')
    parser.add_argument('--first', type=int, default=0, help='number of the first input')
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--json', type=Path, help='file for the figures of each kind')
    asked = parser.parse_args()
    if unknown := set(asked.kinds) - set(KINDS):
        parser.error(f'{unknown.pop()} is no kind of input; known: {", ".join(KINDS)}')
    signal.signal(signal.SIGPROF, _give_up)
    warnings.simplefilter('ignore')
    np.seterr(all='ignore')
    logging.disable()
    table = Table('kind', 'inputs', 'foreign exceptions', 'over 2 s', 'slowest [s]', 'peak [MiB]')
    console = Console()
    good = True
    figures = {}
    for kind in asked.kinds or KINDS:
        found = fuzz(kind, KINDS[kind](), first=asked.first, inputs=asked.inputs, seed=asked.seed)
        good &= found.is_good
        for where, (number, text) in found.examples.items():
            console.out(f'{kind} {number}: {where}, {found.foreign[where]} times\n{text}')
        for number in found.slow:
            console.out(f'{kind} {number}: more than {LONGEST_S:g} s')
        seconds, number = found.slowest
        figures[kind] = {
            'inputs': found.inputs,
            'foreign exceptions': found.foreign.total(),
            f'over {LONGEST_S:g} s': len(found.slow),
            'slowest [CPU s]': round(seconds, 2),
            'most memory [MiB]': round(found.peak_mib),
        }
        table.add_row(
            kind, str(found.inputs), str(found.foreign.total()), str(len(found.slow)),
            f'{seconds:.2f} (input {number})', f'{found.peak_mib:.0f}',
        )  # fmt: skip
    console.print(table)
    if asked.json:
        asked.json.write_text(json.dumps(figures, indent=1) + '\n', 'utf-8')
    return 0 if good else 1


if __name__ == '__main__':
    sys.exit(main())
