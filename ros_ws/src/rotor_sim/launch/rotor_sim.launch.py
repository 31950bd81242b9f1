# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Launch node `rotor_sim` alone: the rotor and its sensors."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    """Return the node with the parameters of `params_file`."""
    share = FindPackageShare('rotor_sim')
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                'params_file',
                default_value=PathJoinSubstitution([share, 'config', 'rotor_sim.yaml']),
                description='YAML file with the parameters of the node',
            ),
            Node(
                package='rotor_sim',
                executable='rotor_sim_node',
                output='screen',
                parameters=[LaunchConfiguration('params_file')],
            ),
        ]
    )
