# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of scenarios."""

from rotor_common.errors import RigError


class ScenarioError(RigError, ValueError):
    """A scenario that cannot be found, read or run."""
