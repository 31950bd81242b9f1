# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The climbing-diving flight of Hou et al. 2016."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
import pydantic

from maneuver_gen.curves import (
    SMOOTH_STEP_PEAK_SLOPE,
    FloatArray,
    cos,
    smooth_step,
    smooth_step_integral,
)
from maneuver_gen.errors import ManeuverError
from maneuver_gen.maneuver import Maneuver, check_range, time_field
from rotor_common.configuration import quantity
from rotor_common.constants import GRAVITY_M_S2


@dataclass(frozen=True)
class RatePulse:
    """One stretch of the flight-path rate: smooth rise, hold, smooth fall back to zero.

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
        # clipped at the end, so that the angle stays exactly constant
        elapsed = np.clip(times_s - self.start_s, 0.0, 2.0 * self.transition_s + self.hold_s)
        falling = elapsed - (self.transition_s + self.hold_s)
        return elapsed / self.transition_s, falling / self.transition_s


class ClimbDive(Maneuver):
    """Climbing-diving flight: level, pull-up, climb, push-over, dive, pull-out, level.

    Speed is constant and the flight-path rate gives the load, as in Hou et al. 2016, eq. (1).
    The paper's rate is constant; here it rises and falls smoothly with a limited onset.
    """

    profile: str = 'climb_dive'
    speed_m_s: float = quantity(120.0, unit='m/s', description='flight speed v', ge=30, le=600)
    pull_rate_rad_s: float = quantity(
        0.1635, unit='rad/s', description='flight-path rate of pull-up and pull-out', gt=0, le=1
    )
    push_rate_rad_s: float = quantity(
        0.0736, unit='rad/s', description='flight-path rate of the push-over, downward', gt=0, le=1
    )
    climb_angle_rad: float = quantity(
        0.36, unit='rad', description='flight-path angle of the climb', gt=0, le=1.57
    )
    dive_angle_rad: float = quantity(
        0.36,
        unit='rad',
        description='flight-path angle of the dive, below the horizon',
        gt=0,
        le=1.57,
    )
    onset_per_s: float = quantity(
        5.0, unit='1/s', description='largest change per second of w_maneuver v / g', ge=0.1, le=20
    )
    level_s: float = time_field(
        1.5, description='level flight before the pull-up and after the end'
    )
    climb_s: float = time_field(0.6, description='straight climb')
    dive_s: float = time_field(0.6, description='straight dive')
    weight: bool = pydantic.Field(
        True, description='false leaves out the weight, as eq. (1): level flight is then 0'
    )

    @pydantic.model_validator(mode='after')
    def _within_range(self) -> Self:
        steepest = max(self.climb_angle_rad, self.dive_angle_rad)
        least, most = (math.cos(steepest), 1.0) if self.weight else (0.0, 0.0)
        check_range(
            least - self.push_rate_rad_s * self.speed_m_s / GRAVITY_M_S2,
            most + self.pull_rate_rad_s * self.speed_m_s / GRAVITY_M_S2,
            'lower speed_m_s, pull_rate_rad_s or push_rate_rad_s',
        )
        self.pulses()
        return self

    def load_factors(self, times_s: FloatArray) -> FloatArray:
        """Return n = cos(flight-path angle) + rate v / g, or without the weight."""
        return vertical_plane_load_factor(
            self.flight_path_angle(times_s),
            self.flight_path_rate(times_s),
            self.speed_m_s,
            self.weight,
        )

    def flight_path_angle(self, times_s: FloatArray) -> FloatArray:
        """Return the angle turned so far, rad, positive climbing."""
        return sum((pulse.angle(times_s) for pulse in self.pulses()), np.zeros_like(times_s))

    def flight_path_rate(self, times_s: FloatArray) -> FloatArray:
        """Return the rate of the flight-path angle, rad/s, positive nose up."""
        return sum((pulse.rate(times_s) for pulse in self.pulses()), np.zeros_like(times_s))

    def pulses(self) -> tuple[RatePulse, RatePulse, RatePulse]:
        """Return pull-up, push-over and pull-out; raises ManeuverError if an angle is too small."""
        climb, dive = self.climb_angle_rad, self.dive_angle_rad
        pull, push = self.pull_rate_rad_s, -self.push_rate_rad_s
        pull_up = self._pulse('climb_angle_rad', self.level_s, pull, climb)
        push_over = self._pulse(
            'climb_angle_rad + dive_angle_rad', pull_up.end_s + self.climb_s, push, -climb - dive
        )
        pull_out = self._pulse('dive_angle_rad', push_over.end_s + self.dive_s, pull, dive)
        return pull_up, push_over, pull_out

    def _pulse(self, name: str, start_s: float, rate_rad_s: float, angle_rad: float) -> RatePulse:
        load_factor_change = abs(rate_rad_s) * self.speed_m_s / GRAVITY_M_S2
        transition_s = SMOOTH_STEP_PEAK_SLOPE * load_factor_change / self.onset_per_s
        hold_s = angle_rad / rate_rad_s - transition_s
        if hold_s < 0.0:
            raise ManeuverError(
                f'{name} = {abs(angle_rad):g} rad is passed before the flight-path rate reaches '
                f'{abs(rate_rad_s):g} rad/s at onset_per_s = {self.onset_per_s:g}; the angle must '
                f'be at least {abs(rate_rad_s) * transition_s:.4g} rad, or the onset faster'
            )
        return RatePulse(start_s, rate_rad_s, transition_s, hold_s)


def vertical_plane_load_factor(
    angle_rad: FloatArray, rate_rad_s: FloatArray, speed_m_s: float, weight: bool = True
) -> FloatArray:
    """Return n = cos(angle) + rate v / g for flight in the vertical plane.

    Source: Hou et al. 2016, eq. (1): the load on a mass is m w_maneuver v; it leaves the weight
    out, which is `weight=False`: n = rate v / g, 0 in level flight. With the weight it is the
    balance of forces normal to the flight path, lift / weight = cos(angle) + rate v / g.
    """
    pull = rate_rad_s * speed_m_s / GRAVITY_M_S2
    return pull + cos(angle_rad) if weight else pull
