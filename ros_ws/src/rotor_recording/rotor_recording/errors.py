# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of recordings and of imported files."""

from rotor_common.errors import RigError


class RecordingError(RigError):
    """A recording that cannot be written, read or replayed."""


class RecordingInputError(RecordingError, ValueError):
    """A given recording, or a choice of its topics, that cannot be read or replayed."""


class ImportFileError(RigError, ValueError):
    """A file of another machine, or an option of its import, that cannot be used."""
