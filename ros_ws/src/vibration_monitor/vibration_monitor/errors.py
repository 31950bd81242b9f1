# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of the vibration monitor and its recordings."""

from rotor_interfaces.errors import RigError


class MonitorError(RigError, ValueError):
    """An input of the monitor's own functions that is not allowed; one sentence says why."""


class RecordingError(RigError):
    """A recording that cannot be written, read or replayed."""


class RecordingInputError(RecordingError, ValueError):
    """A given recording, or a choice of its topics, that cannot be read or replayed."""
