# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The machines that an evaluation flies: of a suite by name, or of a stored one."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from operator import index
from pathlib import Path

from rotor_bench.dataset.folder import SUITE, read_manifest
from rotor_bench.dataset.run import choose
from rotor_bench.dataset.suite import Flight, Machine, plan_suite
from rotor_bench.dataset.suite_config import SuiteConfig, load_suite
from rotor_bench.dataset.write import file_of
from rotor_bench.errors import DatasetError
from rotor_bench.evaluation.runner import Simulated, Source
from rotor_common.errors import DataError, RigError, WireError
from rotor_common.plain_data import LARGEST_JSON, parse_json
from rotor_common.text_file import read_text
from rotor_interfaces.waveform import WaveformBlock
from rotor_recording.reading import Recording, waveform_blocks
from vibration_monitor.block_columns import first_sample_of


@dataclass(frozen=True)
class Chosen:
    """Machines and where their blocks come from; `folder` is that of a stored suite."""

    config: SuiteConfig
    seed: int
    machines: tuple[Machine, ...]
    source: Source
    folder: Path | None


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
            # each is as long as it should be, so what differs is the blocks
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


def load(suite: str, *, seed: int, split: str, limit: int | None) -> Chosen:
    """Return the machines of a split of a suite, all or `limit` spread over it.

    `suite` is a name, a YAML file, or the folder of a data set, which knows its seed; of that
    the machines whose every flight is there.

    Raises:
        RigError: a suite that cannot be read, or has no such machine.

    """
    folder = Path(suite)
    source: Source
    if folder.is_dir():
        config, seed = _description(folder)
        machines: Sequence[Machine] = _complete(folder, plan_suite(config, seed))
        source = Stored(folder.absolute())
    else:
        config = load_suite(suite)
        machines = plan_suite(config, seed)
        source = Simulated()
    chosen = choose(machines, split=split)
    if limit is not None and limit < len(chosen):
        chosen = choose(chosen, count=limit)
    return Chosen(config, seed, tuple(chosen), source, folder if folder.is_dir() else None)


def _description(folder: Path) -> tuple[SuiteConfig, int]:
    """Return the suite and the seed that a data set was drawn from."""
    try:
        what = parse_json(read_text(folder / SUITE, LARGEST_JSON))
        return SuiteConfig.from_mapping(what['suite'], str(folder / SUITE)), index(what['seed'])
    except (DataError, LookupError, TypeError):
        raise DatasetError(
            f'{folder} holds no data set that can be read; make one by `rotor-rig dataset`'
        ) from None


def _complete(folder: Path, machines: Sequence[Machine]) -> list[Machine]:
    """Return the machines whose every flight is there."""
    there = {row['file'] for row in read_manifest(folder)}
    found = [m for m in machines if all(file_of(flight) in there for flight in m.flights)]
    if not found:
        raise DatasetError(f'{folder} holds no machine with all its flights; finish the data set')
    return found
