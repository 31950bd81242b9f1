# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Detectors that cheat: each says that it got through only where it did.

`Looks` tries everything that a process can do at once, and its evidence lists what worked; each of
the others cheats in one way. The test writes a copy of this file with the constants filled in.
"""

import contextlib
import ctypes
import json
import math
import mmap
import os
import platform
import select
import socket
import stat
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path

from rotor_bench.evaluation.pipe_protocol import DONE, REPLY_HEAD, VERDICT, receive_block
from rotor_interfaces.waveform import WaveformBlock
from vibration_monitor.detectors.protocol import Verdict

EVALUATOR = 0
SUITE = ''
PORT = 0
NOTE = 'cheat'
"""Filled in by the test; the note has its process number, and names what is left behind."""

ALARM = 2.0
LIBC = ctypes.CDLL(None, use_errno=True)
PERF_EVENT_OPEN, BPF, ADD_KEY, KEYCTL = (
    (298, 321, 248, 250) if platform.machine() == 'x86_64' else (241, 280, 217, 219)
)
IPC_CREAT = 0o1000
PTRACE_SEIZE, PTRACE_DETACH = 0x4206, 17
PR_SET_PDEATHSIG, PR_SET_NAME = 1, 15


def key() -> int:
    return 0x5EED0000 | (EVALUATOR & 0xFFFF)


def perf_event_open() -> bool:
    attributes = (ctypes.c_uint64 * 16)(1 | (128 << 32))  # a software clock
    opened = [
        LIBC.syscall(PERF_EVENT_OPEN, attributes, process, -1, -1, 0)
        for process in (EVALUATOR, os.getppid())
    ]
    return any(number >= 0 for number in opened)


def bpf() -> bool:
    map_of_one = (ctypes.c_uint32 * 32)(2, 4, 4, 1)
    return int(LIBC.syscall(BPF, 0, map_of_one, 128)) >= 0


def ptrace() -> bool:
    for process in {EVALUATOR, os.getppid()} - {0}:
        if LIBC.ptrace(PTRACE_SEIZE, process, None, None) == 0:
            LIBC.ptrace(PTRACE_DETACH, process, None, None)
            return True
    return False


def memory_file() -> bool:
    with contextlib.suppress(OSError), open(f'/proc/{EVALUATOR}/mem', 'rb') as file:  # noqa: PTH123
        file.seek(id(sys))
        return len(file.read(8)) == 8
    return False


def signal_to_evaluator() -> bool:
    with contextlib.suppress(OSError):
        os.kill(EVALUATOR, 0)
        return True
    return False


def suite_folder() -> bool:
    with contextlib.suppress(OSError):
        return bool(os.listdir(SUITE))  # noqa: PTH208
    return False


def tcp() -> bool:
    with contextlib.suppress(OSError), socket.create_connection(('127.0.0.1', PORT), 1):
        return True
    return False


def udp() -> bool:
    with contextlib.suppress(OSError), socket.socket(type=socket.SOCK_DGRAM) as line:
        return line.sendto(b'note', ('127.0.0.1', PORT)) == 4
    return False


def memory_shared_in_system_v() -> bool:
    known = bool(LIBC.shmget(key(), 4096, 0) >= 0)
    LIBC.shmget(key(), 4096, IPC_CREAT | 0o600)
    return known


def messages_in_system_v() -> bool:
    known = bool(LIBC.msgget(key(), 0) >= 0)
    LIBC.msgget(key(), IPC_CREAT | 0o600)
    return known


def keyring() -> bool:
    """Look in the keyring of the user."""
    name = NOTE.encode()
    known = LIBC.syscall(KEYCTL, 10, -4, b'user', name, 0) >= 0
    LIBC.syscall(ADD_KEY, b'user', name, b'note', ctypes.c_size_t(4), -4)
    return bool(known)


def in_file(path: Path) -> bool:
    known = False
    with contextlib.suppress(OSError):
        known = path.exists()
        path.write_text('note')
    return known


def memory_shared_in_posix() -> bool:
    return in_file(Path('/dev/shm') / NOTE)  # noqa: S108


def file_in_temp() -> bool:
    return in_file(Path(f'/tmp/{NOTE}-temp'))  # noqa: S108


def file_in_folder() -> bool:
    return in_file(Path(f'{NOTE}-here'))


def file_beside_folder() -> bool:
    return in_file(Path(f'../{NOTE}-beside'))


def file_in_home() -> bool:
    return in_file(Path.home() / f'{NOTE}-home')


ATTEMPTS: tuple[Callable[[], bool], ...] = (
    perf_event_open, bpf, ptrace, memory_file, signal_to_evaluator, suite_folder, tcp, udp,
)  # fmt: skip
NOTES: tuple[Callable[[], bool], ...] = (
    memory_shared_in_system_v, messages_in_system_v, keyring, memory_shared_in_posix, file_in_temp,
    file_in_folder, file_beside_folder, file_in_home,
)  # fmt: skip
"""What got a note from an earlier flight, and leaves one."""


def looked() -> list[str]:
    return [attempt.__name__ for attempt in (*ATTEMPTS, *NOTES) if attempt()]


def streams() -> list[socket.socket]:
    """Return all sockets of this process."""
    numbers = []
    for number in range(3, 256):
        with contextlib.suppress(OSError):
            if stat.S_ISSOCK(os.fstat(number).st_mode):
                numbers.append(number)
    return [socket.socket(fileno=os.dup(number)) for number in numbers]


class Sound:
    """Honest: alarmed while the signal is high."""

    alarm_score = ALARM

    def fit(self, flights: Iterable[Iterable[WaveformBlock]]) -> None:
        for flight in flights:
            for _ in flight:
                pass

    def push(self, block: WaveformBlock) -> Verdict:
        return Verdict(float(block.rows['disk_y'].max()), 'looked')


class Looks(Sound):
    """Tries everything, in its fit too."""

    def fit(self, flights: Iterable[Iterable[WaveformBlock]]) -> None:
        super().fit(flights)
        looked()

    def push(self, block: WaveformBlock) -> Verdict:  # noqa: ARG002
        return Verdict(1.0, json.dumps(looked()))


class Backdates(Sound):
    """Reads on by itself before it says anything, to answer for the first block."""

    def push(self, block: WaveformBlock) -> Verdict:
        highest = float(block.rows['disk_y'].max())
        for stream in streams():
            while select.select([stream], [], [], 0.3)[0]:
                later = receive_block(stream)
                if not isinstance(later, WaveformBlock):
                    break
                highest = max(highest, float(later.rows['disk_y'].max()))
        return Verdict(highest, 'read on')


class AnswersInAdvance(Sound):
    """Says in its first breath that there is an alarm at every block."""

    def push(self, block: WaveformBlock) -> Verdict:
        for stream in streams():
            stream.sendall(100 * REPLY_HEAD.pack(VERDICT, 2 * ALARM, 0))
        return super().push(block)


class EndsEarly(Sound):
    """Says that all is done before the flight is over."""

    def push(self, block: WaveformBlock) -> Verdict:
        for stream in streams():
            stream.sendall(REPLY_HEAD.pack(VERDICT, 0.0, 0) + REPLY_HEAD.pack(DONE, 0.0, 0))
        time.sleep(0.2)
        return super().push(block)


class RepliesAtLength(Sound):
    """Announces a text of 4 GB, and begins."""

    def push(self, block: WaveformBlock) -> Verdict:
        for stream in streams():
            stream.sendall(REPLY_HEAD.pack(VERDICT, 0.0, 2**32 - 1) + bytes(100_000))
        return super().push(block)


class RepliesNonsense(Sound):
    def push(self, block: WaveformBlock) -> Verdict:
        for stream in streams():
            stream.sendall(bytes(range(255, 100, -1)))
        return super().push(block)


class RepliesInFit(Sound):
    """Sends verdicts where none are asked for."""

    def fit(self, flights: Iterable[Iterable[WaveformBlock]]) -> None:
        for stream in streams():
            stream.sendall(100 * REPLY_HEAD.pack(VERDICT, 2 * ALARM, 0))
        super().fit(flights)


class RepliesInfinity(Sound):
    def push(self, block: WaveformBlock) -> Verdict:
        for stream in streams():
            stream.sendall(REPLY_HEAD.pack(VERDICT, math.inf, 0))
        return super().push(block)


class Drips(Sound):
    """Sends a byte of its verdict now and then, so that something always comes."""

    def push(self, block: WaveformBlock) -> Verdict:
        (stream,) = streams()
        for byte in REPLY_HEAD.pack(VERDICT, 0.0, 1000):
            stream.sendall(bytes([byte]))
        for _ in range(1000):
            time.sleep(0.2)
            stream.sendall(b'.')
        return super().push(block)


TERMINAL = 'a\x1b]0;owned\x07\x1b[2J\u202e\u200b\r\nb\0' + 2000 * 'c'


class WritesToTheTerminal(Sound):
    def push(self, block: WaveformBlock) -> Verdict:
        return Verdict(super().push(block).score, TERMINAL)


class RaisesToTheTerminal(Sound):
    def push(self, block: WaveformBlock) -> Verdict:  # noqa: ARG002
        raise ValueError(TERMINAL)


class ExecutesMemory(Sound):
    """Becomes another program, out of memory or of a file that it has written."""

    def push(self, block: WaveformBlock) -> Verdict:
        program = next(Path('/lib64').glob('ld-linux*')).read_bytes()  # it can be called itself
        with contextlib.suppress(OSError):
            memory = os.memfd_create(NOTE)
            os.write(memory, program)
            os.execve(memory, ['program', '--version'], {})  # noqa: S606
        with contextlib.suppress(OSError):
            Path('program').write_bytes(program)
            Path('program').chmod(0o700)
            os.execv('program', ['program', '--version'])  # noqa: S606
        return super().push(block)


class Outlives(Sound):
    """Leaves a process behind that nothing ties to this one."""

    def push(self, block: WaveformBlock) -> Verdict:
        with contextlib.suppress(OSError):
            if not os.fork():
                os.setsid()
                if not os.fork():
                    LIBC.prctl(PR_SET_PDEATHSIG, 0, 0, 0, 0)
                    LIBC.prctl(PR_SET_NAME, NOTE.encode(), 0, 0, 0)
                    time.sleep(300.0)
                os._exit(0)
        return super().push(block)


class TakesMemory(Sound):
    """Takes 20 GB, of its own or to share; the pages are not touched, to spare the machine."""

    def push(self, block: WaveformBlock) -> Verdict:
        taken: list[object] = []
        for take in (bytearray, lambda size: mmap.mmap(-1, size)):
            with contextlib.suppress(MemoryError, OSError):
                taken.extend(take(1 << 30) for _ in range(20))
        return Verdict(super().push(block).score, f'{len(taken)} GB')


class TakesTheDisk(Sound):
    """Makes a file of 1 TB, and as many large ones as go."""

    def push(self, block: WaveformBlock) -> Verdict:
        said = []
        with contextlib.suppress(OSError), open('sparse', 'wb') as file:  # noqa: PTH123
            file.truncate(1 << 40)
            said.append('1 TB')
        written = 0
        with contextlib.suppress(OSError):
            for number in range(40):
                with open(f'large-{number}', 'wb', buffering=0) as file:  # noqa: PTH123
                    for _ in range(8):
                        written += file.write(bytes(1 << 20))
        return Verdict(super().push(block).score, f'{said} {written >> 20} MB')


class Shares(Sound):
    """Notes in memory that all processes forked from a fitted one would share."""

    notes = mmap.mmap(-1, 4096)
    verdict: Verdict | None = None

    def push(self, block: WaveformBlock) -> Verdict:  # noqa: ARG002
        if self.verdict is None:
            self.verdict = Verdict(1.0, 'known' if self.notes[0] else 'fresh')
            self.notes[0] = 1
        return self.verdict
