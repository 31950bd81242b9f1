# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""How tests share the cores of a machine: what runs nodes in real time stays on one worker.

Those tests have deadlines to keep and share recorded runs. They come first, since they take
longest; all others are spread over the workers file by file. See scripts/test.
"""

from pathlib import Path

import pytest

ROOT = Path(__file__).parent


def is_real_time(path: Path) -> bool:
    """Say whether a file's tests run nodes, windows or whole commands and wait for them."""
    return ROOT / 'tests' in path.parents or path.stem.endswith(('_node', '_window', '_screenshot'))


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Group the tests for the workers."""
    items.sort(key=lambda item: not is_real_time(item.path))
    for item in items:
        group = 'real time' if is_real_time(item.path) else str(item.path)
        item.add_marker(pytest.mark.xdist_group(group))
