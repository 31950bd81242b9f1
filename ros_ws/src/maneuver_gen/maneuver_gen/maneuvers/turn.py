# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A level turn."""

import numpy as np

from maneuver_gen.curves import FloatArray, cos, smooth_step
from maneuver_gen.maneuver import Maneuver, lateral_load_factor_field, time_field
from rotor_common.configuration import quantity


class Turn(Maneuver):
    """Level coordinated turn: load factor 1 / cos(bank); lateral load only from stated slip."""

    profile: str = 'turn'
    bank_rad: float = quantity(
        unit='rad', description='bank angle of the turn, either side', ge=-1.48, le=1.48
    )
    level_s: float = time_field(1.5, description='level flight before and after the turn')
    roll_s: float = time_field(
        1.5, description='how long rolling in takes, and rolling out', ge=0.1
    )
    turn_s: float = time_field(10.0, description='how long the bank is held')
    slip_load_factor: float = lateral_load_factor_field(
        'lateral load factor from slip, in step with the bank, positive to the left wing'
    )

    def load_factors(self, times_s: FloatArray) -> FloatArray:
        """Return the load of the bank, and the slip that grows and fades with it."""
        rolled = self.rolled(times_s)
        normal = coordinated_turn_load_factor(self.bank_rad * rolled)
        return np.column_stack((normal, self.slip_load_factor * rolled))

    def rolled(self, times_s: FloatArray) -> FloatArray:
        """Return the part of the bank: smooth roll in to 1, hold for turn_s, smooth roll out."""
        rolling_in = smooth_step((times_s - self.level_s) / self.roll_s)
        out_s = self.level_s + self.roll_s + self.turn_s
        return rolling_in - smooth_step((times_s - out_s) / self.roll_s)


def coordinated_turn_load_factor(bank_rad: FloatArray) -> FloatArray:
    """Return n = 1 / cos(bank): level turn without slip, whatever the speed and radius.

    Source: balance of vertical forces, lift cos(bank) = weight.
    """
    return 1.0 / cos(bank_rad)
