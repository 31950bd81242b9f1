# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A small node as a user would write it: publishes the largest |disk_y| so far in 10 um."""

import sys
from typing import Any

import numpy as np
import rclpy
from rclpy.node import Node
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Float64

from rotor_interfaces.waveform import decode

FORBIDDEN = ('truth', 'config', 'load')


class ScoreNode(Node):  # type: ignore[misc]
    """Scores NaN for good once it has seen a topic that a detector must not see."""

    def __init__(self) -> None:
        super().__init__('score')
        self.largest = 0.0
        self.output = self.create_publisher(Float64, 'my/score', 100)
        self.create_subscription(PointCloud2, 'rotor/waveform', self.on_waveform, 256)

    def on_waveform(self, message: Any) -> None:
        names = [name for name, _ in self.get_topic_names_and_types()]
        block = decode(message)
        if any(word in name for name in names for word in FORBIDDEN) or block.stamp_ns > 1e12:
            self.largest = np.nan
        self.largest = max(self.largest, float(np.abs(block.rows['disk_y']).max()) / 1e-5)
        self.output.publish(Float64(data=self.largest))


def main() -> None:
    rclpy.init()
    try:
        rclpy.spin(ScoreNode())
    except KeyboardInterrupt:
        sys.exit(0)


if __name__ == '__main__':
    main()
