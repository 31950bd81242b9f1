# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The folder of a data set: its description, the journal of finished flights, the manifest."""

import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor_bench.dataset.suite import Flight
from rotor_bench.dataset.suite_config import SuiteConfig, respelt
from rotor_bench.dataset.write import Row, file_of, remove_unfinished, sha256
from rotor_bench.errors import DatasetError
from rotor_common.durable_file import write_whole
from rotor_common.errors import DataError
from rotor_common.plain_data import LARGEST_JSON, parse_json
from rotor_common.text_file import read_text

if TYPE_CHECKING:
    import pyarrow as pa

MANIFEST = 'manifest.parquet'
SUITE = 'suite.json'
README = 'README.txt'
JOURNAL = 'finished.jsonl'

COLUMNS = {
    'file': 'MCAP file, relative to this folder; its name says nothing',
    'size_bytes': 'size of the file',
    'sha256': 'SHA-256 of the file',
    'machine': 'number of the virtual machine',
    'number': 'place of the flight among those of its machine',
    'role': 'reference (healthy, for fitting) or test',
    'split': 'train or test; a machine is in one of them',
    'duration_s': 'length, s',
    'group': 'group of machines in the suite',
    'crack': 'healthy, constant or growing',
    'crack_stiffness_ratio': 'K = dk/k at the end of the flight',
    'decoy': 'healthy, but as long as the flights with a growing crack',
    'maneuver': 'maneuver family',
    'held_out_family': 'whether no flight of the train split is of this family',
    'speed_program': 'course of the speed',
    'speed_rad_s': 'nominal speed of the machine, rad/s',
    'confounder': 'what has changed since the reference flights',
    'eccentricity_m': 'eccentricity on this flight, m',
    'clearance_m': 'radial clearance on this flight, m',
    'shaft_stiffness_n_m': 'stiffness of the shaft of this machine, each side, N/m',
    'damping_ratio': 'damping ratio of the shaft of this machine',
    'crack_half_angle_rad': 'half angle over which the crack (to be) opens, rad',
    'forcing_n': 'force on the disk at twice the speed, as from a misalignment, N',
    'sensor_fault': 'fault of a sensor on this flight, or empty',
    'crack_angle_rad': 'angle from the unbalance to the crack (to be), rad',
    'noise': 'noise of the sensors: factor on the preset by name',
    'encoder': 'whether the angle column is there; otherwise the key-phasor alone',
    'load_factor_min': 'least load factor',
    'load_factor_max': 'greatest load factor',
    'load_factor_range': 'their difference',
    'seed': 'seed of the sensors',
}
"""The columns of the manifest, in order, and what they mean."""


class Folder:
    """The folder of one data set, new or existing: flights, manifest, description of the suite.

    Raises DatasetError if the folder holds something else or cannot be written.
    """

    def __init__(
        self, path: Path, suite: SuiteConfig, seed: int, versions: Mapping[str, str]
    ) -> None:
        self.path = path
        self._what = {'suite': suite.plain(), 'seed': seed, 'versions': dict(versions)}
        self.finished: dict[str, Row] = {}
        self._prepare()

    def _prepare(self) -> None:
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            if (self.path / SUITE).exists():
                self._check_suite()
            elif any(self.path.iterdir()):
                raise DatasetError(
                    f'the folder {self.path} is not empty and holds no data set; give a new folder'
                )
            remove_unfinished(self.path)
            write_whole(self.path / SUITE, json.dumps(self._what, indent=1).encode())
            write_whole(self.path / README, _readme(self._what).encode())
            self._read_finished()
        except OSError as error:
            raise DatasetError(
                f'the folder {self.path} cannot be written ({error.strerror}); choose another'
            ) from None

    def _check_suite(self) -> None:
        try:
            there = parse_json(read_text(self.path / SUITE, LARGEST_JSON))
            there['suite'] = respelt(there['suite'])
        except (DataError, LookupError, TypeError, AttributeError):
            there = {}
        for key, what in (('suite', 'another suite'), ('seed', 'another seed'),
                          ('versions', 'other versions of the program')):  # fmt: skip
            if there.get(key) != self._what[key]:
                raise DatasetError(
                    f'the folder {self.path} holds a data set of {what}; give a new folder'
                )

    def _read_finished(self) -> None:
        """Find the flights that earlier runs have finished; a file of another size is ignored."""
        rows = self._journal()
        if (self.path / MANIFEST).exists():
            rows += read_manifest(self.path)
        for row in rows:
            path = self.path / row['file']
            if path.is_file() and path.stat().st_size == row['size_bytes']:
                self.finished[row['file']] = row

    def _journal(self) -> list[Row]:
        try:
            lines = (self.path / JOURNAL).read_text('utf-8').splitlines()
        except FileNotFoundError:
            return []
        rows = []
        for line in lines:
            try:
                rows.append(respelt(json.loads(line)))
            except ValueError:
                continue  # the line that a killed run was writing
        return rows

    def is_finished(self, flight: Flight) -> bool:
        """Say whether an earlier run has written the flight, and its bytes are unchanged."""
        row = self.finished.get(file_of(flight))
        return row is not None and sha256(self.path / row['file']) == row['sha256']

    def add(self, written: Iterable[Row]) -> None:
        """Note finished files, so that an interrupted run can go on after them.

        Raises DatasetError if a file is missing: its writer has another folder at this path.
        """
        with (self.path / JOURNAL).open('a', encoding='utf-8') as journal:
            for row in written:
                if not (self.path / row['file']).is_file():
                    raise DatasetError(
                        f'a worker has written {row["file"]}, but it is not in {self.path}; all '
                        'workers need that folder at the same path'
                    )
                self.finished[row['file']] = row
                journal.write(json.dumps(row) + '\n')
            journal.flush()
            os.fsync(journal.fileno())

    def write_manifest(self) -> None:
        """Write the manifest of all finished flights, in their order, and remove the journal."""
        import pyarrow as pa  # noqa: PLC0415 - slow
        from pyarrow import parquet  # noqa: PLC0415

        rows = sorted(self.finished.values(), key=lambda row: (row['machine'], row['number']))
        columns = {name: [row[name] for row in rows] for name in COLUMNS}
        table = pa.table(columns, metadata={key: json.dumps(v) for key, v in self._what.items()})
        sink = pa.BufferOutputStream()
        parquet.write_table(table, sink)
        write_whole(self.path / MANIFEST, sink.getvalue().to_pybytes())
        (self.path / JOURNAL).unlink(missing_ok=True)
        remove_unfinished(self.path)


def read_table(folder: Path) -> 'pa.Table':
    """Return the manifest of a data set; raises DatasetError where there is none."""
    from pyarrow import ArrowException, parquet  # noqa: PLC0415 - slow

    path = folder / MANIFEST
    try:
        table = parquet.read_table(path)
        return table.rename_columns(list(respelt(dict.fromkeys(table.column_names))))
    except (OSError, ArrowException) as error:
        raise DatasetError(
            f'{path} cannot be read ({type(error).__name__}); make the data set, or finish it, by '
            '`rotor-rig dataset`'
        ) from None


def read_manifest(folder: Path) -> list[Row]:
    """Return the rows of the manifest of a data set, see COLUMNS."""
    rows: list[Row] = read_table(folder).to_pylist()
    return rows


def _readme(what: Mapping[str, Any]) -> str:
    suite = what['suite']
    width = max(len(name) for name in COLUMNS)
    columns = '\n'.join(f'  {name:{width}}  {meaning}' for name, meaning in COLUMNS.items())
    return f"""Data set of the cracked rotor rig: suite {suite['name']}, seed {what['seed']}.
{suite['description']}

flights/*.mcap     one flight of one virtual machine each; opens in rotor-rig, rerun, Foxglove
manifest.parquet   one row a flight: file, checksum, labels
suite.json         the description that the flights were drawn from

The recordings hold the truth and the scenario next to what the sensors say: a detector must be
given the topic rotor/waveform alone, without the columns that it could not have.

Columns of the manifest:
{columns}
"""
