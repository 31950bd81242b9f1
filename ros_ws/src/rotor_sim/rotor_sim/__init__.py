# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Physics, integrator and sensor models of the cracked rotor; needs no ROS."""

from rotor_sim.errors import IntegrationError, RotorError
from rotor_sim.plant.parameters import RotorParameters
from rotor_sim.rotor_config import RotorSimConfig
from rotor_sim.stream.load_grid import LoadGrid
from rotor_sim.stream.simulator import RotorSimulator

__all__ = [
    'IntegrationError',
    'LoadGrid',
    'RotorError',
    'RotorParameters',
    'RotorSimConfig',
    'RotorSimulator',
]
