# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Surveys and exponents against the reference table and against each other.

The table, docs/physics.md, was computed by a program of its own; see test_truth_rotor_reference
for its tolerances.
"""

from typing import Any

import numpy as np
import pytest

from rotor_dynamics import (
    Ensemble,
    LyapunovExponent,
    OperatingPoint,
    Plan,
    lyapunov_exponent,
    survey,
)
from rotor_dynamics.diagrams import Method
from rotor_dynamics.surveys import HARMONICS
from rotor_sim import RotorParameters

PRINTED = 5e-4
SCATTER = 2e-3
"""Of an exponent of 500 revolutions: physics.md, section 3."""


@pytest.mark.slow
def test_reference_table_by_survey(reference_table: list[Any]) -> None:
    points = [
        OperatingPoint(RotorParameters.hou2016(variant, **changes), float(speed), float(load))
        for variant, changes, speed, load, *_ in reference_table
    ]
    found = survey(points, Plan(1500, 300, 256, exponent_revolutions=500))
    scale = found.length_scale_m
    assert found.converged.all()
    assert (found.steps_per_revolution == 256).all()
    for n, (_, _, _, _, mean_y, amplitudes_z, *section_limits, exponent) in enumerate(
        reference_table
    ):
        assert abs(found.mean_y[n] / scale[n] - mean_y) < 2 * PRINTED
        orders = found.order_amplitude_z[n, : len(HARMONICS)] / scale[n]
        np.testing.assert_allclose(orders, amplitudes_z, rtol=0, atol=2 * PRINTED)
        for section, (low, high, decimals) in zip((found.y, found.z), section_limits, strict=True):
            # half a unit of the last printed digit, and as much for where the 300 points fall
            assert abs(section[n].min() / scale[n] - low) < 10.0**-decimals
            assert abs(section[n].max() / scale[n] - high) < 10.0**-decimals
        assert abs(found.exponent[n] - exponent) < SCATTER
    # physics.md: all of them follow the ball-pass order, with a negative exponent
    assert (found.label == 'quasi-periodic').all()
    jumping = np.array([variant != 'derived' for variant, *_ in reference_table])
    assert np.array_equal(np.isfinite(found.naive_exponent), jumping)


def exponent(
    variant: str,
    crack: float,
    *,
    method: Method = 'tangent',
    saltation: bool = True,
    revolutions: int = 500,
) -> LyapunovExponent:
    return lyapunov_exponent(
        RotorParameters.hou2016(variant, crack_stiffness_ratio=crack),
        speed_rad_s=352.0,
        load_factor=3.0,
        transient_revolutions=500,
        revolutions=revolutions,
        method=method,
        saltation=saltation,
    )


@pytest.mark.parametrize('crack', [0.1, 0.2])
def test_two_trajectories_and_tangents_agree_where_f_is_continuous(crack: float) -> None:
    tangent = exponent('derived', crack)
    pair = exponent('derived', crack, method='two_trajectories')
    # the same start and the same revolutions: what is left is that the neighbour is 1e-8 away,
    # and contact's stiffness bends like a root, 1e-4, in what little touches within that distance
    assert pair.exponent == pytest.approx(tangent.exponent, abs=1e-5)
    assert pair.standard_error == pytest.approx(tangent.standard_error, abs=1e-5)
    assert tangent.standard_error < SCATTER
    assert not np.array_equal(pair.running, tangent.running)  # it is another computation
    assert exponent('derived', crack, saltation=False).exponent == tangent.exponent


def test_saltation_decides_the_sign_where_f_jumps() -> None:
    """natural, K = 0.2: a negative exponent that looks positive to who does not see the jumps.

    Between two steps a neighbour 1e-8 away never sees a jump: the pair finds the same as tangents
    without saltation.
    """
    true = exponent('natural', 0.2, revolutions=400)
    naive = exponent('natural', 0.2, saltation=False, revolutions=400)
    pair = exponent('natural', 0.2, method='two_trajectories', revolutions=400)
    assert true.exponent < -3.0 * true.standard_error
    assert naive.exponent > 3.0 * naive.standard_error
    assert naive.exponent - true.exponent > 0.02
    error = np.hypot(pair.standard_error, naive.standard_error)
    assert abs(pair.exponent - naive.exponent) < 2.0 * error


def test_sign_with_saltation_holds_without_any_tangent() -> None:
    """natural, K = 0.2: neighbours so far apart that they cross steps apart draw together.

    200 revolutions are 1257 of tau: -0.005 leaves 1e-3 of a distance of 0.03, down to what a
    crossing seen a step late keeps apart: seen 0.003 to 0.01 at 8192 steps, twice that at 4096.
    +0.024 would be e^30: as far apart as the motion is wide.
    """
    parameters = RotorParameters.hou2016('natural', crack_stiffness_ratio=0.2)
    where = OperatingPoint(parameters, 352.0, 3.0)
    units = np.repeat([1.0, 352.0], 6) * parameters.length_scale_m
    ensemble = Ensemble([where], 8192)
    section = ensemble.advance(300, 1)[0, 100:, 0] / parameters.length_scale_m
    offsets = np.random.default_rng(4).standard_normal((8, 12)) * 1e-2
    crowd = Ensemble([where] * 8, 8192, ensemble.states + offsets * units, ensemble.revolution)
    crowd.advance(200)
    spread = np.ptp(crowd.states / units, axis=0)[:2].max()
    assert np.ptp(section) > 0.3
    assert np.ptp(offsets, axis=0)[:2].min() > 0.02
    assert spread < 0.01
