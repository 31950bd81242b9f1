# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The directory in which numba caches compiled code."""

import contextlib
import os
import tempfile
from pathlib import Path


def can_be_kept(source: str) -> bool:
    """Say whether numba finds a folder for the machine code of a source file.

    The same places as numba's: NUMBA_CACHE_DIR, beside the file, the user's cache. If none can be
    written, as in a read-only installation without a home, numba's cache option is an error.
    """
    folders = [Path(source).parent / '__pycache__']
    if named := os.environ.get('NUMBA_CACHE_DIR'):
        folders.insert(0, Path(named))
    if cache := os.environ.get('XDG_CACHE_HOME'):
        folders.append(Path(cache, 'numba'))
    else:
        with contextlib.suppress(RuntimeError):  # a user without a home
            folders.append(Path.home() / '.cache' / 'numba')
    return any(_takes_files(folder) for folder in folders)


def _takes_files(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True
