# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A linear change of the load factor."""

import numpy as np

from maneuver_gen.curves import FloatArray
from maneuver_gen.maneuver import Maneuver, load_factor_field, time_field


class Ramp(Maneuver):
    """A straight line from one load factor to another."""

    profile: str = 'ramp'
    before: float = load_factor_field(1.0, description='load factor before the ramp')
    after: float = load_factor_field(description='load factor after the ramp')
    start_s: float = time_field(0.0, description='time at which the ramp starts')
    duration_s: float = time_field(description='how long the ramp takes', ge=0.01)

    def load_factors(self, times_s: FloatArray) -> FloatArray:
        """Return the straight line, held at both ends."""
        share = np.clip((times_s - self.start_s) / self.duration_s, 0.0, 1.0)
        return self.before * (1.0 - share) + self.after * share
