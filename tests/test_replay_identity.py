# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The monitor on a replay over DDS says bit for bit what it said live."""

import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from live_flight import CLI

from rig_support import LiveRuns, recorded
from rotor_interfaces import topics
from rotor_recording.reading import Recording

pytestmark = pytest.mark.slow


def test_a_monitor_on_a_replay_gives_the_live_indicators(
    live: LiveRuns, domain: dict[str, str], tmp_path: Path
) -> None:
    import rclpy
    from rclpy.context import Context
    from rclpy.experimental.events_executor import EventsExecutor
    from rclpy.node import Node

    from rotor_interfaces import ros

    run = live('climb_dive', '--duration', '6', '--rate', 0)
    expected = [
        message.position.tobytes()
        for _, message in recorded(Recording(run.folder), topics.INDICATORS)
    ]
    context = Context()
    rclpy.init(context=context, domain_id=int(domain['ROS_DOMAIN_ID']))
    node = Node('listener', context=context)
    heard: list[Any] = []
    ros.subscription(node, topics.INDICATORS, heard.append)
    executor = EventsExecutor(context=context)
    executor.add_node(node)
    monitor = subprocess.Popen(
        [sys.executable, '-m', 'vibration_monitor.node'], env=domain, stdin=subprocess.DEVNULL
    )
    replay = None
    try:
        deadline = time.monotonic() + 300.0
        while not node.count_publishers('monitor/indicators'):
            assert time.monotonic() < deadline, 'the monitor did not start'
            executor.spin_once(0.1)
        replay = subprocess.Popen(
            [*CLI, 'replay', str(run.folder), '--rate', '2', '--topic', 'rotor/waveform'],
            env=domain,
            stdin=subprocess.DEVNULL,
            cwd=tmp_path,
        )
        deadline = time.monotonic() + 300.0
        while len(heard) < len(expected) and time.monotonic() < deadline:
            executor.spin_once(0.1)
        assert replay.wait(300) == 0
    finally:
        for process in (replay, monitor):
            if process is not None and process.poll() is None:
                process.terminate()
                process.wait(300)
        executor.shutdown()
        node.destroy_node()
        rclpy.shutdown(context=context)
    assert [message.position.tobytes() for message in heard] == expected
    assert len(expected) > 5
