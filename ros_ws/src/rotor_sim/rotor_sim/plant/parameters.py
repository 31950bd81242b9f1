# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the cracked rotor on two ball bearings, and the four readings of the paper.

Source: Hou, Chen, Cao, Lu, Mechanism and Machine Theory 105 (2016) 515-528, parameter set (8).
The variants differ in data only: `hou2016` makes one plant of the fields below.
"""

import math
from typing import Any, Literal, Self

import pydantic

from rotor_common.configuration import ConfigModel, quantity
from rotor_common.constants import GRAVITY_M_S2
from rotor_sim.errors import RotorError

HIGHEST_CRACK = 0.5
"""Deepest crack, K = dk/k; the paper goes to 0.3, one shape of breathing not far beyond."""

Variant = Literal['derived', 'natural', 'figure', 'figure_chaos']
PhaseConvention = Literal['atan2_z_y', 'arctan_y_over_z', 'atan2_y_z']
ThetaConvention = Literal['continuous', 'gap_open', 'last_branch']

_DERIVED: dict[str, Any] = {
    'load_scale': 1.0,
    'crack_scale': 1.0,
    'bearing_crack_mass_ratio': True,
    'coupling_sign': -1,
    'phase_convention': 'atan2_z_y',
    'theta_convention': 'continuous',
}
_FIGURE = _DERIVED | {'load_scale': 2.0, 'crack_scale': 2.0, 'theta_convention': 'last_branch'}

VARIANTS: dict[str, dict[str, Any]] = {
    'derived': _DERIVED,
    'natural': _DERIVED
    | {
        'bearing_crack_mass_ratio': False,
        'phase_convention': 'arctan_y_over_z',
        'theta_convention': 'gap_open',
    },
    'figure': _FIGURE | {'coupling_sign': 1},
    'figure_chaos': _FIGURE | {'bearing_crack_mass_ratio': False, 'phase_convention': 'atan2_y_z'},
}
"""Named readings of the equations as data; see docs/physics.md for what each reproduces."""
OF_THE_VARIANT = {'variant', *_DERIVED}
"""Fields of RotorParameters that the choice of a variant sets."""


class RotorParameters(ConfigModel):
    """Cracked rotor, two equal ball bearings and the convention of the equations, in SI.

    The defaults are the paper's set (8) with k = 2.5e7 N/m per side and the variant `derived`.
    Frame `rotor`: y along a positive load, the shaft turns from y to z, angle 0 = heavy spot
    on +y. Raises ConfigError with one sentence for any impossible value.
    """

    disk_mass_kg: float = quantity(
        32.1, unit='kg', ge=0.1, le=1e4, description='mass m of the disk'
    )
    bearing_mass_kg: float = quantity(
        4.0, unit='kg', ge=0.01, le=1e3, description='mass m_b at each bearing (inner-ring side)'
    )
    shaft_stiffness_n_m: float = quantity(
        2.5e7, unit='N/m', ge=1e3, le=1e11, description='stiffness k of the shaft, each side'
    )
    damping_ratio: float = quantity(
        0.01, unit='1', ge=0.0, le=0.5, description='xi of the damping c = 2 xi m w'
    )
    crack_stiffness_ratio: float = quantity(
        0.1,
        unit='1',
        ge=0.0,
        le=HIGHEST_CRACK,
        description='K = dk/k, the part of the stiffness that the open crack takes away',
    )
    crack_angle_rad: float = quantity(
        math.pi / 3,
        unit='rad',
        ge=-2 * math.pi,
        le=2 * math.pi,
        description='beta, angle from the unbalance to the crack',
    )
    crack_half_angle_rad: float = quantity(
        math.pi / 6,
        unit='rad',
        ge=0.01,
        le=math.pi / 2,
        description='alpha, half of the crack angle',
    )
    clearance_m: float = quantity(
        0.0, unit='m', ge=0.0, le=1e-4, description='radial clearance delta_0 of the bearings'
    )
    eccentricity_m: float = quantity(
        1e-5, unit='m', ge=0.0, le=1e-3, description='eccentricity e of the disk'
    )
    ball_count: int = quantity(8, unit='1', ge=3, le=64, description='balls N_b of a bearing')
    contact_stiffness_n_m15: float = quantity(
        1.334e10,
        unit='N/m^1.5',
        ge=0.0,
        le=1e13,
        description='Hertzian stiffness K_b of one ball contact',
    )
    inner_radius_m: float = quantity(
        0.0401, unit='m', ge=1e-3, le=10.0, description='radius r_i of the inner race'
    )
    outer_radius_m: float = quantity(
        0.0639, unit='m', ge=1e-3, le=10.0, description='radius r_o of the outer race'
    )

    variant: Variant | Literal['custom'] = pydantic.Field(
        default='derived',
        description='named reading that the next six fields follow',
    )
    load_scale: float = quantity(
        1.0, unit='1', gt=0.0, le=10.0, description='factor on the load in the equations'
    )
    crack_scale: float = quantity(
        1.0, unit='1', gt=0.0, le=10.0, description='factor on dk in the equations'
    )
    bearing_crack_mass_ratio: bool = pydantic.Field(
        default=True, description="whether the bearing's crack term carries its n = m/m_b"
    )
    coupling_sign: Literal[-1, 1] = pydantic.Field(
        default=-1, description='sign of k_yz = sign f dk sin(psi) cos(psi)'
    )
    phase_convention: PhaseConvention = pydantic.Field(
        default='atan2_z_y', description="how phi follows from the disk's displacement"
    )
    theta_convention: ThetaConvention = pydantic.Field(
        default='continuous', description='how theta is wrapped into the branches of eq. (4)'
    )

    @pydantic.model_validator(mode='after')
    def _check(self) -> Self:
        if self.outer_radius_m <= self.inner_radius_m:
            raise RotorError(
                f'outer_radius_m = {self.outer_radius_m:g} m is not above inner_radius_m = '
                f'{self.inner_radius_m:g} m; the balls need room between the races'
            )
        self.check_crack(self.crack_stiffness_ratio)
        for name, value in VARIANTS.get(self.variant, {}).items():
            if getattr(self, name) != value:
                raise RotorError(
                    f'{name} = {getattr(self, name)!r} is not that of variant '
                    f'{self.variant!r} ({value!r}); name the variant `custom` to mix readings'
                )
        return self

    def check_crack(self, ratio: float) -> None:
        """Raise RotorError where an open crack K = `ratio` leaves the shaft no stiffness."""
        if self.crack_scale * ratio >= 1.0:
            raise RotorError(
                f'crack_stiffness_ratio = {ratio:g} leaves the shaft of variant {self.variant!r} '
                f'no stiffness when the crack opens; it must stay below {1.0 / self.crack_scale:g}'
            )

    @classmethod
    def hou2016(cls, variant: str = 'derived', **changes: Any) -> Self:
        """Return the paper's rotor in the named reading, with `changes` to single fields.

        Raises RotorError for an unknown variant, ConfigError for an unknown or impossible value.
        """
        if variant not in VARIANTS:
            raise RotorError(
                f'variant = {variant!r} is not known; it must be one of {", ".join(VARIANTS)}'
            )
        return cls(**(VARIANTS[variant] | {'variant': variant} | changes))

    @property
    def critical_speed_rad_s(self) -> float:
        """Critical speed w_c0 = sqrt(2k/m) of the uncracked rotor on rigid bearings, rad/s."""
        return math.sqrt(2.0 * self.shaft_stiffness_n_m / self.disk_mass_kg)

    @property
    def fastest_mode_rad_s(self) -> float:
        """Upper estimate of the fastest natural frequency, a bearing on its balls at n = 12, rad/s.

        Hertz stiffness 1.5 F/d at the static load F = K_b C d^1.5 with C = N_b/4 (the sum of
        cos^2.5 over half a ring of balls), in line with the shaft.
        """
        mass = 0.5 * self.disk_mass_kg + self.bearing_mass_kg
        force = mass * self.load_scale * 12.0 * GRAVITY_M_S2
        balls = 0.25 * self.ball_count * self.contact_stiffness_n_m15
        contact = 1.5 * balls ** (2.0 / 3.0) * force ** (1.0 / 3.0)
        bearing = (contact + self.shaft_stiffness_n_m) / self.bearing_mass_kg
        return math.sqrt(max(bearing, 2.0 * self.shaft_stiffness_n_m / self.disk_mass_kg))

    @property
    def length_scale_m(self) -> float:
        """Static deflection delta = load_scale m g/(2k), the unit of the dimensionless view, m.

        The figures' variants print lengths over the delta of the printed k, twice the derived.
        """
        weight = self.load_scale * self.disk_mass_kg * GRAVITY_M_S2
        return weight / (2.0 * self.shaft_stiffness_n_m)

    @property
    def cage_ratio(self) -> float:
        """Cage speed over shaft speed, r_i/(r_i + r_o) (outer ring at rest, pure rolling)."""
        return self.inner_radius_m / (self.inner_radius_m + self.outer_radius_m)

    @property
    def ball_pass_order(self) -> float:
        """Ball-pass frequency over shaft speed, N_b r_i/(r_i + r_o)."""
        return self.ball_count * self.cage_ratio

    @property
    def breathing_jumps(self) -> bool:
        """Whether f jumps as the rotor moves; in `derived` it is continuous."""
        return (
            self.theta_convention != 'continuous' or self.phase_convention == 'arctan_y_over_z'
        ) and self.crack_stiffness_ratio > 0.0

    @property
    def bearing_crack_scale(self) -> float:
        """Factor on dk in the bearing equations: crack_scale, over m/m_b where n is left out."""
        if self.bearing_crack_mass_ratio:
            return self.crack_scale
        return self.crack_scale * self.bearing_mass_kg / self.disk_mass_kg
