# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Flight maneuvers and the load that they put on the rotor; needs no ROS except for the node."""

from maneuver_gen.errors import ManeuverError
from maneuver_gen.load_grid import check_duration, flight_path_angle, load_grid
from maneuver_gen.maneuver import Maneuver, load_factor_field, time_field
from maneuver_gen.registry import ManeuverConfig, parse_maneuver, resolve_paths

__all__ = [
    'Maneuver',
    'ManeuverConfig',
    'ManeuverError',
    'check_duration',
    'flight_path_angle',
    'load_factor_field',
    'load_grid',
    'parse_maneuver',
    'resolve_paths',
    'time_field',
]
