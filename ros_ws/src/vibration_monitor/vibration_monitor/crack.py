# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""How deep a crack would have to be to explain what the probes say: an estimate of K = dk/k.

`crack_model` turns every window into equivalent loads q_n at 2x and 3x and into p_n(beta), what a
crack of K = 1 would do. A crack's q_n grows with the load, whereas a misalignment's force and a
probe's runout stay:

    q_n = constant (runout, misalignment) + runout (w^2) + K p_n(beta)

is fitted by least squares over the last minute; the manoeuvre is the test signal. Both orders must
speak for the crack. In level flight only the difference from reference flights is left.
"""

import cmath
import math
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibration_monitor.crack_model import (
    BETAS_RAD,
    CRACK_ORDERS,
    NOISE_M,
    Complex,
    CrackConfig,
    CrackWindow,
    Real,
    bend,
    drift_terms,
    equivalent_loads,
    unit_crack,
)
from vibration_monitor.trend import overlap_inflation

_LEAST_ERROR_M = 1e-10
"""Error of q_n that is always reckoned with: a motion that repeats itself proves nothing."""

_LEAST_CHANGE_M = 1e-6
"""RMS by which the static bend must change, 0.08 g: in steady flight q and p share their noise."""

_RUNOUT_SPREAD_M = 5e-6
"""How large a runout may be: keeps the fit determined at constant speed."""

_CERTAINTY = 4.0
"""Standard errors that the lower bound lies below the estimate."""

_LEVEL_ERROR_M = 2e-8
"""What the constant terms may change from flight to flight without any fault."""

_PERSISTENCE_REVOLUTIONS = 160
"""An estimate is the one that says least of the estimates over so many revolutions."""


@dataclass(frozen=True)
class CrackEstimate:
    """Crack stiffness ratio K that explains the last minute; NaN where nothing can be said.

    `lowest` is what K is at least (4 standard errors, the lesser of both orders); negative where
    there is no evidence. `angle_rad` is the crack's axis from the mark of angle 0 (beta).
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


class CrackEstimator:
    """Estimates K window after window; forgets with the time constant `memory_s`.

    A second memory of a quarter of that follows a crack that grows, or comes at once; of the two,
    the estimate with the higher lower bound holds. What is given is the estimate that says least of
    those over 160 revolutions; they must lie within half of `memory_s`.
    """

    def __init__(
        self, config: CrackConfig, *, window_revolutions: int, hop_revolutions: int
    ) -> None:
        self.config = config
        self._inflation = overlap_inflation(window_revolutions, hop_revolutions)
        self._rigid = np.full(2, config.rigid_critical_speed_rad_s**2)
        self._constant: Complex | None = None
        if config.baseline is not None:
            self._rigid = np.array(config.baseline.rigid_critical_speeds_rad_s) ** 2
            self._constant = config.baseline.terms()
        self._by_load = {config.memory_s: _Fit(), 0.25 * config.memory_s: _Fit()}
        self._by_reference = _Fit(drifts=False)
        self._time_s = 0.0
        count = math.ceil(_PERSISTENCE_REVOLUTIONS / hop_revolutions)
        self._recent: deque[tuple[float, CrackFindings]] = deque(maxlen=count)

    def update(self, window: CrackWindow) -> CrackFindings:
        """Take the next window; return what is known now, nothing where a probe said nothing."""
        self._age(window.step_s)
        if not window.is_complete():
            return CrackFindings()
        self._add(window)
        if self._time_s < self.config.settle_s:
            return CrackFindings()
        self._recent.append((self._time_s, self._judge()))
        return self._least()

    def _age(self, step_s: float) -> None:
        if math.isnan(step_s):  # without a speed
            return
        self._time_s += step_s
        for memory_s, fit in self._by_load.items():
            fit.age(math.exp(-step_s / memory_s))
        self._by_reference.age(math.exp(-step_s / self.config.memory_s))

    def _add(self, window: CrackWindow) -> None:
        if self.config.baseline is not None:
            window = self.config.baseline.corrected(window)
        loads, weights = equivalent_loads(window, self._rigid, self.config.damping_ratio)
        unit = unit_crack(window, self.config.crack_half_angle_rad)
        drift = drift_terms(window)
        static = complex(*bend(window.mean))
        for fit in self._by_load.values():
            fit.add(drift, unit, loads, weights, static)
        if self._constant is not None:
            rest = loads - drift @ self._constant
            self._by_reference.add(drift, unit, rest, weights, static)

    def _judge(self) -> CrackFindings:
        both = [fit.judge(0.0, self._inflation) for fit in self._by_load.values()]
        by_load = max(both, key=lambda estimate: estimate.lowest)
        if self._constant is None:
            return CrackFindings(by_load)
        return CrackFindings(by_load, self._by_reference.judge(_LEVEL_ERROR_M, self._inflation))

    def _least(self) -> CrackFindings:
        while self._time_s - self._recent[0][0] > 0.5 * self.config.memory_s:
            self._recent.popleft()
        if len(self._recent) < (self._recent.maxlen or 1):
            return CrackFindings()
        findings = [finding for _, finding in self._recent]
        return CrackFindings(
            min((each.by_load for each in findings), key=_lowest),
            min((each.by_reference for each in findings), key=_lowest),
        )


def _lowest(estimate: CrackEstimate) -> float:
    return estimate.lowest


class _Fit:
    """Weighted least squares of q on drift terms and the crack at each of BETAS_RAD; it forgets.

    All sums are by order; `drifts` False leaves out the drift terms.
    """

    def __init__(self, *, drifts: bool = True) -> None:
        orders, terms, betas = len(CRACK_ORDERS), 2, len(BETAS_RAD)
        self._drifts = drifts
        self._windows = 0.0
        self._bends: list[float | complex] = [0.0, 0.0]  # sums of the static bend, and squared
        self._sums: list[NDArray[Any]] = [
            np.zeros(orders),  # weight
            np.zeros((orders, terms, terms)),  # drift with drift
            np.zeros((orders, terms), np.complex128),  # drift with q
            np.zeros(orders),  # q with q
            np.zeros((orders, terms, betas), np.complex128),  # drift with crack
            np.zeros((orders, betas), np.complex128),  # crack with q
            np.zeros((orders, betas)),  # crack with crack
        ]

    def age(self, keep: float) -> None:
        """Multiply the weight of all windows so far by `keep`."""
        self._windows *= keep
        self._bends = [keep * each for each in self._bends]
        self._sums = [keep * each for each in self._sums]

    def add(
        self, drift: Real, unit: Complex, loads: Complex, weights: Real, static_bend: complex
    ) -> None:
        """Take a window; `static_bend` is y + i z in m."""
        self._windows += 1.0
        self._bends = [self._bends[0] + static_bend, self._bends[1] + abs(static_bend) ** 2]
        new = [
            weights,
            weights[:, None, None] * np.outer(drift, drift),
            (weights * loads)[:, None] * drift,
            weights * np.abs(loads) ** 2,
            weights[:, None, None] * drift[:, None] * unit[:, None, :],
            (weights * loads)[:, None] * np.conj(unit),
            weights[:, None] * np.abs(unit) ** 2,
        ]
        self._sums = [old + now for old, now in zip(self._sums, new, strict=True)]

    def _bend_change_m(self) -> float:
        """Return by how much the static bend changes, RMS."""
        total, square = self._bends
        return math.sqrt(max(abs(square) / self._windows - abs(total / self._windows) ** 2, 0.0))

    def _drift_inverse(self) -> Real:
        """Return the inverse of the drift's normal matrix, (orders, terms, terms).

        The term with the square of the speed has a prior about 0, the spread of a runout, which
        keeps the fit determined at constant speed.
        """
        weight, square, *_ = self._sums
        prior = np.zeros_like(square)
        prior[:, 1, 1] = (NOISE_M / _RUNOUT_SPREAD_M) ** 2 + 1e-12 * weight
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
        # what rounding leaves of two equal sums must not divide; nor a crack that never opens
        left = np.maximum(left, 1e-12 * self._sums[-1] + 1e-300)
        size = np.sqrt(np.maximum(self._sums[-1] / weight[:, None], 1e-300))
        # what does not lie along the crack's axis counts as error
        ratio = right / left
        rest = power[:, None] - ratio.real**2 * left
        rest = np.maximum(rest, _LEAST_ERROR_M**2 * weight[:, None])
        degrees = max(self._windows - 3.0 * inflation, 1.0)
        # half of the rest is real: `rest` sums real and imaginary parts
        variance = inflation * 0.5 * rest / degrees / left
        lowest = ratio.real - _CERTAINTY * np.sqrt(variance) - error_m / size
        if self._drifts and self._bend_change_m() < _LEAST_CHANGE_M:
            lowest = np.minimum(lowest, 0.0)
        lowest = lowest.min(axis=0)
        best = int(np.argmax(lowest))
        angle = float(BETAS_RAD[best]) + 0.5 * cmath.phase(complex(ratio[0, best]))
        return CrackEstimate(
            ratio=float(ratio[:, best].real.min()),
            lowest=float(lowest[best]),
            angle_rad=math.remainder(angle, 2.0 * math.pi),
        )
