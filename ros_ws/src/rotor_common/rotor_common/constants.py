# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of the whole rig."""

GRAVITY_M_S2 = 9.81
"""As the paper rounds it (Hou et al. 2016): a load factor of 1 is 9.81 m/s^2 along +y."""

STANDARD_GRAVITY_M_S2 = 9.80665
"""The unit g of sensors and of foreign files (ISO 80000-3)."""

NANOSECONDS = 1_000_000_000
"""In a second."""

LOAD_RATE_HZ = 100
"""Points of the load grid a second."""

LOAD_STEP_NS = NANOSECONDS // LOAD_RATE_HZ
"""Point k of the load grid is at k times this."""

LANES = 16
"""Rotors, or channels, that are computed side by side: four AVX2 registers of float64.

Fewer hide the latency of square roots less well; docs/performance.md.
"""
OFFLINE_EPOCH_NS = 1_700_000_000_000_000_000
"""Stamp of time 0 in an offline run and in an imported file."""

MIN_SAMPLES_PER_CYCLE = 6
"""Below this a quintic spline changes an amplitude by more than 1e-4.

Its gain at x cycles a sample is 120 sinc(x)^6 / (66 + 52 cos(2 pi x) + 2 cos(4 pi x)), the
cardinal spline of Unser, IEEE Signal Processing Magazine 16 (1999) 22-38: 0.99993 at 1/6.
"""
