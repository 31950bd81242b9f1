# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Measure how long a live run takes to begin and, after Ctrl-C, to end.

    python benchmarks/start_and_end.py

With the rig's Fast DDS profile and with Fast DDS's own times, in turn: compare within a run.
"""

import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

ROUNDS = 5
BYTES_OF_A_RUN = 200_000
"""So much is recorded in the first third of a second."""
CASES = {'profile of the rig': {}, 'times of Fast DDS': {'FASTRTPS_DEFAULT_PROFILES_FILE': ''}}


def start_and_end(environment: dict[str, str]) -> tuple[float, float]:
    """Return the time from the command to recorded samples, and from Ctrl-C to the end, s."""
    with tempfile.TemporaryDirectory(prefix='rotor-rig-benchmark-') as folder:
        started = time.monotonic()
        rig = subprocess.Popen(
            [sys.executable, '-m', 'rotor_bringup', 'run', '--record', folder],
            env=os.environ | environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        while not any(
            path.stat().st_size > BYTES_OF_A_RUN for path in Path(folder).glob('*/*.active')
        ):
            if rig.poll() is not None:
                raise SystemExit('the run ended before it began')
            time.sleep(0.02)
        began = time.monotonic()
        rig.send_signal(signal.SIGINT)
        rig.wait()
        return began - started, time.monotonic() - began


def main() -> None:
    """Measure both in turn and print a table and JSON."""
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in CASES}
    for _ in range(ROUNDS):
        for name, environment in CASES.items():
            found[name].append(start_and_end(environment))
    table = Table('median of five, s', 'to the first samples', 'from Ctrl-C to the end')
    medians = {
        name: [round(statistics.median(column), 2) for column in zip(*times, strict=True)]
        for name, times in found.items()
    }
    for name, both in medians.items():
        table.add_row(name, *map(str, both))
    console = Console()
    console.print(table)
    console.print_json(json.dumps(medians))


if __name__ == '__main__':
    main()
