# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Rough air: the course of a load factor in Dryden turbulence, as a sum of sinusoids.

Sources: the spectrum of the vertical gusts is Dryden's in MIL-F-8785C, 3.7.2; the sum of sinusoids
at random phases is Shinozuka & Deodatis, Appl. Mech. Rev. 44 (1991) 191. The aircraft answers by
heaving alone: it follows slow gusts and feels fast ones.
"""

import functools
import math
from dataclasses import dataclass

import numpy as np

from maneuver_gen.profiles import FloatArray

WAVES = 32
BAND_HZ = (0.02, 5.0)
"""The grid of 100 Hz carries 5 Hz with straight lines; below 0.02 Hz the aircraft follows."""

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
