# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The machines that an evaluation flies: of a suite by name, or of a stored one."""

from collections.abc import Sequence
from dataclasses import dataclass
from operator import index
from pathlib import Path

from rotor_bench.dataset.folder import SUITE, read_manifest
from rotor_bench.dataset.run import choose
from rotor_bench.dataset.suite import Machine, plan_suite
from rotor_bench.dataset.suite_config import SuiteConfig, load_suite
from rotor_bench.dataset.write import file_of
from rotor_bench.errors import DatasetError
from rotor_bench.evaluation.sources import Simulated, Source, Stored
from rotor_common.errors import DataError
from rotor_common.plain_data import LARGEST_JSON, parse_json
from rotor_common.text_file import read_text


@dataclass(frozen=True)
class Chosen:
    """Machines and where their blocks come from; `folder` is that of a stored suite."""

    config: SuiteConfig
    seed: int
    machines: tuple[Machine, ...]
    source: Source
    folder: Path | None


def load(suite: str, *, seed: int, split: str, limit: int | None) -> Chosen:
    """Return the machines of a split of a suite, all or `limit` spread over it.

    `suite` is a name, a YAML file, or the folder of a data set, which has its own seed; of a data
    set only machines with all their flights are returned.

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
    """Return the machines whose flights are all there."""
    there = {row['file'] for row in read_manifest(folder)}
    found = [m for m in machines if all(file_of(flight) in there for flight in m.flights)]
    if not found:
        raise DatasetError(f'{folder} holds no machine with all its flights; finish the data set')
    return found
