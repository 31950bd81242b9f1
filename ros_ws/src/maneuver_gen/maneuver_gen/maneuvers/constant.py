# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A constant load factor, level flight by default."""

import numpy as np

from maneuver_gen.curves import FloatArray
from maneuver_gen.maneuver import Maneuver, lateral_load_factor_field, load_factor_field


class Constant(Maneuver):
    """The same load for the whole run."""

    profile: str = 'constant'
    load_factor: float = load_factor_field(1.0, description='normal load factor; level flight is 1')
    lateral_load_factor: float = lateral_load_factor_field(
        'lateral load factor, positive to the left'
    )

    def load_factors(self, times_s: FloatArray) -> FloatArray:
        """Return the two load factors at every time."""
        return np.tile((self.load_factor, self.lateral_load_factor), (len(times_s), 1))
