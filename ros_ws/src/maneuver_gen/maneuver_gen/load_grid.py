# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The load grid: a maneuver sampled at 100 Hz, with the same bits live and offline."""

import numpy as np

from maneuver_gen.curves import FloatArray
from maneuver_gen.errors import ManeuverError
from maneuver_gen.maneuver import LONGEST_S, Maneuver
from rotor_common.constants import GRAVITY_M_S2, LOAD_RATE_HZ, LOAD_STEP_NS


def check_duration(config: Maneuver, duration_s: float) -> None:
    """Raise ManeuverError unless the maneuver can be flown for duration_s, s.

    Allowed: above 0 and at most a day. Recorded flights are read: each must cover its part.
    """
    if not 0.0 < duration_s <= LONGEST_S:
        raise ManeuverError(
            f'duration_s = {duration_s:g} is out of range; allowed: above 0 to {LONGEST_S:g} s'
        )
    config.check_duration(duration_s)


def load_grid(config: Maneuver, duration_s: float) -> FloatArray:
    """Return the loads for a run of duration_s: float64, (points, 2), m/s^2.

    Row k is (load_y, load_z), apparent gravity per unit mass in frame `rotor` at k x 10 ms, from
    k = 0 through the first point at or after the end and one more. A longer run has the same
    first rows, bit for bit. Raises ManeuverError as `check_duration` and `Maneuver.sample`.
    """
    check_duration(config, duration_s)
    # in whole nanoseconds, so that no rounding error adds a point
    last = -(-round(duration_s * 1e9) // LOAD_STEP_NS)
    return GRAVITY_M_S2 * config.sample(np.arange(last + 2) / LOAD_RATE_HZ)


def flight_path_angle(config: Maneuver, times_s: FloatArray) -> FloatArray:
    """Return the flight-path angle at times of the run, rad, shape (n,), positive climbing.

    Only a climb-dive has one; NaN for the other maneuvers that come with the rig.
    """
    return config.flight_path_angle(times_s)
