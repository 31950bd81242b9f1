# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Keeps the engines of plants: writes each once, loads it, and says while it compiles."""

import atexit
import contextlib
import functools
import hashlib
import importlib.util
import os
import shutil
import sys
import tempfile
from pathlib import Path
from types import ModuleType
from typing import Any

from rotor_common import machine_code
from rotor_common.durable_file import write_whole


@functools.cache
def _folder() -> Path:
    """Return where engines are kept: the user's cache, or for this process a folder of its own."""
    with contextlib.suppress(OSError, RuntimeError):  # read-only, or a user without a home
        folder = Path(os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache', 'rotor_rig')
        folder = folder / 'engines'
        folder.mkdir(parents=True, exist_ok=True)
        if os.access(folder, os.W_OK | os.X_OK):
            return folder
    passing = Path(tempfile.mkdtemp(prefix='rotor_rig_'))
    atexit.register(shutil.rmtree, passing, ignore_errors=True)
    return passing


@functools.cache
def load(text: str) -> ModuleType:
    """Return the module of an engine; its functions compile when first called.

    The file is named by the hash of its text, so machine code on disk is never that of another.
    """
    name = f'engine_{hashlib.sha256(text.encode()).hexdigest()[:20]}'
    path = _folder() / f'{name}.py'
    kept = machine_code.can_be_kept(str(path))
    whole = text.replace('cache=CACHE', f'cache={kept}')
    if not path.exists():
        write_whole(path, whole.encode())
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None  # noqa: PT018, S101 - the file is there
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def plain(text: str) -> dict[str, Any]:
    """Return the functions of an engine as plain Python, for single evaluations."""
    names: dict[str, Any] = {}
    lines = text.replace('import numba\n', '').replace(
        'jit = numba.njit(**OPTIONS)\ninline = numba.njit(**OPTIONS, forceinline=True)',
        'jit = inline = lambda function: function',
    )
    exec(compile(lines.replace('cache=CACHE', 'cache=False'), '<engine>', 'exec'), names)  # noqa: S102
    return names
