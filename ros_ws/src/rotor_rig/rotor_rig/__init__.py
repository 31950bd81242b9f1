# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The rig as a library: scenarios, offline runs, recordings and studies; docs/library.md.

The names below are loaded when first used. Results are `xarray.Dataset` with units in the attrs.
"""

from typing import TYPE_CHECKING

from rotor_common.lazy_names import lazy_names

if TYPE_CHECKING:
    from rotor_dynamics.diagrams import (
        Sweep,
        lyapunov_diagram,
        orbit_diagram,
        parameter_map,
        poincare_section,
        waterfall,
    )
    from rotor_dynamics.ensemble import OperatingPoint
    from rotor_dynamics.surveys import Plan
    from rotor_rig.results import analyze, monitor, recording, scenario, simulate
    from rotor_rig.scenario_model import Scenario, load_scenario
    from rotor_sim.plant.parameters import RotorParameters
    from vibration_monitor.monitor_config import MonitorConfig

__all__ = [
    'MonitorConfig',
    'OperatingPoint',
    'Plan',
    'RotorParameters',
    'Scenario',
    'Sweep',
    'analyze',
    'load_scenario',
    'lyapunov_diagram',
    'monitor',
    'orbit_diagram',
    'parameter_map',
    'poincare_section',
    'recording',
    'scenario',
    'simulate',
    'waterfall',
]

_DIAGRAMS = (
    'Sweep',
    'lyapunov_diagram',
    'orbit_diagram',
    'parameter_map',
    'poincare_section',
    'waterfall',
)

__getattr__ = lazy_names(
    __name__,
    {
        'MonitorConfig': 'vibration_monitor.monitor_config',
        'OperatingPoint': 'rotor_dynamics.ensemble',
        'Plan': 'rotor_dynamics.surveys',
        'RotorParameters': 'rotor_sim.plant.parameters',
        'Scenario': 'rotor_rig.scenario_model',
        'load_scenario': 'rotor_rig.scenario_model',
        **dict.fromkeys(_DIAGRAMS, 'rotor_dynamics.diagrams'),
        **dict.fromkeys(
            ('analyze', 'monitor', 'recording', 'scenario', 'simulate'), 'rotor_rig.results'
        ),
    },
)
