# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Write a rerun file; a full disk is an error."""

import os
import threading
from pathlib import Path

import rerun as rr

from rotor_view.viewer import ViewError

_PIECE = 2**16


class ViewFile:
    """Writes what a recording stream sends into a new `.rrd` file, until `close`.

    rerun writes into a pipe and a thread copies from there to the file: on a full disk rerun
    itself would block for ever and ignore every signal.

    Raises:
        ViewError: the file cannot be made.

    """

    def __init__(self, stream: rr.RecordingStream, path: Path) -> None:
        self._stream = stream
        self._path = path
        self._refused: OSError | None = None
        try:
            self._file = path.open('wb')
        except OSError as error:
            raise self._error(error) from None
        reading, writing = os.pipe()
        self._pipe = os.fdopen(reading, 'rb', buffering=0)  # gives what there is, at once
        self._thread = threading.Thread(target=self._copy, daemon=True)
        self._thread.start()
        try:
            stream.save(f'/proc/self/fd/{writing}')
        finally:
            os.close(writing)  # rerun has opened it for itself

    def _copy(self) -> None:
        """Copy until rerun closes its end; after an error keep reading, so that rerun can go on."""
        with self._pipe:
            try:
                with self._file:
                    while data := self._pipe.read(_PIECE):
                        self._file.write(data)
                        self._file.flush()
            except OSError as error:
                self._refused = error
            while self._pipe.read(_PIECE):
                pass

    def check(self) -> None:
        """Raise ViewError if the file could not be written."""
        if self._refused is not None:
            raise self._error(self._refused)

    def close(self) -> None:
        """Finish the file, once the stream has been flushed; raises ViewError."""
        self._stream.disconnect()
        self._thread.join()
        self.check()

    def _error(self, error: OSError) -> ViewError:
        return ViewError(
            f'the view cannot be written to {self._path.parent} ({error.strerror}); choose '
            'another folder'
        )
