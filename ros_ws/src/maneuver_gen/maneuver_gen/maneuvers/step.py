# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A step of the load factor."""

import numpy as np

from maneuver_gen.curves import FloatArray
from maneuver_gen.maneuver import Maneuver, load_factor_field, time_field


class Step(Maneuver):
    """A sudden change of the load factor (within one grid interval, 10 ms)."""

    profile: str = 'step'
    before: float = load_factor_field(1.0, description='load factor before the step')
    after: float = load_factor_field(description='load factor from the step on')
    at_s: float = time_field(description='time of the step')

    def load_factors(self, times_s: FloatArray) -> FloatArray:
        """Return `before` for t < at_s and `after` from at_s on."""
        return np.where(times_s < self.at_s, self.before, self.after)
