# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Measure the live rig: CPU share, latency from block to indicator, real-time factor, losses.

    python benchmarks/live_rig.py

Numbers are of one run each on a shared machine: compare them within a run, not across machines.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from rotor_interfaces import topics
from rotor_interfaces.messages import from_cdr
from rotor_interfaces.topics import Topic
from rotor_recording.reading import RecordedMessage, Recording

SCENARIO = 'climb_dive'


def run(*options: str) -> tuple[dict[str, Any], Recording]:
    """Run the scenario live; return its summary and its recording."""
    folder = tempfile.mkdtemp(prefix='rotor-rig-benchmark-')
    done = subprocess.run(
        [
            *(sys.executable, '-m', 'rotor_bringup', 'run', SCENARIO, '--record', folder, '--json'),
            *options,
        ],
        capture_output=True,
        text=True,
        check=True,
    )
    summary = json.loads(done.stdout)
    return summary, Recording(Path(summary['recording']))


def messages(recording: Recording, topic: Topic) -> list[RecordedMessage]:
    """Return all messages of a topic."""
    return list(recording.messages([recording.find(topic) or '']))


def latencies_ms(recording: Recording) -> NDArray[np.float64]:
    """Return for each window the wall time from its last block to its indicators, ms.

    Both as the recorder received them; the window's last block is the one that holds the
    window's last sample or, where the resampling needs its margin, the one after it.
    """
    blocks = messages(recording, topics.WAVEFORM)
    starts = np.array([block.log_time_ns for block in blocks])
    received = np.array([block.publish_time_ns for block in blocks])
    found = []
    for window in messages(recording, topics.INDICATORS):
        earlier = received[received <= window.publish_time_ns]
        last = max(int(np.searchsorted(starts, window.log_time_ns, 'right')) - 1, 0)
        complete = received[min(last + 1, len(earlier) - 1)]
        found.append((window.publish_time_ns - complete) * 1e-6)
    return np.array(found)


def cpu_share(recording: Recording) -> float:
    """Return the simulator's CPU time over wall time between its first and last report."""
    reports = []
    for message in messages(recording, topics.DIAGNOSTICS):
        for status in from_cdr(message.data, message.type).status:
            values = {value.key: value.value for value in status.values}
            if 'process time [s]' in values:
                reports.append((message.publish_time_ns * 1e-9, float(values['process time [s]'])))
    (wall_0, cpu_0), (wall_1, cpu_1) = reports[0], reports[-1]
    return (cpu_1 - cpu_0) / (wall_1 - wall_0)


def main() -> None:
    """Run three ways and print one table."""
    table = Table('run', 'real-time factor', 'simulator CPU', 'latency p50', 'p99', 'lost', 'late')
    for name, options in (
        ('processes, rate 1', ()),
        ('processes, rate 0', ('--rate', '0')),
        ('composed, rate 0', ('--rate', '0', '--composed')),
    ):
        summary, recording = run(*options)
        latency = latencies_ms(recording)
        table.add_row(
            name,
            f'{summary["real_time_factor"]:.2f}',
            f'{100 * cpu_share(recording):.0f} %',
            f'{np.percentile(latency, 50):.1f} ms',
            f'{np.percentile(latency, 99):.1f} ms',
            str(summary['lost_samples']),
            str(summary['late_blocks']),
        )
    Console().print(table)


if __name__ == '__main__':
    main()
