# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The detector of docs/extending runs as it says, and the page of results can be filled."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from rotor_bench.dataset.suite import plan_suite
from rotor_bench.errors import DatasetError
from rotor_bench.evaluation import landlock
from rotor_bench.evaluation import results_page as page
from spy_detector import CHANNELS

DOCS = Path(__file__).parents[4] / 'docs'


@pytest.mark.slow
def test_the_tutorial_runs(tmp_path: Path) -> None:
    text = (DOCS / 'extending' / 'detector.md').read_text('utf-8')
    code, _ = re.findall(r'```python\n(.*?)```', text, re.DOTALL)
    lines = [line for line in code.splitlines() if line.strip()]
    assert len(lines) <= 32, '30 lines and two docstrings are enough'
    (tmp_path / 'my_detector.py').write_text(code)
    command = re.findall(r'rotor-rig (evaluate my_detector.*)', text)[0].split()
    done = subprocess.run(
        [sys.executable, '-m', 'rotor_bringup', *command[:-1], '1'],  # one machine instead of 3
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=500,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    content = json.loads((tmp_path / 'evaluation' / 'evaluation.json').read_text('utf-8'))
    numbers = content['detectors']['my_detector:MyDetector']
    assert (numbers['failed'], numbers['silent']) == (0, 0)
    assert ('Landlock' in content['isolation']) == bool(landlock.version())
    outcomes = [f['outcomes']['my_detector:MyDetector'] for f in content['flights']]
    assert all('times the reference at G =' in outcome['evidence'] for outcome in outcomes)


def test_the_page_has_a_place_for_results() -> None:
    text = (DOCS / 'evaluation.md').read_text('utf-8')
    assert text.count(page.BEGIN) == text.count(page.END) == 1
    with pytest.raises(DatasetError, match='no place for results'):
        page.filled('nothing', {})


def test_the_results_are_of_the_suite_as_it_is() -> None:
    """Whoever changes the suite owes the page a new run."""
    content = json.loads((DOCS / 'evaluation.json').read_text('utf-8'))
    planned = [
        flight
        for machine in plan_suite(content['suite'], content['seed'])
        for flight in machine.flights
        if flight.split == content['split'] and flight.role == 'test'
    ]
    found = {(flight['machine'], flight['number']): flight for flight in content['flights']}
    assert {(flight.machine, flight.number) for flight in planned} == set(found)
    for flight in planned:
        labels = found[flight.machine, flight.number]['labels']
        assert labels['maneuver'] == flight.grid.family
        assert labels['crack_stiffness_ratio'] == flight.grid.crack_stiffness_ratio
        assert labels['speed_rad_s'] == pytest.approx(flight.rotor.speed_rad_s, rel=1e-5)


def test_the_page_tells_in_how_many_ways_the_spy_looks() -> None:
    text = (DOCS / 'evaluation.md').read_text('utf-8')
    assert f'in {len(CHANNELS)} ways' in text
