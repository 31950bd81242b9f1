# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Nonlinear analyses of the cracked rotor: orbit diagrams, spectra, exponents, sections.

Pure functions, no ROS. They integrate at constant speed and load in SIMD lanes (`ensemble`), with
fastmath, and agree with the live simulator to rounding, not bit by bit. The names below are
loaded when first used: kernels are compiled for those that need them.
"""

from typing import TYPE_CHECKING

from rotor_common.lazy_names import lazy_names

if TYPE_CHECKING:
    from rotor_dynamics.cache import ResultCache
    from rotor_dynamics.diagrams import (
        LyapunovExponent,
        Sweep,
        continuation,
        lyapunov_diagram,
        lyapunov_exponent,
        orbit_diagram,
        parameter_map,
        poincare_section,
        waterfall,
    )
    from rotor_dynamics.ensemble import Ensemble, OperatingPoint
    from rotor_dynamics.surveys import Plan, Survey, survey, sweep

__all__ = [
    'Ensemble',
    'LyapunovExponent',
    'OperatingPoint',
    'Plan',
    'ResultCache',
    'Survey',
    'Sweep',
    'continuation',
    'lyapunov_diagram',
    'lyapunov_exponent',
    'orbit_diagram',
    'parameter_map',
    'poincare_section',
    'survey',
    'sweep',
    'waterfall',
]

__getattr__ = lazy_names(
    __name__,
    {
        'Ensemble': 'rotor_dynamics.ensemble',
        'LyapunovExponent': 'rotor_dynamics.diagrams',
        'OperatingPoint': 'rotor_dynamics.ensemble',
        'Plan': 'rotor_dynamics.surveys',
        'ResultCache': 'rotor_dynamics.cache',
        'Survey': 'rotor_dynamics.surveys',
        'Sweep': 'rotor_dynamics.diagrams',
        'continuation': 'rotor_dynamics.diagrams',
        'lyapunov_diagram': 'rotor_dynamics.diagrams',
        'lyapunov_exponent': 'rotor_dynamics.diagrams',
        'orbit_diagram': 'rotor_dynamics.diagrams',
        'parameter_map': 'rotor_dynamics.diagrams',
        'poincare_section': 'rotor_dynamics.diagrams',
        'survey': 'rotor_dynamics.surveys',
        'sweep': 'rotor_dynamics.surveys',
        'waterfall': 'rotor_dynamics.diagrams',
    },
)
