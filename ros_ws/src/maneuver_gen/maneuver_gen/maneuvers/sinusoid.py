# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A sinusoidal load factor."""

from typing import Self

import pydantic

from maneuver_gen.curves import FloatArray, swing
from maneuver_gen.maneuver import Maneuver, check_range, load_factor_field
from rotor_common.configuration import quantity


class Sinusoid(Maneuver):
    """A load factor that swings: mean + amplitude sin(2 pi f t + phase)."""

    profile: str = 'sinusoid'
    mean: float = load_factor_field(1.0, description='mean load factor')
    amplitude: float = quantity(
        unit='1', description='zero-to-peak load factor of the swing', ge=0, le=7.5
    )
    # the grid of 100 Hz, read with straight lines, rounds a peak at 5 Hz by 1.2 % at most
    frequency_hz: float = quantity(unit='Hz', description='frequency of the swing', gt=0, le=5)
    phase_rad: float = quantity(
        0.0, unit='rad', description='phase of the swing at time 0', ge=-6.3, le=6.3
    )

    @pydantic.model_validator(mode='after')
    def _within_range(self) -> Self:
        check_range(
            self.mean - self.amplitude, self.mean + self.amplitude, 'lower mean or amplitude'
        )
        return self

    def load_factors(self, times_s: FloatArray) -> FloatArray:
        """Return mean + amplitude sin(2 pi f t + phase)."""
        return self.mean + swing(times_s, self.amplitude, self.frequency_hz, self.phase_rad)
