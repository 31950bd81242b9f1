# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Errors that the rig raises on purpose: one clear sentence, shown without a traceback."""


class RigError(Exception):
    """Base of every error that a user of the rig can cause and correct."""


class ConfigError(RigError, ValueError):
    """A key, type or value in a scenario or parameter set that is not allowed."""


class WireError(RigError, ValueError):
    """A message that breaks the wire contract."""


class DataError(RigError, ValueError):
    """A text or file of plain data (YAML, JSON, CSV) that is not accepted."""


class ProcessError(RigError):
    """A process of the rig that failed."""


def refusal(error: OSError) -> str:
    """Return the error of the system in words, with the file if it names one."""
    what = error.strerror or str(error)
    return f'{what}: {error.filename}' if error.filename else what
