# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Flights that an evaluation has finished, kept beside its report until that is written.

A part is one flight of every machine of a batch. It belongs to one key, made of everything that
decides what the detectors say; parts of another key are thrown away.
"""

import contextlib
import hashlib
import importlib.util
import json
import platform
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

from rotor_bench.dataset.folder import MANIFEST
from rotor_bench.dataset.suite import Flight
from rotor_bench.evaluation.isolation import place_of_detector
from rotor_bench.evaluation.outcome import Evaluated, FlightResult
from rotor_bench.evaluation.suites import Chosen
from rotor_common.durable_file import write_whole
from rotor_common.errors import ConfigError
from vibration_monitor.detectors.protocol import detector_target

_PACKAGES = (
    'maneuver_gen', 'rotor_bench', 'rotor_common', 'rotor_interfaces', 'rotor_recording',
    'rotor_rig', 'rotor_sim', 'vibration_monitor',
)  # fmt: skip


def key_of(chosen: Chosen, detectors: Sequence[str]) -> str:
    """Return the SHA-256 of everything that decides what the detectors say about the flights.

    Raises:
        RigError: a detector that cannot be found.

    """
    content = {
        'suite': chosen.config.plain(),
        'seed': chosen.seed,
        'machines': [machine.number for machine in chosen.machines],
        'stored': chosen.folder and _digest([chosen.folder / MANIFEST]),
        'detectors': [(n, detector_target(n), _digest([place_of_detector(n)])) for n in detectors],
        'rig': _digest(map(_package, _PACKAGES)),
        'packages': sorted(f'{found.name} {found.version}' for found in distributions()),
        'python': [sys.version, platform.machine()],
    }
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()


def _package(name: str) -> Path:
    spec = importlib.util.find_spec(name)
    assert spec is not None  # noqa: S101 - they import one another
    return Path(str(spec.origin)).parent


def _digest(places: Iterable[Path]) -> str:
    """Return the SHA-256 of files, and of all files in folders except compiled Python."""
    digest = hashlib.sha256()
    for place in places:
        for path in [place] if place.is_file() else sorted(place.rglob('*')):
            if path.is_file() and '__pycache__' not in path.parts:
                content = path.read_bytes()
                digest.update(f'{path.relative_to(place)}\0{len(content)}\0'.encode())
                digest.update(content)
    return digest.hexdigest()


@dataclass(frozen=True)
class Parts:
    """The folder of the parts of one evaluation; several processes may write to it."""

    folder: Path
    key: str

    def clean(self) -> tuple[int, int]:
        """Remove parts of another key; return the numbers of flights kept and of parts removed."""
        kept = gone = 0
        for path in self._files():
            part = self._read(path)
            if part is None:
                path.unlink()
                gone += path.suffix == '.json'  # not the file of a killed run
            else:
                kept += len(part['flights'])
        return kept, gone

    def load(self, flights: Sequence[Flight]) -> Evaluated | None:
        """Return the stored results of flights in lock-step, None if they must be flown."""
        part = self._read(self._path(flights))
        if part is None:
            return None
        results = [FlightResult.from_plain(plain) for plain in part['flights']]
        return Evaluated(results, part['isolation'], part['alarm_scores'])

    def store(self, flights: Sequence[Flight], part: Evaluated) -> None:
        """Store the results of flights; raises ConfigError if they cannot be written."""
        content = {
            'key': self.key,
            'isolation': part.isolation,
            'alarm_scores': part.alarm_scores,
            'flights': [result.plain() for result in part.flights],
        }
        try:
            self.folder.mkdir(exist_ok=True)
            write_whole(self._path(flights), json.dumps(content).encode())
        except OSError as error:
            raise ConfigError(
                f'finished flights cannot be kept in {self.folder}: {error.strerror}; make room, '
                'and the same command goes on'
            ) from None

    def remove(self) -> None:
        """Remove the parts, and their folder unless it holds something else."""
        for path in self._files():
            path.unlink()
        with contextlib.suppress(OSError):
            self.folder.rmdir()

    def _files(self) -> list[Path]:
        return sorted(self.folder.glob('machine_*_flight_*.json*'))

    def _path(self, flights: Sequence[Flight]) -> Path:
        return self.folder / f'machine_{flights[0].machine}_flight_{flights[0].number}.json'

    def _read(self, path: Path) -> dict[str, Any] | None:
        """Return a part of this key, None for any other file."""
        try:
            part = json.loads(path.read_text('utf-8'))
        except (OSError, ValueError):
            return None
        is_ours = isinstance(part, dict) and part.get('key') == self.key
        return part if is_ours else None
