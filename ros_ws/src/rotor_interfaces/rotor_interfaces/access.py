# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Access control over DDS: this machine only by default, or SROS 2."""

import os
import subprocess
import sys
from pathlib import Path

from rotor_common.errors import ConfigError

_RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'
_PROFILE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
_LOCALHOST_ONLY = 'ROS_LOCALHOST_ONLY'
LOOPBACK_PROFILE = Path(__file__).with_name('fastdds.xml')
NETWORK_PROFILE = Path(__file__).with_name('fastdds_network.xml')
SECURITY_PAGE = 'docs/security.md'
_NODE = 'import rclpy; rclpy.init(); rclpy.create_node("rotor_rig_security_check")'
_FAST_DDS = ('', 'rmw_fastrtps_cpp', 'rmw_fastrtps_dynamic_cpp')


def keep_on_this_machine() -> None:
    """Bind DDS to the loopback interface unless ROS_AUTOMATIC_DISCOVERY_RANGE opens it.

    For this process and those that it starts. A Fast DDS profile of the user is kept, and then the
    range has its ROS 2 meaning. Other DDS ignore the profiles: for them the range is LOCALHOST.
    """
    # to ROS 2 an empty range means the subnet, and ROS_LOCALHOST_ONLY overrides it
    wanted = os.environ.get(_RANGE) or 'LOCALHOST'
    if os.environ.get(_LOCALHOST_ONLY) == '1':
        wanted = 'LOCALHOST'
    os.environ[_RANGE] = wanted
    profile = os.environ.get(_PROFILE)
    if profile not in (None, str(LOOPBACK_PROFILE), str(NETWORK_PROFILE)):
        return
    if os.environ.get('RMW_IMPLEMENTATION', '') not in _FAST_DDS:
        return
    # the process that started this one has already done this
    is_done = wanted == 'SYSTEM_DEFAULT' and profile == str(LOOPBACK_PROFILE)
    is_open = wanted in ('SUBNET', 'SYSTEM_DEFAULT') and not is_done
    os.environ[_PROFILE] = str(NETWORK_PROFILE if is_open else LOOPBACK_PROFILE)
    if wanted == 'LOCALHOST':
        # with LOCALHOST rmw_fastrtps adds sockets of all interfaces to those of the profile
        os.environ[_RANGE] = 'SYSTEM_DEFAULT'
        os.environ.pop(_LOCALHOST_ONLY, None)


def check_security() -> None:
    """Make sure that the nodes are secured if ROS_SECURITY_ENABLE requires it.

    ROS 2 itself starts unsecured nodes without the keystore, or with a value that it does not know.

    Raises:
        ConfigError: security is required but not available, or the variable has another value.

    """
    enabled = os.environ.get('ROS_SECURITY_ENABLE', '')
    if enabled in ('', 'false'):
        return
    if enabled != 'true':
        raise _refusal(
            f'ROS_SECURITY_ENABLE = {enabled!r} is not allowed', "it must be 'true' or 'false'"
        )
    strategy = os.environ.get('ROS_SECURITY_STRATEGY', '')
    if strategy != 'Enforce':
        raise _refusal(
            f'ROS_SECURITY_STRATEGY = {strategy!r} is not allowed with ROS_SECURITY_ENABLE=true',
            "it must be 'Enforce': with anything else, nodes without keys start unsecured",
        )
    keystore = os.environ.get('ROS_SECURITY_KEYSTORE', '')
    if not (keystore and Path(keystore, 'enclaves').is_dir()):
        raise _refusal(
            f'ROS_SECURITY_KEYSTORE = {keystore!r} is no keystore',
            'ROS_SECURITY_ENABLE=true needs the folder that `ros2 security create_keystore` makes',
        )
    enclave = os.environ.get('ROS_SECURITY_ENCLAVE_OVERRIDE', '')
    if not (enclave.startswith('/') and Path(keystore, 'enclaves', enclave[1:]).is_dir()):
        raise _refusal(
            f'ROS_SECURITY_ENCLAVE_OVERRIDE = {enclave!r} is no enclave of the keystore {keystore}',
            'it must be the enclave of the rig, such as /rotor_rig',
        )
    # only a node that starts proves that the keys are good and that this DDS has security
    started = subprocess.run(
        [sys.executable, '-c', _NODE],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    if started.returncode:
        lines = started.stderr.partition('RCLError: ')[2].splitlines() or ['it gives no reason']
        raise _refusal(
            f'ROS_SECURITY_ENABLE=true: a secured node does not start ({lines[0]})',
            'it takes /opt/ros/jazzy, whose Fast DDS has security, and the keys of the rig',
        )


def _refusal(what: str, remedy: str) -> ConfigError:
    return ConfigError(f'{what}; {remedy} (see {SECURITY_PAGE}), or unset ROS_SECURITY_ENABLE')
