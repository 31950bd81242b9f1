# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Cache of results on disk, keyed by the question, so that a repeated run continues."""

import dataclasses
import functools
import hashlib
import importlib.util
import io
import json
import os
import struct
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pydantic
from numpy.typing import NDArray

from rotor_common.durable_file import write_whole
from rotor_dynamics.errors import AnalysisError

Arrays = dict[str, NDArray[Any]]

_MODEL_SOURCES = {
    'rotor_sim': ('plant/*.py', 'plant/elements/*.py'),
    'rotor_dynamics': ('continuations.py', 'ensemble.py', 'lyapunov.py', 'surveys.py'),
}  # fmt: skip
"""Sources that the numbers of an analysis depend on; any change of them changes all keys. Labels
are made from the numbers whenever they are needed."""

_DAMAGE = (
    OSError,
    EOFError,
    KeyError,
    ValueError,
    RuntimeError,  # raised by the zip reader for encryption and unknown compression
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
)


_SEAL_BYTES = 64


class ResultCache:
    """A folder of npz files named by a key of model, plan, start and code version.

    The comment at the end of a file is the SHA-256 of all bytes before it.

    Several processes may share the folder: a file appears whole or not at all. Nothing is ever
    removed; the folder may be deleted at any time.

    Raises AnalysisError if the folder cannot be made or written to.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = Path(folder)
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise AnalysisError(
                f'the cache folder {folder} cannot be made: {error.strerror}; name another one'
            ) from None
        if not os.access(self.folder, os.W_OK | os.X_OK):
            raise AnalysisError(f'the cache folder {folder} cannot be written to; name another one')

    @staticmethod
    def key(function_name: str, payload: Any) -> str:
        """Return the key of a result: SHA-256 over the function, `payload` and the code version.

        `payload` is anything made of JSON types, configuration models, dataclasses and arrays;
        TypeError for anything else, since the texts of two different ones might be equal.
        """
        content = [function_name, code_version(), payload]
        text = json.dumps(content, default=_plain, sort_keys=True, separators=(',', ':'))
        return hashlib.sha256(text.encode()).hexdigest()

    def load(self, key: str) -> Arrays | None:
        """Return the arrays stored under `key`; None if there are none or the file is damaged.

        Every byte of the file is checked first: the directory of a zip file has no checksum.
        """
        try:
            content = self._path(key).read_bytes()
            if _seal(content) != content[-_SEAL_BYTES:]:
                return None
            with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
                return dict(arrays)
        except _DAMAGE:
            return None

    def store(self, key: str, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Store `arrays` under `key`; AnalysisError if they cannot be written."""
        try:
            content = io.BytesIO()
            np.savez(content, allow_pickle=False, **arrays)
            with zipfile.ZipFile(content, 'a') as archive:
                archive.comment = bytes(_SEAL_BYTES)
            sealed = content.getvalue()
            write_whole(self._path(key), sealed[:-_SEAL_BYTES] + _seal(sealed))
        except OSError as error:
            raise AnalysisError(
                f'a result cannot be kept in the cache folder {self.folder}: {error.strerror}; '
                'make room or name another folder'
            ) from None

    def _path(self, key: str) -> Path:
        return self.folder / f'{key}.npz'


def _seal(content: bytes) -> bytes:
    """Return the SHA-256 of a file without its seal."""
    return hashlib.sha256(content[:-_SEAL_BYTES]).hexdigest().encode()


@functools.cache
def code_version() -> str:
    """Return the SHA-256 of the sources that the results of an analysis depend on."""
    digest = hashlib.sha256()
    for package, names in _MODEL_SOURCES.items():
        folder = _folder(package)
        for path in sorted(path for name in names for path in folder.glob(name)):
            content = path.read_bytes()
            digest.update(f'{package}/{path.relative_to(folder)}\0{len(content)}\0'.encode())
            digest.update(content)
    return digest.hexdigest()


def _folder(package: str) -> Path:
    spec = importlib.util.find_spec(package)
    assert spec is not None and spec.origin is not None  # noqa: PT018, S101 - it is required
    return Path(spec.origin).parent


def _plain(value: Any) -> Any:
    """Return `value` in JSON types, for the kinds that a payload may hold."""
    if isinstance(value, pydantic.BaseModel):
        return {'model': type(value).__name__, **value.model_dump(mode='json')}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
        return {'dataclass': type(value).__name__, **fields}
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray) and value.dtype != object:
        return {'array': value.dtype.str, 'shape': value.shape, 'bytes': value.tobytes().hex()}
    raise TypeError(f'a cache key cannot be made from a {type(value).__name__}')
