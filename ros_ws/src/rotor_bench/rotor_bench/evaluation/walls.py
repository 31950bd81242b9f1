# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The sandbox of a detector process, and which parts of it this machine lacks.

A `Walls` maps the name of each restriction to why it is missing, '' where it is in force. Each is
tried on its own: one that the kernel, or a container, does not allow is named in the report, and
the evaluation goes on.
"""

import contextlib
import ctypes
import errno
import os
import resource
import signal
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path

from rotor_bench.evaluation import landlock, seccomp

Walls = dict[str, str]

FILES = 'Landlock'
SHARED = {'users': 0x1000_0000, 'network': 0x4000_0000, 'host name': 0x0400_0000}
"""Namespaces of all detectors of a server: there is nothing in them to connect to."""
OWN = {'IPC': 0x0800_0000, 'mounts': 0x0002_0000, 'processes': 0x2000_0000}
"""Namespaces of one process of a detector."""

MEMORY = 2 << 30
"""Bytes of memory that a detector may use, beyond what is loaded before its code."""
ADDRESSES = 8 << 30
"""Bytes of address space beyond what is loaded; libraries take much."""
FILE = 64 << 20
"""Largest file in bytes, and size of the detector's folder where that is a tmpfs."""
FOLDER_FILES = 4096
OPEN_FILES = 256
CPU_S = 4 * 3600
THREADS = 1024

_PR_SET_CHILD_SUBREAPER = 36
_PR_CAP_AMBIENT, _PR_CAP_AMBIENT_CLEAR_ALL = 47, 4
_PR_CAPBSET_READ, _PR_CAPBSET_DROP = 23, 24
_CAPABILITY_VERSION_3 = 0x2008_0522
_MS_NOSUID_NODEV_NOEXEC = 2 | 4 | 8
_MS_PRIVATE_EVERYWHERE = (1 << 18) | (1 << 14)

_LIBC = ctypes.CDLL(None, use_errno=True)


def text(walls: Walls) -> str:
    """Return in words which restrictions are in force and which are missing."""
    standing = [name for name, lack in walls.items() if not lack]
    names = [name for name in standing if name not in {**SHARED, **OWN}]
    if spaces := [name for name in standing if name not in names]:
        names.append(f'namespaces ({", ".join(spaces)})')
    lacking = [f'{name} ({lack})' for name, lack in walls.items() if lack]
    begin = f'process and {", ".join(names)}' if names else 'process only'
    return f'{begin}; weak without {", ".join(lacking)}' if lacking else begin


def is_weak(isolation: str) -> bool:
    """Say whether a restriction is missing, given the result of `text`."""
    return FILES not in isolation or 'weak without' in isolation


def enter_shared() -> Walls:
    """Move this process, which has one thread, into the namespaces of a server of detectors."""
    user, group = os.getuid(), os.getgid()
    walls: Walls = {}
    for name, flag in SHARED.items():
        _try(walls, name, partial(_unshare, flag))
        if name == 'users' and not walls[name]:
            Path('/proc/self/setgroups').write_text('deny')
            Path('/proc/self/uid_map').write_text(f'{user} {user} 1')
            Path('/proc/self/gid_map').write_text(f'{group} {group} 1')
    return walls


def enter_own(folder: Path) -> Walls:
    """Put the next fork of this process into new namespaces, and `folder` on a small tmpfs."""
    walls: Walls = {}
    for name, flag in OWN.items():
        _try(walls, name, partial(_unshare, flag))
    if not walls['mounts']:
        _try(walls, 'mounts', lambda: _mount_small(folder))
    return walls


def _mount_small(folder: Path) -> None:
    options = f'size={FILE},nr_inodes={FOLDER_FILES},mode=700'.encode()
    _checked(_LIBC.mount(None, b'/', None, ctypes.c_ulong(_MS_PRIVATE_EVERYWHERE), None))
    place, flags = os.fsencode(folder), ctypes.c_ulong(_MS_NOSUID_NODEV_NOEXEC)
    _checked(_LIBC.mount(b'tmpfs', place, b'tmpfs', flags, options))


def close_around(read: Iterable[Path], folder: Path, hide: Sequence[Path], known: Walls) -> Walls:
    """Restrict this process for good: limits, files, capabilities, system calls.

    Args:
        read: folders below which it may read.
        folder: where it may write.
        hide: folders below `read` that it may not read.
        known: the restrictions in force already.

    """
    walls: Walls = {}
    limits: Walls = {}
    _try(limits, 'limits', lambda: _limit(own_users='users' in known and not known['users']))
    if version := landlock.version():
        restrict = partial(landlock.restrict, read, [folder, Path(os.devnull)], hide)
        _try(walls, f'{FILES} {version}', restrict)
    else:
        walls['files and /proc'] = 'this kernel cannot close them'
    _try(walls, 'capabilities dropped', _drop_capabilities)
    _try(walls, 'no new privileges', landlock.gain_no_privileges)
    _try(walls, 'seccomp', seccomp.restrict)
    return walls | limits | known


def _limit(*, own_users: bool) -> None:
    limits = {
        resource.RLIMIT_DATA: _loaded('VmData') + MEMORY,
        resource.RLIMIT_AS: _loaded('VmSize') + ADDRESSES,
        resource.RLIMIT_FSIZE: FILE,
        resource.RLIMIT_NOFILE: OPEN_FILES,
        resource.RLIMIT_CPU: CPU_S,
        resource.RLIMIT_CORE: 0,
    }
    if own_users:  # otherwise all processes of this user count
        limits[resource.RLIMIT_NPROC] = THREADS
    for kind, limit in limits.items():
        _, hard = resource.getrlimit(kind)
        lowest = limit if hard == resource.RLIM_INFINITY else min(limit, hard)
        resource.setrlimit(kind, (lowest, lowest))


def _loaded(name: str) -> int:
    """Return bytes of this process, by name in its status."""
    for line in Path('/proc/self/status').read_text('utf-8').splitlines():
        if line.startswith(f'{name}:'):
            return int(line.split()[1]) * 1024
    raise OSError(0, f'/proc/self/status has no {name}')


class _CapabilityHead(ctypes.Structure):
    _fields_ = (('version', ctypes.c_uint32), ('pid', ctypes.c_int))


def _drop_capabilities() -> None:
    """Give up every capability, and those that a program could gain."""
    _LIBC.prctl(_PR_CAP_AMBIENT, _PR_CAP_AMBIENT_CLEAR_ALL, 0, 0, 0)
    number = 0
    while _LIBC.prctl(_PR_CAPBSET_READ, number, 0, 0, 0) >= 0:
        # if this is not permitted nothing can be gained anyway: no new privileges, no programs
        _LIBC.prctl(_PR_CAPBSET_DROP, number, 0, 0, 0)
        number += 1
    head = _CapabilityHead(_CAPABILITY_VERSION_3, 0)
    none = (ctypes.c_uint32 * 6)()
    _checked(_LIBC.capset(ctypes.byref(head), none))


def adopt() -> None:
    """Become the parent of orphans below this process, so that they can be found and ended."""
    _LIBC.prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def end_all_below() -> None:
    """Kill every process below this one and wait until there is none."""
    while True:
        if os.getpid() == 1:
            with contextlib.suppress(ProcessLookupError):
                os.kill(-1, signal.SIGKILL)  # all of the namespace but this one
        else:
            with contextlib.suppress(OSError):
                for child in Path('/proc/thread-self/children').read_text('utf-8').split():
                    os.kill(int(child), signal.SIGKILL)
        try:
            os.wait()
        except ChildProcessError:
            return


def _unshare(flag: int) -> None:
    try:
        _checked(_LIBC.unshare(flag))
    except OSError as error:
        if error.errno == errno.ENOSPC:  # "no space left on device" would mislead
            raise OSError(error.errno, 'their number is limited here') from None
        raise


def _try(walls: Walls, name: str, build: Callable[[], object]) -> None:
    """Apply a restriction and note whether it is in force."""
    try:
        build()
        walls[name] = ''
    except OSError as error:
        walls[name] = error.strerror or str(error)


def _checked(result: int) -> None:
    if result < 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))
