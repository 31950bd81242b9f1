# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of the bringup package."""

from rotor_interfaces.errors import RigError


class ScenarioError(RigError, ValueError):
    """A scenario that cannot be found, read or run."""


class ProcessError(RigError):
    """A process of the rig that failed."""
