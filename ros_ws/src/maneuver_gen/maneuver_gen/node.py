# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Node `maneuver_gen`: publishes the load grid ahead of the simulator by a lead.

Thin adapter around `maneuver_gen.load_grid`: point k of the 100 Hz grid carries the stamp
epoch + k * 10 ms. The epoch is the wall clock at the moment when the simulator reports ready on
`rig/progress`; from then on its reports are the credit: the grid is sent up to the lead beyond
what the simulator has consumed, at whatever speed it runs.
"""

import sys
import time
from typing import Any

from maneuver_gen.errors import ManeuverError
from maneuver_gen.load_grid import load_grid
from maneuver_gen.registry import parse_maneuver
from rotor_common.constants import LOAD_STEP_NS, NANOSECONDS
from rotor_common.errors import ConfigError
from rotor_interfaces import messages, ros, topics
from rotor_interfaces.credit import Credit
from rotor_interfaces.messages import ROS
from rotor_interfaces.ros import Node
from rotor_interfaces.run_topics import RUN_ID, RunTopics


class ManeuverNode(Node):  # type: ignore[misc]
    """Publishes `maneuver/load` for one flight."""

    def __init__(self) -> None:
        super().__init__('maneuver_gen')
        config = ros.declare(
            self, 'config', '', 'maneuver section of a scenario as JSON; empty: level flight'
        )
        duration_s = ros.declare(self, 'duration_s', 20.0, 'length of the flight [s]')
        self._lead_s = ros.declare(
            self, 'lead_s', 2.0, 'how far the grid runs ahead of the simulator [s], 0.1 to 10'
        )
        self._consumer = ros.declare(
            self, 'consumer', 'rotor_sim', 'name on rig/progress whose credit paces the grid'
        )
        run = RunTopics(self, ros.declare(self, 'run_id', '', RUN_ID))
        if not 0.1 <= self._lead_s <= 10.0:
            raise ConfigError(f'lead_s = {self._lead_s:g} is out of range; allowed: 0.1 to 10 s')
        self._grid = load_grid(parse_maneuver(config or '{"profile": "constant"}'), duration_s)
        self._epoch_ns = -1  # until the simulator is ready
        self._next = 0
        self._credit = Credit()
        self._simulators: set[bytes] = set()  # whoever published the credit first
        self._is_doubtful = False  # ready was reported again, which any node can do
        self._publisher = run.publisher(topics.MANEUVER_LOAD)
        self._progress = run.subscription(topics.PROGRESS, self._on_progress)

    def _on_progress(self, message: Any) -> None:
        if message.frame_id != self._consumer:
            return
        stamp_ns = messages.stamp_ns(message)
        if self._epoch_ns < 0:
            if stamp_ns == 0:
                self._epoch_ns = time.time_ns()
                self._credit.take(0, 0)  # ready
                self._simulators = self._publishers_of_credit()
                self._publish_until(self._epoch_ns)
            return
        self._is_doubtful |= stamp_ns == 0
        if self._has_started_anew():
            raise ManeuverError(
                f'{self._consumer} restarted in the middle of a flight; a flight has one '
                'simulator, so start the whole rig again'
            )
        refused = self._credit.refused
        self._credit.take(stamp_ns, self._epoch_ns + (self._next - 1) * LOAD_STEP_NS)
        if self._credit.refused > refused:
            self.get_logger().warning(
                f'rig/progress refused: {self._consumer} cannot be at {stamp_ns} ns '
                f'({self._credit.refused} reports refused so far)',
                throttle_duration_sec=1.0,
            )
        self._publish_until(self._credit.consumed_ns)

    def _has_started_anew(self) -> bool:
        """Say whether ready was reported again and the simulator is gone before all was sent."""
        is_out = self._next >= len(self._grid)  # then all is sent, and it may have ended
        if is_out or (self._simulators and not self._is_doubtful):
            return False
        there = self._publishers_of_credit()
        self._simulators = self._simulators or there
        return bool(self._simulators) and not self._simulators & there

    def _publishers_of_credit(self) -> set[bytes]:
        """Return the ids of the publishers of rig/progress in nodes of the consumer's name."""
        return {
            bytes(found.endpoint_gid)
            for found in self.get_publishers_info_by_topic(self._progress.topic_name)
            if found.node_name == self._consumer
        }

    def _publish_until(self, consumed_ns: int) -> None:
        """Publish every grid point up to the lead beyond `consumed_ns`, or beyond the epoch."""
        limit_ns = max(consumed_ns, self._epoch_ns) + int(self._lead_s * NANOSECONDS)
        while self._next < len(self._grid):
            stamp_ns = self._epoch_ns + self._next * LOAD_STEP_NS
            if stamp_ns > limit_ns:
                return
            load_y, load_z = self._grid[self._next]
            self._publisher.publish(messages.load(ROS, stamp_ns, load_y, load_z))
            self._next += 1

    def is_done(self) -> bool:
        """Say no: the latched grid must outlive the run; a signal ends the node."""
        return False

    def finish(self) -> None:
        """Do nothing: the grid is latched."""


def main(args: list[str] | None = None) -> int:
    """Run the node until a signal; return the exit code."""
    return ros.run(lambda: [ManeuverNode()], args)


if __name__ == '__main__':
    sys.exit(main())
