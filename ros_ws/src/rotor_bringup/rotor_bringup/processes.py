# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Starts, watches and stops the processes of a live run.

There is no `launch` package on PyPI, so this is the small part of it that the rig needs: one
parameter file for all nodes, one process a node (or one for all), signals in the right order.
"""

import ctypes
import signal
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from rotor_common.errors import ProcessError
from rotor_common.exit_code import ExitCode
from rotor_interfaces import dds

STOP_TIMEOUT_S = 30.0
"""Enough for a starved machine, on which a process may still import or finalise a recording."""
_PR_SET_PDEATHSIG = 1
_LIBC = ctypes.CDLL(None)


@dataclass(frozen=True)
class ProcessPlan:
    """One process: its name, the module it runs, and whether the rig can do without it."""

    name: str
    module: str
    optional: bool = False


class ProcessGroup:
    """The processes of one run, in the order in which they are to be stopped."""

    def __init__(
        self,
        plans: Sequence[ProcessPlan],
        parameters: dict[str, dict[str, Any]],
        folder: Path,
        ros_arguments: Sequence[str] = (),
    ) -> None:
        """Prepare the run.

        Args:
            plans: the processes.
            parameters: of the nodes, by node name.
            folder: takes the file of the parameters and the logs.
            ros_arguments: more arguments for every process.

        """
        self._plans = plans
        self._ros_arguments = ros_arguments
        self._folder = folder
        self._running: dict[str, subprocess.Popen[bytes]] = {}
        self._parameter_file = folder / 'parameters.yaml'
        sections = {
            f'/**/{node}': {'ros__parameters': values} for node, values in parameters.items()
        }
        self._parameter_file.write_text(yaml.safe_dump(sections), 'utf-8')

    def start(self) -> None:
        """Start every process in its own session, so that Ctrl-C reaches this process alone."""
        for plan in self._plans:
            command = [sys.executable, '-m', plan.module, '--ros-args', '--params-file']
            with self._log(plan.name).open('wb') as log:
                self._running[plan.name] = subprocess.Popen(
                    [*command, str(self._parameter_file), *self._ros_arguments],
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                    preexec_fn=_prepare_child,  # noqa: PLW1509 - two system calls, no threads yet
                )

    def pids(self) -> dict[str, int]:
        """Return the process ids by name."""
        return {name: process.pid for name, process in self._running.items()}

    def has_ended(self, name: str) -> bool:
        """Say whether process `name` has ended by itself with success.

        Raises:
            ProcessError: any process that the run needs has failed, or ended before `name`.

        """
        ended = False
        for plan in self._plans:
            code = self._running[plan.name].poll()
            if code is None or plan.optional:
                continue
            if code == 0 and plan.name == name:
                ended = True
                continue
            raise ProcessError(f'{plan.name} {_ending(code)}{self._last_words(plan.name)}')
        return ended

    def stop(self) -> tuple[list[str], list[str]]:
        """End the processes one after the other, SIGINT first.

        Return what did not end well: failures, and warnings about optional processes.
        """
        failures: list[str] = []
        warnings: list[str] = []
        for plan in self._plans:
            process = self._running.get(plan.name)
            if process is None:
                continue
            complaints = warnings if plan.optional else failures
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            try:
                code = process.wait(STOP_TIMEOUT_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
                complaints.append(f'{plan.name} did not end in {STOP_TIMEOUT_S:g} s: killed')
                continue
            if code not in (0, ExitCode.INTERRUPTED):
                complaints.append(f'{plan.name} {_ending(code)}{self._last_words(plan.name)}')
        return failures, warnings

    def _log(self, name: str) -> Path:
        return self._folder / f'{name}.log'

    def _last_words(self, name: str) -> str:
        lines = self._log(name).read_text('utf-8', errors='replace').strip().splitlines()
        return f': {lines[-1].removeprefix("error: ")}' if lines else ''


def _ending(code: int) -> str:
    if code == -signal.SIGBUS:
        free = dds.free_shared_memory() // 1024
        return (
            f'was ended by SIGBUS: {dds.SHARED_MEMORY} has run full ({free} KiB free now); '
            '`fastdds shm clean` removes what killed processes have left there'
        )
    if code < 0:
        return f'was ended by {signal.Signals(-code).name}'
    return 'was interrupted' if code == ExitCode.INTERRUPTED else f'ended with exit code {code}'


def _prepare_child() -> None:
    """Ask Linux for SIGTERM when the parent dies, so that a killed rig leaves no process behind.

    Signals are blocked until the child's run loop handles them (`ros.run`): none hits its imports.
    """
    _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
