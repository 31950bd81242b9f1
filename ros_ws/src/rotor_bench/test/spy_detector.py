# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A detector that judges no vibration: it looks for K in every other way it can think of.

The rig that tests it (spy_rig.py) leaves the plan, marked by PLAN, wherever an evaluation could,
and hides each flight's K in everything about its blocks that is no measurement. Its evidence is
the list of the channels through which it learnt something.
"""

import contextlib
import ctypes
import gc
import hashlib
import json
import os
import socket
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock
from vibration_monitor.detectors.protocol import Verdict

PLAN = 'TELL' + 'TALE'  # in two parts: the spy must not find its own code
PLACES: list[str] = []
"""Where the plan lies; the rig writes it in, so that nothing depends on a search."""
PORT = 0
ABSTRACT = '\0tell-the-plan'

SEEN = {'flights': 0}
"""Memory of the module."""
NOTE = 'spy-was-here'


def holds_plan(content: Any) -> bool:
    text = content.decode('latin-1') if isinstance(content, bytes) else str(content)
    return PLAN in text


def readable(path: str | Path) -> bytes:
    with contextlib.suppress(OSError):
        opened = os.open(path, os.O_RDONLY | os.O_NONBLOCK)  # a pipe must not hold us
        try:
            return os.read(opened, 100_000)
        finally:
            os.close(opened)
    return b''


def argv() -> bool:
    return holds_plan(sys.argv) or holds_plan(sys.orig_argv)


def environment() -> bool:
    return holds_plan(dict(os.environ))


def current_folder() -> bool:
    names = [name for _, folders, files in os.walk('.') for name in (*folders, *files)]
    return any(holds_plan(name) or holds_plan(readable(name)) for name in names)


def folders_above() -> bool:
    found = False
    for folder in list(Path.cwd().parents)[:6]:
        with contextlib.suppress(OSError):
            for path in folder.iterdir():
                found = found or holds_plan(path) or holds_plan(readable(path))
    return found


def known_places() -> bool:
    return any(holds_plan(readable(place)) for place in PLACES)


def links() -> bool:
    found = False
    for number, place in enumerate(PLACES):
        with contextlib.suppress(OSError):
            Path(f'hard-{number}').hardlink_to(place)
            found = found or holds_plan(readable(f'hard-{number}'))
        with contextlib.suppress(OSError):
            Path(f'soft-{number}').symlink_to(place)
            found = found or holds_plan(readable(f'soft-{number}'))
    return found


def descriptors() -> bool:
    found = False
    for number in range(256):
        with contextlib.suppress(OSError):
            found = found or holds_plan(os.pread(number, 100_000, 0))
    return found


def processes() -> bool:
    return any(
        holds_plan(readable(f'/proc/{pid}/{name}'))
        for pid in range(max(1, os.getpid() - 2000), os.getpid() + 100)
        for name in ('cmdline', 'environ')
    )


def parents() -> bool:
    found = False
    for pid in {'self', str(os.getppid())}:
        found = found or any(
            holds_plan(readable(f'/proc/{pid}/{n}')) for n in ('cmdline', 'environ')
        )
        with contextlib.suppress(OSError):
            for link in Path(f'/proc/{pid}/fd').iterdir():
                found = found or holds_plan(readable(link))
    return found


class _Piece(ctypes.Structure):
    _fields_ = (('base', ctypes.c_void_p), ('length', ctypes.c_size_t))


def memory_of_the_parent() -> bool:
    """Read the parent at an address that a fork has in common with it."""
    local = ctypes.create_string_buffer(16)
    here = _Piece(ctypes.addressof(local), 16)
    there = _Piece(id(sys), 16)
    read = ctypes.CDLL(None).process_vm_readv
    return bool(read(os.getppid(), ctypes.byref(here), 1, ctypes.byref(there), 1, 0) == 16)


def frames() -> bool:
    frame: Any = sys._getframe()
    while frame is not None:
        with contextlib.suppress(Exception):
            if any(holds_plan(value) for value in list(frame.f_locals.values())):
                return True
        frame = frame.f_back
    return False


def objects() -> bool:
    own = {id(globals()), id(sys.modules[__name__])}
    for value in gc.get_objects():
        if id(value) in own or not isinstance(value, dict | list | tuple):
            continue
        inner: Iterable[Any] = value.values() if isinstance(value, dict) else value
        with contextlib.suppress(Exception):
            if any(isinstance(item, str | bytes) and holds_plan(item) for item in list(inner)):
                return True
    return False


def modules() -> bool:
    for name, module in list(sys.modules.items()):
        if name.startswith('rotor_bench.dataset') or name == 'spy_rig':
            return True
        values = [] if name == __name__ else list(getattr(module, '__dict__', {}).values())
        if any(isinstance(value, str) and holds_plan(value) for value in values):
            return True
    return False


def tcp() -> bool:
    with contextlib.suppress(OSError), socket.create_connection(('127.0.0.1', PORT), 1) as line:
        return holds_plan(line.recv(1000))
    return False


def abstract_socket() -> bool:
    with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX) as line:
        line.settimeout(1)
        line.connect(ABSTRACT)
        return holds_plan(line.recv(1000))
    return False


def commands() -> bool:
    """Let a program that is not confined look."""
    try:
        process = os.fork()
    except OSError:
        return False
    if not process:
        with contextlib.suppress(BaseException):
            os.execv('/bin/sh', ['/bin/sh', '-c', f'grep -q {PLAN} {PLACES[0]}'])  # noqa: S606
        os._exit(99)
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]) == 0


PLAN_CHANNELS: tuple[Callable[[], bool], ...] = (
    argv, environment, current_folder, folders_above, known_places, links, descriptors, processes,
    parents, memory_of_the_parent, frames, objects, modules, tcp, abstract_socket, commands,
)  # fmt: skip


def stamp(block: WaveformBlock) -> float:
    return block.stamp_ns / 1e9


def frame(block: WaveformBlock) -> float:
    return float(block.frame_id.partition('=')[2] or 0.0)


def columns(block: WaveformBlock) -> float:
    extra = [name for name in block.columns if name not in (WAVEFORM_DTYPE.names or ())]
    return float(block.rows[extra[0]][0]) if extra else 0.0


def order_of_columns(block: WaveformBlock) -> float:
    known = [name for name in block.columns if name in (WAVEFORM_DTYPE.names or ())]
    return 0.0 if known == list(WAVEFORM_DTYPE.names or ()) else 1.0


def padding(block: WaveformBlock) -> float:
    return float(block.rows.dtype.itemsize != WAVEFORM_DTYPE.itemsize)


def base(block: WaveformBlock) -> float:
    """Look at the memory that the rows are a part of."""
    owner: Any = block.rows
    while getattr(owner, 'base', None) is not None:
        owner = owner.base
    memory = owner if isinstance(owner, np.ndarray) else np.frombuffer(owner, np.uint8)
    if memory.nbytes <= block.rows.nbytes:
        return 0.0
    return float(memory.view(np.uint8).reshape(-1)[-8:].view(np.float64)[0])


def first_sample(block: WaveformBlock) -> float:
    return float(block.rows['sample'][0]) / 1e9


def time(block: WaveformBlock) -> float:
    return float(block.rows['time'][0])


def nan_payload(block: WaveformBlock) -> float:
    angle = np.ascontiguousarray(block.rows['angle'])
    return int(angle.view(np.uint64)[0] & ((1 << 51) - 1)) / 1e9 if np.isnan(angle[0]) else 0.0


def attributes(block: WaveformBlock) -> float:
    return float(block.__dict__.get('crack', 0.0))


BLOCK_CHANNELS: tuple[Callable[[WaveformBlock], float], ...] = (
    stamp, frame, columns, order_of_columns, padding, base, first_sample, time, nan_payload,
    attributes,
)  # fmt: skip

MEMORY_CHANNELS = ('memory_of_module', 'memory_of_class', 'note_in_folder', 'note_in_temp',
                   'note_in_home', 'note_in_environment')  # fmt: skip


class SpyDetector:
    alarm_score = 0.5
    flights = 0

    def __init__(self) -> None:
        self._verdict: Verdict | None = None

    def fit(self, flights: Iterable[Iterable[WaveformBlock]]) -> None:
        for flight in flights:
            for _ in flight:
                pass

    def push(self, block: WaveformBlock) -> Verdict:
        if self._verdict is None:
            found = [channel.__name__ for channel in PLAN_CHANNELS if channel()]
            found += list(self._remembered())
            told = {channel.__name__: channel(block) for channel in BLOCK_CHANNELS}
            found += [name for name, value in told.items() if value]
            cracks = [told[name] for name in ('stamp', 'nan_payload', 'base') if told[name]]
            digest = hashlib.sha256(np.ascontiguousarray(block.rows['disk_y']).tobytes()).digest()
            guess = int.from_bytes(digest[:4], 'little') / 2**32
            self._verdict = Verdict(max(cracks) if cracks else guess, json.dumps(found))
        return self._verdict

    def _remembered(self) -> Iterator[str]:
        """Yield in which places an earlier flight is remembered, and remember this one."""
        if SEEN['flights']:
            yield 'memory_of_module'
        SEEN['flights'] += 1
        if SpyDetector.flights:
            yield 'memory_of_class'
        SpyDetector.flights += 1
        folders = {
            'note_in_folder': Path(),
            'note_in_temp': Path(tempfile.gettempdir()),
            'note_in_home': Path(os.environ['HOME']),
        }
        for name, folder in folders.items():
            note = folder / f'{NOTE}-{name}'
            if readable(note):
                yield name
            with contextlib.suppress(OSError):
                note.write_text(NOTE)
        if NOTE in os.environ:
            yield 'note_in_environment'
        os.environ[NOTE] = '1'


CHANNELS = {
    *(channel.__name__ for channel in PLAN_CHANNELS),
    *(channel.__name__ for channel in BLOCK_CHANNELS),
    *MEMORY_CHANNELS,
}
