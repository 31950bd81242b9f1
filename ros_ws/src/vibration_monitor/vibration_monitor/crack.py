# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""How deep a crack would have to be to explain what the probes say: an estimate of K = dk/k.

Method: equivalent loads (Markert, Platz and Seidler, International Journal of Rotating Machinery 7
(2001) 311-321). The motion of the disk and of both bearings is measured, so the equation of the
disk alone, (5a-b) of Hou et al. 2016, gives the force that the sound shaft leaves unexplained,
whatever the bearings, their clearance and the unbalance do. At order n and over the stiffness k:

    q_n = (1 + 4 i xi n w^2/W) b_n - (2 n^2 w^2/W) x_n,   b = 2 x - x_1 - x_2,   W = w_c0^2 = 2k/m

A crack that breathes once a revolution adds K times its share of the static bend b_0 to the
forward part of q_n: b_0 K/4 at 2x (for any crack half angle) and 0.113 b_0 K at 3x (30 degrees;
0.107 to 0.125 from 10 to 90), from the Fourier series of f cos^2 and f sin cos. So q_n grows in
proportion to the load, whereas a misalignment's force and a probe's runout stay as they are:

    q_n = runout and misalignment (constant) + runout (w^2) + K share_n exp(i n angle) b_0

is fitted by least squares over the last minute; the manoeuvre is the test signal. Both orders must
show the crack. In level flight only the difference from reference flights is left.
"""

import cmath
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import pydantic
from numpy.typing import NDArray

from rotor_interfaces.config import ConfigModel, quantity
from vibration_monitor.errors import MonitorError

PROBES = ('disk_y', 'disk_z', 'brg1_y', 'brg1_z', 'brg2_y', 'brg2_z')
"""Displacements that the estimate needs, in the order of `CrackWindow`."""

CRACK_ORDERS = (2.0, 3.0)
_SHARES = np.array([0.25, 0.1134])
"""Forward part of f cos^2 and f sin cos at these orders, of a half angle of 30 degrees."""

_SPEED_SCALE_RAD_S = 400.0
_WITH_SPEED = 3
"""Regressors of a flight: constant, with the square of the speed, with the static bend."""

_NOISE_M, _RELATIVE_ERROR = 1e-8, 0.02
"""Errors of q_n: the probes' noise in a window, and what scale errors and transients make of it."""

_RUNOUT_SPREAD_M = 5e-6
"""How large a runout may be: keeps the fit determined at constant speed."""

_CERTAINTY = 4.0
"""Standard errors that the lower bound lies below the estimate."""

_LEVEL_ERROR_M = 2e-8
"""What the constant terms may change from flight to flight without any fault."""

_STIFFNESS_SPREAD = 0.03
"""Standard deviation of W about its design value, relative; the ball-pass line refines it."""


class CrackBaseline(ConfigModel):
    """What healthy reference flights of one machine teach, see `learn_baseline`."""

    rigid_critical_speeds_rad_s: tuple[float, float] = pydantic.Field(
        description='measured sqrt(2k/m) in the directions y and z, rad/s'
    )
    constant_y_m: tuple[float, ...] = pydantic.Field(
        min_length=4,
        max_length=4,
        description='real parts of q: constant at 2x and 3x, then growth by (w/400)^2, m',
    )
    constant_z_m: tuple[float, ...] = pydantic.Field(
        min_length=4, max_length=4, description='imaginary parts of the same, m'
    )

    def terms(self) -> NDArray[np.complex128]:
        """Return the constant terms and those with the square of the speed, (2, 2), by order."""
        flat = np.array(self.constant_y_m) + 1j * np.array(self.constant_z_m)
        return flat.reshape(2, 2)


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
    """What one window of revolutions says, for PROBES; SI, phases relative to shaft angle 0.

    `mean` (6,) in m; `vectors` (6, 2) in m at CRACK_ORDERS, `ball_pass` (6,) in m at the ball-pass
    order; `step_s` is the time since the window before.
    """

    speed_rad_s: float
    step_s: float
    mean: NDArray[np.float64]
    vectors: NDArray[np.complex128]
    ball_pass: NDArray[np.complex128]

    @classmethod
    def of(cls, indicators: Mapping[str, float], hop_revolutions: int) -> Self:
        """Return the window that these indicators of the monitor describe; NaN where one lacks."""

        def vector(channel: str, order: str) -> complex:
            amplitude = indicators.get(f'{channel}/amplitude_{order}', math.nan)
            phase = indicators.get(f'{channel}/phase_{order}', math.nan)
            return amplitude * complex(math.cos(phase), math.sin(phase))

        speed_rad_s = indicators.get('speed_rad_s', math.nan)
        tracked = [f'order_{order:g}' for order in CRACK_ORDERS]
        return cls(
            speed_rad_s=speed_rad_s,
            step_s=2.0 * math.pi * hop_revolutions / speed_rad_s,
            mean=np.array([indicators.get(f'{name}/mean', math.nan) for name in PROBES]),
            vectors=np.array([[vector(name, order) for order in tracked] for name in PROBES]),
            ball_pass=np.array([vector(name, 'ball_pass') for name in PROBES]),
        )

    def equivalent_loads(self, config: CrackConfig) -> NDArray[np.complex128]:
        """Return the forward parts of q at CRACK_ORDERS, (2,) in m, for the design stiffness."""
        rigid = np.full(2, config.rigid_critical_speed_rad_s**2)
        return _loads(self, rigid, config.damping_ratio)[1]


@dataclass(frozen=True)
class CrackEstimate:
    """Crack stiffness ratio K that explains the last minute; NaN where nothing can be said.

    `lowest` is what K is at least (4 standard errors, both orders); negative where there is no
    evidence. `angle_rad` is the crack's axis from the mark of angle 0 (beta).
    """

    ratio: float
    lowest: float
    angle_rad: float


UNKNOWN = CrackEstimate(math.nan, math.nan, math.nan)


@dataclass(frozen=True)
class CrackFindings:
    """What speaks for a crack: the change with the load, and the difference from the reference.

    The second works in level flight but is fooled by whatever changes 2x and 3x at once, such as a
    scratch under a probe; it is UNKNOWN without a baseline.
    """

    by_load: CrackEstimate = UNKNOWN
    by_reference: CrackEstimate = UNKNOWN


def learn_baseline(
    windows: Iterable[CrackWindow], config: CrackConfig, ball_pass_order: float
) -> CrackBaseline:
    """Return what healthy windows, of different loads and speeds, teach about one machine.

    The shaft's stiffness comes from the ball-pass line, which no fault of the shaft drives: there
    q = 0, so (W/2 + 2 i xi n w^2) b = n^2 w^2 x, in each direction (this takes up the errors of the
    probes' scales as well). The constant terms come from the fit above.

    Raises:
        MonitorError: there is no window with all six probes.

    """
    known = [window for window in windows if _is_complete(window)]
    if not known:
        raise MonitorError(
            'the reference flights hold no whole window with all of ' + ', '.join(PROBES)
        )
    rigid = _rigid_squares(known, config, ball_pass_order)
    fit = _Regression(_WITH_SPEED)
    for window in known:
        regressors, loads, weights = _loads(window, rigid, config.damping_ratio)
        fit.add(regressors, loads, weights=weights, keep=1.0)
    constant = fit.solve()[0][:, :2].T.reshape(-1)
    return CrackBaseline(
        rigid_critical_speeds_rad_s=(math.sqrt(rigid[0]), math.sqrt(rigid[1])),
        constant_y_m=tuple(constant.real.tolist()),
        constant_z_m=tuple(constant.imag.tolist()),
    )


class CrackEstimator:
    """Estimates K window after window; forgets with the time constant `memory_s`."""

    def __init__(self, config: CrackConfig) -> None:
        self.config = config
        self._rigid = np.full(2, config.rigid_critical_speed_rad_s**2)
        self._constant: NDArray[np.complex128] | None = None
        if config.baseline is not None:
            self._rigid = np.array(config.baseline.rigid_critical_speeds_rad_s) ** 2
            self._constant = config.baseline.terms()
        self._varying = _Regression(_WITH_SPEED)
        self._level = _Regression(1)
        self._time_s = 0.0

    def update(self, window: CrackWindow) -> CrackFindings:
        """Take the next window; return what is known now."""
        if not _is_complete(window):
            return CrackFindings()
        keep = math.exp(-window.step_s / self.config.memory_s)
        regressors, loads, weights = _loads(window, self._rigid, self.config.damping_ratio)
        self._varying.add(regressors, loads, weights=weights, keep=keep)
        if self._constant is not None:
            rests = loads - regressors[:2] @ self._constant
            self._level.add(regressors[2:], rests, weights=weights, keep=keep)
        self._time_s += window.step_s
        if self._time_s < self.config.settle_s:
            return CrackFindings()
        by_load = _judge(self._varying, 0.0)
        if self._constant is None:
            return CrackFindings(by_load)
        return CrackFindings(by_load, _judge(self._level, _LEVEL_ERROR_M))


def _loads(
    window: CrackWindow, rigid: NDArray[np.float64], damping_ratio: float
) -> tuple[NDArray[np.float64], NDArray[np.complex128], NDArray[np.float64]]:
    """Return the regressors (3,), the forward equivalent loads q (2,) in m, and their weights.

    q is the difference of two terms; where these are large (near a resonance) so are its errors.
    """
    bend = _bend(window.vectors).T
    square = window.speed_rad_s**2
    orders = np.array(CRACK_ORDERS)[:, np.newaxis]
    damping = 1.0 + 4.0j * damping_ratio * orders * square / rigid
    inertia = 2.0 * orders**2 * square / rigid * window.vectors[:2].T
    q = damping * bend - inertia
    static = float(_bend(window.mean)[0])
    regressors = np.array([1.0, square / _SPEED_SCALE_RAD_S**2, static])
    errors = _RELATIVE_ERROR / _NOISE_M * np.abs(inertia).max(axis=1)
    return regressors, 0.5 * (q[:, 0] + 1j * q[:, 1]), 1.0 / (1.0 + errors**2)


def _judge(fit: '_Regression', error_m: float) -> CrackEstimate:
    """Return the crack that the last regressor's coefficients speak of."""
    coefficients, errors = fit.solve()
    slopes = coefficients[:, -1]
    ratios = np.abs(slopes) / _SHARES
    doubt = _CERTAINTY * errors[:, -1] + error_m / fit.root_mean_square(-1)
    lowest = ratios - doubt / _SHARES
    angle = _angle(complex(slopes[0]), complex(slopes[1]))
    return CrackEstimate(float(ratios.min()), float(lowest.min()), angle)


def _rigid_squares(
    windows: list[CrackWindow], config: CrackConfig, order: float
) -> NDArray[np.float64]:
    """Return W of both directions, (rad/s)^2; the design value is the prior."""
    square = np.array([window.speed_rad_s**2 for window in windows])[:, np.newaxis]
    b = np.array([_bend(window.ball_pass) for window in windows])
    x = np.array([window.ball_pass[:2] for window in windows]) * order**2 * square
    x = x - 2.0j * config.damping_ratio * order * square * b
    design = config.rigid_critical_speed_rad_s**2
    power = (np.abs(b) ** 2).sum(axis=0)
    half = (np.conj(b) * x).real.sum(axis=0) / power
    noise = (np.abs(x - half * b) ** 2).sum(axis=0) / len(windows)
    prior = noise / (0.5 * _STIFFNESS_SPREAD * design) ** 2
    return np.asarray(2.0 * (half * power + 0.5 * design * prior) / (power + prior))


class _Regression:
    """Weighted least squares of one complex response an order on real regressors; forgets."""

    def __init__(self, count: int) -> None:
        orders = len(CRACK_ORDERS)
        self._windows = 0.0
        self._weight = np.zeros(orders)
        self._normal = np.zeros((orders, count, count))
        self._right = np.zeros((orders, count), np.complex128)
        self._power = np.zeros(orders)

    def add(
        self,
        regressors: NDArray[np.float64],
        responses: NDArray[np.complex128],
        *,
        weights: NDArray[np.float64],
        keep: float,
    ) -> None:
        """Take the responses (orders,) after multiplying the weight of all before by `keep`."""
        self._windows = keep * self._windows + 1.0
        self._weight = keep * self._weight + weights
        square = np.outer(regressors, regressors)
        self._normal = keep * self._normal + weights[:, None, None] * square
        self._right = keep * self._right + np.outer(weights * responses, regressors)
        self._power = keep * self._power + weights * np.abs(responses) ** 2

    def root_mean_square(self, index: int) -> NDArray[np.float64]:
        """Return the weighted RMS of a regressor, (orders,)."""
        return np.asarray(np.sqrt(self._normal[:, index, index] / self._weight))

    def solve(self) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
        """Return the coefficients and their standard errors, (orders, count) each.

        The coefficient of the square of the speed, the second of three, has a prior about 0 of
        _RUNOUT_SPREAD_M, which keeps the fit determined at constant speed.
        """
        count = self._right.shape[1]
        unit = np.eye(count)
        scale = np.sqrt(np.maximum(np.diagonal(self._normal, axis1=1, axis2=2), 1e-300))
        normal = self._normal / (scale[:, :, None] * scale[:, None, :])
        right = self._right / scale
        free = (np.linalg.inv(normal + 1e-9 * unit) * right[:, None, :]).sum(axis=2)
        explained = (np.conj(free) * right).real.sum(axis=1)
        # what rounding leaves of two equal sums is no noise
        rest = np.maximum(self._power - explained, 1e-14 * self._power)
        noise = rest / max(self._windows - count, 1.0)
        prior = np.full((len(noise), count), 1e-12)
        if count == _WITH_SPEED:
            prior[:, 1] += noise / (_RUNOUT_SPREAD_M * scale[:, 1]) ** 2
        inverse = np.linalg.inv(normal + prior[:, :, None] * unit)
        coefficients = (inverse * right[:, None, :]).sum(axis=2) / scale
        variance = np.maximum(np.diagonal(inverse, axis1=1, axis2=2), 0.0)
        return coefficients, np.sqrt(noise[:, None] * variance) / scale


def _bend(values: NDArray[Any]) -> NDArray[Any]:
    """Return b = 2 x - x_1 - x_2 in both directions; (2, ...) of (6, ...)."""
    return np.asarray(2.0 * values[:2] - values[2:4] - values[4:])


def _is_complete(window: CrackWindow) -> bool:
    return bool(np.isfinite(window.mean).all() and np.isfinite(window.vectors).all())


def _angle(second: complex, third: complex) -> float:
    """Return beta in (-pi, pi] from exp(2 i beta) and exp(3 i beta); NaN where one is missing."""
    if not (second and third):
        return math.nan
    half = 0.5 * cmath.phase(second)
    # 2x leaves two angles half a turn apart; 3x tells them apart
    fits = cmath.rect(1.0, 3.0 * half - cmath.phase(third)).real
    return half if fits > 0.0 else half - math.copysign(math.pi, half)
