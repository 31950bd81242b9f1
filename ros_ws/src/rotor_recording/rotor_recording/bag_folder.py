# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The files of a recording: a bag folder or a single file, compressed or not."""

import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path, PureWindowsPath
from typing import Any

import lz4.frame
import zstandard

from rotor_common.errors import DataError
from rotor_common.plain_data import LARGEST_YAML, parse_yaml
from rotor_common.text_file import read_text, require_file
from rotor_recording.db3_file import MAGIC, Db3File
from rotor_recording.errors import RecordingInputError
from rotor_recording.mcap_file import McapFile
from rotor_recording.mcap_records import compression_of

METADATA_FILE = 'metadata.yaml'
_PACKED_SUFFIX = re.compile(r'\.(zstd|zst|lz4)$')
_BAG_NAME = re.compile(r'\.(mcap(\.active)?|db3)(\.(zstd|zst|lz4))?$')

Note = Callable[[str], None]


def is_recording(path: Path) -> bool:
    """Say whether a path is meant as a recording: a folder, or the name of a file of a bag."""
    return path.is_dir() or not {'.mcap', '.db3'}.isdisjoint(path.suffixes)


def bag_files(path: Path, note: Note) -> list[Path]:
    """Return the files of a recording in their order.

    Args:
        path: a folder, or a file, which is returned as it is.
        note: takes a sentence for each file that is missing or left out.

    Raises:
        RecordingInputError: no file there, or messages in a compression that is not known.

    """
    try:
        if not path.is_dir():
            return [path]
        found = sorted((p for p in path.iterdir() if _BAG_NAME.search(p.name)), key=_natural)
    except OSError as error:
        raise RecordingInputError(f'{path} cannot be read ({error.strerror})') from None
    information = _metadata(path / METADATA_FILE, note)
    listed = _listed(information, note)
    _check_compression(path, information)
    there = [path / name for name in listed if os.path.isfile(path / name)]  # noqa: PTH113 - no error
    missing = [name for name in listed if path / name not in there]
    if not found and not there:
        raise RecordingInputError(
            f'{path} holds no .mcap file and no .db3 file; give the folder of a bag'
        )
    if there:
        for name in missing:
            note(f'{name} of {METADATA_FILE} is missing, so its messages are left out')
        chosen, why = there, f'not in {METADATA_FILE}'
    else:
        chosen, why = _of_one_kind(found), f'beside {_of_one_kind(found)[0].name}'
        if missing:
            note(
                f'{METADATA_FILE} names {", ".join(missing)}, which is not there; read instead: '
                f'{", ".join(file.name for file in chosen)}'
            )
    for file in found:
        if file not in chosen:
            note(f'{file.name} is left out, since it is {why}; give it by itself to read it')
    return chosen


def open_file(path: Path, folder: Callable[[], Path], note: Note) -> McapFile | Db3File:
    """Return an opened file of a bag, which may be compressed as a whole.

    Args:
        path: the file.
        folder: returns the folder into which a compressed file is unpacked.
        note: takes a sentence for what is lost of a compressed file.

    Raises:
        RecordingInputError: not readable, not a bag, or no room to unpack it.

    """
    try:
        require_file(path)
        with path.open('rb') as file:
            head = file.read(len(MAGIC))
    except DataError as error:
        raise RecordingInputError(f'{error}; check the path and its permissions') from None
    except OSError as error:
        raise RecordingInputError(
            f'{path} cannot be read ({error.strerror}); check the path and its permissions'
        ) from None
    compression = compression_of(head)
    if compression:
        unpacked = _unpacked(path, compression, folder, note)
        try:
            return open_file(unpacked, folder, note)
        except RecordingInputError as error:
            raise RecordingInputError(str(error).replace(str(unpacked), str(path))) from None
    return Db3File(path) if head == MAGIC else McapFile(path)


def _unpacked(path: Path, compression: str, folder: Callable[[], Path], note: Note) -> Path:
    """Unpack a file as far as it is whole; return the new file."""
    reader: Any
    try:
        target = folder() / _PACKED_SUFFIX.sub('', path.name)
        with path.open('rb') as packed, target.open('wb') as unpacked:
            if compression == 'lz4':
                reader = lz4.frame.LZ4FrameFile(packed)
            else:
                unpacker = zstandard.ZstdDecompressor()
                reader = unpacker.stream_reader(packed, read_across_frames=True)
            try:
                shutil.copyfileobj(reader, unpacked)
            except (zstandard.ZstdError, RuntimeError, EOFError):
                note(f'{path.name} is damaged or cut; what could be unpacked of it is read')
    except OSError as error:
        raise RecordingInputError(
            f'{path} is compressed as a whole ({compression}) and cannot be unpacked '
            f'({error.strerror or error}); set TMPDIR to a folder with room for it, or unpack it '
            f'yourself: {compression} -d {path.name}'
        ) from None
    return target


def _metadata(path: Path, note: Note) -> dict[str, Any]:
    """Return the content of metadata.yaml; empty without a usable file."""
    if not path.is_file():
        return {}
    try:
        document = parse_yaml(read_text(path, LARGEST_YAML), foreign=True)
        information = document['rosbag2_bagfile_information']
        if isinstance(information, dict) and isinstance(information['relative_file_paths'], list):
            return information
    except (DataError, TypeError, KeyError):
        pass
    note(f'{METADATA_FILE} is damaged, so the files of the folder are read without it')
    return {}


def _listed(information: dict[str, Any], note: Note) -> list[str]:
    """Return the names of the files in metadata.yaml, each once, without their folders."""
    names = information.get('relative_file_paths', [])
    if information and not names:
        note(f'{METADATA_FILE} names no file, so the files of the folder are read without it')
    # only the name: an older rosbag2 wrote the folder too, and nothing outside is read
    return list(dict.fromkeys(PureWindowsPath(str(name)).name for name in names))


def _check_compression(path: Path, information: dict[str, Any]) -> None:
    """Raise for messages in an unknown compression; that of files is known by their first bytes."""
    mode, name = (str(information.get(f'compression_{k}') or '') for k in ('mode', 'format'))
    if mode.upper() == 'MESSAGE' and name not in ('zstd', 'lz4'):
        raise RecordingInputError(
            f'the messages of {path} are compressed one by one with {name!r}; known are zstd and '
            'lz4, so convert the bag with `ros2 bag convert` where it was made'
        )


def _of_one_kind(files: list[Path]) -> list[Path]:
    """Return the MCAP files of a folder, else its SQLite files; none whose unpacked copy is there.

    Files of both kinds, or packed and unpacked ones, are copies of each other.
    """
    chosen = [file for file in files if '.mcap' in file.suffixes] or files
    names = {file.name for file in chosen}
    return [file for file in chosen if _PACKED_SUFFIX.sub('', file.name) not in names - {file.name}]


def _natural(path: Path) -> list[Any]:
    """Return a sorting key that puts run_10 after run_9."""
    return [int(part) if part.isdigit() else part for part in re.split(r'(\d+)', path.name)]
