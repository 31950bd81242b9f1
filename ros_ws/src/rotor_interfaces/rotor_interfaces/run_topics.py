# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Hidden topics of one run, which separate its nodes from all others.

A message of ROS 2 does not say who sent it. So the nodes that share a `run_id` talk to each other
on hidden topics that have this id in their name, `_run_ID/rotor/waveform`, where nobody else
publishes; on the topics of the contract everything goes out a second time, for everybody else.
"""

import math
import re
import secrets
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from rotor_common.errors import ConfigError
from rotor_interfaces import messages, ros, topics
from rotor_interfaces.ros import Node
from rotor_interfaces.topics import Topic

RUN_ID = 'run of this node, which then hears only the nodes of the same run; empty: hears everybody'
"""Description of the parameter `run_id` of every node."""
_HIDDEN = '_run_'
LISTEN_S = 1.0
"""Without a block for this long, no other rig is running."""
ENDING_S = 3.0
"""How long to wait for another running rig, which may be about to end."""
LOOK_S = 1.0
WAIT_LOOK_S = 0.05
_SHARED = (topics.DIAGNOSTICS, topics.PROGRESS)  # what several nodes of a rig publish
_ALLOWED = re.compile(r'[A-Za-z0-9_]*')


def new_run_id() -> str:
    """Return an id that no other run has; the ids of later runs are greater."""
    # begins with a letter: nothing may take it for a number
    return f'r{time.time_ns():016x}{secrets.token_hex(4)}'


class RunPublisher:
    """Publishes a topic to the nodes of the run and to everybody else.

    Without a run there is only one topic, on which everybody listens.
    """

    def __init__(self, inside: Any, outside: Any) -> None:
        self._inside = inside
        self._outside = outside
        self._held: Any = None

    def publish(self, message: Any, *, inside: bool = False) -> None:
        """Publish to all; with `inside` only to the run, while it may still be refused."""
        # not serialized once for both: rclpy then adds more bytes than readers of CDR allow
        self._inside.publish(message)
        if inside:
            self._held = message
        elif self._outside is not None:
            self._outside.publish(message)

    def publish_outside(self) -> None:
        """Publish the last message of the run to everybody else."""
        if self._outside is not None and self._held is not None:
            self._outside.publish(self._held)

    def get_subscription_count(self) -> int:
        """Return how many nodes of the run listen; without a run, how many nodes."""
        return int(self._inside.get_subscription_count())


class RunTopics:
    """Makes the publishers and subscriptions of a node that belongs to a run, or to none.

    Raises:
        ConfigError: a `run_id` that cannot be part of a topic's name.

    """

    def __init__(self, node: Node, run_id: str) -> None:
        if not _ALLOWED.fullmatch(run_id):
            raise ConfigError(
                f'run_id = {run_id!r} is not allowed; it must consist of letters, digits and '
                'underscores, or be empty'
            )
        self.run_id = run_id
        self._node = node
        self._outputs: list[Any] = []

    def publisher(self, topic: Topic) -> RunPublisher:
        """Return a publisher with the type and QoS of the contract."""
        # the hidden one first: others then never see the public one alone
        inside = ros.publisher(self._node, self._inside(topic))
        outside = ros.publisher(self._node, topic) if self.run_id else None
        self._outputs += [inside] if outside is None else [inside, outside]
        return RunPublisher(inside, outside)

    def subscription(
        self, topic: Topic, callback: Callable[[Any], None], *, raw: bool = False
    ) -> Any:
        """Return a subscription to the nodes of the run; raw = CDR bytes."""
        return ros.subscription(self._node, self._inside(topic), callback, raw=raw)

    def wait_until_acknowledged(self) -> None:
        """Wait until all readers have what was published, the run's own first."""
        ros.wait_until_acknowledged(self._outputs)

    def other_sources(self, topic: Topic) -> int:
        """Return how many others publish a topic of the contract.

        Without a run that is all but one. Publishers of later runs do not count: a run gives way
        to every earlier one, so that of two that start together one runs.
        """
        if not self.run_id:
            return max(self._count(topic.name) - 1, 0)
        own = self._count(self._inside(topic).name)
        others = self._count(topic.name) - own
        if others > 0:
            later = {run for run in self._runs() if run > self.run_id}
            others -= sum(self._count(hidden_name(topic, run)) for run in later)
        return max(others, own - 1, 0)  # who knows the ID can publish on the hidden topic alone

    def _count(self, name: str) -> int:
        return int(self._node.count_publishers(name))

    def _runs(self) -> set[str]:
        """Return the ids of all runs in this namespace that have a topic."""
        begin = self._node.resolve_topic_name(f'{_HIDDEN}x')[:-1]
        names = [name for name, _ in self._node.get_topic_names_and_types()]
        return {
            name.removeprefix(begin).partition('/')[0] for name in names if name.startswith(begin)
        }

    def _inside(self, topic: Topic) -> Topic:
        return replace(topic, name=hidden_name(topic, self.run_id)) if self.run_id else topic


class OtherRigs:
    """Finds out whether others publish the topics that the rig of this simulator publishes.

    Before the run begins, by the ROS graph and by the blocks that come on the topic of the
    contract, where this rig does not publish yet; then by the graph.

    `topics` are the names of the topics that others published at the last look.
    """

    def __init__(self, node: Node, run: RunTopics) -> None:
        self.topics: list[str] = []
        self._node = node
        self._run = run
        self._made_s = time.monotonic()
        self._first_s = self._last_s = -math.inf  # when a block of the other rig came
        self._found: list[Topic] = []
        self._next_look_s = self._made_s
        self._flight: Any = None
        if run.run_id:  # without a run our own subscription would count as a consumer's
            waveform = replace(topics.WAVEFORM, depth=1, best_effort=True)
            self._flight = ros.subscription(node, waveform, self._on_block, raw=True)

    def _on_block(self, _: bytes) -> None:
        now = time.monotonic()
        if now - self._last_s > LISTEN_S:
            self._first_s = now
        self._last_s = now

    def obstacles(self) -> list[str]:
        """Return why the run cannot begin now, in a sentence for each reason."""
        now = time.monotonic()
        if now >= self._next_look_s:  # not each time: the other rig needs the processor
            self._next_look_s = now + WAIT_LOOK_S
            awaited = (topics.WAVEFORM, topics.MANEUVER_LOAD)
            self._found = [topic for topic in awaited if self._run.other_sources(topic)]
        found = list(self._found)
        if self._is_flying() and topics.WAVEFORM not in found:
            found.insert(0, topics.WAVEFORM)
        if not found and self._flight is not None and now - self._made_s < LISTEN_S:
            return ['still listening for another source']
        return [
            f'another source publishes {topic.name} in this ROS domain (end it, choose another '
            'ROS_DOMAIN_ID, or give --namespace)'
            for topic in found
        ]

    def stay(self) -> bool:
        """Say whether another rig has run for so long that it is not about to end."""
        return self._is_flying() and time.monotonic() - self._first_s > ENDING_S

    def begin(self) -> None:
        """Look at the graph from now on, since this rig begins to publish."""
        if self._flight is not None:
            self._node.destroy_subscription(self._flight)
        ros.timer(self._node, LOOK_S, self._look)

    def _look(self) -> None:
        before = self.topics
        self.topics = [
            topic.name
            for topic in topics.TOPICS
            if topic not in _SHARED and self._run.other_sources(topic)
        ]
        if set(self.topics) - set(before):
            self._node.get_logger().warning(self.text())

    def text(self) -> str:
        """Return in a few words what others publish, '' for nothing."""
        names = ', '.join(self.topics)
        return f'another source publishes {names} in this ROS domain' if names else ''

    def _is_flying(self) -> bool:
        return time.monotonic() - self._last_s < LISTEN_S


class Progress:
    """Reports on `rig/progress` how far a consumer has come.

    The stamp is that of the newest block consumed; zero means ready, nothing consumed yet.
    """

    def __init__(self, run: RunTopics, consumer: str) -> None:
        self._publisher = run.publisher(topics.PROGRESS)
        self._consumer = consumer

    def report(self, stamp_ns: int) -> None:
        """Publish the stamp of the newest consumed block; 0 = ready, for the own run alone."""
        header = messages.header(messages.ROS, stamp_ns, self._consumer)
        self._publisher.publish(header, inside=not stamp_ns)


def hidden_name(topic: Topic, run_id: str) -> str:
    """Return the name on which the nodes of a run publish a topic among themselves."""
    return f'{_HIDDEN}{run_id}/{topic.name.lstrip("/")}'
