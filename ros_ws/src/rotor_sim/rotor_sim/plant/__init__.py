# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The rotor's equations: elements, assembly, statics and the generated engine."""

from typing import TYPE_CHECKING

from rotor_common.lazy_names import lazy_names

if TYPE_CHECKING:
    from rotor_sim.plant.compiled_plant import CompiledPlant, Instant
    from rotor_sim.plant.element import ALL_AXES, TRANSLATIONS, Element, Matrices
    from rotor_sim.plant.plant import Node, Plant
    from rotor_sim.plant.statics import static_equilibrium

__all__ = [
    'ALL_AXES',
    'TRANSLATIONS',
    'CompiledPlant',
    'Element',
    'Instant',
    'Matrices',
    'Node',
    'Plant',
    'static_equilibrium',
]

__getattr__ = lazy_names(
    __name__,
    {
        'ALL_AXES': 'rotor_sim.plant.element',
        'TRANSLATIONS': 'rotor_sim.plant.element',
        'CompiledPlant': 'rotor_sim.plant.compiled_plant',
        'Element': 'rotor_sim.plant.element',
        'Instant': 'rotor_sim.plant.compiled_plant',
        'Matrices': 'rotor_sim.plant.element',
        'Node': 'rotor_sim.plant.plant',
        'Plant': 'rotor_sim.plant.plant',
        'static_equilibrium': 'rotor_sim.plant.statics',
    },
)
