# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""How tests share the cores of a machine: what starts processes of the rig stays on one worker.

Those tests wait for each other's deadlines and share recorded runs. They come first, since they
take longest; all others are spread over the workers file by file. See scripts/test.
"""

from pathlib import Path

import pytest

ROOT = Path(__file__).parent


def starts_processes(path: Path) -> bool:
    """Say whether a file's tests start nodes or commands of the rig and wait for them."""
    return ROOT / 'tests' in path.parents or path.stem.endswith(('_node', '_window', '_screenshot'))


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Group the tests for the workers."""
    items.sort(key=lambda item: not starts_processes(item.path))
    for item in items:
        group = 'processes' if starts_processes(item.path) else str(item.path)
        item.add_marker(pytest.mark.xdist_group(group))
