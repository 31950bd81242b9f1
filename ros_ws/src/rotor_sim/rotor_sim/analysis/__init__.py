# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Nonlinear analyses of the cracked rotor: orbit diagrams, spectra, exponents, sections.

Pure functions, no ROS. They integrate at constant speed and load in SIMD lanes (`ensemble`), with
fastmath, and agree with the live simulator to rounding, not bit by bit.
"""

from rotor_sim.analysis.cache import ResultCache
from rotor_sim.analysis.diagrams import (
    LyapunovDiagram,
    LyapunovExponent,
    OrbitDiagram,
    ParameterMap,
    PoincareSection,
    Waterfall,
    continuation,
    lyapunov_diagram,
    lyapunov_exponent,
    orbit_diagram,
    parameter_map,
    poincare_section,
    waterfall,
)
from rotor_sim.analysis.ensemble import Ensemble, OperatingPoint
from rotor_sim.analysis.surveys import Plan, Survey, survey, sweep

__all__ = [
    'Ensemble',
    'LyapunovDiagram',
    'LyapunovExponent',
    'OperatingPoint',
    'OrbitDiagram',
    'ParameterMap',
    'Plan',
    'PoincareSection',
    'ResultCache',
    'Survey',
    'Waterfall',
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
