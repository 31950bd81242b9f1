# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Read text files that a user names, with a size limit."""

import os
import stat
from pathlib import Path

from rotor_common.errors import DataError


def require_file(path: Path) -> None:
    """Raise DataError for a device, a pipe or a socket, which would be read without end.

    Also for a name that no file can have. For a missing file it raises the system's OSError; a
    folder is accepted here.
    """
    try:
        mode = path.stat().st_mode
    except ValueError as error:
        raise DataError(f'{str(path)!r} cannot be read: {error}') from None
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        raise DataError(f'{path} cannot be read: it is a device or a pipe; name a file')


def read_text(path: Path, largest_bytes: int) -> str:
    """Return the text of a UTF-8 file, without its byte order mark; raises DataError.

    Only a regular file of at most `largest_bytes` is read: no folder, device or pipe.
    """
    try:
        require_file(path)
        # if it has become a pipe, opening it does not wait for a writer
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        with open(descriptor, 'rb') as file:  # noqa: PTH123 - a descriptor has no path
            content = file.read(largest_bytes + 1)
    except OSError as error:
        raise DataError(f'{path} cannot be read: {error.strerror or error}') from None
    if len(content) > largest_bytes:
        raise DataError(f'{path} has more than {largest_bytes / 1e6:g} MB, the most that is read')
    try:
        return content.decode('utf-8-sig')
    except UnicodeDecodeError:
        raise DataError(f'{path} is not a UTF-8 text file') from None
