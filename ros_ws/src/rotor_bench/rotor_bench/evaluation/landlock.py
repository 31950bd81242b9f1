# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Landlock, Linux's self-restriction of a process: files, TCP, signals, other processes.

https://docs.kernel.org/userspace-api/landlock.html. There is no libc wrapper, hence the numbers
of the system calls, which are the same on every architecture.
"""

import ctypes
import os
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path

_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446
_PATH_BENEATH = 1
_PR_SET_NO_NEW_PRIVS = 38
_VERSION = 1

_READ_FILE, _READ_DIR = 1 << 2, 1 << 3
_READ = _READ_FILE | _READ_DIR
_WRITE = sum(1 << bit for bit in (1, 4, 5, 7, 8, 10, 12))
"""Write files; remove files and folders; make folders, files, pipes, links. No devices, sockets."""
_EVERYTHING_ABI_1 = (1 << 13) - 1
_REFER, _TRUNCATE, _IOCTL_DEV = 1 << 13, 1 << 14, 1 << 15
_OF_FILES = (1 << 0) | (1 << 1) | _READ_FILE | _TRUNCATE | _IOCTL_DEV
_TCP = 0b11
_SCOPES = 0b11
"""Abstract sockets and signals of processes outside."""

_LIBC = ctypes.CDLL(None, use_errno=True)


class _Ruleset(ctypes.Structure):
    _fields_ = (
        ('handled_access_fs', ctypes.c_uint64),
        ('handled_access_net', ctypes.c_uint64),
        ('scoped', ctypes.c_uint64),
    )


class _PathBeneath(ctypes.Structure):
    _pack_ = 1
    _fields_ = (('allowed_access', ctypes.c_uint64), ('parent_fd', ctypes.c_int32))


def version() -> int:
    """Return the version of Landlock that this kernel supports, 0 for none."""
    return max(0, int(_LIBC.syscall(_CREATE_RULESET, None, ctypes.c_size_t(0), _VERSION)))


def gain_no_privileges() -> None:
    """Keep this process and its children from gaining privileges by exec; raises OSError."""
    _checked(_LIBC.prctl(_PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0))


def restrict(read: Iterable[Path], write: Iterable[Path], hide: Collection[Path] = ()) -> int:
    """Let this thread, and what it forks, read below `read` and read and write below `write`.

    No file below `hide` can be read, even where that is below `read`. Nothing else of the file
    system can be opened, /proc included, nothing can be executed, and where the kernel supports it:
    no TCP, no signals to and no tracing of processes outside. This cannot be undone. Paths that do
    not exist are left out. Return the version, 0 if the kernel has no Landlock: then nothing is
    restricted.

    Raises:
        OSError: the kernel has it but refuses.

    """
    spoken = version()
    if not spoken:
        return 0
    handled = _EVERYTHING_ABI_1
    handled |= _REFER if spoken >= 2 else 0
    handled |= _TRUNCATE if spoken >= 3 else 0
    handled |= _IOCTL_DEV if spoken >= 5 else 0
    attributes = _Ruleset(handled, _TCP if spoken >= 4 else 0, _SCOPES if spoken >= 6 else 0)
    size = ctypes.c_size_t(ctypes.sizeof(attributes))
    ruleset = _checked(_LIBC.syscall(_CREATE_RULESET, ctypes.byref(attributes), size, 0))
    try:
        hidden = [os.path.realpath(path) for path in hide]
        tops = {os.path.realpath(path) for path in read}
        for place, access in {rule for top in tops for rule in _around(top, hidden)}:
            _allow(ruleset, place, access)
        for path in write:
            _allow(ruleset, path, (_READ | _WRITE | _REFER | _TRUNCATE) & handled)
        gain_no_privileges()
        _checked(_LIBC.syscall(_RESTRICT_SELF, ruleset, 0))
    finally:
        os.close(ruleset)
    return spoken


def _around(path: str, hidden: Collection[str]) -> Iterator[tuple[str, int]]:
    """Yield the rules for reading below `path` except `hidden`: rules can only allow.

    Paths are strings, for speed: every detector's process does this for every installed package.
    """
    below = os.path.join(path, '')  # noqa: PTH118 - ends with /
    if any(below.startswith(one + os.sep) for one in hidden):
        return
    if not any(one.startswith(below) for one in hidden):
        yield path, _READ
        return
    yield path, _READ_DIR
    with os.scandir(path) as entries:
        for entry in entries:
            if not entry.is_symlink():  # its target is allowed, or not, under its own path
                yield from _around(entry.path, hidden)


def _allow(ruleset: int, path: str | Path, access: int) -> None:
    try:
        opened = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except FileNotFoundError:
        return
    try:
        allowed = access if Path(path).is_dir() else access & _OF_FILES
        rule = _PathBeneath(allowed, opened)
        _checked(_LIBC.syscall(_ADD_RULE, ruleset, _PATH_BENEATH, ctypes.byref(rule), 0))
    finally:
        os.close(opened)


def _checked(result: int) -> int:
    if result < 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))
    return result
