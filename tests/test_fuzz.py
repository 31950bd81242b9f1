# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The quick part of benchmarks/fuzz.py: no hostile input ends the rig, hangs it or fills memory."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.mark.slow
@pytest.mark.parametrize(
    'kind',
    [
        'blocks', 'views', 'recordings', 'repeats', 'sqlite', 'texts', 'matlab', 'scenarios',
    ],
)  # fmt: skip
def test_no_hostile_input_gets_through(kind: str) -> None:
    done = subprocess.run(
        [sys.executable, ROOT / 'benchmarks/fuzz.py', kind, '--inputs', '200', '--seed', '11'],
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
def test_what_gets_through_is_found() -> None:
    """A consumer that lets everything through must not pass."""
    program = (
        'import fuzz, fuzz_blocks, sys\n'
        'fuzz_blocks.Blocks.feed = lambda self, rng: {}[int(rng.integers(9))]\n'
        'sys.argv[1:] = ["blocks", "--inputs", "3"]\n'
        'sys.exit(fuzz.main())\n'
    )
    done = subprocess.run(
        [sys.executable, '-c', program],
        cwd=ROOT / 'benchmarks',
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 1
    assert 'KeyError' in done.stdout
