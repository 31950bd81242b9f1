# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The crack estimate: the K = dk/k that would explain the measured displacements.

`crack_model` turns every window into equivalent loads q_n at 2x and 3x and into p_n(beta), what a
crack of K = 1 would do. A crack's q_n grows with the load, whereas a misalignment's force and a
probe's runout stay, and a probe whose scale has changed goes with the motion itself:

    q_n = constant (runout, misalignment) + runout (w^2) + scale errors x motion + K p_n(beta)

is fitted by least squares over the last minute, each order by itself; the maneuver is the test
signal. Both orders must speak for the crack. In level flight only the difference from reference
flights is left.
"""

import math
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from rotor_common.constants import GRAVITY_M_S2
from vibration_monitor.crack_model import (
    BETAS_RAD,
    CRACK_ORDERS,
    NOISE_M,
    Complex,
    CrackConfig,
    CrackWindow,
    EquivalentLoads,
    Real,
    bend,
    drift_terms,
    equivalent_loads,
    unit_crack,
)
from vibration_monitor.spectrum import overlap_inflation

_LEAST_ERROR_M = 1e-10
"""Least error assumed for q_n: a motion that repeats exactly proves nothing."""

_LEAST_CHANGE_M = 1e-6
"""RMS by which the static bend must change, 0.08 g: in steady flight q and p share their noise."""

_LARGEST_UNSEEN_RATIO = 0.05
"""A shaft is called sound only where a crack of this K is ruled out."""

_HIGHEST_SPEED = 0.525
"""As part of the rigid critical speed; above it such a crack was missed despite a narrow bound."""

_HIGHEST_ESTIMATE_SPEED = 0.6
"""No estimate above this part of that speed: at 0.8 a sound shaft had a lower bound of 0.03."""

_RUNOUT_SPREAD_M = 5e-6
"""Expected size of a runout; keeps the fit determined at constant speed."""

_GAIN_SPREAD = 0.15
"""Expected size of the scale errors of the disk's probes that the baseline does not know of.

An equal error of both bearings' probes has the same effect: without a crack, x_1 + x_2 is
proportional to x. At steady speed a wrong stiffness has it too.
"""

_MODEL_ERROR = 0.3
"""Share of a crack's load that may differ from K p_n, for example because the crack grows.

At low speed a crack's motion is like its load: a scale error of 100 % explains a growing crack
better than a crack of constant K does, so large scale errors are penalized. The residual of a
growing crack has one shape and does not average out: it counts once for all windows.
"""

_ROUNDS = 3
"""Rounds of weighting the fit against the expected size of the scale errors.

The first round hardly allows for them; the second knows the residual of the fit with them.
"""

_CERTAINTY = 4.0
"""Standard errors that the lower bound lies below the estimate."""

_LEVEL_ERROR_M = 2e-8
"""Change of the constant terms from flight to flight without any fault."""

_FIRST_CRACK = 4 + 2 + 1
_COLUMNS = _FIRST_CRACK + len(BETAS_RAD)

_LEAST_SQUARE_M2 = 1e-300
"""Keeps a quotient finite."""

_PERSISTENCE_REVOLUTIONS = 160
"""The estimate returned is the lowest of the estimates over this many revolutions."""


@dataclass(frozen=True)
class CrackEstimate:
    """Crack stiffness ratio K that explains the last minute; NaN where nothing can be said.

    `lowest` is the lower bound of K (4 standard errors, the lesser of both orders); negative where
    there is no evidence. A probe that reads too high makes both too small by the same share.
    `angle_rad` is the crack's axis from the mark of angle 0 (beta). `resolution` is 4 standard
    errors of the less certain order.
    """

    ratio: float
    lowest: float
    angle_rad: float
    resolution: float


UNKNOWN = CrackEstimate(math.nan, math.nan, math.nan, math.nan)


@dataclass(frozen=True)
class CrackFindings:
    """What speaks for a crack: the change with the load, and the difference from the reference.

    The second works in level flight but is fooled by whatever changes 2x and 3x at once, such as a
    scratch under a probe or a new gain of one; it is UNKNOWN without a baseline. `doubt` says why
    `by_load` cannot vouch for a sound shaft; empty where it can.
    """

    by_load: CrackEstimate = UNKNOWN
    by_reference: CrackEstimate = UNKNOWN
    doubt: str = ''


class CrackEstimator:
    """Estimates K window after window; forgets with the time constant `memory_s`.

    A second fit with a quarter of that time constant follows a crack that grows or appears at once;
    of the two, the estimate with the higher lower bound is used. The result is the lowest of the
    estimates over 160 revolutions, which must lie within half of `memory_s`.
    """

    def __init__(
        self, config: CrackConfig, *, window_revolutions: int, hop_revolutions: int
    ) -> None:
        self.config = config
        self._inflation = overlap_inflation(window_revolutions, hop_revolutions)
        self._rigid = np.full(2, config.rigid_critical_speed_rad_s**2)
        self._damping = np.full(2, config.damping_ratio)
        self._constant: Complex | None = None
        if config.baseline is not None:
            self._rigid = np.array(config.baseline.rigid_critical_speeds_rad_s) ** 2
            self._damping = np.array(config.baseline.damping_ratios)
            self._constant = config.baseline.terms()
        self._by_load = {config.memory_s: _LoadFit(), 0.25 * config.memory_s: _LoadFit()}
        self._by_reference = _ReferenceFit()
        self._time_s = 0.0
        count = math.ceil(_PERSISTENCE_REVOLUTIONS / hop_revolutions)
        self._recent: deque[tuple[float, CrackFindings]] = deque(maxlen=count)

    def update(self, window: CrackWindow) -> CrackFindings:
        """Take the next window; return the findings, UNKNOWN where a probe has no valid value."""
        self._age(window.step_s)
        if silent := window.silent_probes():
            return CrackFindings(doubt=f'no valid value of {", ".join(silent)}')
        if window.speed_rad_s > _HIGHEST_ESTIMATE_SPEED * self._rigid_rad_s():
            return CrackFindings(doubt=self._too_fast(window.speed_rad_s))
        self._add(window)
        if self._time_s < self.config.settle_s:
            return CrackFindings(
                doubt=f'the crack estimate has had {self._time_s:.1f} s of the '
                f'{self.config.settle_s:g} s that it needs to settle'
            )
        self._recent.append((self._time_s, self._judge(window.speed_rad_s)))
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
        found = equivalent_loads(window, self._rigid, self._damping)
        unit = unit_crack(window, self.config.crack_half_angle_rad)
        drift = drift_terms(window)
        static_bend = complex(*bend(window.mean))
        for fit in self._by_load.values():
            fit.add(drift, found, unit, static_bend)
        if self._constant is not None:
            rest = found.loads - drift @ self._constant
            self._by_reference.add(rest, unit, found.weights)

    def _judge(self, speed_rad_s: float) -> CrackFindings:
        both = [fit.judge(self._inflation) for fit in self._by_load.values()]
        by_load = max(both, key=lambda estimate: estimate.lowest)
        by_reference = UNKNOWN
        if self._constant is not None:
            by_reference = self._by_reference.judge(self._inflation)
        return CrackFindings(by_load, by_reference, self._doubt(by_load, speed_rad_s))

    def _doubt(self, by_load: CrackEstimate, speed_rad_s: float) -> str:
        """Return why the change with the load cannot vouch for a sound shaft, '' where it can."""
        if all(fit.bend_change_m() < _LEAST_CHANGE_M for fit in self._by_load.values()):
            # the static bend is 2 g/W for each unit of load factor
            load_factor = 0.5 * _LEAST_CHANGE_M * self._rigid_rad_s() ** 2 / GRAVITY_M_S2
            memory_s = self.config.memory_s
            span = 'minute' if memory_s == 60.0 else f'{memory_s:g} s'
            return f'the load has not changed by {load_factor:.2g} g in the last {span}'
        if speed_rad_s > _HIGHEST_SPEED * self._rigid_rad_s():
            return self._too_fast(speed_rad_s)
        # twice: what the fit takes for a probe's scale error makes a crack look that much smaller
        largest = by_load.ratio + 2.0 * by_load.resolution
        if largest > _LARGEST_UNSEEN_RATIO:
            return f'a crack of up to K = {largest:.2g} is not ruled out'
        return ''

    def _too_fast(self, speed_rad_s: float) -> str:
        return (
            f'at {speed_rad_s:.0f} rad/s a crack may be missed; the crack estimate can call a '
            f'shaft sound up to {_HIGHEST_SPEED * self._rigid_rad_s():.0f} rad/s'
        )

    def _rigid_rad_s(self) -> float:
        """Return the critical speed on rigid bearings, the mean of both directions."""
        return math.sqrt(float(np.mean(self._rigid)))

    def _least(self) -> CrackFindings:
        while self._time_s - self._recent[0][0] > 0.5 * self.config.memory_s:
            self._recent.popleft()
        needed = self._recent.maxlen or 1
        if len(self._recent) < needed:
            return CrackFindings(
                doubt=f'the crack estimate has {len(self._recent)} of the {needed} windows '
                f'({_PERSISTENCE_REVOLUTIONS} revolutions) that it needs'
            )
        findings = [finding for _, finding in self._recent]
        return CrackFindings(
            min((each.by_load for each in findings), key=_lowest),
            min((each.by_reference for each in findings), key=_lowest),
            next((each.doubt for each in reversed(findings) if each.doubt), ''),
        )


def _lowest(estimate: CrackEstimate) -> float:
    return estimate.lowest


class _Products:
    """Weighted products of all pairs of columns of the fit, by order, with decaying weights.

    Real and imaginary part of a column are two rows; `sums` is (orders, columns, columns).
    """

    def __init__(self, columns: int) -> None:
        self.windows = 0.0
        self.weight = np.zeros(len(CRACK_ORDERS))
        self.sums = np.zeros((len(CRACK_ORDERS), columns, columns))

    def age(self, keep: float) -> None:
        """Multiply the weight of all windows so far by `keep`."""
        self.windows *= keep
        self.weight *= keep
        self.sums *= keep

    def add(self, columns: Complex, weights: Real) -> None:
        """Take a window's columns, (orders, columns)."""
        self.windows += 1.0
        self.weight += weights
        rows = np.stack((columns.real, columns.imag), axis=1)
        self.sums += weights[:, None, None] * (rows.transpose(0, 2, 1) @ rows)

    def variance(self, rest: Real, inflation: float) -> Real:
        """Return the variance of a window's real or imaginary part from the sum of squares `rest`.

        No window is better than _LEAST_ERROR_M: a motion that repeats exactly proves nothing.
        """
        rest = np.maximum(rest, _LEAST_ERROR_M**2 * self.weight[:, None])
        degrees = max(self.windows - 3.0 * inflation, 1.0)
        return inflation * 0.5 * rest / degrees


class _ReferenceFit:
    """Least-squares fit of a crack at each of BETAS_RAD to the loads beyond the reference."""

    def __init__(self) -> None:
        self._products = _Products(1 + len(BETAS_RAD))

    def age(self, keep: float) -> None:
        """Multiply the weight of all windows so far by `keep`."""
        self._products.age(keep)

    def add(self, loads: Complex, unit: Complex, weights: Real) -> None:
        """Take a window: loads (orders,) in m beyond the reference, unit (orders, betas) in m."""
        self._products.add(np.column_stack((loads, unit)), weights)

    def judge(self, inflation: float) -> CrackEstimate:
        """Return the crack at the angle with the highest lower bound."""
        products = self._products
        power, right = products.sums[:, 0, 0], products.sums[:, 0, 1:]
        left = _squares(products.sums[:, 1:, 1:])
        left = np.maximum(left, _LEAST_SQUARE_M2)
        ratio = right / left
        variance = products.variance(power[:, None] - ratio**2 * left, inflation)
        size = np.sqrt(left / products.weight[:, None])
        return _best(ratio, ratio - _CERTAINTY * np.sqrt(variance / left) - _LEVEL_ERROR_M / size)


class _LoadFit:
    """Least-squares fit of the terms of a sound machine and a crack at each of BETAS_RAD to q.

    Columns: a constant and the square of the speed, each as real and imaginary; the two scale
    errors; q; the cracks.
    """

    def __init__(self) -> None:
        self._products = _Products(_COLUMNS)
        self._bends: list[float | complex] = [0.0, 0.0]  # sums of the static bend and its square

    def age(self, keep: float) -> None:
        """Multiply the weight of all windows so far by `keep`."""
        self._products.age(keep)
        self._bends = [keep * each for each in self._bends]

    def add(self, drift: Real, found: EquivalentLoads, unit: Complex, static_bend: complex) -> None:
        """Take a window; `unit` (orders, betas) in m, `static_bend` is y + i z in m."""
        drifts = np.broadcast_to(np.concatenate((drift, 1j * drift)), (len(CRACK_ORDERS), 4))
        columns = np.column_stack((drifts, found.gain_slopes, found.loads, unit))
        self._products.add(columns, found.weights)
        self._bends = [self._bends[0] + static_bend, self._bends[1] + abs(static_bend) ** 2]

    def judge(self, inflation: float) -> CrackEstimate:
        """Return the crack at the angle with the highest lower bound."""
        products = self._products
        sums = self._without_drift()
        gains, load, cracks = sums[:, :2], sums[:, 2], sums[:, 3:]
        power, gain_load, crack_load = load[:, 2], load[:, :2], load[:, 3:]
        gain_gain, gain_crack = gains[:, :, :2], gains[:, :, 3:]
        # never divide by the rounding error of two equal sums, nor by a crack that never opens
        least = 1e-12 * _squares(products.sums[:, _FIRST_CRACK:, _FIRST_CRACK:]) + _LEAST_SQUARE_M2
        alone = np.maximum(_squares(cracks[:, :, 3:]), least)
        ratio, variance = crack_load / alone, np.zeros_like(alone)
        for _ in range(_ROUNDS):
            model_error = (_MODEL_ERROR * ratio) ** 2 * alone
            prior = np.maximum(np.maximum(variance, NOISE_M**2), model_error) / _GAIN_SPREAD**2
            inverse = np.linalg.inv(gain_gain[:, None] + prior[:, :, None, None] * np.eye(2))
            of_load = (inverse @ gain_load[:, None, :, None])[..., 0]
            of_crack = np.einsum('obij,ojb->obi', inverse, gain_crack)
            left = np.maximum(alone - np.einsum('oib,obi->ob', gain_crack, of_crack), least)
            right = crack_load - np.einsum('oib,obi->ob', gain_crack, of_load)
            ratio = right / left
            # K is real: what does not lie along the crack's axis stays unexplained
            explained = np.einsum('oi,obi->ob', gain_load, of_load) + ratio**2 * left
            variance = products.variance(power[:, None] - explained, inflation)
        found = _best(ratio, ratio - _CERTAINTY * np.sqrt(variance / left))
        if self.bend_change_m() < _LEAST_CHANGE_M:
            return replace(found, lowest=min(found.lowest, 0.0))
        return found

    def bend_change_m(self) -> float:
        """Return the RMS change of the static bend within the memory, in m."""
        count = self._products.windows
        total, square = self._bends
        return math.sqrt(max(abs(square) / count - abs(total / count) ** 2, 0.0))

    def _without_drift(self) -> Real:
        """Return the products of the other columns without the part that the drift explains.

        The term with the square of the speed has a prior about 0 with the spread of a runout: it
        keeps the fit determined at constant speed.
        """
        sums = self._products.sums
        prior = np.zeros((len(CRACK_ORDERS), 4, 4))
        spread = (NOISE_M / _RUNOUT_SPREAD_M) ** 2 + 1e-12 * self._products.weight
        prior[:, 1, 1] = prior[:, 3, 3] = spread
        with_drift = sums[:, :4, 4:]
        explained = np.linalg.solve(sums[:, :4, :4] + prior, with_drift)
        return np.asarray(sums[:, 4:, 4:] - with_drift.transpose(0, 2, 1) @ explained)


def _squares(products: Real) -> Real:
    return np.diagonal(products, axis1=1, axis2=2)


def _best(ratio: Real, lowest: Real) -> CrackEstimate:
    """Return the crack where the lesser bound of both orders is highest; args (orders, betas)."""
    of_both = lowest.min(axis=0)
    best = int(np.argmax(of_both))
    # the vertex of a parabola through the best angle and its neighbours
    before, here, after = of_both[[best - 1, best, (best + 1) % len(BETAS_RAD)]]
    curvature = 2.0 * here - before - after
    step = 0.5 * (after - before) / curvature if curvature > 0.0 else 0.0
    angle = BETAS_RAD[best] + step * BETAS_RAD[1]
    return CrackEstimate(
        ratio=float(ratio[:, best].min()),
        lowest=float(here),
        angle_rad=math.remainder(float(angle), 2.0 * math.pi),
        resolution=float((ratio - lowest)[:, best].max()),
    )
