# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Equivalent loads of a crack from the disk's equation of motion, window by window.

Method: equivalent loads (Markert, Platz and Seidler, International Journal of Rotating Machinery 7
(2001) 311-321). The motion of the disk and of both bearings is measured, so the equation of the
disk alone, (5a-b) of Hou et al. 2016, gives the force that the sound shaft leaves unexplained,
whatever the bearings, their clearance and the unbalance do. At order n and over the stiffness k:

    q_n = (1 + 4 i xi n w^2/W) b_n - (2 n^2 w^2/W) x_n,   b = 2 x - x_1 - x_2,   W = w_c0^2 = 2k/m

A crack at the angle beta that breathes with the measured orbit adds K p_n(beta), where p is f of
eq. (4) times the measured bend, turned as in eq. (3). In slow motion p_n = share_n b_0
exp(i n beta) with the static bend b_0: forward 1/4 at 2x, whatever the half angle, and 0.113 at 3x.
"""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np
import pydantic
from numpy.typing import NDArray

from rotor_common.configuration import ConfigModel, quantity
from rotor_interfaces.channels import DISPLACEMENT_COLUMNS

PROBES = DISPLACEMENT_COLUMNS
"""Displacements that the estimate needs, in the order of `CrackWindow`."""

ORBIT_ORDERS = (1.0, 2.0, 3.0)
"""Orders that the orbit is made of."""

CRACK_ORDERS = (2.0, 3.0)

_OTHER = [place ^ 1 for place in range(len(PROBES))]
"""For each of PROBES the index of the probe in the other direction at the same place."""

BETAS_RAD = 2.0 * np.pi * np.arange(36) / 36
"""Angles from the mark of angle 0 at which a crack is looked for."""

_ANGLES = 2.0 * np.pi * np.arange(48) / 48
_WAVES = np.exp(-1j * np.outer(CRACK_ORDERS, _ANGLES))
_ORBIT = np.exp(1j * np.outer(ORBIT_ORDERS, _ANGLES))

_FORWARD = np.array([0.5, 0.5j])
"""Turns a vector in y and z into its forward part."""

_SPEED_SCALE_RAD_S = 400.0

LARGEST_MOTION_M = 1.0
"""A larger displacement is no shaft motion, and products of such numbers could pass for a crack."""

NOISE_M, RELATIVE_ERROR = 1e-8, 0.02
"""Errors of q_n: the probes' noise in a window, and the relative error by transients."""

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]


class CrackBaseline(ConfigModel):
    """Data of one machine from healthy reference flights, see `crack_baseline.learn_baseline`."""

    rigid_critical_speeds_rad_s: tuple[float, float] = pydantic.Field(
        description='measured sqrt(2k/m) in the directions y and z, rad/s'
    )
    damping_ratios: tuple[float, float] = pydantic.Field(
        description='measured xi of the shaft in the directions y and z'
    )
    bearing_scale_errors: tuple[float, ...] = pydantic.Field(
        min_length=4,
        max_length=4,
        description='by how much brg1_y, brg1_z, brg2_y, brg2_z read more than the probe of the '
        'disk in the same direction, as a share',
    )
    bearing_cross_axis: tuple[float, ...] = pydantic.Field(
        min_length=4,
        max_length=4,
        description='what the same four probes take up of the other direction, as a share',
    )
    constant_y_m: tuple[float, ...] = pydantic.Field(
        min_length=4,
        max_length=4,
        description='real parts of q: constant at 2x and 3x, then growth by (w/400)^2, m',
    )
    constant_z_m: tuple[float, ...] = pydantic.Field(
        min_length=4, max_length=4, description='imaginary parts of the same, m'
    )

    def terms(self) -> Complex:
        """Return the constant terms and those with the square of the speed, (2, 2), by order."""
        flat = np.array(self.constant_y_m) + 1j * np.array(self.constant_z_m)
        return flat.reshape(2, 2)

    def corrected(self, window: 'CrackWindow') -> 'CrackWindow':
        """Return the window with the bearings' probes scaled and aligned as the disk's.

        To first order in the errors.
        """
        scale = np.array([0.0, 0.0, *self.bearing_scale_errors])
        cross = np.array([0.0, 0.0, *self.bearing_cross_axis])

        def correct(values: NDArray[Any]) -> NDArray[Any]:
            return np.asarray((values.T * (1.0 - scale) - values[_OTHER].T * cross).T)

        return dataclasses.replace(
            window,
            mean=correct(window.mean),
            vectors=correct(window.vectors),
            ball_pass=correct(window.ball_pass),
        )


class CrackConfig(ConfigModel):
    """What the crack estimate must know of the rotor."""

    rigid_critical_speed_rad_s: float = quantity(
        math.sqrt(2 * 2.5e7 / 32.1),
        unit='rad/s',
        gt=0.0,
        le=1e5,
        description='critical speed sqrt(2k/m) of the sound rotor on rigid bearings',
    )
    damping_ratio: float = quantity(
        0.01, unit='1', ge=0.0, le=0.5, description='xi of the shaft damping 2 xi m w'
    )
    crack_half_angle_rad: float = quantity(
        math.pi / 6, unit='rad', ge=0.01, le=math.pi / 2, description='alpha of the breathing'
    )
    memory_s: float = quantity(
        60.0, unit='s', ge=5.0, le=3600.0, description='time constant of the forgetting'
    )
    settle_s: float = quantity(
        10.0, unit='s', ge=0.0, le=600.0, description='time before the first estimate'
    )
    baseline: CrackBaseline | None = pydantic.Field(
        default=None, description='what reference flights taught (rotor-rig baseline); optional'
    )


@dataclass(frozen=True, eq=False)
class CrackWindow:
    """Motion at PROBES in one window of revolutions; SI, phases relative to shaft angle 0.

    `mean` (6,) in m; `vectors` (6, 3) in m at ORBIT_ORDERS, `ball_pass` (6,) in m at the ball-pass
    order; `step_s` is the time since the previous window.
    """

    speed_rad_s: float
    step_s: float
    mean: NDArray[np.float64]
    vectors: NDArray[np.complex128]
    ball_pass: NDArray[np.complex128]

    @classmethod
    def of(cls, indicators: Mapping[str, float], revolutions: float) -> Self:
        """Return the window that these indicators describe; NaN where one is missing.

        `revolutions` have passed since the previous window.
        """

        def vector(channel: str, order: str) -> complex:
            amplitude = indicators.get(f'{channel}/amplitude_{order}', math.nan)
            phase = indicators.get(f'{channel}/phase_{order}', math.nan)
            return amplitude * complex(math.cos(phase), math.sin(phase))

        speed_rad_s = indicators.get('speed_rad_s', math.nan)
        tracked = [f'order_{order:g}' for order in ORBIT_ORDERS]
        return cls(
            speed_rad_s=speed_rad_s,
            step_s=2.0 * math.pi * revolutions / speed_rad_s,
            mean=np.array([indicators.get(f'{name}/mean', math.nan) for name in PROBES]),
            vectors=np.array([[vector(name, order) for order in tracked] for name in PROBES]),
            ball_pass=np.array([vector(name, 'ball_pass') for name in PROBES]),
        )

    def silent_probes(self) -> list[str]:
        """Return the probes whose mean or a vector is missing or beyond LARGEST_MOTION_M."""
        told = np.abs(self.mean) <= LARGEST_MOTION_M  # False for NaN
        told &= (np.abs(self.vectors) <= LARGEST_MOTION_M).all(axis=1)
        return [name for name, ok in zip(PROBES, told.tolist(), strict=True) if not ok]

    def is_complete(self) -> bool:
        """Say whether all six probes have a valid mean and valid vectors."""
        return not self.silent_probes()


def drift_terms(window: CrackWindow) -> Real:
    """Return the terms of runout and misalignment: a constant, and the square of the speed."""
    return np.array([1.0, (window.speed_rad_s / _SPEED_SCALE_RAD_S) ** 2])


class EquivalentLoads(NamedTuple):
    """Forward equivalent loads q at CRACK_ORDERS, (2,) in m, and what is known of their errors.

    `gain_slopes` (2, 2) in m: the derivative of q, for each order, by a scale error of the disk's
    probe in y and in z. q is the difference of two terms; where these are large (near a
    resonance) so are its errors, and the weight in `weights` (2,) is less than 1.
    """

    loads: Complex
    gain_slopes: Complex
    weights: Real


def equivalent_loads(window: CrackWindow, rigid: Real, damping_ratios: Real) -> EquivalentLoads:
    """Return the equivalent loads of a window; `rigid` is W, (rad/s)^2, both (2,) in y and z."""
    vectors = window.vectors[:, 1:]
    square = window.speed_rad_s**2
    orders = np.array(CRACK_ORDERS)[:, np.newaxis]
    damping = 1.0 + 4.0j * damping_ratios * orders * square / rigid
    inertia = 2.0 * orders**2 * square / rigid * vectors[:2].T
    q = damping * bend(vectors).T - inertia
    slopes = 2.0 * damping * vectors[:2].T - inertia
    errors = RELATIVE_ERROR / NOISE_M * np.abs(inertia).max(axis=1)
    return EquivalentLoads(q @ _FORWARD, slopes * _FORWARD, 1.0 / (1.0 + errors**2))


def unit_crack(window: CrackWindow, half_angle: float) -> Complex:
    """Return the forward load of a crack of K = 1 at each of BETAS_RAD, (2, 36) in m.

    f cos^2 and f sin cos of eq. (3) and (4) over one turn of the measured orbit.
    """
    motion = window.mean[:, np.newaxis] + (window.vectors @ _ORBIT).real
    y, z = motion[:2]
    bend_y, bend_z = bend(motion)
    psi = _ANGLES + BETAS_RAD[:, np.newaxis]
    opening = np.arcsin(np.clip(np.cos(psi - np.arctan2(z, y)), -1.0, 1.0))
    swing = np.clip(opening / half_angle, -1.0, 1.0)
    f = 0.5 * (1.0 + np.sin(0.5 * np.pi * swing))
    along = f * (np.cos(psi) * bend_y + np.sin(psi) * bend_z)
    forward = along * (np.cos(psi) + 1j * np.sin(psi))  # y + i z of the load
    return np.asarray((_WAVES @ forward.T) / len(_ANGLES))


def bend(values: NDArray[Any]) -> NDArray[Any]:
    """Return b = 2 x - x_1 - x_2 in both directions; (2, ...) of (6, ...)."""
    return np.asarray(2.0 * values[:2] - values[2:4] - values[4:])
