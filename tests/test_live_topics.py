# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The rig as an independent subscriber sees it: rates, units, and no sample missing in 20 s."""

import json
import os
import subprocess
import time
from collections import defaultdict
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from live_flight import CLI

from rotor_interfaces import topics
from rotor_interfaces.gaps import SampleContinuity
from rotor_interfaces.waveform import WAVEFORM_DTYPE, decode

DURATION_S = 20


@pytest.fixture(scope='module')
def heard(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Any]]:
    """Everything that a subscriber of its own hears during the default scenario."""
    pytest.importorskip('rclpy', reason='needs ROS 2')
    import rclpy
    from live_flight import private_environment
    from rclpy.context import Context
    from rclpy.experimental.events_executor import EventsExecutor
    from rclpy.node import Node

    from rotor_interfaces import access, ros

    folder = tmp_path_factory.mktemp('listener')
    environment = private_environment(folder / 'log')
    context = Context()
    with patch.dict(os.environ):
        access.keep_on_this_machine()  # the rig's DDS profile: without it a rig is found 0.4 s late
        rclpy.init(context=context, domain_id=int(environment['ROS_DOMAIN_ID']))
        node = Node('listener', context=context)
    messages: dict[str, list[Any]] = defaultdict(list)
    for topic in topics.TOPICS:
        ros.subscription(node, topic, messages[topic.name].append)
    executor = EventsExecutor(context=context)
    executor.add_node(node)
    process = subprocess.Popen(
        [*CLI, 'run', '--record', str(folder), '--json'],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        stdin=subprocess.DEVNULL,
        text=True,
    )
    deadline = time.monotonic() + 300
    while process.poll() is None and time.monotonic() < deadline:
        executor.spin_once(0.1)
    ros.spin_until_quiet(executor)
    out, err = process.communicate(timeout=10)
    executor.shutdown()
    node.destroy_node()
    rclpy.shutdown(context=context)
    assert process.returncode == 0, err
    messages['summary'] = [json.loads(out)]
    return messages


pytestmark = [pytest.mark.slow, pytest.mark.real_time]


def test_no_sample_is_missing(heard: dict[str, list[Any]]) -> None:
    stream = SampleContinuity()
    for message in heard['rotor/waveform']:
        block = decode(message)
        assert block.rows.dtype == WAVEFORM_DTYPE
        stream.check(block.first_sample, len(block.rows))
    assert decode(heard['rotor/waveform'][0]).first_sample == 0
    assert stream.next_sample == DURATION_S * 10_240
    assert (stream.gaps, stream.restarts) == (0, 0)
    assert heard['summary'][0]['lost_samples'] == 0


def test_rates_are_those_of_the_contract(heard: dict[str, list[Any]]) -> None:
    counts = {name: len(received) for name, received in heard.items()}
    blocks = DURATION_S * 40
    assert counts['rotor/waveform'] == blocks
    assert counts['rotor/shaft'] == blocks
    assert counts['rotor/truth'] == blocks
    assert counts['maneuver/load'] >= DURATION_S * 100
    # the anti-alias filter, 17 outputs to each side, is not complete at the two ends
    assert DURATION_S * 200 - 2 * 17 <= counts['rotor/bearing_1/imu'] <= DURATION_S * 200
    assert counts['rotor/bearing_1/imu'] == counts['rotor/bearing_2/imu']
    # best effort: a tick may be lost, and nobody waits for it
    assert counts['/clock'] >= 0.9 * blocks
    # windows of 64 revolutions, a new one every 16, at 352 rad/s
    revolutions = 352.0 * DURATION_S / (2.0 * np.pi)
    assert counts['monitor/indicators'] == (int(revolutions) - 64) // 16 + 1
    assert counts['monitor/spectrum'] == counts['monitor/indicators']
    assert counts['monitor/alarm'] >= DURATION_S - 1


def test_stamps_follow_the_sample_count(heard: dict[str, list[Any]]) -> None:
    from rotor_interfaces.messages import sample_stamp_ns, stamp_ns

    epoch = stamp_ns(heard['maneuver/load'][0])
    assert abs(time.time_ns() - epoch) < 600e9, 'the epoch of a live run is the wall clock'
    for message in heard['rotor/waveform']:
        expected = sample_stamp_ns(epoch, decode(message).first_sample, 10_240)
        assert stamp_ns(message) == expected
    for k, message in enumerate(heard['maneuver/load']):
        assert stamp_ns(message) == epoch + k * 10_000_000


def test_the_load_the_truth_and_the_imu_agree(heard: dict[str, list[Any]]) -> None:
    load = np.array([message.accel.linear.y for message in heard['maneuver/load']])
    truth = np.array([m.position[list(m.name).index('load_factor')] for m in heard['rotor/truth']])
    grid_times = np.arange(len(load)) / 100
    block_times = np.arange(len(truth)) * 0.025
    np.testing.assert_allclose(truth, np.interp(block_times, grid_times, load) / 9.81, atol=1e-12)
    # REP-145: an accelerometer at rest in level flight reads +1 g away from the ground, and
    # rotor +y points to the ground
    resting = np.array([m.linear_acceleration.y for m in heard['rotor/bearing_1/imu'][:100]])
    assert resting.mean() == pytest.approx(-9.81, abs=0.3)
    assert heard['rotor/bearing_1/imu'][0].orientation_covariance[0] == -1.0


def test_the_configuration_is_enough_to_run_it_again(
    heard: dict[str, list[Any]],
) -> None:
    from rotor_rig.scenario_model import Scenario, load_scenario

    config = json.loads(heard['rotor/config'][0].data)
    assert Scenario.from_mapping(config['scenario']) == load_scenario('climb_dive')
    assert config['column_units']['disk_y'] == 'm'
    assert config['versions']['rotor_sim']


def test_health_is_reported_and_good(heard: dict[str, list[Any]]) -> None:
    names = {status.name for array in heard['/diagnostics'] for status in array.status}
    assert {
        'rotor_sim: co-simulation',
        'vibration_monitor: stream',
        'recorder: stream',
    } <= names
