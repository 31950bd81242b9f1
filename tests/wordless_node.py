# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes that are no detectors: `nan`, `empty`, `type`, `timer` and `silent` say no number."""

import sys
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Float64, String

KINDS = {'nan': Float64, 'timer': Float64, 'empty': DiagnosticArray, 'type': String}


class WordlessNode(Node):  # type: ignore[misc]
    """Answers every block in the way that was asked for."""

    def __init__(self, how: str) -> None:
        super().__init__('wordless')
        self._how = how
        self._output = self.create_publisher(KINDS[how], 'my/score', 100) if how in KINDS else None
        self.create_subscription(PointCloud2, 'rotor/waveform', self._on_waveform, 256)
        if how == 'timer':
            self.create_timer(0.02, lambda: self._on_waveform(None))

    def _on_waveform(self, _: Any) -> None:
        if self._output is None:
            return
        message = KINDS[self._how]()
        if isinstance(message, Float64):
            message.data = float('nan')
        self._output.publish(message)


def main() -> None:
    rclpy.init()
    try:
        rclpy.spin(WordlessNode(sys.argv[1]))
    except KeyboardInterrupt:
        sys.exit(0)


if __name__ == '__main__':
    main()
