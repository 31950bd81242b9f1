# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""What a killed rig leaves behind: found at the next start by who holds its lock, and removed.

The kernel releases a lock when its holder dies, whatever killed it; a process id may have been
reused. Only what belongs to this user is touched.
"""

import contextlib
import fcntl
import os
import re
import shutil
import stat
import tempfile
import time
from collections.abc import Collection, Iterator
from pathlib import Path
from types import TracebackType
from typing import Self

SHARED_MEMORY = Path('/dev/shm')  # noqa: S108 - where Fast DDS puts its files
PREFIX = 'rotor-rig-'
"""Begins the name of every folder that the rig makes in the temporary directory."""

YOUNG_S = 10.0
"""A younger file may belong to a participant that has not taken its lock yet."""

_OWNER = 'owner'
_LOCK = re.compile(r'(fastrtps_(?:[0-9a-z]{16}|port\d{1,5}))_(?:el|sl)')


class OwnFolder:
    """A folder in the temporary directory that is locked while this process lives.

    As a context it gives the path, and is removed with the block.

    Raises:
        OSError: it cannot be made.

    """

    def __init__(self, kind: str = '', parent: Path | None = None) -> None:
        """Make the folder; `kind` is a word in its name, `parent` another place for it."""
        self.path = Path(tempfile.mkdtemp(prefix=f'{PREFIX}{kind}', dir=parent))
        unnamed = self.path / f'{_OWNER}.tmp'
        self._lock = os.open(unnamed, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
        fcntl.flock(self._lock, fcntl.LOCK_EX)
        os.write(self._lock, f'{os.getpid()}\n'.encode())
        unnamed.rename(self.path / _OWNER)  # from here on it can be found, and is locked

    def cleanup(self) -> None:
        """Remove the folder; twice is harmless."""
        shutil.rmtree(self.path, ignore_errors=True)
        with contextlib.suppress(OSError):
            os.close(self._lock)
        self._lock = -1

    def __enter__(self) -> Path:
        return self.path

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.cleanup()


def remove_leftovers(parents: Collection[Path] = ()) -> list[Path]:
    """Remove what killed rigs of this user have left; return the removed paths.

    Args:
        parents: further folders in which the rig makes folders of its own.

    """
    gone = []
    for parent in {Path(tempfile.gettempdir()), *parents}:
        gone += [folder for folder in _own_folders(parent) if _remove_folder(folder)]
    for base, locks in _groups().items():
        gone += _remove_shared_memory(base, locks)
    return gone


def _own_folders(parent: Path) -> Iterator[Path]:
    with contextlib.suppress(OSError):
        for entry in os.scandir(parent):
            if entry.name.startswith(PREFIX) and entry.is_dir(follow_symlinks=False):
                with contextlib.suppress(OSError):
                    if entry.stat(follow_symlinks=False).st_uid == os.getuid():
                        yield Path(entry.path)


def _remove_folder(folder: Path) -> bool:
    with contextlib.suppress(OSError), _Held(folder / _OWNER):
        shutil.rmtree(folder, ignore_errors=True)
        return True
    return False


def _groups() -> dict[str, list[Path]]:
    """Return the lock files of Fast DDS by the segment or port that they guard."""
    groups: dict[str, list[Path]] = {}
    with contextlib.suppress(OSError):
        for file in SHARED_MEMORY.iterdir():
            if match := _LOCK.fullmatch(file.name):
                groups.setdefault(match[1], []).append(file)
    return groups


def _remove_shared_memory(base: str, locks: list[Path]) -> list[Path]:
    """Remove a segment or port if nobody holds one of its locks, as `fastdds shm clean` does."""
    files = [SHARED_MEMORY / base, SHARED_MEMORY / f'sem.{base}_mutex', *locks]
    gone = []
    with contextlib.suppress(OSError), contextlib.ExitStack() as held:
        for lock in locks:
            held.enter_context(_Held(lock, made_before_s=time.time() - YOUNG_S))
        for file in files:  # the locks last: they protect what is only partly removed
            with contextlib.suppress(OSError):
                if file.lstat().st_uid == os.getuid():
                    file.unlink()
                    gone.append(file)
    return gone


class _Held:
    """A lock file whose holder is gone, locked for as long as the block lasts.

    Raises:
        OSError: it is held, is another user's or no plain file, or has just been made or replaced.

    """

    def __init__(self, file: Path, made_before_s: float | None = None) -> None:
        self._file = os.open(file, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
        try:
            found = os.fstat(self._file)
            if found.st_uid != os.getuid() or not stat.S_ISREG(found.st_mode):
                raise PermissionError
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if not os.path.samestat(found, file.lstat()):
                raise FileNotFoundError
            if made_before_s is not None and found.st_ctime > made_before_s:
                raise BlockingIOError
        except OSError:
            os.close(self._file)
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        os.close(self._file)
