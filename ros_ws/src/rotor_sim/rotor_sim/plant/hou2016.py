# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The cracked rotor of Hou et al. 2016 as a plant: one disk, two bearings, one crack."""

import functools
from typing import Any

from rotor_sim.plant.elements.ball_bearing import BallBearing
from rotor_sim.plant.elements.hou_crack import HouCrack
from rotor_sim.plant.elements.shaft_segment import ShaftSegment
from rotor_sim.plant.elements.turning_force import TurningForce
from rotor_sim.plant.elements.unbalance import Unbalance
from rotor_sim.plant.generator import Record
from rotor_sim.plant.parameters import RotorParameters
from rotor_sim.plant.plant import Node, Plant

RECORDS = (
    *(Record('acceleration', place) for place in (2, 3, 4, 5)),
    Record('load', 0),
    Record('load', 1),
    *(Record('force', axis, f'ball_bearing_{number}') for number in (1, 2) for axis in (0, 1)),
)
"""What the sensors need beside the displacements: accelerations of the bearings (m/s^2), load y, z
(m/s^2), contact forces on the journals (N)."""

_HALF_SPAN_M = 0.5
"""Of the pictures; the equations know no length."""


@functools.lru_cache(maxsize=4096)
def hou2016(p: RotorParameters, forcing_n: float = 0.0, forcing_phase_rad: float = 0.0) -> Plant:
    """Return the plant of eq. (5) in the reading of the parameters, with a force at 2 x speed."""
    bearing: dict[str, Any] = {
        'ball_count': p.ball_count,
        'contact_stiffness_n_m15': p.contact_stiffness_n_m15,
        'clearance_m': p.clearance_m,
        'inner_radius_m': p.inner_radius_m,
        'outer_radius_m': p.outer_radius_m,
    }
    damping = 2.0 * p.damping_ratio * p.disk_mass_kg
    sides = (
        ShaftSegment(
            node='disk',
            other=other,
            stiffness_n_m=p.shaft_stiffness_n_m,
            damping_per_speed_n_s2_m=damping,
        )
        for other in ('bearing_1', 'bearing_2')
    )
    forcing = (
        (
            TurningForce(
                name='forcing', node='disk', amplitude_n=forcing_n, phase_rad=forcing_phase_rad
            ),
        )
        if forcing_n
        else ()
    )
    return Plant(
        nodes={
            'disk': Node(mass_kg=p.disk_mass_kg),
            'bearing_1': Node(mass_kg=p.bearing_mass_kg, position_m=-_HALF_SPAN_M),
            'bearing_2': Node(mass_kg=p.bearing_mass_kg, position_m=_HALF_SPAN_M),
        },
        twins=(('bearing_1', 'bearing_2'),),
        load_scale=p.load_scale,
        elements=(
            *sides,
            HouCrack(
                name='crack',
                disk='disk',
                bearing_1='bearing_1',
                bearing_2='bearing_2',
                shaft_stiffness_n_m=p.shaft_stiffness_n_m,
                stiffness_ratio=p.crack_stiffness_ratio,
                angle_rad=p.crack_angle_rad,
                half_angle_rad=p.crack_half_angle_rad,
                disk_scale=p.crack_scale,
                bearing_scale=p.bearing_crack_scale,
                coupling_sign=p.coupling_sign,
                phase_convention=p.phase_convention,
                theta_convention=p.theta_convention,
            ),
            Unbalance(
                name='unbalance', node='disk', unbalance_kg_m=p.disk_mass_kg * p.eccentricity_m
            ),
            *forcing,
            BallBearing(node='bearing_1', **bearing),
            BallBearing(node='bearing_2', **bearing),
        ),
    )
