# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of the vibration monitor."""

from rotor_common.errors import RigError


class MonitorError(RigError, ValueError):
    """An input of the monitor's own functions that is not allowed; one sentence says why."""
