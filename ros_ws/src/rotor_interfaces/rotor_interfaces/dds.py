# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Settings of DDS and ROS 2, made and checked before either starts."""

import contextlib
import ctypes
import fcntl
import os
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

from rotor_common.errors import ConfigError
from rotor_common.exit_code import ExitCode
from rotor_common.leftovers import OwnFolder
from rotor_interfaces import access

HIGHEST_DOMAIN = 232
RANGES = ('LOCALHOST', 'SUBNET', 'SYSTEM_DEFAULT')
"""Discovery ranges; with ROS's fourth, OFF, the processes of a rig would not find each other."""
SHARED_MEMORY = Path('/dev/shm')  # noqa: S108 - where Linux has it
BYTES_A_PROCESS = 2**20
"""Fast DDS takes 660 KiB, the tracing of ROS 8 KiB."""
_FIRST_PORT, _PORTS_A_DOMAIN = 7400, 250
_PORT_FILE = 'fastrtps_port'


def require_loadable(processes: int = 1) -> None:
    """Raise ConfigError if merely importing rclpy would end the process without a message."""
    free = free_shared_memory()
    if free < processes * BYTES_A_PROCESS:
        raise ConfigError(
            f'{SHARED_MEMORY} has {free // 1024} KiB free, and ROS 2 needs '
            f'{processes * BYTES_A_PROCESS // 1024} KiB there; `fastdds shm clean` removes what '
            'killed processes have left, and `df` and `ls -l` show what else is in it'
        )
    # after the shared memory, which this uses
    name = os.environ.get('RMW_IMPLEMENTATION', '')
    if name:
        try:
            ctypes.CDLL(f'lib{name}.so')
        except OSError:
            raise ConfigError(
                f'RMW_IMPLEMENTATION = {name!r} is not installed here; unset it, or set '
                'rmw_fastrtps_cpp'
            ) from None


def exit_unless_loadable() -> None:
    """End the process with a message if importing rclpy would end it without one."""
    try:
        require_loadable()
    except ConfigError as error:
        sys.stderr.write(f'error: {error}\n')
        sys.exit(ExitCode.BAD_INPUT)


def free_shared_memory() -> int:
    """Return how many bytes of shared memory are free; no limit if the system has none at all.

    Without shared memory Fast DDS uses UDP; if it is full, the process ends by SIGBUS.
    """
    try:
        found = os.statvfs(SHARED_MEMORY)
    except OSError:
        return sys.maxsize
    return found.f_bavail * found.f_frsize


@contextlib.contextmanager
def environment() -> Iterator[None]:
    """Prepare the environment; without ROS_LOG_DIR, logs go to a folder removed at the end.

    Raises:
        ConfigError: a variable of ROS 2 has a value that cannot work, no shared memory is left, or
            security is not available.

    """
    access.keep_on_this_machine()
    _check_variables()
    require_loadable()
    access.check_security()
    with contextlib.ExitStack() as stack:
        if not os.environ.get('ROS_LOG_DIR'):
            os.environ['ROS_LOG_DIR'] = str(stack.enter_context(OwnFolder('log-')))
            stack.callback(os.environ.pop, 'ROS_LOG_DIR', None)
        yield


def _check_variables() -> None:
    domain = os.environ.get('ROS_DOMAIN_ID', '')
    if domain and not (domain.isascii() and domain.isdecimal() and int(domain) <= HIGHEST_DOMAIN):
        raise ConfigError(
            f'ROS_DOMAIN_ID = {domain!r} is not allowed; it must be a whole number from 0 to '
            f'{HIGHEST_DOMAIN}'
        )
    wanted = os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE']
    if wanted not in RANGES:
        reason = 'the processes of the rig would not find each other; ' if wanted == 'OFF' else ''
        raise ConfigError(
            f'ROS_AUTOMATIC_DISCOVERY_RANGE = {wanted!r} is not allowed; {reason}it must be one '
            f'of {", ".join(RANGES)}, or unset'
        )
    profile = os.environ.get('FASTRTPS_DEFAULT_PROFILES_FILE')
    if profile and not (Path(profile).is_file() and os.access(profile, os.R_OK)):
        raise ConfigError(
            f'FASTRTPS_DEFAULT_PROFILES_FILE = {profile!r} is no file that can be read; name '
            "one, or unset it for the rig's own"
        )
    logs = os.environ.get('ROS_LOG_DIR')
    if logs:
        try:
            Path(logs).mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=logs).close()
        except OSError as error:
            raise ConfigError(
                f'ROS_LOG_DIR = {logs!r} cannot be written to ({error.strerror}); name another '
                'folder, or unset it'
            ) from None


def other_users() -> list[int]:
    """Return the ids of other users with whose DDS the nodes here cannot exchange data.

    Fast DDS makes its shared memory accessible to one user only, and does not use UDP for the
    others: nodes of two users find each other, and then exchange nothing.
    """
    found = set()
    if f'{SHARED_MEMORY}/fastrtps_' not in Path('/proc/self/maps').read_text('utf-8', 'replace'):
        return []  # this process uses no shared memory
    for path in SHARED_MEMORY.glob(f'{_PORT_FILE}*_el'):
        with contextlib.suppress(OSError):
            owner = path.stat().st_uid
            number = path.name.removeprefix(_PORT_FILE).removesuffix('_el')
            if owner != os.geteuid() and _is_of_domain(number) and _is_held(path):
                found.add(owner)
    return sorted(found)


def warning_about(users: Iterable[int]) -> str:
    """Return the sentence about `other_users`."""
    ids = ', '.join(str(user) for user in sorted(users))
    return (
        f'another user (uid {ids}) runs ROS 2 nodes in this domain: they and the nodes of uid '
        f'{os.geteuid()} find each other but exchange no data; run both as one user, or the rig '
        'with ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET FASTDDS_BUILTIN_TRANSPORTS=UDPv4, which other '
        'machines hear too'
    )


def _is_of_domain(port: str) -> bool:
    domain = int(os.environ.get('ROS_DOMAIN_ID') or 0)
    return port.isdecimal() and (int(port) - _FIRST_PORT) // _PORTS_A_DOMAIN == domain


def _is_held(lock_file: Path) -> bool:
    """Say whether a living process holds this lock of Fast DDS; a killed one leaves the file."""
    with lock_file.open('rb') as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False
