# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Hostile files of other systems: texts and MATLAB files to import, SQLite bags."""

import contextlib
import io
import os
import pickle
import sqlite3
import struct
import tempfile
import zlib
from pathlib import Path
from typing import IO, Any
from unittest import mock

import numpy as np
from fuzz_blocks import EPOCH_NS
from fuzz_files import Recordings, changed_text, command, spoilt
from numpy.random import Generator, default_rng
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as BagWriter
from scipy.io import loadmat, savemat

from rotor_interfaces.messages import typestore
from rotor_interfaces.topics import Topic
from rotor_recording.importing import matlab

CHANNELS = ('brg1_ay', 'brg1_az', 'disk_y', 'brg2_ay')
COLUMNS = ('1', '2', 'acc', 'time', 'bearing.gs', 'x[:,2]', 'x[2,:]', 'x', 's[2].x', 'words', '')
CELLS = (
    '', 'nan', 'inf', '1,5', '1.5', '-0', '1e999', '1e-999', '9' * 400, '9' * 6000, '1:30',
    '2020-01-01 10:00:00', '"', '""', '"1,5"', '#', '%', 'ü', '\0', '\x1b[31m', '\r', '\n\n', '\t',
    ';', ',,,', '1_000', '٣', 'x' * 3000, '1 000', '0x10', '\ufeff', '\x85', '\u2028', 'NaN(7)',
)  # fmt: skip
TYPES: tuple[Any, ...] = (
    None, 0, -1, 1, 2**31, 2**63 - 1, -(2**63), 0.5, 1e300, '', 'x', 'cdr', 'json', '\x1b[31m',
    '/rotor/waveform', 'sensor_msgs/msg/PointCloud2', 'std_msgs/msg/String', '[' * 3000, b'',
    b'\0\1\0\0', b'\xff' * 40, 'a\0b', '- depth: 2024-01-01', '/dev/zero',
)  # fmt: skip


class Imports:
    """Files through `import`, each with options of a user who does not know them."""

    name = 'x.txt'

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix='rotor-rig-fuzz-')

    def start(self) -> None:
        """Keep nothing."""

    def content(self, rng: Generator) -> bytes:
        """Return the bytes of a file."""
        raise NotImplementedError

    def feed(self, rng: Generator) -> None:
        """Import one file."""
        folder = Path(self._folder.name)
        file, out = folder / self.name, folder / 'imported.mcap'
        out.unlink(missing_ok=True)
        file.write_bytes(self.content(rng))
        chosen = rng.choice(CHANNELS, int(rng.integers(1, 3)), replace=False)
        options = [f'--channel={name}={rng.choice(COLUMNS)}' for name in chosen]
        options += [str(rng.choice(['--rate-hz=5120', '--time=1', '--time=x[:,1]', '--unit=g']))]
        other = (
            '--speed-hz=25', '--tacho=1', '--tacho=x[:,1]', '--decimal=comma', '--decimal=point',
            '--first-line=1', '--first-line=7', '--unit=um', '--pulses-per-revolution=3',
        )  # fmt: skip
        options += [str(o) for o in rng.choice(other, int(rng.integers(0, 3)), replace=False)]
        command('import', str(file), f'--out={out}', *options)


class Texts(Imports):
    """Tables as loggers write them, of which lines and cells have changed."""

    def content(self, rng: Generator) -> bytes:
        """Return a text in one of its encodings."""
        text = changed_text(rng, self._table(rng))
        encoding = str(rng.choice(['utf-8', 'utf-8', 'latin-1', 'utf-16', 'utf-8-sig']))
        return spoilt(rng, text.encode(encoding, 'replace') or b'\n')

    def _table(self, rng: Generator) -> str:
        delimiter = str(rng.choice([',', ';', '\t', ' ', '  ']))
        end = str(rng.choice(['\n', '\r\n', '\r']))
        count, width = int(rng.choice([1, 3, 40, 400, 3000])), int(rng.choice([1, 2, 3, 200]))
        times = np.arange(count) / 5120
        values = np.column_stack([times, *rng.standard_normal((width - 1, count))])
        rows = [[f'{x:.6g}' for x in row] for row in values[: 20_000 // width]]
        for _ in range(rng.integers(0, 5)):
            row = rows[rng.integers(len(rows))]
            row[rng.integers(len(row))] = CELLS[rng.integers(len(CELLS))]
        if rng.integers(5) == 0:
            rows[rng.integers(len(rows))] *= int(rng.choice([2, 300]))
        lines = [delimiter.join(row) for row in rows]
        if rng.integers(4) == 0:
            lines = [line.replace('.', ',') for line in lines]
        names = delimiter.join(['time', 'acc', 'words'][:width])
        heads = ([], [names], ['# x', names], ['Rate,5120', '', names], ['1', '2', '3'] * 50)
        return end.join([*heads[rng.integers(len(heads))], *lines])


class Matlab(Imports):
    """MATLAB files with structs, matrices and words, damaged before they are packed."""

    name = 'x.mat'

    def __init__(self) -> None:
        super().__init__()
        samples = default_rng(1).standard_normal((500, 3))
        acc = {'gs': samples[:, 0], 'sr': 5120.0, 'rate': 25.0}
        objects = np.array([{'x': samples[:, 1]}, {'x': 'word'}], object)
        variables = {
            'bearing': acc, 'x': samples, 's': objects, 'words': 'a word', 'c': samples * 1j,
            'cell': np.array([samples[:3], 'x', 5], object), 'on': samples[:, 0] > 0,
            'small': (samples * 100).astype(np.int8), 'deep': {'a': {'b': {'c': samples[:2]}}},
        }  # fmt: skip
        self._whole = io.BytesIO()
        savemat(self._whole, variables)
        self._old = io.BytesIO()
        savemat(self._old, {'x': samples, 'words': 'a word'}, format='4')
        loadmat(io.BytesIO(self._whole.getvalue()))  # imports what it needs, before any fork

    def content(self, rng: Generator) -> bytes:
        """Return a file of version 4, or of version 5 packed or not."""
        if rng.integers(4) == 0:
            return spoilt(rng, self._old.getvalue())
        data = self._whole.getvalue()
        if rng.integers(2):
            return spoilt(rng, data)
        found, place = bytearray(data[:128]), 128
        while place < len(data):
            (length,) = struct.unpack_from('<I', data, place + 4)
            element = spoilt(rng, data[place : place + 8 + length])
            if rng.integers(40) == 0:
                element += bytes(int(rng.choice([10_000_000, 300_000_000])))
            packed = zlib.compress(element, 1)
            found += struct.pack('<II', 15, len(packed)) + packed
            place += 8 + length
        return spoilt(rng, bytes(found)) if rng.integers(3) == 0 else bytes(found)

    def feed(self, rng: Generator) -> None:
        """Import one file, whose reader is a fork, which is a hundred times as fast."""
        with mock.patch.object(matlab.subprocess, 'run', _forked):
            super().feed(rng)


def _forked(arguments: list[str], **_: Any) -> Any:
    """Stand in for the process of `load_mat`; raises where it takes too long or too much."""
    with tempfile.TemporaryFile() as sink:
        return _read_by_fork(arguments[-1], sink)


def _read_by_fork(path: str, sink: IO[bytes]) -> Any:
    child = os.fork()
    if not child:
        code = 1
        with contextlib.suppress(BaseException):
            matlab._limit_memory(path)  # noqa: SLF001
            sink.write(pickle.dumps(matlab._read(path)))  # noqa: SLF001
            sink.flush()
            code = 0
        os._exit(code)
    _, status, used = os.wait4(child, 0)
    if used.ru_utime + used.ru_stime > 2.0 or used.ru_maxrss > 1536 * 1024:
        raise AssertionError(f'reader took {used.ru_utime} s and {used.ru_maxrss / 1024} MiB')
    sink.seek(0)
    return mock.Mock(returncode=os.waitstatus_to_exitcode(status), stdout=sink.read(), stderr=b'?')


class Sqlite(Recordings):
    """SQLite bags of which rows, columns and bytes have changed, through all that reads them."""

    suffix = '.db3'

    def _recording(self, rng: Generator) -> bytes:
        folder = Path(self._folder.name)
        bag = folder / 'template'
        if not bag.exists() or rng.integers(20) == 0:
            self._write(rng, bag)
        file = folder / 'changed.db3'
        file.write_bytes((bag / 'template.db3').read_bytes())
        with contextlib.closing(sqlite3.connect(file, isolation_level=None)) as database:
            database.execute('PRAGMA journal_mode=OFF')
            for _ in range(rng.integers(0, 4)):
                with contextlib.suppress(sqlite3.Error, OverflowError):
                    self._change(rng, database)
        return file.read_bytes()

    def _write(self, rng: Generator, bag: Path) -> None:
        for file in bag.glob('*'):
            file.unlink()
        if bag.exists():
            bag.rmdir()
        version = 9 if rng.integers(4) else 8
        known: dict[Topic, Any] = {}
        with BagWriter(bag, version=version, storage_plugin=StoragePlugin.SQLITE3) as writer:
            for number, (topic, data) in enumerate(self._messages(rng, '{}')):
                if topic not in known:
                    name = f'/{topic.name.lstrip("/")}'
                    known[topic] = writer.add_connection(name, topic.type, typestore=typestore())
                writer.write(known[topic], EPOCH_NS + number * 10_000_000, data)

    def _change(self, rng: Generator, database: sqlite3.Connection) -> None:
        listed = database.execute("SELECT name FROM sqlite_master WHERE type = 'table'").fetchall()
        table = listed[rng.integers(len(listed))][0]
        columns = [row[1] for row in database.execute(f'PRAGMA table_info({table})')]
        column = columns[rng.integers(len(columns))]
        value = TYPES[rng.integers(len(TYPES))]
        kind = rng.integers(12)
        if kind < 7:
            which = f'(SELECT rowid FROM {table} ORDER BY rowid LIMIT 1 OFFSET ?)'  # noqa: S608
            row = int(rng.integers(8))
            query = f'UPDATE {table} SET {column} = ? WHERE rowid = {which}'  # noqa: S608
            database.execute(query, (value, row))
        elif kind == 7:
            database.execute(f'UPDATE {table} SET {column} = ?', (value,))  # noqa: S608
        elif kind == 8:
            database.execute(f'DELETE FROM {table}')  # noqa: S608
        elif kind == 9:
            database.execute(f'DROP TABLE {table}')
        elif kind == 10:
            database.execute(f'ALTER TABLE {table} DROP COLUMN {column}')
        else:
            database.execute(f'ALTER TABLE {table} RENAME TO other_{table}')
