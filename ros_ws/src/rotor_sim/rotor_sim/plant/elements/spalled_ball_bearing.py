# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A ball bearing with a spall: a race or a ball that has lost contact depth at one place."""

import math
from collections.abc import Mapping
from typing import Any, Literal, Self

import pydantic

from rotor_common.configuration import quantity
from rotor_sim.errors import PlantError
from rotor_sim.plant.arithmetic import power_1_5, turned
from rotor_sim.plant.elements.ball_bearing import BallBearing, pressed

_WIDEST_RAD = 0.5


def smooth_step(t: float) -> float:
    """Return 0 below t = 0, 1 above t = 1 and 3 t^2 - 2 t^3 between; its slope has no jump."""
    t = min(max(t, 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


def spall_shape(across: float, along: float, p: Any) -> float:
    """Return the share of the depth, 0 to 1, where a contact stands to the spall.

    (along, across) are cos and sin of the angle from the middle of the spall to the contact, which
    grows as the contact moves through the spall.
    """
    shape = smooth_step((across + p.half) / p.entry) * smooth_step((p.half - across) / p.exit)
    return shape if along > 0.0 else 0.0


class SpalledBallBearing(BallBearing):
    """The ball bearing with one spall, where a ball has `depth_m` more clearance.

    On the outer race it stands still at `angle_rad` from +y; on the inner race it turns with the
    shaft and stands there at shaft angle 0; on the ball that starts at +y it turns with the ball
    and meets the outer, then the inner race, once each per turn of the ball on the cage. The ball
    rolls into it over the first and out of it over the last part of its length. All balls are
    distinct. Pure rolling: the slip of the cage is left out, so the lines are sharp at N_b W_c,
    N_b (W - W_c) and 2 W_b with W_c = W r_i/(r_i + r_o), W_b = 2 W r_i r_o/(r_o^2 - r_i^2)
    (McFadden and Smith, J. Sound Vib. 96 (1984) 69; Harris, Rolling Bearing Analysis, 1991).
    """

    live = ('depth_m',)

    kind: str = 'spalled_ball_bearing'
    spall_on: Literal['outer_race', 'inner_race', 'ball'] = pydantic.Field(
        description='what the spall is on'
    )
    depth_m: float = quantity(
        unit='m', ge=0.0, le=1e-3, description='contact depth that is lost in the spall'
    )
    length_m: float = quantity(
        2e-3, unit='m', ge=1e-5, le=0.1, description='length of the spall along the rolling'
    )
    entry_share: float = quantity(
        0.25, unit='1', ge=0.01, le=0.99, description='part of the length that leads in'
    )
    exit_share: float = quantity(
        0.25, unit='1', ge=0.01, le=0.99, description='part of the length that leads out'
    )
    angle_rad: float = quantity(
        0.0, unit='rad', ge=-7.0, le=7.0, description='place of the spall at shaft angle 0, y to z'
    )

    @pydantic.model_validator(mode='after')
    def _check_spall(self) -> Self:
        if self.entry_share + self.exit_share > 1.0:
            raise PlantError(
                f'entry_share + exit_share = {self.entry_share + self.exit_share:g} is above 1; '
                'a spall leads in before it leads out'
            )
        if self._half_angle_rad > _WIDEST_RAD:
            raise PlantError(
                f'length_m = {self.length_m:g} m is too long for the {self.spall_on}; allowed: up '
                f'to {2.0 * _WIDEST_RAD * self._radius_m:g} m, an angle of 1 rad'
            )
        return self

    @property
    def _radius_m(self) -> float:
        match self.spall_on:
            case 'outer_race':
                return self.outer_radius_m
            case 'inner_race':
                return self.inner_radius_m
            case _:
                return 0.5 * (self.outer_radius_m - self.inner_radius_m)

    @property
    def _half_angle_rad(self) -> float:
        return 0.5 * self.length_m / self._radius_m

    @property
    def _is_paired(self) -> bool:
        return False

    @property
    def _spin(self) -> float:
        """Turns of a ball on its cage per turn of the shaft."""
        r_i, r_o = self.inner_radius_m, self.outer_radius_m
        return 2.0 * r_i * r_o / ((r_o - r_i) * (r_o + r_i))

    def rotations(self) -> Mapping[str, float]:
        """Return the cage, and the spin of a ball on it where that has the spall."""
        spin = {'spin': self._spin} if self.spall_on == 'ball' else {}
        return {**super().rotations(), **spin}

    def coefficients(self) -> Mapping[str, float | tuple[float, ...]]:
        """Return those of the bearing, and place and shape of the spall."""
        half = math.sin(self._half_angle_rad)
        return {
            **super().coefficients(),
            'spall_cos': math.cos(self.angle_rad),
            'spall_sin': math.sin(self.angle_rad),
            'half': half,
            'entry': 2.0 * half * self.entry_share,
            'exit': 2.0 * half * self.exit_share,
        }

    def structure(self) -> Mapping[str, Any]:
        """Return how the balls stand to each other, and where the spall is."""
        return {**super().structure(), 'spall_on': self.spall_on}

    def labels(self) -> Mapping[str, float]:
        """Return how often a ball or race meets the spall per turn of the shaft, and its length."""
        cage = self.rotations()['cage']
        orders = {
            'outer_race': self.ball_count * cage,
            'inner_race': self.ball_count * (1.0 - cage),
            'ball': 2.0 * self._spin,
        }
        return {'spall_order': orders[self.spall_on], 'length_m': self.length_m}

    @staticmethod
    def force(x: Any, p: Any, d: Any, s: Any) -> Any:
        """Return the sum of the contacts on the journal, then on the housing."""
        y, z, housing_y, housing_z = x
        # in the frame of the cage the balls stand still
        q, r = turned(y - housing_y, z - housing_z, d.cos_cage, -d.sin_cage)
        c, s_ = p.spall_cos, p.spall_sin
        shape = 0.0
        if s.spall_on == 'ball':
            c, s_ = turned(c, s_, d.cos_spin, d.sin_spin)
            # the second race meets it half a turn later
            shape = spall_shape(s_ if c > 0.0 else -s_, abs(c), p)
        else:
            if s.spall_on == 'inner_race':
                c, s_ = turned(c, s_, d.cos, d.sin)
            c, s_ = turned(c, s_, d.cos_cage, -d.sin_cage)
        along, across = 0.0, 0.0
        for j in range(s.directions):
            if s.spall_on != 'ball':
                beside = p.sines[j] * c - p.cosines[j] * s_
                # balls are slower than the inner race: they move through its spall backward
                beside = -beside if s.spall_on == 'inner_race' else beside
                shape = spall_shape(beside, p.cosines[j] * c + p.sines[j] * s_, p)
            lost = p.depth_m * shape if s.spall_on != 'ball' or j == 0 else 0.0
            where = q * p.cosines[j] + r * p.sines[j]
            f = power_1_5(pressed(where, p.clearance + lost, s.is_paired))
            along += f * p.cosines[j]
            across += f * p.sines[j]
        force_y, force_z = turned(along, across, d.cos_cage, d.sin_cage)
        force_y *= p.stiffness
        force_z *= p.stiffness
        return -force_y, -force_z, force_y, force_z
