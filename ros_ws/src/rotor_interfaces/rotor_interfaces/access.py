# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Who can reach the nodes of the rig over DDS: without a word, only this machine."""

import os
from pathlib import Path

_RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'
_PROFILE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
_LOCALHOST_ONLY = 'ROS_LOCALHOST_ONLY'
LOOPBACK_PROFILE = Path(__file__).with_name('fastdds.xml')
NETWORK_PROFILE = Path(__file__).with_name('fastdds_network.xml')
_FAST_DDS = ('', 'rmw_fastrtps_cpp', 'rmw_fastrtps_dynamic_cpp')


def keep_on_this_machine() -> None:
    """Bind DDS to the loopback interface unless ROS_AUTOMATIC_DISCOVERY_RANGE opens it.

    For this process and those that it starts. A Fast DDS profile of the user stays, and then the
    range means what it means to ROS 2. Other DDS do not look at the profiles: for them the range
    is LOCALHOST.
    """
    # to ROS 2 an empty range means the subnet, and ROS_LOCALHOST_ONLY comes before it
    wanted = os.environ.get(_RANGE) or 'LOCALHOST'
    if os.environ.get(_LOCALHOST_ONLY) == '1':
        wanted = 'LOCALHOST'
    os.environ[_RANGE] = wanted
    profile = os.environ.get(_PROFILE)
    if profile not in (None, str(LOOPBACK_PROFILE), str(NETWORK_PROFILE)):
        return
    if os.environ.get('RMW_IMPLEMENTATION', '') not in _FAST_DDS:
        return
    # where we have been before, in the process that started this one
    is_done = wanted == 'SYSTEM_DEFAULT' and profile == str(LOOPBACK_PROFILE)
    is_open = wanted in ('SUBNET', 'SYSTEM_DEFAULT') and not is_done
    os.environ[_PROFILE] = str(NETWORK_PROFILE if is_open else LOOPBACK_PROFILE)
    if wanted == 'LOCALHOST':
        # with LOCALHOST rmw_fastrtps adds sockets of all interfaces to those of the profile
        os.environ[_RANGE] = 'SYSTEM_DEFAULT'
        os.environ.pop(_LOCALHOST_ONLY, None)
