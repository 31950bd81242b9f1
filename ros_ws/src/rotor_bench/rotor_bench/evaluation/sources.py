# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Where the blocks of the flights under test come from: the simulator, or recordings."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from rotor_bench.dataset.stream import fly
from rotor_bench.dataset.suite import Flight
from rotor_bench.dataset.write import file_of
from rotor_bench.errors import DatasetError
from rotor_common.errors import RigError, WireError
from rotor_interfaces.waveform import WaveformBlock
from rotor_recording.reading import Recording, waveform_blocks
from vibration_monitor.block_columns import first_sample_of


class Source(Protocol):
    """Where the blocks of flights come from."""

    def fly(self, flights: Sequence[Flight]) -> Iterator[Sequence[WaveformBlock]]:
        """Yield the next block of each flight until they end together."""


class Simulated:
    """Flights are simulated as they are needed."""

    def fly(self, flights: Sequence[Flight]) -> Iterator[list[WaveformBlock]]:
        """Yield the output of the sensors, block after block."""
        for blocks in fly(flights, flights[0].suite.block_samples):
            yield [WaveformBlock(0, block.rows) for block in blocks]


@dataclass(frozen=True)
class Stored:
    """Flights are read from the recordings of a data set."""

    folder: Path

    def fly(self, flights: Sequence[Flight]) -> Iterator[tuple[WaveformBlock, ...]]:
        """Yield what was recorded of each flight, block after block.

        Raises:
            RecordingError: a recording that cannot be read.
            DatasetError: one that is damaged, has a gap, or is not as long as its flight.

        """
        streams = [_whole(self.folder / file_of(flight), flight) for flight in flights]
        try:
            yield from zip(*streams, strict=True)
        except RigError:
            raise
        except ValueError:
            # each flight has the right length, so the lengths of the blocks differ
            raise DatasetError(
                f'flights {flights[0].name} to {flights[-1].name} in {self.folder} differ in the '
                'length of their blocks; make the data set anew by `rotor-rig dataset`'
            ) from None


def _whole(path: Path, flight: Flight) -> Iterator[WaveformBlock]:
    """Yield the blocks of a recording; raises unless they are the whole flight."""
    recording = Recording(path)
    wanted = round(flight.duration_s * flight.scenario.rate_hz)
    samples, fits = 0, True
    for block in waveform_blocks(recording):
        end = samples + len(block.rows)
        try:
            fits = first_sample_of(block) == samples and end <= wanted
        except WireError as error:
            raise DatasetError(f'{path} is damaged after sample {samples}: {error}') from None
        if not fits:
            break
        yield block
        samples = end
    if recording.damage:
        raise DatasetError(f'{path} is damaged: {recording.damage[0]}')
    if not fits or samples != wanted:
        raise DatasetError(
            f'{path} should hold {wanted} samples from 0 and nothing else, which is so for the '
            f'first {samples} only; remove it and make it anew by `rotor-rig dataset`'
        )
