# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Node `replay` of an evaluation: replays an anonymous flight and notes what is said about it.

`python -m rotor_bench.evaluation.listener_node FILE TOPIC RATE OUT`; OUT becomes a JSON mapping:
`said` is a list of (time in s, score, reason), `failure` says what is wrong with the node, and
`is_absent` whether there was none. The time is that of /clock when it was heard: the end of the
newest block that was out by then; no stamp makes it earlier. Scores are the levels of a
DiagnosticArray (0, 1, 2; 3, stale, is no score) or the value of a Float64.
"""

import json
import math
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rotor_bench.evaluation.pipe_protocol import one_line
from rotor_common.constants import NANOSECONDS
from rotor_common.exit_code import ExitCode
from rotor_interfaces import messages, ros, topics
from rotor_interfaces.topics import Topic
from rotor_recording.reading import Recording
from rotor_recording.replay import ReplayOptions
from rotor_recording.replay_node import ReplayNode
from vibration_monitor.detection import Level

LOOK_S = 0.05
QUIET_S = 1.0
"""A node may still publish for this long after the last block, and after its last message."""
_SAID = ('diagnostic_msgs/msg/DiagnosticArray', 'std_msgs/msg/Float64')
LONGEST_AFTER_S = 5.0
"""A node that publishes by a timer never falls silent: after this time the flight is over."""
PATIENCE_S = 15.0
"""How long a node may take until it publishes the topic and listens to the waveform."""


MOST_SAID = 100_000
"""Messages of one flight that are kept: several for every block of an hour."""


class ListenerNode(ReplayNode):
    """Replays once a node that publishes the topic listens, and records what it publishes."""

    def __init__(self, file: Path, topic: str, rate: float) -> None:
        options = ReplayOptions(
            rate=rate, loop=False, start_s=0.0, topics=(), wait_for_subscribers_s=PATIENCE_S
        )
        super().__init__(Recording(file), options)
        self.said: list[tuple[float, float, str]] = []
        self.failure = ''
        self.is_absent = False
        self._topic = topic if topic.startswith('/') else f'/{topic}'
        self._input: Any = None
        self._made_s = time.monotonic()
        self._heard_s = -math.inf
        self._quiet_since_s = self._over_s = math.inf
        self._looking = ros.timer(self, LOOK_S, self._look)

    def _look(self) -> None:
        """Subscribe to the topic as soon as it is there, with the type that it has."""
        if self._input is None:
            types = dict(self.get_topic_names_and_types()).get(self._topic)
            if types and types[0] not in _SAID:
                self.failure = f'{self._topic} is {types[0]}; a detector says {" or ".join(_SAID)}'
            elif types:
                self._input = ros.subscription(self, Topic(self._topic, types[0], 256), self._hear)
        waited_s = time.monotonic() - self._made_s
        if waited_s > PATIENCE_S and (self._input is None or not self.published):
            self.is_absent = True
            self.failure = (
                f'no node published {self._topic} and listened to {topics.WAVEFORM.name} within '
                f'{PATIENCE_S:g} s'
            )

    def _start_if_heard(self) -> None:
        if self._input is not None and self._input.get_publisher_count():
            super()._start_if_heard()

    def _hear(self, message: Any) -> None:
        self._heard_s = time.monotonic()
        if len(self.said) >= MOST_SAID:
            self.failure = f'it published more than {MOST_SAID} messages in one flight'
        elif hasattr(message, 'status'):
            text = one_line('; '.join(status.message for status in message.status))
            time_ns = dated(messages.stamp_ns(message), self._clock_ns)
            self.said.append((time_ns / NANOSECONDS, worst_level(message.status), text))
        elif hasattr(message, 'data'):
            self.said.append((self._clock_ns / NANOSECONDS, float(message.data), ''))

    def is_done(self) -> bool:
        """Say whether the flight is over and the node has fallen silent."""
        if self.failure:
            return True
        if not super().is_done():
            return False
        now_s = time.monotonic()
        self._over_s = min(self._over_s, now_s)
        self._quiet_since_s = max(self._heard_s, min(self._quiet_since_s, now_s))
        return now_s - self._quiet_since_s > QUIET_S or now_s - self._over_s > LONGEST_AFTER_S


def dated(stamp_ns: int, clock_ns: int) -> int:
    """Return the time of a message with `stamp_ns` that was heard when /clock was `clock_ns`.

    A stamp of 0, or one before the clock, does not date it back; a negative one is kept, so that
    it is reported as outside the flight.
    """
    return stamp_ns if stamp_ns < 0 else max(stamp_ns, clock_ns)


def worst_level(statuses: Sequence[Any]) -> float:
    """Return the highest level, NaN where all are stale or there are none."""
    levels = (status.level for status in statuses)
    numbers = [level[0] if isinstance(level, bytes) else int(level) for level in levels]
    return float(max((n for n in numbers if n != Level.STALE), default=math.nan))


def main(arguments: Sequence[str] | None = None) -> int:
    """Replay one flight; return the exit code."""
    file, topic, rate, out = sys.argv[1:] if arguments is None else arguments
    nodes: list[ListenerNode] = []

    def create() -> list[ListenerNode]:
        nodes.append(ListenerNode(Path(file), topic, float(rate)))
        return nodes

    code = ros.run(create, [], has_end=True)
    if code == ExitCode.DONE:
        node = nodes[0]
        found = {'said': node.said, 'failure': node.failure, 'is_absent': node.is_absent}
        Path(out).write_text(json.dumps(found), 'utf-8')
    return code


if __name__ == '__main__':
    sys.exit(main())
