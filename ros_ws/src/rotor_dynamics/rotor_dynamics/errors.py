# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of the analyses."""

from rotor_common.errors import RigError


class AnalysisError(RigError, ValueError):
    """An analysis that cannot be made: a range, a step or a folder that cannot be used."""
