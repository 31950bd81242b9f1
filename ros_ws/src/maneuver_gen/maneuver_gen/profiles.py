# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Flight profiles as pure functions of time: float64 arrays in, load factors out.

A load factor here is apparent gravity (g - a) divided by 9.81 m/s^2: the normal load factor n
along rotor +y (level flight is n = 1), the lateral one along rotor +z. Each value depends on
its own time only, bit for bit, wherever it stands in the array.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotor_common.constants import GRAVITY_M_S2

SMOOTH_STEP_PEAK_SLOPE = 1.5
"""The steepest slope of `smooth_step`, at its middle."""

FloatArray = NDArray[np.float64]


def _sin(values: FloatArray) -> FloatArray:
    # NumPy's SIMD sine may round differently by place in the array; the C library's does not
    return np.array([math.sin(value) for value in values.tolist()], dtype=np.float64)


def _cos(values: FloatArray) -> FloatArray:
    return np.array([math.cos(value) for value in values.tolist()], dtype=np.float64)


def smooth_step(x: FloatArray) -> FloatArray:
    """Return 3x^2 - 2x^3, held at 0 below x = 0 and at 1 above x = 1 (slope 0 at both ends)."""
    u = np.clip(x, 0.0, 1.0)
    return u * u * (3.0 - 2.0 * u)


def smooth_step_integral(x: FloatArray) -> FloatArray:
    """Return the integral of `smooth_step` from 0 to x: x^3 - x^4/2 up to 1, then x - 1/2."""
    u = np.clip(x, 0.0, 1.0)
    return u * u * u * (1.0 - 0.5 * u) + np.maximum(x - 1.0, 0.0)


def constant(times_s: FloatArray, load_factor: float) -> FloatArray:
    """Return the same load factor at all times."""
    return np.full_like(times_s, load_factor)


def step(times_s: FloatArray, before: float, after: float, at_s: float) -> FloatArray:
    """Return `before` for t < at_s and `after` from at_s on."""
    return np.where(times_s < at_s, before, after)


def ramp(
    times_s: FloatArray, before: float, after: float, start_s: float, duration_s: float
) -> FloatArray:
    """Return a straight line from `before` to `after` over duration_s, held at both ends."""
    share = np.clip((times_s - start_s) / duration_s, 0.0, 1.0)
    return before * (1.0 - share) + after * share


def sinusoid(
    times_s: FloatArray, mean: float, amplitude: float, frequency_hz: float, phase_rad: float
) -> FloatArray:
    """Return mean + amplitude sin(2 pi f t + phase)."""
    return mean + amplitude * _sin(2.0 * math.pi * frequency_hz * times_s + phase_rad)


@dataclass(frozen=True)
class RatePulse:
    """One manoeuvre of the flight-path rate: smooth rise, hold, smooth fall back to zero.

    `rate_rad_s` is positive nose up; rise and fall take `transition_s` each. The pulse turns the
    flight path by rate (transition + hold).
    """

    start_s: float
    rate_rad_s: float
    transition_s: float
    hold_s: float

    @property
    def end_s(self) -> float:
        """Time at which the rate is back at zero, s."""
        return self.start_s + 2.0 * self.transition_s + self.hold_s

    def rate(self, times_s: FloatArray) -> FloatArray:
        """Return the flight-path rate, rad/s."""
        rise, fall = self._phases(times_s)
        return self.rate_rad_s * (smooth_step(rise) - smooth_step(fall))

    def angle(self, times_s: FloatArray) -> FloatArray:
        """Return the angle turned so far, rad: the exact integral of `rate`."""
        rise, fall = self._phases(times_s)
        turned = smooth_step_integral(rise) - smooth_step_integral(fall)
        return self.rate_rad_s * self.transition_s * turned

    def _phases(self, times_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        # clipped at the end, so that the angle stays where it is, exactly
        elapsed = np.clip(times_s - self.start_s, 0.0, 2.0 * self.transition_s + self.hold_s)
        falling = elapsed - (self.transition_s + self.hold_s)
        return elapsed / self.transition_s, falling / self.transition_s


def flight_path_rate(times_s: FloatArray, pulses: tuple[RatePulse, ...]) -> FloatArray:
    """Return the flight-path rate of a row of pulses, rad/s, positive nose up."""
    return sum((pulse.rate(times_s) for pulse in pulses), np.zeros_like(times_s))


def flight_path_angle(times_s: FloatArray, pulses: tuple[RatePulse, ...]) -> FloatArray:
    """Return the flight-path angle of a row of pulses from level flight, rad, positive climbing."""
    return sum((pulse.angle(times_s) for pulse in pulses), np.zeros_like(times_s))


def vertical_plane_load_factor(
    angle_rad: FloatArray, rate_rad_s: FloatArray, speed_m_s: float, weight: bool = True
) -> FloatArray:
    """Return n = cos(angle) + rate v / g for flight in the vertical plane.

    Source: Hou et al. 2016, eq. (1): the load on a mass is m w_maneuver v; it leaves the weight
    out, which is `weight=False`: n = rate v / g, 0 in level flight. With the weight it is the
    balance of forces normal to the flight path, lift / weight = cos(angle) + rate v / g.
    """
    pull = rate_rad_s * speed_m_s / GRAVITY_M_S2
    return pull + _cos(angle_rad) if weight else pull


def bank_angle(
    times_s: FloatArray, bank_rad: float, start_s: float, roll_s: float, turn_s: float
) -> FloatArray:
    """Return the bank angle of a turn, rad: smooth roll in, hold for turn_s, smooth roll out."""
    rolling_in = smooth_step((times_s - start_s) / roll_s)
    rolling_out = smooth_step((times_s - (start_s + roll_s + turn_s)) / roll_s)
    return bank_rad * (rolling_in - rolling_out)


def coordinated_turn_load_factor(bank_rad: FloatArray) -> FloatArray:
    """Return n = 1 / cos(bank): level turn without slip, whatever the speed and radius.

    Source: balance of vertical forces, lift cos(bank) = weight.
    """
    return 1.0 / _cos(bank_rad)
