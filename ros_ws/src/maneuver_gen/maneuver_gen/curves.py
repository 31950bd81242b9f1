# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Curves from which maneuvers are composed: float64 arrays in and out.

Each value depends on its own argument only, bit for bit, whatever its position in the array.
"""

import math

import numpy as np
from numpy.typing import NDArray

SMOOTH_STEP_PEAK_SLOPE = 1.5
"""The steepest slope of `smooth_step`, at its middle."""

FloatArray = NDArray[np.float64]


def sin(values: FloatArray) -> FloatArray:
    """Return the sine of each value, rad."""
    # NumPy's SIMD sine may round differently by position in the array; the C library's does not
    return np.array([math.sin(value) for value in values.tolist()], dtype=np.float64)


def cos(values: FloatArray) -> FloatArray:
    """Return the cosine of each value, rad."""
    return np.array([math.cos(value) for value in values.tolist()], dtype=np.float64)


def smooth_step(x: FloatArray) -> FloatArray:
    """Return 3x^2 - 2x^3, held at 0 below x = 0 and at 1 above x = 1 (slope 0 at both ends)."""
    u = np.clip(x, 0.0, 1.0)
    return u * u * (3.0 - 2.0 * u)


def smooth_step_integral(x: FloatArray) -> FloatArray:
    """Return the integral of `smooth_step` from 0 to x: x^3 - x^4/2 up to 1, then x - 1/2."""
    u = np.clip(x, 0.0, 1.0)
    return u * u * u * (1.0 - 0.5 * u) + np.maximum(x - 1.0, 0.0)


def swing(
    times_s: FloatArray, amplitude: float, frequency_hz: float, phase_rad: float
) -> FloatArray:
    """Return amplitude sin(2 pi f t + phase)."""
    return amplitude * sin(2.0 * math.pi * frequency_hz * times_s + phase_rad)
