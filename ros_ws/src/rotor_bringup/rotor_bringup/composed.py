# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""All nodes of the rig in one process: the same nodes, one executor."""

import sys
from typing import cast

from maneuver_gen.node import ManeuverNode
from rotor_interfaces import ros
from rotor_interfaces.ros import RigNode
from rotor_recording.recorder_node import RecorderNode
from rotor_sim.node import RotorSimNode
from vibration_monitor.node import MonitorNode


def create() -> list[RigNode]:
    """Return the four nodes in the order in which they finish."""
    return cast(list[RigNode], [RotorSimNode(), ManeuverNode(), MonitorNode(), RecorderNode()])


def main(args: list[str] | None = None) -> int:
    """Run all nodes until the simulator is done or a signal comes; return the exit code."""
    return ros.run(create, args, has_end=True)


if __name__ == '__main__':
    sys.exit(main())
