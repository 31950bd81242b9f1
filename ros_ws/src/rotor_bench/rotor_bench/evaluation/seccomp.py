# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""System calls that a detector under test cannot make, closed by libseccomp.

https://github.com/seccomp/libseccomp is the C library that Debian's apt and systemd use; it has
no dependable wheel, so its five functions are called through ctypes. It belongs to the system and
may be missing.
"""

import ctypes
import errno

LIBRARY = 'libseccomp.so.2'

_DENIED = (
    # another process, the kernel, or the machine
    'perf_event_open', 'bpf', 'ptrace', 'process_vm_readv', 'process_vm_writev',
    'process_madvise', 'kcmp', 'pidfd_getfd', 'userfaultfd', 'syslog', 'acct', 'quotactl',
    'init_module', 'finit_module', 'delete_module', 'kexec_load', 'kexec_file_load', 'reboot',
    'swapon', 'swapoff', 'iopl', 'ioperm', 'settimeofday', 'clock_settime', 'clock_adjtime',
    'adjtimex', 'sethostname', 'setdomainname', 'lookup_dcookie', 'nfsservctl',
    # memory and messages that outlive a process or reach another one
    'shmget', 'shmat', 'shmctl', 'shmdt', 'semget', 'semop', 'semtimedop', 'semctl', 'msgget',
    'msgsnd', 'msgrcv', 'msgctl', 'mq_open', 'mq_unlink', 'add_key', 'request_key', 'keyctl',
    'memfd_create', 'memfd_secret', 'flock', 'connect', 'bind', 'listen',
    # ways around the other restrictions
    'io_uring_setup', 'io_uring_enter', 'io_uring_register', 'mount', 'umount2', 'move_mount',
    'open_tree', 'fsopen', 'fsconfig', 'fsmount', 'fspick', 'mount_setattr', 'pivot_root',
    'chroot', 'setns', 'unshare', 'name_to_handle_at', 'open_by_handle_at', 'fanotify_init',
    # programs and processes
    'execve', 'execveat', 'fork', 'vfork',
)  # fmt: skip

_ALLOW, _ERRNO = 0x7FFF0000, 0x00050000
_NOT_EQUAL, _MASKED_EQUAL = 1, 7
_UNIX = 1
_SOCKET_TYPES = 0xF
_CLONE_THREAD = 0x10000


class _Comparison(ctypes.Structure):
    _fields_ = (
        ('argument', ctypes.c_uint),
        ('operation', ctypes.c_int),
        ('first', ctypes.c_uint64),
        ('second', ctypes.c_uint64),
    )


def restrict() -> None:
    """Deny the calls to this thread and to those that it starts; this cannot be undone.

    They fail with EPERM. Threads can be made, processes cannot.

    Raises:
        OSError: the library is missing, or the kernel refuses.

    """
    library = ctypes.CDLL(LIBRARY)
    library.seccomp_init.restype = ctypes.c_void_p
    rules = ctypes.c_void_p(library.seccomp_init(ctypes.c_uint32(_ALLOW)))
    if not rules:
        raise OSError(errno.ENOMEM, 'seccomp_init failed')

    def deny(name: str, number: int, *comparisons: _Comparison) -> None:
        call = library.seccomp_syscall_resolve_name(name.encode())
        if call == -1:
            return  # the library is older than the call
        conditions = (_Comparison * len(comparisons))(*comparisons)
        _checked(
            library.seccomp_rule_add_array(
                rules, ctypes.c_uint32(_ERRNO | number), call, len(comparisons), conditions
            )
        )

    try:
        for name in _DENIED:
            deny(name, errno.EPERM)
        # the only socket allowed is a Unix stream socket, which cannot be connected
        deny('socket', errno.EPERM, _Comparison(0, _NOT_EQUAL, _UNIX, 0))
        for kind in range(2, _SOCKET_TYPES + 1):
            deny('socket', errno.EPERM, _Comparison(1, _MASKED_EQUAL, _SOCKET_TYPES, kind))
        deny('clone', errno.EPERM, _Comparison(0, _MASKED_EQUAL, _CLONE_THREAD, 0))
        deny('clone3', errno.ENOSYS)  # its flags cannot be seen; the C library then calls clone
        _checked(library.seccomp_load(rules))
    finally:
        library.seccomp_release(rules)


def _checked(result: int) -> None:
    if result < 0:
        raise OSError(-result, f'libseccomp: error {-result}')
