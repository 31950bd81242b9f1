# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""What the system tests share: private ROS domains, finished commands, decoded recordings."""

import fcntl
import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from rotor_interfaces.messages import from_cdr
from rotor_interfaces.topics import Topic
from rotor_recording.reading import Recording


@dataclass(frozen=True)
class RigRun:
    """A finished `rotor-rig` command."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        """What --json printed."""
        return json.loads(self.out)


Rig = Callable[..., RigRun]


@dataclass(frozen=True)
class LiveRun:
    """A live run that ended well: its bag folder and its --json summary."""

    folder: Path
    summary: dict[str, Any]


LiveRuns = Callable[..., LiveRun]
OfflineFlights = Callable[[str], Path]


@contextmanager
def shared_folder(factory: pytest.TempPathFactory, name: str) -> Iterator[tuple[Path, bool]]:
    """Give a folder common to all workers of pytest, and whether it is still to be filled.

    While one fills it, the others wait.
    """
    root = factory.getbasetemp()
    folder = (root.parent if 'PYTEST_XDIST_WORKER' in os.environ else root) / name
    filled = folder.with_name(f'{name}.filled')
    with folder.with_name(f'{name}.lock').open('w') as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield folder, not filled.exists()
        filled.touch()


def recorded(recording: Recording, topic: Topic) -> Iterator[tuple[int, Any]]:
    """Yield (log time in ns, decoded message) of a topic."""
    name = recording.find(topic)
    assert name is not None, f'{topic.name} was not recorded'
    for message in recording.messages([name]):
        yield message.log_time_ns, from_cdr(message.data, message.type)
