# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""How deep a crack would have to be to explain what the probes say: an estimate of K = dk/k.

Method: equivalent loads (Markert, Platz and Seidler, International Journal of Rotating Machinery 7
(2001) 311-321). The motion of the disk and of both bearings is measured, so the equation of the
disk alone, (5a-b) of Hou et al. 2016, gives the force that the sound shaft leaves unexplained,
whatever the bearings, their clearance and the unbalance do. At order n and over the stiffness k:

    q_n = (1 + 4 i xi n w^2/W) b_n - (2 n^2 w^2/W) x_n,   b = 2 x - x_1 - x_2,   W = w_c0^2 = 2k/m

A crack at the angle beta that breathes with the measured orbit adds K p_n(beta), where p is f of
eq. (4) times the measured bend, turned as in eq. (3). In slow motion p_n = share_n b_0
exp(i n beta) with the static bend b_0: forward 1/4 at 2x, whatever the half angle, and 0.113 at 3x.
So a crack's q_n grows with the load, whereas a misalignment's force and a probe's runout stay:

    q_n = constant (runout, misalignment) + runout (w^2) + K p_n(beta)

is fitted by least squares over the last minute; the manoeuvre is the test signal. Both orders must
show the same crack. In level flight only the difference from reference flights is left.
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

ORBIT_ORDERS = (1.0, 2.0, 3.0)
"""Orders that the orbit is made of."""

CRACK_ORDERS = (2.0, 3.0)

_ANGLES = 2.0 * np.pi * np.arange(48) / 48
_BETAS = 2.0 * np.pi * np.arange(36) / 36
_WAVES = np.exp(-1j * np.outer(CRACK_ORDERS, _ANGLES))
_ORBIT = np.exp(1j * np.outer(ORBIT_ORDERS, _ANGLES))

_SPEED_SCALE_RAD_S = 400.0

_NOISE_M, _RELATIVE_ERROR = 1e-8, 0.02
"""Errors of q_n: the probes' noise in a window, and what scale errors and transients make of it."""

_LEAST_ERROR_M = 1e-10
"""Error of q_n that is always reckoned with: a motion that repeats itself proves nothing."""

_RUNOUT_SPREAD_M = 5e-6
"""How large a runout may be: keeps the fit determined at constant speed."""

_CERTAINTY = 4.0
"""Standard errors that the lower bound lies below the estimate."""

_LEVEL_ERROR_M = 2e-8
"""What the constant terms may change from flight to flight without any fault."""

_STIFFNESS_SPREAD = 0.03
"""Standard deviation of W about its design value, relative; the ball-pass line refines it."""

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]


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
    """What one window of revolutions says, for PROBES; SI, phases relative to shaft angle 0.

    `mean` (6,) in m; `vectors` (6, 3) in m at ORBIT_ORDERS, `ball_pass` (6,) in m at the ball-pass
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
        tracked = [f'order_{order:g}' for order in ORBIT_ORDERS]
        return cls(
            speed_rad_s=speed_rad_s,
            step_s=2.0 * math.pi * hop_revolutions / speed_rad_s,
            mean=np.array([indicators.get(f'{name}/mean', math.nan) for name in PROBES]),
            vectors=np.array([[vector(name, order) for order in tracked] for name in PROBES]),
            ball_pass=np.array([vector(name, 'ball_pass') for name in PROBES]),
        )

    def equivalent_loads(self, config: CrackConfig) -> Complex:
        """Return the forward parts of q at CRACK_ORDERS, (2,) in m, for the design stiffness."""
        rigid = np.full(2, config.rigid_critical_speed_rad_s**2)
        return _loads(self, rigid, config.damping_ratio)[0]


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
    probes' scales as well). The constant terms come from the fit above with K = 0.

    Raises:
        MonitorError: there is no window with all six probes.

    """
    known = [
        window for window in windows if _is_complete(window) and np.isfinite(window.ball_pass).all()
    ]
    if not known:
        raise MonitorError(
            'the reference flights hold no whole window with all of ' + ', '.join(PROBES)
        )
    rigid = _rigid_squares(known, config, ball_pass_order)
    fit = _Fit()
    for window in known:
        loads, weights = _loads(window, rigid, config.damping_ratio)
        none = np.zeros((len(CRACK_ORDERS), len(_BETAS)), np.complex128)
        fit.add(_drift(window), none, loads, weights=weights, keep=1.0)
    constant = fit.constant_terms().T.reshape(-1)
    return CrackBaseline(
        rigid_critical_speeds_rad_s=(math.sqrt(rigid[0]), math.sqrt(rigid[1])),
        constant_y_m=tuple(constant.real.tolist()),
        constant_z_m=tuple(constant.imag.tolist()),
    )


class CrackEstimator:
    """Estimates K window after window; forgets with the time constant `memory_s`.

    A second memory of a quarter of that follows a crack that grows, or comes at once; of the two,
    the estimate with the higher lower bound holds. `inflation` is how many times larger a variance
    is because the windows overlap.
    """

    def __init__(self, config: CrackConfig, inflation: float = 1.0) -> None:
        self.config = config
        self._inflation = inflation
        self._rigid = np.full(2, config.rigid_critical_speed_rad_s**2)
        self._constant: Complex | None = None
        if config.baseline is not None:
            self._rigid = np.array(config.baseline.rigid_critical_speeds_rad_s) ** 2
            self._constant = config.baseline.terms()
        self._by_load = {config.memory_s: _Fit(), 0.25 * config.memory_s: _Fit()}
        self._by_reference = _Fit(drifts=False)
        self._time_s = 0.0

    def update(self, window: CrackWindow) -> CrackFindings:
        """Take the next window; return what is known now."""
        if not _is_complete(window):
            return CrackFindings()
        loads, weights = _loads(window, self._rigid, self.config.damping_ratio)
        unit = _unit_crack(window, self.config.crack_half_angle_rad)
        drift = _drift(window)
        for memory_s, fit in self._by_load.items():
            keep = math.exp(-window.step_s / memory_s)
            fit.add(drift, unit, loads, weights=weights, keep=keep)
        if self._constant is not None:
            keep = math.exp(-window.step_s / self.config.memory_s)
            rest = loads - drift @ self._constant
            self._by_reference.add(drift, unit, rest, weights=weights, keep=keep)
        self._time_s += window.step_s
        if self._time_s < self.config.settle_s:
            return CrackFindings()
        both = [fit.judge(0.0, self._inflation) for fit in self._by_load.values()]
        by_load = max(both, key=lambda estimate: estimate.lowest)
        if self._constant is None:
            return CrackFindings(by_load)
        return CrackFindings(by_load, self._by_reference.judge(_LEVEL_ERROR_M, self._inflation))


def _loads(window: CrackWindow, rigid: Real, damping_ratio: float) -> tuple[Complex, Real]:
    """Return the forward equivalent loads q (2,) in m and their weights.

    q is the difference of two terms; where these are large (near a resonance) so are its errors.
    """
    vectors = window.vectors[:, 1:]
    square = window.speed_rad_s**2
    orders = np.array(CRACK_ORDERS)[:, np.newaxis]
    damping = 1.0 + 4.0j * damping_ratio * orders * square / rigid
    inertia = 2.0 * orders**2 * square / rigid * vectors[:2].T
    q = damping * _bend(vectors).T - inertia
    errors = _RELATIVE_ERROR / _NOISE_M * np.abs(inertia).max(axis=1)
    return 0.5 * (q[:, 0] + 1j * q[:, 1]), 1.0 / (1.0 + errors**2)


def _drift(window: CrackWindow) -> Real:
    """Return what runout and misalignment go with: a constant, and the square of the speed."""
    return np.array([1.0, (window.speed_rad_s / _SPEED_SCALE_RAD_S) ** 2])


def _unit_crack(window: CrackWindow, half_angle: float) -> Complex:
    """Return the forward load of a crack of K = 1 at each of _BETAS, (2, betas) in m.

    f cos^2 and f sin cos of eq. (3) and (4) over one turn of the measured orbit.
    """
    motion = window.mean[:, np.newaxis] + (window.vectors @ _ORBIT).real
    y, z = motion[:2]
    bend_y, bend_z = _bend(motion)
    psi = _ANGLES + _BETAS[:, np.newaxis]
    opening = np.arcsin(np.clip(np.cos(psi - np.arctan2(z, y)), -1.0, 1.0))
    swing = np.clip(opening / half_angle, -1.0, 1.0)
    f = 0.5 * (1.0 + np.sin(0.5 * np.pi * swing))
    along = f * (np.cos(psi) * bend_y + np.sin(psi) * bend_z)
    forward = along * (np.cos(psi) + 1j * np.sin(psi))  # y + i z of the load
    return np.asarray((_WAVES @ forward.T) / len(_ANGLES))


def _rigid_squares(windows: list[CrackWindow], config: CrackConfig, order: float) -> Real:
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


class _Fit:
    """Weighted least squares of q on drift terms and the crack at each of _BETAS; it forgets.

    All sums are by order; `drifts` False leaves out the drift terms.
    """

    def __init__(self, *, drifts: bool = True) -> None:
        orders, terms, betas = len(CRACK_ORDERS), 2, len(_BETAS)
        self._drifts = drifts
        self._windows = 0.0
        self._sums: list[NDArray[Any]] = [
            np.zeros(orders),  # weight
            np.zeros((orders, terms, terms)),  # drift with drift
            np.zeros((orders, terms), np.complex128),  # drift with q
            np.zeros(orders),  # q with q
            np.zeros((orders, terms, betas), np.complex128),  # drift with crack
            np.zeros((orders, betas), np.complex128),  # crack with q
            np.zeros((orders, betas)),  # crack with crack
        ]

    def add(
        self, drift: Real, unit: Complex, loads: Complex, *, weights: Real, keep: float
    ) -> None:
        """Take a window after multiplying the weight of all before by `keep`."""
        self._windows = keep * self._windows + 1.0
        new = [
            weights,
            weights[:, None, None] * np.outer(drift, drift),
            (weights * loads)[:, None] * drift,
            weights * np.abs(loads) ** 2,
            weights[:, None, None] * drift[:, None] * unit[:, None, :],
            (weights * loads)[:, None] * np.conj(unit),
            weights[:, None] * np.abs(unit) ** 2,
        ]
        self._sums = [keep * old + now for old, now in zip(self._sums, new, strict=True)]

    def constant_terms(self) -> Complex:
        """Return the drift's coefficients without a crack, (orders, terms)."""
        _, _, with_load, *_ = self._sums
        return np.asarray((self._drift_inverse() @ with_load[:, :, None])[:, :, 0])

    def _drift_inverse(self) -> Real:
        """Return the inverse of the drift's normal matrix, (orders, terms, terms).

        The term with the square of the speed has a prior about 0, the spread of a runout, which
        keeps the fit determined at constant speed.
        """
        weight, square, *_ = self._sums
        prior = np.zeros_like(square)
        prior[:, 1, 1] = (_NOISE_M / _RUNOUT_SPREAD_M) ** 2 + 1e-12 * weight
        return np.asarray(np.linalg.inv(square + prior))

    def judge(self, error_m: float, inflation: float) -> CrackEstimate:
        """Return the crack, at the angle where both orders speak for it most."""
        weight, _, with_load, power, with_crack, right, left = self._sums
        if self._drifts:
            inverse = self._drift_inverse()
            explained = inverse @ with_load[:, :, None]
            power = power - (np.conj(with_load)[:, None, :] @ explained)[:, 0, 0].real
            turned = inverse @ with_crack
            left = left - (np.conj(with_crack) * turned).sum(axis=1).real
            right = right - (np.conj(with_crack) * explained).sum(axis=1)
        # what rounding leaves of two equal sums must not divide
        left = np.maximum(left, 1e-12 * self._sums[-1] + 1e-300)
        ratio = right / left
        rest = power[:, None] - np.abs(ratio) ** 2 * left
        rest = np.maximum(rest, _LEAST_ERROR_M**2 * weight[:, None])
        degrees = max(self._windows - 3.0 * inflation, 1.0)
        size = np.sqrt(self._sums[-1] / weight[:, None])
        doubt = _CERTAINTY * np.sqrt(inflation * rest / degrees / left) + error_m / size
        lowest = (ratio.real - doubt).min(axis=0)
        best = int(np.argmax(lowest))
        angle = float(_BETAS[best]) + 0.5 * cmath.phase(complex(ratio[0, best]))
        return CrackEstimate(
            ratio=float(ratio[:, best].real.min()),
            lowest=float(lowest[best]),
            angle_rad=math.remainder(angle, 2.0 * math.pi),
        )


def _bend(values: NDArray[Any]) -> NDArray[Any]:
    """Return b = 2 x - x_1 - x_2 in both directions; (2, ...) of (6, ...)."""
    return np.asarray(2.0 * values[:2] - values[2:4] - values[4:])


def _is_complete(window: CrackWindow) -> bool:
    return bool(np.isfinite(window.mean).all() and np.isfinite(window.vectors).all())
