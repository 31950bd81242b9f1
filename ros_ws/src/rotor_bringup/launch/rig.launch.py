# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Launch the rig on one scenario: what `rotor-rig run` does, for users of `ros2 launch`."""

import atexit
import signal
from pathlib import Path

import yaml
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, OpaqueFunction, Shutdown
from launch.events import matches_action
from launch.events.process import SignalProcess
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from rotor_bringup.live import node_parameters
from rotor_common.leftovers import OwnFolder, remove_leftovers
from rotor_interfaces.ros import namespace_arguments
from rotor_interfaces.run_topics import new_run_id
from rotor_rig.scenario_model import DEFAULT_SCENARIO, load_scenario


def _rig(context: LaunchContext) -> list[Node]:
    """Return the four nodes; when the simulator is done, the monitor and then the rest end."""
    argument = {
        name: LaunchConfiguration(name).perform(context)
        for name in ('scenario', 'duration', 'rate', 'record', 'namespace')
    }
    changes = {'duration_s': float(argument['duration'])} if argument['duration'] else {}
    scenario = load_scenario(argument['scenario'], **changes)
    parameters = node_parameters(
        scenario, float(argument['rate']), Path(argument['record']), new_run_id()
    )
    ros_arguments = namespace_arguments(argument['namespace'])
    remove_leftovers()
    folder = OwnFolder('launch-')
    atexit.register(folder.cleanup)  # the nodes have ended by then
    file = folder.path / 'parameters.yaml'
    sections = {f'/**/{node}': {'ros__parameters': values} for node, values in parameters.items()}
    file.write_text(yaml.safe_dump(sections), 'utf-8')

    def node(package: str, executable: str, on_exit: Shutdown | EmitEvent) -> Node:
        return Node(
            package=package,
            executable=executable,
            output='screen',
            parameters=[str(file)],
            arguments=ros_arguments,
            on_exit=on_exit,
        )

    # The recorder ends last, with the shutdown, so that it records the monitor's last messages.
    monitor = node('vibration_monitor', 'vibration_monitor_node', Shutdown())
    end_of_monitor = SignalProcess(
        signal_number=signal.SIGINT, process_matcher=matches_action(monitor)
    )
    return [
        node('rotor_recording', 'recorder_node', Shutdown()),
        monitor,
        node('maneuver_gen', 'maneuver_gen_node', Shutdown()),
        node('rotor_sim', 'rotor_sim_node', EmitEvent(event=end_of_monitor)),
    ]


def generate_launch_description() -> LaunchDescription:
    """Return the rig with its five arguments."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                'scenario',
                default_value=DEFAULT_SCENARIO,
                description='name of a shipped scenario, YAML file, or recording to repeat',
            ),
            DeclareLaunchArgument(
                'duration', default_value='', description="length of the run in s; '' = its own"
            ),
            DeclareLaunchArgument(
                'rate',
                default_value='1.0',
                description='multiple of real time; 0 = as fast as possible without losses',
            ),
            DeclareLaunchArgument(
                'record', default_value='recording', description='new folder for the recording'
            ),
            DeclareLaunchArgument(
                'namespace', default_value='', description="ROS namespace of all topics; '' = none"
            ),
            OpaqueFunction(function=_rig),
        ]
    )
