# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The page of the reliability run says what its figures say, and the run finds what is wrong."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parent.parent
pytest.importorskip('rclpy', reason='needs ROS 2')

import reliability  # noqa: E402
import reliability_flights  # noqa: E402
from reliability_page import page  # noqa: E402


def figures() -> Any:
    return json.loads((ROOT / 'docs/reliability.json').read_text('utf-8'))


def test_the_page_is_that_of_the_figures() -> None:
    assert (ROOT / 'docs/reliability.md').read_text('utf-8') == page(figures(), reliability.PARTS)


def test_the_figures_are_of_full_runs() -> None:
    assert not any(result['quick'] for result in figures().values())
    assert set(figures()) <= set(reliability.PARTS)


def test_a_promise_that_does_not_hold_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(folder: Path, *, quick: bool) -> dict[str, Any]:
        raise reliability_flights.BrokenPromise(f'{folder.exists()} {quick}', {'seen': 1})

    out = tmp_path / 'out.json'
    part = reliability.Part('Title', 'Promise.', broken)
    monkeypatch.setitem(reliability.PARTS, 'kills', part)
    monkeypatch.setattr(sys, 'argv', ['x', 'kills', '--quick', '--out', str(out)])
    assert reliability.main() == 1
    result = json.loads(out.read_text('utf-8'))
    assert result['kills']['broken'] == 'True True'
    assert result['kills']['figures'] == {'seen': 1}
    assert '**Did not hold:** True True.' in page(result, reliability.PARTS)


def test_a_part_that_is_none_is_refused() -> None:
    done = subprocess.run(
        [sys.executable, ROOT / 'benchmarks/reliability.py', 'fly'],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert 'fly is no part; known: kills, signals' in done.stderr
