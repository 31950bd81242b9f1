# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Fixtures of the system tests: a private ROS domain for each run, and the runs many tests read."""

import itertools
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from rotor_interfaces.messages import from_cdr
from rotor_interfaces.topics import Topic
from vibration_monitor.reading import Recording

CLI = [sys.executable, '-m', 'rotor_bringup.cli']
_domains = itertools.count(os.getpid() % 150)


def private_environment(log_folder: Path) -> dict[str, str]:
    """Return an environment with a ROS domain of its own, on loopback."""
    return {
        **os.environ,
        'ROS_DOMAIN_ID': str(20 + next(_domains) % 200),
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
        'ROS_LOG_DIR': str(log_folder),
    }


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


@pytest.fixture(scope='session')
def rig(tmp_path_factory: pytest.TempPathFactory) -> Rig:
    """Run `rotor-rig ARGUMENTS` in a ROS domain of its own and wait for it."""

    def run(*arguments: object, timeout_s: float = 180.0) -> RigRun:
        environment = private_environment(tmp_path_factory.mktemp('log'))
        done = subprocess.run(
            [*CLI, *(str(argument) for argument in arguments)],
            env={**environment, 'COLUMNS': '200'},
            capture_output=True,
            text=True,
            timeout=timeout_s,
            stdin=subprocess.DEVNULL,
        )
        return RigRun(done.returncode, done.stdout, done.stderr)

    return run


@dataclass(frozen=True)
class LiveRun:
    """A live run that ended well: its bag folder and its --json summary."""

    folder: Path
    summary: dict[str, Any]


LiveRuns = Callable[..., LiveRun]


@pytest.fixture(scope='session')
def live(rig: Rig, tmp_path_factory: pytest.TempPathFactory) -> LiveRuns:
    """Run a scenario live with given options, once a session for each combination."""
    finished: dict[tuple[str, ...], LiveRun] = {}

    def run(*arguments: object) -> LiveRun:
        key = tuple(str(argument) for argument in arguments)
        if key not in finished:
            folder = tmp_path_factory.mktemp('recordings')
            done = rig('run', *key, '--record', folder, '--json')
            assert done.code == 0, done.err
            finished[key] = LiveRun(Path(done.json['recording']), done.json)
        return finished[key]

    return run


def recorded(recording: Recording, topic: Topic) -> Iterator[tuple[int, Any]]:
    """Yield (log time in ns, decoded message) of a topic."""
    name = recording.find(topic)
    assert name is not None, f'{topic.name} was not recorded'
    for message in recording.messages([name]):
        yield message.log_time_ns, from_cdr(message.data, message.type)


@pytest.fixture
def domain(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[dict[str, str]]:
    """A private ROS domain for this process and those it starts."""
    environment = private_environment(tmp_path / 'log')
    for name in ('ROS_DOMAIN_ID', 'ROS_AUTOMATIC_DISCOVERY_RANGE', 'ROS_LOG_DIR'):
        monkeypatch.setenv(name, environment[name])
    yield environment
