# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""docs/extending/command.md and output_format.md as a reader follows them, on one flight."""

import json
import re
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from extending_support import RIG, installed, page, run
from rotor_recording.reading import Recording, waveform_blocks


@pytest.fixture(scope='module')
def flight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp('flight') / 'flight.mcap'
    run(*RIG, 'simulate', 'climb_dive', '--duration', '2', '--out', str(path))
    return path


def commands(part: str) -> list[list[str]]:
    return [line.split() for line in re.findall('^rotor-rig (.*)$', page(part), re.MULTILINE)]


@pytest.mark.slow
def test_an_installed_verb_is_listed_helped_and_run(flight: Path, tmp_path: Path) -> None:
    site = installed('command', 'peaks', tmp_path)
    assert re.search(r'peaks +Print the largest absolute', run(*RIG, '--help', path=site))
    assert 'peaks' not in run(*RIG, '--help')
    help_, plain, as_json = (
        run(*RIG, *words, path=site, cwd=flight.parent) for words in commands('command')
    )
    assert 'Print the largest absolute value' in help_
    rows = np.concatenate([block.rows for block in waveform_blocks(Recording(flight))])
    found = json.loads(as_json)
    names = rows.dtype.names or ()
    assert found == {name: float(np.abs(rows[name]).max()) for name in names[3:]}
    assert f'disk_z       {found["disk_z"]:.4g}\n' in plain


@pytest.mark.slow
def test_an_installed_format_writes_the_windows(flight: Path, tmp_path: Path) -> None:
    site = installed('output_format', 'parquet_windows', tmp_path)
    (words,) = commands('output_format')
    run(*RIG, *words, path=site, cwd=flight.parent)
    run(*RIG, 'analyze', str(flight), '--out', str(tmp_path / 'windows.json'))
    rows = pq.read_table(flight.parent / 'windows.parquet').to_pylist()
    assert len(rows) > 1
    assert rows == json.loads((tmp_path / 'windows.json').read_text())
