# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of the bringup package."""

from rotor_interfaces.errors import RigError


class ScenarioError(RigError, ValueError):
    """A scenario that cannot be found, read or run."""


class ProcessError(RigError):
    """A process of the rig that failed."""


class DatasetError(RigError, ValueError):
    """A suite or a folder of a data set that cannot be used."""


class ImportFileError(RigError, ValueError):
    """A file of another machine, or an option of its import, that does not serve."""
