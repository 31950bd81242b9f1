# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Simulates flights and writes each to one self-describing MCAP file, complete or absent."""

import hashlib
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Self

from maneuver_gen.load_grid import load_grid
from rotor_bench.dataset.cdr import JointStateBytes, WaveformBytes, load_bytes
from rotor_bench.dataset.stream import fly
from rotor_bench.dataset.suite import Flight
from rotor_common.constants import LOAD_STEP_NS
from rotor_interfaces import messages, topics
from rotor_interfaces.messages import OFFLINE, sample_stamp_ns
from rotor_recording.recording import RecordingWriter
from rotor_sim.messages import config_message
from rotor_sim.stream.simulator import SimulatedBlock

FLIGHTS = 'flights'
UNFINISHED = '.unfinished'
_SHAFT = ('shaft',)


Row = dict[str, Any]
"""The row of one flight in the manifest: its file and its labels."""


def file_of(flight: Flight) -> str:
    """Return the file of a flight, relative to the folder of the data set."""
    return f'{FLIGHTS}/{flight.name}.mcap'


def write_flights(
    flights: Sequence[Flight], folder: Path, versions: Mapping[str, str]
) -> list[Row]:
    """Fly equally long flights in lock-step and write a file for each into the data set `folder`.

    Files get their names when all of them are whole; returns their rows of the manifest.
    `versions`, stored in the files, are those of the calling process, so that the bytes do not
    depend on the worker.

    Raises RigError if a flight cannot be flown or written; then there is no new file.
    """
    (folder / FLIGHTS).mkdir(parents=True, exist_ok=True)
    (folder / UNFINISHED).mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder / UNFINISHED) as place:
        paths = [Path(place) / Path(file_of(flight)).name for flight in flights]
        with ExitStack() as stack:
            files = [
                stack.enter_context(_FlightFile(flight, path, versions))
                for flight, path in zip(flights, paths, strict=True)
            ]
            for blocks in fly(flights, flights[0].suite.block_samples):
                for file, block in zip(files, blocks, strict=True):
                    file.write(block)
        rows = [_row(flight, path) for flight, path in zip(flights, paths, strict=True)]
        for path, row in zip(paths, rows, strict=True):
            path.replace(folder / row['file'])
    return rows


def sha256(path: Path) -> str:
    """Return the SHA-256 of a file."""
    with path.open('rb') as file:
        return hashlib.file_digest(file, 'sha256').hexdigest()


def _row(flight: Flight, path: Path) -> Row:
    return {
        'file': file_of(flight),
        'size_bytes': path.stat().st_size,
        'sha256': sha256(path),
        'machine': flight.machine,
        'number': flight.number,
        'role': flight.role,
        'split': flight.split,
        'duration_s': flight.duration_s,
        **flight.labels,
    }


def remove_unfinished(folder: Path) -> None:
    """Remove the files that interrupted writers left."""
    shutil.rmtree(folder / UNFINISHED, ignore_errors=True)


class _FlightFile:
    """Writes the simulator's output for one flight, block after block."""

    def __init__(self, flight: Flight, path: Path, versions: Mapping[str, str]) -> None:
        scenario = flight.scenario
        self._epoch_ns = scenario.epoch_ns
        self._rate_hz = scenario.rate_hz
        self._load = self._load_messages(flight)
        self._next_load = next(self._load)
        self._waveform = WaveformBytes()
        self._shaft = JointStateBytes(_SHAFT, velocity=True)
        self._truth: JointStateBytes | None = None
        config = {'scenario': scenario.plain(), 'versions': dict(versions)}
        # noise hardly compresses, and trying costs as much as all the rest of writing
        self._writer = RecordingWriter.single_file(path, config=config, compress=False)
        message = config_message(OFFLINE, config['scenario'], versions)
        self._writer.write(topics.CONFIG, messages.to_cdr(message), self._epoch_ns, self._epoch_ns)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._writer.close()

    def write(self, block: SimulatedBlock) -> None:
        """Write the messages of one block: the load up to its end, waveform, shaft and truth."""
        stamp_ns = sample_stamp_ns(self._epoch_ns, block.first_sample, self._rate_hz)
        end = block.first_sample + len(block.rows)
        end_ns = sample_stamp_ns(self._epoch_ns, end, self._rate_hz)
        while self._next_load[0] <= end_ns:
            self._writer.write(topics.MANEUVER_LOAD, self._next_load[1], *[self._next_load[0]] * 2)
            self._next_load = next(self._load)
        if self._truth is None:
            self._truth = JointStateBytes(list(block.truth))
        turn = (block.shaft_angle_rad,), (block.shaft_speed_rad_s,)
        for topic, data in (
            (topics.WAVEFORM, self._waveform(stamp_ns, block.rows)),
            (topics.SHAFT, self._shaft(stamp_ns, *turn)),
            (topics.TRUTH, self._truth(stamp_ns, list(block.truth.values()))),
        ):
            self._writer.write(topic, data, stamp_ns, stamp_ns)

    def _load_messages(self, flight: Flight) -> Iterator[tuple[int, bytes]]:
        """Yield stamps and bytes of the whole load grid."""
        points = load_grid(flight.scenario.maneuver, flight.duration_s)
        stamps = [self._epoch_ns + k * LOAD_STEP_NS for k in range(len(points))]
        yield from zip(stamps, load_bytes(stamps, points), strict=True)
