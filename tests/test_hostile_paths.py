# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Names that no file can have, and what is no file: one printable sentence, exit code 2."""

import os
import re
import socket
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from rotor_bringup.cli import app


def _long(_: Path) -> str:
    return 'x' * 5000


def _deep(_: Path) -> str:
    return '/'.join(['d'] * 3000)


def _null(_: Path) -> str:
    return 'a\0b'


def _loop(folder: Path) -> str:
    (folder / 'one').symlink_to(folder / 'other')
    (folder / 'other').symlink_to(folder / 'one')
    return str(folder / 'one')


def _in_a_loop(folder: Path) -> str:
    return f'{_loop(folder)}/x'


def _below_a_file(folder: Path) -> str:
    (folder / 'file').touch()
    return str(folder / 'file' / 'x')


def _control(folder: Path) -> str:
    return str(folder / 'a\nb\x1b[31m\x07')


def _no_text(folder: Path) -> str:
    return str(folder / '\udcff')


def _lone_surrogate(folder: Path) -> str:
    return str(folder / '\ud800')


def _pipe(folder: Path) -> str:
    os.mkfifo(folder / 'pipe.mcap')
    return str(folder / 'pipe.mcap')


def _socket(folder: Path) -> str:
    with socket.socket(socket.AF_UNIX) as one:
        one.bind(str(folder / 's.mcap'))
    return str(folder / 's.mcap')


def _device(_: Path) -> str:
    return '/dev/zero'


def _device_by_another_name(folder: Path) -> str:
    (folder / 'zero.mcap').symlink_to('/dev/zero')
    return str(folder / 'zero.mcap')


NO_NAMES = [_long, _deep, _null, _in_a_loop, _below_a_file, _lone_surrogate]
NO_FILES = [_loop, _control, _no_text, _pipe, _socket, _device, _device_by_another_name]
IMPORT = ['--channel', 'brg1_ay=1', '--unit', 'g', '--rate-hz', '1000', '--speed-hz', '10']
READING = {
    'analyze': ['analyze', '{}'],
    'view': ['view', '{}', '--save', 'view.rrd'],
    'replay': ['replay', '{}'],
    'show': ['scenario', 'show', '{}'],
    'check': ['scenario', 'check', '{}'],
    'simulate': ['simulate', '{}', '--out', 'run.mcap'],
    'baseline': ['baseline', '{}'],
    'import': ['import', '{}', '--out', 'imported.mcap', *IMPORT],
    'dataset': ['dataset', '{}', '--out', 'data'],
    'evaluate': ['evaluate', 'ratios', '--suite', '{}'],
}
WRITING = {
    'simulate': ['simulate', 'level_healthy', '--duration', '0.1', '--out', '{}.mcap'],
    'import': ['import', 'samples.csv', '--out', '{}.mcap', *IMPORT],
    'dataset': ['dataset', 'smoke', '--out', '{}'],
    'poincare': ['poincare', '--out', '{}.png'],
}


def check(arguments: list[str], name: str) -> None:
    result = CliRunner().invoke(app, [argument.format(name) for argument in arguments])
    assert result.exit_code == 2, (result.output, result.exception)
    said = result.stderr
    if said.startswith('Usage:'):  # typer refuses some itself, in its box
        assert 'Invalid value' in said
        return
    assert re.fullmatch(r'error: [^\x00-\x1f\x7f]+\n', said), said[:500]


@pytest.mark.parametrize('kind', [*NO_NAMES, *NO_FILES])
@pytest.mark.parametrize('command', READING)
def test_what_cannot_be_read_ends_in_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str, kind: Callable[[Path], str]
) -> None:
    monkeypatch.chdir(tmp_path)
    if command == 'replay':
        pytest.importorskip('rclpy', reason='needs ROS 2')
    check(READING[command], kind(tmp_path))


@pytest.mark.parametrize('kind', NO_NAMES)
@pytest.mark.parametrize('command', WRITING)
def test_what_cannot_be_written_ends_in_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str, kind: Callable[[Path], str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'samples.csv').write_text('\n'.join(f'{number / 10}' for number in range(3000)))
    check(WRITING[command], kind(tmp_path))
