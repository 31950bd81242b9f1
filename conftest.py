# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Marks the tests that run nodes in real time; all others may share the cores (see .ci/run)."""

from pathlib import Path

import pytest

SYSTEM_TESTS = Path(__file__).parent / 'tests'
REAL_TIME = ('_node', '_window', '_screenshot')
"""Ends of the names of such files elsewhere."""


@pytest.hookimpl(tryfirst=True)  # before -m chooses
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what runs nodes, windows or whole commands, and has deadlines to keep."""
    for item in items:
        if SYSTEM_TESTS in item.path.parents or item.path.stem.endswith(REAL_TIME):
            item.add_marker(pytest.mark.real_time)
