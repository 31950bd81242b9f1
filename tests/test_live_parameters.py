# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters set while the rig runs: taken at a known sample, refused with a reason, repeatable."""

import json
import os
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest
from live_flight import CLI

from rig_support import Rig, recorded
from rotor_interfaces import topics
from rotor_recording.reading import Recording, waveform_blocks

pytestmark = pytest.mark.slow


TAKEN = {'crack_stiffness_ratio': 0.2, 'displacement_noise_m': 2e-7, 'speed_target_rad_s': 360.0}
REFUSED = [
    ('rotor.clearance_m', 1e-6, 'rotor.clearance_m'),
    ('speed.governor_acceleration_rad_s2', 10.0, 'speed.governor_acceleration_rad_s2'),
    ('crack_stiffness_ratio', 0.9, '0.5'),
    ('speed_target_rad_s', 1000.0, 'highest_rad_s'),
]
"""Name, value and a part of the reason."""


def set_parameters(values: list[tuple[str, float]]) -> list[Any]:
    """Set parameters of /rotor_sim one by one, as `ros2 param set` does; return the results."""
    import rclpy
    from rclpy.context import Context
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.node import Node
    from rclpy.parameter import Parameter
    from rclpy.parameter_client import AsyncParameterClient

    context = Context()
    rclpy.init(context=context, domain_id=int(os.environ['ROS_DOMAIN_ID']))
    node = Node('operator', context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    client = AsyncParameterClient(node, 'rotor_sim')
    results = []
    try:
        deadline = time.monotonic() + 300.0
        while not client.services_are_ready():
            assert time.monotonic() < deadline, 'rotor_sim offers no parameter services'
            executor.spin_once(0.1)
        # the run is under way when its clock ticks
        ticks: list[Any] = []
        from rotor_interfaces import ros

        ros.subscription(node, topics.CLOCK, ticks.append)
        while len(ticks) < 20:
            assert time.monotonic() < deadline, 'the run did not start'
            executor.spin_once(0.1)
        for name, value in values:
            future = client.set_parameters([Parameter(name, value=value)])
            executor.spin_until_future_complete(future, 10.0)
            results.append(future.result().results[0])
    finally:
        executor.shutdown()
        node.destroy_node()
        rclpy.shutdown(context=context)
    return results


def test_changes_take_effect_at_a_sample_and_can_be_repeated(
    domain: dict[str, str], rig: Rig, tmp_path: Path
) -> None:
    process = subprocess.Popen(
        [*CLI, 'run', '--duration', '8', '--record', str(tmp_path), '--json'],
        env=domain,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        results = set_parameters([*TAKEN.items(), *((name, value) for name, value, _ in REFUSED)])
        out, err = process.communicate(timeout=300)
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()
    assert process.returncode == 0, err
    assert [result.successful for result in results] == [True] * len(TAKEN) + [False] * len(REFUSED)
    for (name, _, reason), result in zip(REFUSED, results[len(TAKEN) :], strict=True):
        assert reason in result.reason, name

    recording = Recording(json.loads(out)['recording'])
    configs = [json.loads(message.data) for _, message in recorded(recording, topics.CONFIG)]
    changes = configs[-1]['scenario']['changes']
    assert [change['parameter'] for change in changes] == list(TAKEN)
    sample = changes[0]['sample']
    assert sample > 0
    assert sample % 256 == 0
    ratios = [
        message.position[message.name.index('crack_stiffness_ratio')]
        for _, message in recorded(recording, topics.TRUTH)
    ]
    assert set(ratios[: sample // 256]) == {0.1}
    assert set(ratios[sample // 256 :]) == {0.2}

    again = rig('simulate', recording.path, '--out', tmp_path / 'again.mcap')
    assert again.code == 0, again.err
    live, offline = (
        b''.join(block.rows.tobytes() for block in waveform_blocks(Recording(path)))
        for path in (recording.path, tmp_path / 'again.mcap')
    )
    assert live == offline
