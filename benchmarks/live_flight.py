# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A `rotor-rig run` under way, in a ROS domain of its own, for tests and benchmarks."""

import itertools
import os
import socket
import subprocess
import sys
import tempfile
import time
from collections import deque
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

import psutil  # type: ignore[import-untyped]

from rotor_interfaces.topics import Topic

CLI = [sys.executable, '-m', 'rotor_bringup']
NODES = {
    'rotor_sim': 'rotor_sim.node',
    'maneuver_gen': 'maneuver_gen.node',
    'vibration_monitor': 'vibration_monitor.node',
    'recorder': 'rotor_recording.recorder_node',
}
_domains = itertools.count(os.getpid())
_claims: deque[int] = deque()
BYTES_A_SECOND = 700_000
"""Of a recording, at the least."""


def private_domain() -> str:
    """Return a ROS domain, 20 to 99, that is this process's alone for its next 16 domains.

    For fewer where many processes ask: one that finds none free gives back its oldest.
    Domains above 100 would use ports that Linux hands out to others.
    """
    tries = 0
    while True:
        tries += 1
        if tries % 80 == 0:
            if _claims:
                os.close(_claims.popleft())
            time.sleep(0.1)
        domain = 20 + next(_domains) % 80
        claim = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                claim.bind(f'\0rotor-rig-domain-{domain}')  # another process asks at this moment
                # of the first participant, see 9.6.1 of the DDS Interoperability Wire Protocol
                probe.bind(('127.0.0.1', 7410 + 250 * domain))
            except OSError:
                claim.close()
                continue
        _claims.append(claim.detach())
        if len(_claims) > 16:
            os.close(_claims.popleft())
        return str(domain)


def private_environment(log_folder: Path) -> dict[str, str]:
    """Return an environment with a ROS domain of its own on loopback."""
    return {
        **os.environ,
        'ROS_DOMAIN_ID': private_domain(),
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
        'ROS_LOG_DIR': str(log_folder),
    }


class LiveFlight:
    """A live run that records into a folder; `process` is the command.

    Args:
        folder: where the recording gets a folder of its own.
        options: of `rotor-rig run`, a scenario's name among them.
        environment: with the ROS domain to fly in; default: a private one.

    """

    def __init__(
        self, folder: Path, *options: str, environment: dict[str, str] | None = None
    ) -> None:
        self.folder = folder
        self.environment = environment or private_environment(folder / 'log')
        # a pipe that nobody reads would be full one day
        self._said = tempfile.TemporaryFile('w+')  # noqa: SIM115 - as long as the process
        self.process = subprocess.Popen(
            [*CLI, 'run', '--record', str(folder), *options],
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=self._said,
            stderr=self._said,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def wait_until_recording(self, seconds: float = 2.0) -> Path:
        """Return the file being written once it holds about `seconds` of the run.

        Raises:
            TimeoutError: it did not grow within two minutes.
            ChildProcessError: the command has ended.

        """
        deadline = time.monotonic() + 120.0
        while time.monotonic() < deadline:
            files = list(self.folder.glob('*/*.mcap.active'))
            if files and files[0].stat().st_size > seconds * BYTES_A_SECOND:
                return files[0]
            if self.process.poll() is not None:
                raise ChildProcessError(self.said())
            time.sleep(0.05)
        raise TimeoutError('the recording did not grow')

    def nodes(self) -> dict[str, int]:
        """Return the process ids of the nodes by name."""
        found: dict[str, int] = {}
        for child in psutil.Process(self.process.pid).children():
            try:
                command = child.cmdline()
            except psutil.Error:
                continue
            found |= {name: child.pid for name, module in NODES.items() if module in command}
        return found

    def finish(self, timeout_s: float = 150.0) -> tuple[int, str]:
        """Wait for the end; return the exit code and all that was said."""
        return self.process.wait(timeout_s), self.said()

    def said(self) -> str:
        """Return what the command and its nodes have said so far."""
        self._said.seek(0)
        return self._said.read()

    def bag(self) -> Path:
        """Return the bag folder."""
        return next(path.parent for path in self.folder.glob('*/*.mcap*'))

    def close(self) -> None:
        """Kill what still runs, by its id, and forget what was said."""
        if self.process.poll() is None:
            for pid in (*self.nodes().values(), self.process.pid):
                if psutil.pid_exists(pid):
                    psutil.Process(pid).kill()
            self.process.wait()
        self._said.close()


def running(pids: dict[str, int]) -> list[str]:
    """Return the nodes that still run 5 s later."""
    deadline = time.monotonic() + 5.0
    while True:
        alive = []
        for name, pid in pids.items():
            try:
                process = psutil.Process(pid)
                if process.status() != psutil.STATUS_ZOMBIE and NODES[name] in process.cmdline():
                    alive.append(name)
            except psutil.Error:
                continue
        if not alive or time.monotonic() > deadline:
            return alive
        time.sleep(0.1)


def hidden_topic(node: Any, topic: Topic) -> Topic | None:
    """Return the topic on which the nodes of the one run there talk among themselves."""
    ending = f'/{topic.name.lstrip("/")}'
    for name, _ in node.get_topic_names_and_types():
        if name.startswith('/_run_') and name.endswith(ending):
            return replace(topic, name=name)
    return None
