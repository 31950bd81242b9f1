# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Fixtures of the system tests: commands in private ROS domains, and runs many tests read."""

import hashlib
import json
import subprocess
from pathlib import Path

import pytest
from live_flight import CLI, private_environment

from rig_support import LiveRun, LiveRuns, OfflineFlights, Rig, RigRun, shared_folder


@pytest.fixture(scope='session')
def rig(tmp_path_factory: pytest.TempPathFactory) -> Rig:
    """Run `rotor-rig ARGUMENTS` in a ROS domain of its own and wait for it."""

    def run(*arguments: object, timeout_s: float = 500.0) -> RigRun:
        environment = private_environment(tmp_path_factory.mktemp('log'))
        done = subprocess.run(
            [*CLI, *(str(argument) for argument in arguments)],
            env={**environment, 'COLUMNS': '200'},
            capture_output=True,
            text=True,
            timeout=timeout_s,
            check=False,
            stdin=subprocess.DEVNULL,
        )
        return RigRun(done.returncode, done.stdout, done.stderr)

    return run


@pytest.fixture(scope='session')
def live(rig: Rig, tmp_path_factory: pytest.TempPathFactory) -> LiveRuns:
    """Run a scenario live with given options, once a session for each combination."""

    def run(*arguments: object) -> LiveRun:
        key = [str(argument) for argument in arguments]
        name = f'live-{hashlib.sha256(repr(key).encode()).hexdigest()[:16]}'
        with shared_folder(tmp_path_factory, name) as (folder, is_new):
            if is_new:
                done = rig('run', *key, '--record', folder, '--json')
                assert done.code == 0, done.err
                (folder / 'summary.json').write_text(done.out)
        summary = json.loads((folder / 'summary.json').read_text())
        return LiveRun(Path(summary['recording']), summary)

    return run


@pytest.fixture(scope='session')
def offline(rig: Rig, tmp_path_factory: pytest.TempPathFactory) -> OfflineFlights:
    """Simulate a shipped scenario once a session, and return its recording."""

    def run(scenario: str) -> Path:
        with shared_folder(tmp_path_factory, f'offline-{scenario}') as (folder, is_new):
            if is_new:
                folder.mkdir()
                done = rig('simulate', scenario, '--out', folder / 'flight.mcap')
                assert done.code == 0, done.err
        return folder / 'flight.mcap'

    return run


@pytest.fixture
def domain(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """A private ROS domain for this process and those it starts."""
    environment = private_environment(tmp_path / 'log')
    for name in ('ROS_DOMAIN_ID', 'ROS_AUTOMATIC_DISCOVERY_RANGE', 'ROS_LOG_DIR'):
        monkeypatch.setenv(name, environment[name])
    return environment
