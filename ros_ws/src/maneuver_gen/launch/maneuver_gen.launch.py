# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Launch node `maneuver_gen` alone: the load grid of one flight."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    """Return the node with the parameters of `params_file`."""
    share = FindPackageShare('maneuver_gen')
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                'params_file',
                default_value=PathJoinSubstitution([share, 'config', 'maneuver_gen.yaml']),
                description='YAML file with the parameters of the node',
            ),
            Node(
                package='maneuver_gen',
                executable='maneuver_gen_node',
                output='screen',
                parameters=[LaunchConfiguration('params_file')],
            ),
        ]
    )
