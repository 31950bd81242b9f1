# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The baseline of one machine: what the crack estimate learns from healthy flights.

Near half the critical speed q_n is a small difference of large terms: there a probe that reads 5 %
too much looks like a crack, and so does a damping of another size. But in healthy flights q_n at
1x, 2x and 3x is a constant (unbalance, runout, misalignment) and one term with the square of the
speed, and 0 on the ball-pass line, which no fault of the shaft drives. So the shaft's stiffness,
its damping and the errors of the bearings' probes against the disk's are those that leave the least
beside these terms. (An error that all probes of a direction share changes nothing: K is a ratio.)
"""

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from vibration_monitor.crack_model import (
    NOISE_M,
    ORBIT_ORDERS,
    PROBES,
    RELATIVE_ERROR,
    Complex,
    CrackBaseline,
    CrackConfig,
    CrackWindow,
    Real,
    drift_terms,
    equivalent_loads,
)
from vibration_monitor.errors import MonitorError

_SPREADS = np.array([0.03, 0.005, 0.05, 0.05, 0.03, 0.03])
"""Expected size of the errors: stiffness (share), damping ratio, and as shares the scales and the
cross axes of the bearings' probes."""

_ALIKE_WINDOWS = 5.0
"""Number of consecutive windows that share their errors: they overlap, and a maneuver lasts."""

_ROUNDS = 5
"""Rounds of weighting; the weights settle after three."""

_OUTLIER = 2.0
"""Residuals beyond this many standard deviations have less weight, as in a Cauchy fit."""


def learn_baseline(
    windows: Iterable[CrackWindow], config: CrackConfig, ball_pass_order: float
) -> CrackBaseline:
    """Return the baseline of one machine from healthy windows of different loads and speeds.

    Raises:
        MonitorError: there is no window with all six probes.

    """
    known = [
        window for window in windows if window.is_complete() and np.isfinite(window.ball_pass).all()
    ]
    if not known:
        raise MonitorError(
            'the reference flights hold no whole window with all of ' + ', '.join(PROBES)
        )
    errors = np.array([_probe_errors(known, config, ball_pass_order, i) for i in (0, 1)])
    rigid = config.rigid_critical_speed_rad_s**2 / (1.0 - errors[:, 0])
    # fitted with the configured W; what the fit determines is xi / W
    damping = (config.damping_ratio + errors[:, 1]) / (1.0 - errors[:, 0])
    scaled = CrackBaseline(
        rigid_critical_speeds_rad_s=(math.sqrt(rigid[0]), math.sqrt(rigid[1])),
        damping_ratios=(float(damping[0]), float(damping[1])),
        bearing_scale_errors=tuple(errors[:, 2:4].T.ravel().tolist()),
        bearing_cross_axis=tuple(errors[:, 4:6].T.ravel().tolist()),
        constant_y_m=(0.0,) * 4,
        constant_z_m=(0.0,) * 4,
    )
    constant = _constant_terms([scaled.corrected(window) for window in known], rigid, damping)
    return scaled.model_copy(
        update={
            'constant_y_m': tuple(constant.real.ravel().tolist()),
            'constant_z_m': tuple(constant.imag.ravel().tolist()),
        }
    )


def _probe_errors(
    windows: Sequence[CrackWindow], config: CrackConfig, ball_pass_order: float, axis: int
) -> Real:
    """Return the errors that _SPREADS names in one direction, (6,); `axis` 0 is y, 1 is z.

    Linear least squares with a Gaussian prior, reweighted by the residual of each order.
    """
    lines = list(_lines(windows, config, ball_pass_order, axis))
    errors = np.zeros(len(_SPREADS))
    for _ in range(_ROUNDS):
        normal, right = np.diag(_SPREADS**-2.0), np.zeros(len(_SPREADS))
        for load, slopes in lines:
            rest = np.abs(load + slopes @ errors) ** 2
            variance = max(float(rest.mean()), 1.0)
            weights = 1.0 / variance / (1.0 + rest / variance / _OUTLIER**2) / _ALIKE_WINDOWS
            weighted = np.conj(slopes).T * weights
            normal += (weighted @ slopes).real
            right -= (weighted @ load).real
        errors = np.linalg.solve(normal, right)
    return errors


def _lines(
    windows: Sequence[CrackWindow], config: CrackConfig, ball_pass_order: float, axis: int
) -> Iterator[tuple[Complex, Complex]]:
    """Yield q (windows,) and its derivative by each error (windows, 6), over the noise, by order.

    The terms of a sound machine are removed from both.
    """
    vectors = np.array([np.column_stack((each.vectors, each.ball_pass)) for each in windows])
    square = np.array([each.speed_rad_s**2 for each in windows])
    drift = np.array([drift_terms(each) for each in windows])
    rigid = config.rigid_critical_speed_rad_s**2
    for place, order in enumerate((*ORBIT_ORDERS, ball_pass_order)):
        damping = 1.0 + 4.0j * config.damping_ratio * order * square / rigid
        disk, *bearings = (vectors[:, probe, place] for probe in (axis, 2 + axis, 4 + axis))
        others = (vectors[:, probe, place] for probe in (3 - axis, 5 - axis))
        inertia = 2.0 * order**2 * square / rigid * disk
        bent = 2.0 * disk - bearings[0] - bearings[1]
        damped = 4.0j * order * square / rigid * bent
        slopes = [inertia, damped, *(damping * motion for motion in (*bearings, *others))]
        load = damping * bent - inertia
        scale = 1.0 / np.hypot(NOISE_M, RELATIVE_ERROR * np.abs(inertia))
        columns = np.column_stack((load, *slopes)) * scale[:, np.newaxis]
        if order != ball_pass_order:
            terms = drift * scale[:, np.newaxis]
            columns -= terms @ np.linalg.lstsq(terms, columns, rcond=None)[0]
        yield columns[:, 0], columns[:, 1:]


def _constant_terms(windows: Sequence[CrackWindow], rigid: Real, damping: Real) -> Complex:
    """Return q without a crack: the constant and the term with the square of the speed, (2, 2)."""
    found = [equivalent_loads(window, rigid, damping) for window in windows]
    loads = np.array([each.loads for each in found])
    weights = np.array([each.weights for each in found])
    drift = np.array([drift_terms(window) for window in windows])
    constant = np.empty((2, 2), np.complex128)
    for order in range(2):
        root = np.sqrt(weights[:, order])
        terms = drift * root[:, np.newaxis]
        constant[:, order] = np.linalg.lstsq(terms, loads[:, order] * root, rcond=1e-3)[0]
    return constant
