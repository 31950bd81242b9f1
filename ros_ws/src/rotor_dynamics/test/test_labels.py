# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A label never contradicts the exponent beside it, nor the same motion at twice the steps."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from rotor_dynamics import (
    OperatingPoint,
    Sweep,
    lyapunov_diagram,
    lyapunov_exponent,
    orbit_diagram,
    parameter_map,
    poincare_section,
)
from rotor_dynamics.labels import BATCH, NO_EXPONENT, label_motions
from rotor_dynamics.surveys import Plan
from rotor_sim import RotorParameters

Array = NDArray[np.float64]

POINTS = 300
NOW = np.arange(POINTS)
CHAOS = np.random.default_rng(5).uniform(size=POINTS)
TORUS = np.sin(0.0846 * 2.0 * np.pi * NOW)
PERIODIC = np.array([1.0, 2.0, 4.0])[NOW % 3]
GONE = np.full(POINTS, np.nan)
NONE = (np.nan, np.nan)
SECTIONS = {'chaos': CHAOS, 'torus': TORUS, 'periodic': PERIODIC, 'gone': GONE}


def measured(
    section: Array, exponent: tuple[float, float], finer: tuple[Array, tuple[float, float]] | None
) -> Mapping[str, NDArray[Any]]:
    """Return the arrays of one point: its section, exponent and error at N, and those at 2N."""
    arrays = {
        'y': section[None],
        'z': section[None],
        'exponent': np.array(exponent[:1]),
        'standard_error': np.array(exponent[1:]),
        'diverged_at': np.array([7.0 if np.isnan(section).any() else np.nan]),
        'steps_per_revolution': np.array([256]),
    }
    if finer is not None:
        arrays |= {'finer_y': finer[0][None], 'finer_z': finer[0][None]}
        arrays |= {
            'finer_exponent': np.array(finer[1][:1]),
            'finer_standard_error': np.array(finer[1][1:]),
        }
    return arrays


UP, DOWN, OPEN = (0.05, 0.005), (-0.01, 0.002), (0.003, 0.0015)


@pytest.mark.parametrize(
    ('section', 'exponent', 'finer', 'label', 'reason'),
    [
        (CHAOS, UP, None, 'chaotic', ''),
        (CHAOS, NONE, None, 'undecided', NO_EXPONENT),
        (CHAOS, DOWN, None, 'undecided', 'irregular, but the exponent is negative'),
        (CHAOS, OPEN, None, 'undecided', 'the exponent is not told from zero'),
        (TORUS, UP, None, 'undecided', 'regular, but the exponent is positive'),
        (PERIODIC, UP, None, 'undecided', 'repeats, but the exponent is positive'),
        (TORUS, NONE, None, 'quasi-periodic', ''),
        (PERIODIC, DOWN, None, 'periodic', ''),
        (CHAOS[:50], NONE, None, 'undecided', 'fewer than 100 points'),
        (GONE, NONE, None, 'diverged', 'left the model in revolution 7'),
        (CHAOS, UP, (CHAOS, UP), 'chaotic', ''),
        # as figure, K = 0.225: hops at 256 steps, stays at 512
        (CHAOS, UP, (TORUS, DOWN), 'undecided', '0.0500 +- 0.0050) with 256 steps a revolution'),
        (CHAOS, UP, (CHAOS, OPEN), 'undecided', 'undecided (exponent 0.0030 +- 0.0015) with 512'),
        (CHAOS, UP, (GONE, NONE), 'undecided', 'diverged with 512'),
        (TORUS, DOWN, (TORUS, DOWN), 'quasi-periodic', ''),
        (TORUS, DOWN, (CHAOS, DOWN), 'quasi-periodic', ''),  # blurred, but as stable
        (TORUS, DOWN, (CHAOS, UP), 'undecided', 'chaotic (exponent 0.0500 +- 0.0050) with 512'),
        (TORUS, DOWN, (TORUS, UP), 'undecided', 'undecided (exponent 0.0500'),
        (TORUS, NONE, (PERIODIC, NONE), 'undecided', 'periodic with 512'),
        (TORUS, NONE, (CHAOS, NONE), 'quasi-periodic', ''),  # chaos needs an exponent there too
        (GONE, NONE, (TORUS, DOWN), 'diverged', 'quasi-periodic (exponent -0.0100'),
        (GONE, NONE, (GONE, NONE), 'diverged', 'left the model in revolution 7'),
        (CHAOS, DOWN, (CHAOS, UP), 'undecided', 'irregular, but the exponent is negative'),
    ],
)
def test_rule(
    section: Array,
    exponent: tuple[float, float],
    finer: tuple[Array, tuple[float, float]] | None,
    label: str,
    reason: str,
) -> None:
    found = label_motions(measured(section, exponent, finer))
    assert found['label'].tolist() == [label]
    assert reason in found['reason'][0]
    assert bool(found['reason'][0]) == (label in {'undecided', 'diverged'})


numbers = st.tuples(st.floats(-0.1, 0.1) | st.just(np.nan), st.floats(0.0, 0.02))


@given(
    at_n=st.sampled_from(sorted(SECTIONS)),
    at_2n=st.sampled_from(sorted(SECTIONS)),
    exponent=numbers,
    finer=numbers,
)
def test_no_label_contradicts_an_exponent(
    at_n: str, at_2n: str, exponent: tuple[float, float], finer: tuple[float, float]
) -> None:
    arrays = measured(SECTIONS[at_n], exponent, (SECTIONS[at_2n], finer))
    (label,) = label_motions(arrays)['label']
    positive = [value > 3.0 * error for value, error in (exponent, finer)]
    if label == 'chaotic':
        assert all(positive)
    if label in {'periodic', 'quasi-periodic'}:
        assert not any(positive)


def test_each_of_many_points_is_labelled_as_alone() -> None:
    one = measured(CHAOS, UP, (TORUS, DOWN))
    other = measured(TORUS, DOWN, (TORUS, DOWN))
    count = BATCH + 3
    many = {name: np.concatenate([one[name], *(count - 1) * [other[name]]]) for name in one}
    found = label_motions(many)
    assert found['label'].tolist() == ['undecided', *(count - 1) * ['quasi-periodic']]
    assert found['reason'][0] == label_motions(one)['reason'][0]
    assert set(found['reason'][1:]) == {''}


FIGURE = RotorParameters.hou2016('figure', crack_stiffness_ratio=0.225)
WHERE: dict[str, Any] = {'speed_rad_s': 352.0, 'load_factor': 3.0}


def test_the_label_of_one_motion_rests_on_its_exponent() -> None:
    """figure, K = 0.225: its section alone looks chaotic at some steps, its exponent says no."""
    for steps in (256, 512):
        plan = Plan(300, 300, steps, exponent_revolutions=500)
        found = poincare_section(OperatingPoint(FIGURE, **WHERE), plan)
        exponent, error = found.evidence_exponent, found.evidence_standard_error
        assert np.isfinite(exponent)
        assert found.label != 'chaotic' or exponent > 3.0 * error
        alone = lyapunov_exponent(
            FIGURE, **WHERE, steps_per_revolution=steps, transient_revolutions=600
        )
        assert exponent == alone.exponent  # over the 500 revolutions after the 300 recorded


@pytest.mark.slow
def test_no_diagram_calls_a_motion_chaotic_whose_exponent_is_not_positive() -> None:
    point = OperatingPoint(FIGURE, **WHERE)
    sweep = Sweep('K', np.linspace(0.15, 0.25, 6))
    orbits = orbit_diagram(point, sweep, Plan(200))
    assert 'chaotic' not in orbits.label
    plan = Plan(200, 300, exponent_revolutions=200)
    exponents = lyapunov_diagram(point, sweep, plan)
    grid = parameter_map(point, (sweep, Sweep('G', [3.0])), plan)
    for found in (exponents, grid):
        chaotic = found.label == 'chaotic'
        positive = found.exponent > 3.0 * found.standard_error
        assert positive.values[chaotic.values].all()
        regular = found.label.isin(['periodic', 'quasi-periodic'])
        assert not positive.values[regular.values].any()
    undecided = orbits.label == 'undecided'
    assert all(orbits.reason.values[undecided])
    assert not any(orbits.reason[orbits.label == 'quasi-periodic'])
