# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Check output paths before anything is computed."""

import os
from collections.abc import Collection
from pathlib import Path

from rotor_common.errors import ConfigError

FILE_ENDINGS = frozenset({
    '.avi', '.bag', '.csv', '.db3', '.gif', '.h5', '.hdf5', '.html', '.jpeg', '.jpg', '.json',
    '.jsonl', '.log', '.mat', '.mcap', '.md', '.mp4', '.npy', '.npz', '.parquet', '.pdf', '.png',
    '.py', '.rrd', '.svg', '.tar', '.tsv', '.txt', '.wav', '.xlsx', '.xml', '.yaml', '.yml',
    '.zip', '.zst',
})  # fmt: skip
"""Endings that a new folder may not have, since it would look like a file."""


def check_file(
    path: Path, endings: Collection[str], otherwise: str = '', *, option: str = '--out'
) -> None:
    """Raise ConfigError unless the file of an option has a known ending and can be written.

    `otherwise` is a hint at other kinds of files, added to the error about a wrong ending.
    """
    if path.suffix not in endings:
        hint = f'; {otherwise}' if otherwise else ''
        raise ConfigError(f'{option} {path} must end in {" or ".join(endings)}{hint}')
    if path.is_dir():
        raise ConfigError(f'{option} {path} is a folder; name a file in it')
    if not path.parent.is_dir():
        raise ConfigError(f'{option} {path}: there is no folder {path.parent}; make it first')
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise ConfigError(f'{option} {path} cannot be written to; choose another folder')


def check_folder_name(folder: Path, option: str = '--out') -> None:
    """Raise ConfigError if a folder that is to be made has a name like a file's."""
    if folder.suffix.lower() in FILE_ENDINGS and not folder.is_dir():
        raise ConfigError(
            f'{option} {folder} looks like a file ({folder.suffix}), but a folder is written; name '
            'one without this ending'
        )


def make_folder(folder: Path, option: str = '--out') -> None:
    """Make the folder that a command writes into; raises ConfigError if that fails."""
    check_folder_name(folder, option)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f'{option} {folder} cannot be made: {error.strerror}') from None
    if not os.access(folder, os.W_OK | os.X_OK):
        raise ConfigError(f'{option} {folder} cannot be written to; choose another folder')
