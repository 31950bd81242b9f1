# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Physics, integrator and sensor models of the cracked rotor; needs no ROS."""

from rotor_sim.config import RotorSimConfig
from rotor_sim.errors import AnalysisError, IntegrationError, RotorError
from rotor_sim.load_grid import LoadGrid
from rotor_sim.parameters import RotorParameters
from rotor_sim.simulator import RotorSimulator

__all__ = [
    'AnalysisError',
    'IntegrationError',
    'LoadGrid',
    'RotorError',
    'RotorParameters',
    'RotorSimConfig',
    'RotorSimulator',
]
