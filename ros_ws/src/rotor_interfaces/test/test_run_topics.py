# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Ids of runs, namespaces, and topics that only the nodes of a run hear."""

import os
import re
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip('rclpy', reason='needs ROS 2')

import rclpy
from rclpy.context import Context
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node

from rotor_common.errors import ConfigError
from rotor_interfaces import messages, topics
from rotor_interfaces.messages import ROS
from rotor_interfaces.ros import namespace_arguments, qos
from rotor_interfaces.run_topics import ENDING_S, OtherRigs, Progress, RunTopics, new_run_id

TIMEOUT_S = 20.0


def test_later_runs_have_greater_ids() -> None:
    ids = [new_run_id() for _ in range(100)]
    assert len(set(ids)) == 100
    assert [run[:17] for run in ids] == sorted(run[:17] for run in ids)
    assert all(run.isalnum() and not run[0].isdigit() for run in ids)


PART = '[A-Za-z_][A-Za-z0-9_]*'


@given(
    name=st.one_of(
        st.text('ab_1/~-. é', max_size=12),
        st.from_regex(f'/?{PART}(/{PART})*', fullmatch=True).filter(lambda name: len(name) < 200),
    )
)
def test_a_namespace_is_taken_or_refused_in_one_sentence(name: str) -> None:
    if re.fullmatch(f'/?{PART}(/{PART})*', name):
        full = '/' + name.removeprefix('/')
        assert namespace_arguments(name) == [
            '--ros-args', '-r', f'__ns:={full}', '-r', f'/diagnostics:={full}/diagnostics',
            '-r', f'/clock:={full}/clock',
        ]  # fmt: skip
    elif name:
        with pytest.raises(ConfigError, match=re.escape(f'--namespace {name!r} is not allowed')):
            namespace_arguments(name)
    else:
        assert namespace_arguments(name) == []


class Nodes:
    """Nodes of several runs in one process and one ROS domain."""

    def __init__(self) -> None:
        self._context = Context()
        rclpy.init(context=self._context, domain_id=60 + os.getpid() % 40)
        self._executor = EventsExecutor(context=self._context)
        self._nodes: list[Node] = []

    def node(self) -> Node:
        node = Node('node', context=self._context)
        self._nodes.append(node)
        self._executor.add_node(node)
        return node

    def of(self, run_id: str) -> RunTopics:
        return RunTopics(self.node(), run_id)

    def spin_until(self, condition: Callable[[], bool]) -> None:
        deadline = time.monotonic() + TIMEOUT_S
        while not condition():
            assert time.monotonic() < deadline, 'it never happened'
            self._executor.spin_once(0.02)

    def spin_for(self, seconds: float) -> None:
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self._executor.spin_once(0.02)

    def close(self) -> None:
        self._executor.shutdown()
        for node in self._nodes:
            node.destroy_node()
        rclpy.shutdown(context=self._context)


@pytest.fixture
def nodes(monkeypatch: pytest.MonkeyPatch) -> Iterator[Nodes]:
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    made = Nodes()
    yield made
    made.close()


def heard_by(run: RunTopics, topic: topics.Topic) -> list[Any]:
    said: list[Any] = []
    run.subscription(topic, said.append)
    return said


def text(content: str) -> Any:
    return messages.string(ROS, content)


def test_a_node_hears_its_own_run_and_everybody_hears_all(nodes: Nodes) -> None:
    first, second, nobody = nodes.of('r1'), nodes.of('r2'), nodes.of('')
    outputs = [run.publisher(topics.CONFIG) for run in (first, second, nobody)]
    heard = [heard_by(run, topics.CONFIG) for run in (first, second, nobody)]
    nodes.spin_until(lambda: all(output.get_subscription_count() for output in outputs))
    for output, said in zip(outputs, ('one', 'two', 'free'), strict=True):
        output.publish(text(said))
    nodes.spin_until(lambda: len(heard[2]) == 3 and all(heard))
    nodes.spin_for(0.3)
    assert [[message.data for message in received] for received in heard[:2]] == [['one'], ['two']]
    assert {message.data for message in heard[2]} == {'one', 'two', 'free'}


def test_before_the_run_begins_only_its_nodes_hear(nodes: Nodes) -> None:
    run, nobody = nodes.of('r1'), nodes.of('')
    output, progress = run.publisher(topics.CONFIG), Progress(run, 'monitor')
    inside, outside = heard_by(run, topics.CONFIG), heard_by(nobody, topics.CONFIG)
    stamps = heard_by(nobody, topics.PROGRESS)
    output.publish(text('early'), inside=True)
    progress.report(0)
    nodes.spin_until(lambda: bool(inside))
    nodes.spin_for(0.5)
    assert not outside
    assert not stamps
    output.publish_outside()
    progress.report(7)
    nodes.spin_until(lambda: bool(outside and stamps))
    assert [message.data for message in (*inside, *outside)] == ['early', 'early']
    assert [messages.stamp_ns(message) for message in stamps] == [7]


def test_other_sources_are_counted_but_for_later_runs(nodes: Nodes) -> None:
    early, late, free = nodes.of('r1'), nodes.of('r2'), nodes.of('')
    runs = (early, late, free)

    def counts() -> list[int]:
        return [run.other_sources(topics.WAVEFORM) for run in runs]

    early.publisher(topics.WAVEFORM)
    nodes.spin_until(lambda: counts() == [0, 1, 0])
    late.publisher(topics.WAVEFORM)
    nodes.spin_until(lambda: counts() == [0, 1, 1])
    nodes.spin_for(0.3)
    assert counts() == [0, 1, 1]
    free.publisher(topics.WAVEFORM)
    nodes.spin_until(lambda: counts() == [1, 2, 2])


@pytest.mark.slow
def test_a_rig_that_flies_on_is_told_from_one_that_ends(nodes: Nodes) -> None:
    node, free = nodes.node(), nodes.of('')
    run = RunTopics(node, 'r1')
    run.publisher(topics.WAVEFORM)
    rigs = OtherRigs(node, run)
    assert rigs.obstacles() == ['still listening for another source']
    nodes.spin_until(lambda: rigs.obstacles() == [])

    output = free.publisher(topics.WAVEFORM)
    nodes.spin_until(lambda: bool(rigs.obstacles()))
    assert not rigs.stay()
    nodes.spin_until(lambda: output.get_subscription_count() == 1)

    def fly(until: Callable[[], bool]) -> float:
        began = time.monotonic()
        while not until():
            assert time.monotonic() - began < TIMEOUT_S, 'it never happened'
            output.publish(messages.ros_class(topics.WAVEFORM.type)())
            nodes.spin_for(0.025)
        return time.monotonic() - began

    assert fly(rigs.stay) >= ENDING_S
    (obstacle,) = rigs.obstacles()
    assert obstacle.startswith('another source publishes rotor/waveform in this ROS domain (end')
    nodes.spin_until(lambda: not rigs.stay())
    assert rigs.obstacles()  # its publisher is still there
    assert rigs.text() == ''
    rigs.begin()
    nodes.spin_until(lambda: rigs.topics == ['rotor/waveform'])
    assert rigs.text() == 'another source publishes rotor/waveform in this ROS domain'


def test_what_a_recorder_keeps_is_bit_for_bit_what_was_published(nodes: Nodes) -> None:
    run = nodes.of('r1')
    raw: list[bytes] = []
    run.subscription(topics.TRUTH, raw.append, raw=True)
    output = run.publisher(topics.TRUTH)
    plain = nodes.node()
    direct: list[bytes] = []
    plain_output = plain.create_publisher(
        messages.ros_class(topics.TRUTH.type), 'direct', qos(topics.TRUTH)
    )
    plain.create_subscription(
        messages.ros_class(topics.TRUTH.type),
        'direct',
        direct.append,
        qos(topics.TRUTH),
        raw=True,
    )
    message = messages.joint_state(ROS, 123, 'rotor', ['a', 'load_factor'], np.arange(2.0))
    output.publish(message)
    plain_output.publish(message)
    nodes.spin_until(lambda: bool(raw and direct))
    assert raw == direct
    assert messages.from_cdr(raw[0], topics.TRUTH.type).name == ['a', 'load_factor']


@pytest.mark.parametrize('run_id', ['a b', 'a/b', 'ä', '-'])
def test_an_id_that_no_topic_can_have_is_refused(nodes: Nodes, run_id: str) -> None:
    with pytest.raises(ConfigError, match=r'run_id = .* is not allowed'):
        nodes.of(run_id)
