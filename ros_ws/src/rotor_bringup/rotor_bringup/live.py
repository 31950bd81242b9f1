# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Runs the rig live over DDS: starts the node processes, watches them and stops them in order."""

import json
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import rclpy
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rich.console import Console

from maneuver_gen.load_grid import load_grid
from rotor_bringup.display import Display, RunState
from rotor_bringup.processes import ProcessGroup, ProcessPlan
from rotor_common.console import printable
from rotor_common.constants import GRAVITY_M_S2, LOAD_RATE_HZ
from rotor_common.leftovers import OwnFolder, remove_leftovers
from rotor_common.versions import versions
from rotor_interfaces import dds, messages, ros, topics
from rotor_interfaces.run_topics import RunTopics, new_run_id
from rotor_rig.scenario_model import Scenario

WINDOW_BLOCKS = 64
CONSUMERS = ['vibration_monitor', 'recorder']
OPTIONAL_TOPICS = (topics.TRUTH_WAVEFORM, topics.BEARING_1_IMU, topics.BEARING_2_IMU)
MOST_DIGITS = 18
"""Of a counter on /diagnostics; further digits are ignored."""


@dataclass(frozen=True)
class RunResult:
    """How a live run ended."""

    recording: Path
    state: RunState
    interrupted: bool
    failures: list[str]
    warnings: list[str]


class RunWatcher(Node):  # type: ignore[misc]
    """Fills a RunState from the topics of its run; messages that cannot be of it are ignored."""

    def __init__(self, scenario: Scenario, state: RunState, run_id: str) -> None:
        super().__init__('run_watcher')
        self._state = state
        self._load_factor = load_grid(scenario.maneuver, scenario.duration_s)[:, 0] / (GRAVITY_M_S2)
        self._epoch_ns: int | None = None
        run = RunTopics(self, run_id)
        run.subscription(topics.MANEUVER_LOAD, self._on_load)
        run.subscription(topics.CLOCK, self._on_clock)
        run.subscription(topics.INDICATORS, self._on_indicators)
        run.subscription(topics.ALARM, self._on_alarm)
        run.subscription(topics.DIAGNOSTICS, self._on_diagnostics)

    def _on_load(self, message: Any) -> None:
        if self._epoch_ns is None:
            self._epoch_ns = messages.stamp_ns(message)

    def _on_clock(self, message: Any) -> None:
        simulated_s = self._simulated_s(messages.stamp_ns(message))
        if simulated_s is not None:
            self._state.advance(simulated_s)
            point = min(round(simulated_s * LOAD_RATE_HZ), len(self._load_factor) - 1)
            self._state.load_factor = float(self._load_factor[point])

    def _simulated_s(self, stamp_ns: int) -> float | None:
        """Return the time of the run in s; None where a stamp is not of this run."""
        if self._epoch_ns is None:
            return None
        simulated_s = (stamp_ns - self._epoch_ns) * 1e-9
        return simulated_s if 0.0 <= simulated_s <= self._state.duration_s + 1.0 else None

    def _on_indicators(self, message: Any) -> None:
        if len(message.name) == len(message.position):
            self._state.take_indicators(dict(zip(message.name, message.position, strict=True)))

    def _on_alarm(self, message: Any) -> None:
        time_s = self._simulated_s(messages.stamp_ns(message))
        if message.status and time_s is not None:
            status = message.status[0]
            self._state.take_alarm(messages.level_of(status), printable(status.message), time_s)

    def _on_diagnostics(self, message: Any) -> None:
        for status in message.status:
            for value in status.values:
                if value.key == 'topics with another source':
                    named = {topic.name for topic in topics.TOPICS} & {*value.value.split(', ')}
                    self._state.other_sources.update(named)
                elif value.key.endswith('[1]') and value.value.isdecimal():
                    self._state.take_count(status.name, value.key, int(value.value[:MOST_DIGITS]))


def run_live(
    scenario: Scenario,
    *,
    rate: float,
    folder: Path,
    namespace: str,
    composed: bool,
    view: bool,
    console: Console,
    quiet: bool,
) -> RunResult:
    """Run a scenario live and return when it is over, interrupted or failed.

    Args:
        scenario: what to run.
        rate: multiple of real time; 0 = as fast as the consumers keep up.
        folder: bag folder that the recorder makes.
        namespace: ROS namespace of all topics; '' = none.
        composed: all nodes in one process instead of one each.
        view: also start the rerun viewer.
        console: where progress goes.
        quiet: show no progress.

    Raises:
        ConfigError: ROS 2 cannot start here, not a ROS namespace, or security is not available.
        ProcessError: a process of the rig failed; the others have been ended.

    """
    ros_arguments = ros.namespace_arguments(namespace)
    remove_leftovers()
    state = RunState(scenario.duration_s)
    plans = _plans(composed=composed, view=view)
    run_id = new_run_id()
    with dds.environment(), OwnFolder() as logs, _signals() as received:
        parameters = node_parameters(scenario, rate, folder, run_id)
        group = ProcessGroup(plans, parameters, logs, ros_arguments)
        dds.require_loadable(len(plans) + 1)
        group.start()
        ros.initialise(ros_arguments)
        watcher = RunWatcher(scenario, state, run_id)
        executor = EventsExecutor()
        executor.add_node(watcher)
        strangers = set(dds.other_users())
        try:
            with Display(state, console, quiet=quiet) as display:
                while not received and not group.has_ended(plans[0].name):
                    _spin_for(executor, 0.05)
                    display.refresh()
        finally:
            strangers.update(dds.other_users())
            failures, warnings = group.stop()
            if rclpy.ok():
                ros.spin_until_quiet(executor)
                watcher.destroy_node()
            rclpy.try_shutdown()
    if state.other_sources:
        names = ', '.join(sorted(state.other_sources))
        warnings.append(
            f'another source published {names} in this ROS domain during the run; the recording '
            'and the conclusion are of this run alone, but other subscribers heard both'
        )
    if strangers:
        warnings.append(dds.warning_about(strangers))
    if refused := [f'{count} {what}' for what, count in state.refused_inputs.items() if count]:
        warnings.append(f'the simulator refused {" and ".join(refused)} that cannot be of this run')
    return RunResult(folder, state, bool(received), failures, warnings)


def _spin_for(executor: EventsExecutor, seconds: float) -> None:
    deadline = time.monotonic() + seconds
    while (remaining := deadline - time.monotonic()) > 0.0:
        executor.spin_once(remaining)


def _plans(*, composed: bool, view: bool) -> list[ProcessPlan]:
    if composed:
        plans = [ProcessPlan('rotor_rig', 'rotor_bringup.composed')]
    else:
        plans = [
            ProcessPlan('rotor_sim', 'rotor_sim.node'),
            ProcessPlan('maneuver_gen', 'maneuver_gen.node'),
            ProcessPlan('vibration_monitor', 'vibration_monitor.node'),
            ProcessPlan('recorder', 'rotor_recording.recorder_node'),
        ]
    if view:
        plans.append(ProcessPlan('viewer', 'rotor_view.viewer_node', optional=True))
    return plans


def node_parameters(
    scenario: Scenario, rate: float, folder: Path, run_id: str
) -> dict[str, dict[str, Any]]:
    """Return the parameters of every node; see each node's declarations."""
    parameters: dict[str, dict[str, Any]] = {
        'rotor_sim': {
            'config': scenario.rotor_sim().model_dump_json(),
            'scenario': json.dumps(scenario.plain()),
            'versions': json.dumps(versions()),
            'duration_s': float(scenario.duration_s),
            'rate': float(rate),
            'consumers': CONSUMERS,
            'window_blocks': _window_blocks(scenario),
        },
        'maneuver_gen': {
            'config': json.dumps(scenario.plain()['maneuver']),
            'duration_s': float(scenario.duration_s),
            'lead_s': 2.0 + 2.0 * scenario.block_samples / scenario.rate_hz,
        },
        'vibration_monitor': {'config': scenario.monitor.model_dump_json(), 'listeners': 1},
        'recorder': {
            'path': str(folder),
            'expect': [topic.name for topic in topics.TOPICS if topic not in OPTIONAL_TOPICS],
        },
        'viewer': {},
    }
    return {node: {**values, 'run_id': run_id} for node, values in parameters.items()}


def _window_blocks(scenario: Scenario) -> int:
    """Return how many blocks may be under way: the deepest queue holds them and their IMU data."""
    imu_messages = scenario.sensors.imu_rate_hz * scenario.block_samples / scenario.rate_hz
    return max(1, min(WINDOW_BLOCKS, int(topics.BEARING_1_IMU.depth / (2 * imu_messages + 1))))


@contextmanager
def _signals() -> Iterator[list[int]]:
    """Collect SIGINT and SIGTERM instead of ending by them."""
    received: list[int] = []
    before = {
        number: signal.signal(number, lambda got, _: received.append(got))
        for number in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        yield received
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
