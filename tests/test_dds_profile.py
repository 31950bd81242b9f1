# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The nodes' Fast DDS profile: in force, understood, and the user's own where there is one."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from live_flight import private_environment

from rotor_interfaces import access

PARTICIPANT = """
import os

import rclpy
from std_msgs.msg import Header

from rotor_interfaces import access

access.keep_on_this_machine()
print(os.environ['FASTRTPS_DEFAULT_PROFILES_FILE'])
rclpy.init()
rclpy.create_node('any').create_publisher(Header, 'any', 1)
rclpy.shutdown()
"""


def participant(tmp_path: Path, **profile: str) -> tuple[Path, str]:
    """Return the profile of a process with a node, and what it said on standard error."""
    environment = private_environment(tmp_path / 'log')
    environment.pop('FASTRTPS_DEFAULT_PROFILES_FILE', None)
    ended = subprocess.run(
        [sys.executable, '-c', PARTICIPANT],
        env=environment | profile,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=300.0,
        check=True,
    )
    said = ended.stdout.splitlines()
    return Path(said[0]), '\n'.join(said[1:]) + ended.stderr


def test_the_profile_is_understood(tmp_path: Path) -> None:
    path, said = participant(tmp_path)
    assert path.is_file()
    assert said == ''


def test_a_profile_of_the_user_is_read_instead(tmp_path: Path) -> None:
    mine = tmp_path / 'mine.xml'
    mine.write_text('<profiles><participant><no_such_setting/></participant></profiles>')
    path, said = participant(tmp_path, FASTRTPS_DEFAULT_PROFILES_FILE=str(mine))
    assert path == mine
    assert 'XML' in said, 'Fast DDS must have read and refused it'


def test_the_range_of_the_user_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('FASTRTPS_DEFAULT_PROFILES_FILE', '')
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'SUBNET')
    access.keep_on_this_machine()
    assert os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'SUBNET'
    assert os.environ['FASTRTPS_DEFAULT_PROFILES_FILE'] == ''
    monkeypatch.delenv('ROS_AUTOMATIC_DISCOVERY_RANGE')
    access.keep_on_this_machine()
    assert os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'LOCALHOST'
