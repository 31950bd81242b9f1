# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Gusts: the load factor in Dryden turbulence, as a sum of sinusoids.

Sources: the spectrum of the vertical gusts is Dryden's in MIL-F-8785C, 3.7.2; the sum of sinusoids
at random phases is Shinozuka & Deodatis, Appl. Mech. Rev. 44 (1991) 191. The aircraft answers by
heaving alone: it follows slow gusts and feels fast ones.
"""

import functools
import math
from dataclasses import dataclass
from typing import Self

import numpy as np
import pydantic

from maneuver_gen.curves import FloatArray, swing
from maneuver_gen.maneuver import Maneuver, check_range, load_factor_field
from rotor_common.configuration import quantity

WAVES = 32
BAND_HZ = (0.02, 5.0)
"""The 100 Hz grid resolves 5 Hz by linear interpolation; below 0.02 Hz the aircraft follows."""

HEAVE_RATE_PER_S = 1.0
"""How fast the aircraft takes up a gust's velocity: g (dn/d alpha) / v, about 1/s."""


@dataclass(frozen=True)
class Wave:
    """One sinusoid: load factor amplitude (zero-to-peak), frequency in Hz, phase in rad."""

    amplitude: float
    frequency_hz: float
    phase_rad: float


def load_factor_density(frequency_hz: FloatArray, speed_m_s: float, scale_m: float) -> FloatArray:
    """Return the shape of the load factor's power spectral density, not normalised.

    Dryden's vertical gusts, (1 + 3 (L W)^2) / (1 + (L W)^2)^2 with W = 2 pi f / v, through the
    heaving aircraft, s / (s + HEAVE_RATE_PER_S).
    """
    omega = 2.0 * math.pi * frequency_hz
    reduced = (scale_m * omega / speed_m_s) ** 2
    heave = omega**2 / (omega**2 + HEAVE_RATE_PER_S**2)
    return (1.0 + 3.0 * reduced) / (1.0 + reduced) ** 2 * heave


@functools.lru_cache(maxsize=1024)
def gust_waves(rms: float, speed_m_s: float, scale_m: float, seed: int) -> tuple[Wave, ...]:
    """Return WAVES sinusoids whose sum has the root mean square `rms` over a long time.

    BAND_HZ is cut into bins of equal ratio; each has one sinusoid of the bin's power, at a
    frequency and a phase drawn from `seed`.
    """
    draws = np.random.Generator(np.random.Philox(seed)).random((2, WAVES))
    edges = np.geomspace(*BAND_HZ, WAVES + 1)
    frequencies = edges[:-1] + draws[0] * np.diff(edges)
    power = load_factor_density(frequencies, speed_m_s, scale_m) * np.diff(edges)
    amplitudes = rms * np.sqrt(2.0 * power / power.sum())
    phases = 2.0 * math.pi * draws[1]
    return tuple(map(Wave, amplitudes.tolist(), frequencies.tolist(), phases.tolist()))


class Gusts(Maneuver):
    """Rough air: a load factor that wanders as in Dryden turbulence, set by `seed`."""

    profile: str = 'gusts'
    mean: float = load_factor_field(1.0, description='mean load factor')
    # the peaks of a Gaussian course are some three times higher
    rms: float = quantity(
        0.2, unit='1', description='root mean square of the load factor about its mean', ge=0, le=1
    )
    speed_m_s: float = quantity(120.0, unit='m/s', description='flight speed', ge=30, le=600)
    scale_m: float = quantity(
        533.4, unit='m', description='scale length of the turbulence', ge=10, le=2000
    )
    seed: int = quantity(0, unit='1', description='which course of the gusts', ge=0, le=2**62)

    @pydantic.model_validator(mode='after')
    def _within_range(self) -> Self:
        most = sum(wave.amplitude for wave in self.waves())
        check_range(self.mean - most, self.mean + most, 'lower mean or rms')
        return self

    def waves(self) -> tuple[Wave, ...]:
        """Return the sinusoids that make up the course about its mean."""
        return gust_waves(self.rms, self.speed_m_s, self.scale_m, self.seed)

    def load_factors(self, times_s: FloatArray) -> FloatArray:
        """Return mean + the sum of the sinusoids."""
        normal = np.full_like(times_s, self.mean)
        for wave in self.waves():
            normal += swing(times_s, wave.amplitude, wave.frequency_hz, wave.phase_rad)
        return normal
