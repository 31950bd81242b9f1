# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of the maneuver generator."""

from rotor_common.errors import RigError


class ManeuverError(RigError, ValueError):
    """A maneuver, flight file or run length that is not allowed; one sentence says why."""
