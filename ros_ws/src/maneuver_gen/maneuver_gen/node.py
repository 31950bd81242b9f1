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

from maneuver_gen.config import parse_maneuver
from maneuver_gen.errors import ManeuverError
from maneuver_gen.load_grid import LOAD_RATE_HZ, load_grid
from rotor_interfaces import messages, ros, topics
from rotor_interfaces.errors import ConfigError
from rotor_interfaces.messages import NANOSECONDS, ROS
from rotor_interfaces.ros import Node
from rotor_interfaces.run_topics import RUN_ID, RunTopics

GRID_STEP_NS = NANOSECONDS // LOAD_RATE_HZ


class ManeuverNode(Node):  # type: ignore[misc]
    """Publishes `maneuver/load` for one flight."""

    def __init__(self) -> None:
        super().__init__('maneuver_gen')
        config = ros.declare(
            self, 'config', '', 'manoeuvre section of a scenario as JSON; empty: level flight'
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
        self._publisher = run.publisher(topics.MANEUVER_LOAD)
        run.subscription(topics.PROGRESS, self._on_progress)

    def _on_progress(self, message: Any) -> None:
        if message.frame_id != self._consumer:
            return
        consumed_ns = messages.stamp_ns(message)
        if self._epoch_ns >= 0:
            if consumed_ns == 0:
                raise ManeuverError(
                    f'{self._consumer} started anew in the middle of a flight; a flight has one '
                    'simulator, so start the whole rig again'
                )
            self._publish_until(consumed_ns)
        elif consumed_ns == 0:
            self._epoch_ns = time.time_ns()
            self._publish_until(self._epoch_ns)

    def _publish_until(self, consumed_ns: int) -> None:
        """Publish every grid point up to the lead beyond `consumed_ns`."""
        limit_ns = consumed_ns + int(self._lead_s * NANOSECONDS)
        while self._next < len(self._grid):
            stamp_ns = self._epoch_ns + self._next * GRID_STEP_NS
            if stamp_ns > limit_ns:
                return
            load_y, load_z = self._grid[self._next]
            self._publisher.publish(messages.load(ROS, stamp_ns, load_y, load_z))
            self._next += 1

    def is_done(self) -> bool:
        """Say no: the latched grid must outlive the run; a signal ends the node."""
        return False

    def finish(self) -> None:
        """Owe nothing: the grid is latched."""


def main(args: list[str] | None = None) -> int:
    """Run the node until a signal; return the exit code."""
    return ros.run(lambda: [ManeuverNode()], args)


if __name__ == '__main__':
    sys.exit(main())
