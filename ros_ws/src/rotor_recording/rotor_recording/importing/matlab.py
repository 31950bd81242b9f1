# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""MATLAB files, read in a separate process: damaged ones can crash scipy."""

import os
import pickle
import resource
import struct
import subprocess
import sys
import warnings
import zlib
from pathlib import Path
from typing import Any

from rotor_recording.errors import ImportFileError

EXPANSION = 64
"""A compressed file may grow by this factor in memory; a measurement never grows 1000 times."""
SMALL_BYTES = 512 * 2**20
"""Memory that any file may take in addition."""


def load_mat(path: Path) -> dict[str, Any]:
    """Return the variables of a MATLAB file up to version 7 by name, as `loadmat` has them.

    Structs are objects with `_fieldnames`, axes of length 1 are left out.

    Raises:
        ImportFileError: no MATLAB file, a damaged one, one of version 7.3, or one that takes more
            memory than its size accounts for.

    """
    done = subprocess.run(
        [sys.executable, '-m', __name__, str(path)],
        env={**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        check=False,
    )
    if done.returncode < 0:
        raise ImportFileError(f'{path} is damaged: its reader crashed on it')
    if done.returncode:
        why = done.stderr.decode(errors='replace').strip().rpartition('\n')[2]
        raise ImportFileError(f'{path} cannot be read: {why}')
    found: dict[str, Any] | str = pickle.loads(done.stdout)  # noqa: S301 - our own process wrote it
    if isinstance(found, str):
        raise ImportFileError(f'{path} {found}')
    return found


def _read(path: str) -> dict[str, Any] | str:
    """Return the variables, or what is wrong with the file."""
    from scipy.io import loadmat  # noqa: PLC0415 - slow, and only needed in the separate process
    from scipy.io.matlab import MatReadError  # noqa: PLC0415

    try:
        with warnings.catch_warnings():
            warnings.simplefilter('ignore')  # such as a variable that occurs twice
            return dict(loadmat(path, squeeze_me=True, struct_as_record=False, appendmat=False))
    except MemoryError:
        return _TOO_LARGE
    except NotImplementedError:
        return 'is a MATLAB file of version 7.3, which is not read; save it with -v7'
    except (MatReadError, ValueError, TypeError, LookupError, AttributeError, EOFError, NameError,
            OSError, OverflowError, struct.error, zlib.error) as error:  # fmt: skip
        why = str(error).partition('\n')[0] or type(error).__name__
        return f'is no MATLAB file, or is damaged: {why}'


_TOO_LARGE = (
    f'takes more memory than {EXPANSION} times its size and {SMALL_BYTES >> 20} MiB; if it is not '
    'damaged, save it uncompressed with -v6'
)


def _limit_memory(path: str) -> None:
    """Limit the memory of this process to what a file of that size accounts for."""
    status = Path('/proc/self/status').read_text('ascii')
    used = next(int(line.split()[1]) for line in status.splitlines() if line.startswith('VmData'))
    most = 1024 * used + SMALL_BYTES + EXPANSION * Path(path).stat().st_size
    resource.setrlimit(resource.RLIMIT_DATA, (most, most))


def _main(path: str) -> None:
    """Write the variables, or what is wrong with the file, as a pickle."""
    import scipy.io  # noqa: F401, PLC0415 - its own memory does not count

    _limit_memory(path)
    try:
        pickle.dump(_read(path), sys.stdout.buffer)
    except MemoryError:
        sys.exit(_TOO_LARGE)


if __name__ == '__main__':
    _main(sys.argv[1])
