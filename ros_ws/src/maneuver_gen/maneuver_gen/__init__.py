# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Flight profiles to the load on the rotor: the pure part needs no ROS."""

from maneuver_gen.config import ManeuverConfig, parse_maneuver, resolve_paths
from maneuver_gen.errors import ManeuverError
from maneuver_gen.load_grid import check_duration, flight_path_angle, load_grid

__all__ = [
    'ManeuverConfig',
    'ManeuverError',
    'check_duration',
    'flight_path_angle',
    'load_grid',
    'parse_maneuver',
    'resolve_paths',
]
