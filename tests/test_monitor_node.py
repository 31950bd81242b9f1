# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The monitor as a process, on a source that is not ours: gaps, bad blocks, silence."""

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rotor_interfaces import topics
from rotor_interfaces.messages import level_of, sample_stamp_ns
from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock, encode

pytestmark = pytest.mark.slow
RATE_HZ = 10_240
BLOCK = 256
SPEED_RAD_S = 352.0


class Source:
    """Publishes blocks to a monitor process and hears its diagnostics."""

    def __init__(self, domain: dict[str, str]) -> None:
        import rclpy
        from rclpy.context import Context
        from rclpy.experimental.events_executor import EventsExecutor
        from rclpy.node import Node

        from rotor_interfaces import ros

        self._context = Context()
        rclpy.init(context=self._context, domain_id=int(domain['ROS_DOMAIN_ID']))
        self._node = Node('foreign_source', context=self._context)
        self._publisher = ros.publisher(self._node, topics.WAVEFORM)
        self.diagnostics: list[Any] = []
        self.alarms: list[Any] = []
        ros.subscription(self._node, topics.DIAGNOSTICS, self.diagnostics.append)
        ros.subscription(self._node, topics.ALARM, self.alarms.append)
        self._executor = EventsExecutor(context=self._context)
        self._executor.add_node(self._node)
        self.wait_for(lambda: self._publisher.get_subscription_count() == 1, 90.0)

    def wait_for(self, condition: Callable[[], bool], timeout_s: float = 300.0) -> None:
        deadline = time.monotonic() + timeout_s
        while not condition():
            assert time.monotonic() < deadline, 'it never happened'
            self._executor.spin_once(0.05)

    def send(self, number: int, **change: Any) -> None:
        rows = np.zeros(BLOCK, WAVEFORM_DTYPE)
        sample = number * BLOCK + np.arange(BLOCK)
        rows['time'] = np.arange(BLOCK) / RATE_HZ
        rows['sample'] = sample
        rows['angle'] = SPEED_RAD_S * sample / RATE_HZ
        rows['disk_z'] = 1e-6 * np.cos(rows['angle'])
        stamp_ns = sample_stamp_ns(10**18, number * BLOCK, RATE_HZ)
        message = encode(WaveformBlock(stamp_ns, rows))
        for name, value in change.items():
            setattr(message, name, value)
        self._publisher.publish(message)
        self._executor.spin_once(0.002)

    def reports(self) -> list[tuple[int, str, dict[str, str]]]:
        """Level, text and values of every report of the monitor so far."""
        return [
            (level_of(status), status.message, {v.key: v.value for v in status.values})
            for array in self.diagnostics
            for status in array.status
            if status.name == 'vibration_monitor: stream'
        ]

    def close(self) -> None:
        import rclpy

        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.shutdown(context=self._context)


@contextmanager
def monitored(domain: dict[str, str]) -> Iterator[Source]:
    """Start a monitor and give what talks to it, once it listens."""
    process = subprocess.Popen(
        [sys.executable, '-m', 'vibration_monitor.node'], env=domain, stdin=subprocess.DEVNULL
    )
    try:
        source = Source(domain)
        yield source
        source.close()
    finally:
        process.terminate()
        assert process.wait(300) == 0


@pytest.fixture
def source(domain: dict[str, str]) -> Iterator[Source]:
    with monitored(domain) as source:
        yield source


def test_a_monitor_that_listens_has_nothing_left_to_compile(
    domain: dict[str, str], tmp_path: Path
) -> None:
    # the first window would take 10 s, in which a run in real time loses samples
    cache = tmp_path / 'cache'
    with monitored({**domain, 'NUMBA_CACHE_DIR': str(cache)}) as source:
        before = set(cache.rglob('*.nbc'))
        assert any('windowed_sums' in path.name for path in before)
        for number in range(100):
            source.send(number)
        source.wait_for(lambda: any(int(each[2]['windows [1]']) for each in source.reports()))
        assert set(cache.rglob('*.nbc')) == before


@pytest.mark.real_time
def test_lost_and_bad_blocks_are_counted_and_silence_is_reported(source: Source) -> None:
    for number in range(45):
        if number != 20:
            source.send(number)
    source.wait_for(lambda: len(source.reports()) > 1)
    level, _, values = source.reports()[-1]
    assert level == 1
    assert values['lost samples [1]'] == str(BLOCK)
    source.send(45, is_bigendian=True)
    for number in range(46, 90):
        source.send(number)
    source.wait_for(lambda: source.reports()[-1][2]['refused blocks [1]'] == '1')
    assert source.reports()[-1][2]['lost samples [1]'] == str(2 * BLOCK)
    source.wait_for(lambda: source.reports()[-1][0] == 3)
    assert 'no block for' in source.reports()[-1][1]
    source.wait_for(lambda: level_of(source.alarms[-1].status[0]) == 3)
