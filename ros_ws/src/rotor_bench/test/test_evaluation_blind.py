# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A detector under test learns nothing but the measurements, however it tries."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rotor_bench.evaluation import landlock, statistics
from spy_detector import CHANNELS, PLAN

RIG = Path(__file__).parent / 'spy_rig.py'
FILES = {'folders_above', 'known_places', 'links', 'processes', 'parents', 'memory_of_the_parent',
         'tcp', 'abstract_socket', 'commands'}  # fmt: skip
"""What only Landlock closes."""


def spied(mode: str, folder: Path) -> tuple[set[str], float]:
    """Return through which channels the spy found something, and its area under the ROC."""
    text = f'{PLAN} cracked: every second flight'
    folder = folder / 'inside'
    folder.mkdir()
    done = subprocess.run(
        [sys.executable, str(RIG), mode, text],
        cwd=folder,
        env={**os.environ, 'PLAN_AT_START': text, 'HOME': str(folder), 'TMPDIR': str(folder)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    results: list[dict[str, Any]] = json.loads(done.stdout)
    assert [result['failure'] for result in results if result['failure']] == []
    scores = np.array([result['score'] for result in results])
    cracked = np.array([result['crack'] > 0 for result in results])
    area = statistics.auc(scores, cracked, np.arange(len(scores)), replicates=1).value
    return {name for result in results for name in result['found']}, area


@pytest.mark.slow
def test_a_spy_learns_nothing(tmp_path: Path) -> None:
    found, area = spied('isolated', tmp_path)
    assert found - (set() if landlock.version() else FILES) == set()
    # guesses by chance: 16 flights of each kind, standard deviation sqrt(33 / (12 * 256)) = 0.10
    assert abs(area - 0.5) < 0.3


@pytest.mark.slow
def test_the_same_spy_finds_everything_where_nothing_is_closed(tmp_path: Path) -> None:
    found, area = spied('naive', tmp_path)
    assert found == CHANNELS
    assert area == 1.0
