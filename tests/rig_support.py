# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""What the system tests share: private ROS domains, finished commands, decoded recordings."""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

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


def recorded(recording: Recording, topic: Topic) -> Iterator[tuple[int, Any]]:
    """Yield (log time in ns, decoded message) of a topic."""
    name = recording.find(topic)
    assert name is not None, f'{topic.name} was not recorded'
    for message in recording.messages([name]):
        yield message.log_time_ns, from_cdr(message.data, message.type)
