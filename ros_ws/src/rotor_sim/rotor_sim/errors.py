# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of the rotor simulator."""

from rotor_common.errors import RigError


class RotorError(RigError, ValueError):
    """A rotor parameter, a load grid or a live change that cannot be accepted."""


class PlantError(RotorError):
    """A plant or one of its elements that cannot be built."""


class LoadConflictError(RotorError):
    """A point of the load grid that comes with two values."""


class IntegrationError(RigError):
    """The equations could not be solved: no equilibrium, or a state that left the model."""


class CosimulationError(RigError):
    """The run cannot go on: endpoints missing, a hole in the load grid, a consumer that stalls."""
