# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Every statement of the paper is judged, from data, and failures never count as agreement."""

import copy
import dataclasses
import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from paper_worlds import DIAGRAMS, FACTS, changed, diverged, world
from rotor_bringup.paper import judging
from rotor_bringup.paper.claim import Claim
from rotor_bringup.paper.claims import claims
from rotor_bringup.paper.judging import AGREES, DOES_NOT, PARTLY, Results, Sweeps
from rotor_bringup.plain_json import without_nan
from rotor_sim.analysis import Survey

CLAIMS = claims(FACTS)
NAMES = [claim.name for claim in CLAIMS]


@pytest.fixture(scope='module')
def worlds() -> dict[str, Results]:
    return {level: world(level) for level in (AGREES, PARTLY, DOES_NOT)}


def leaves(facts: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    children = facts.items() if isinstance(facts, dict) else enumerate(facts)
    for key, value in children:
        if isinstance(value, dict | list):
            yield from leaves(value, (*path, key))
        else:
            yield (*path, key)


def another(facts: Any, path: tuple[Any, ...]) -> Any:
    """Return the facts with one leaf changed: a number a little larger, a text longer."""
    made = copy.deepcopy(facts)
    place = made
    for key in path[:-1]:
        place = place[key]
    old = place[path[-1]]
    place[path[-1]] = old + ' (changed)' if isinstance(old, str) else old * 1.5 + 0.125
    return made


@pytest.mark.parametrize('path', list(leaves(FACTS)), ids=lambda path: '.'.join(map(str, path)))
def test_every_fact_is_part_of_a_claim(path: tuple[Any, ...]) -> None:
    """Changing any leaf of the facts changes what some claim says the paper says."""
    before = {(claim.name, claim.paper) for claim in CLAIMS}
    after = {(claim.name, claim.paper) for claim in claims(another(FACTS, path))}
    assert after != before


def test_names_are_unique_and_the_diagrams_exist() -> None:
    assert len(set(NAMES)) == len(NAMES)
    for claim in CLAIMS:
        assert set(claim.needs) <= set(DIAGRAMS), claim.name


@pytest.mark.parametrize('claim', CLAIMS, ids=NAMES)
@pytest.mark.parametrize('level', [AGREES, PARTLY, DOES_NOT])
def test_every_claim_can_get_every_verdict(
    claim: Claim, level: str, worlds: dict[str, Results]
) -> None:
    verdict = claim.evaluate(worlds[level])
    assert verdict is not None
    assert verdict.verdict == level, verdict.why
    assert verdict.why
    assert verdict.unconverged == 0
    json.dumps(without_nan(verdict.value), allow_nan=False)


@pytest.mark.parametrize('claim', CLAIMS, ids=NAMES)
def test_nothing_agrees_where_everything_diverged(claim: Claim, worlds: dict[str, Results]) -> None:
    nothing = changed(worlds[AGREES], lambda survey: diverged(survey, slice(None)))
    verdict = claim.evaluate(nothing)
    assert verdict is not None
    assert verdict.verdict == DOES_NOT
    assert verdict.lost == verdict.points > 0


@pytest.mark.parametrize('claim', CLAIMS, ids=NAMES)
@pytest.mark.parametrize('row', [0, 3, -1])
def test_a_diverged_point_is_said_and_keeps_a_claim_from_agreeing(
    claim: Claim, row: int, worlds: dict[str, Results]
) -> None:
    def lose(survey: Survey) -> Survey:
        return diverged(survey, slice(row, row + 1 or None))

    verdict = claim.evaluate(changed(worlds[AGREES], lose))
    assert verdict is not None
    if claim.index is None or claim.index == row % 4:
        assert verdict.verdict != AGREES
        assert 'diverged' in verdict.why
        assert verdict.lost


@pytest.mark.parametrize('claim', CLAIMS, ids=NAMES)
def test_points_that_did_not_converge_are_said(claim: Claim, worlds: dict[str, Results]) -> None:
    def loosen(survey: Survey) -> Survey:
        return dataclasses.replace(survey, converged=np.zeros(len(survey), np.bool_))

    verdict = claim.evaluate(changed(worlds[AGREES], loosen))
    assert verdict is not None
    assert verdict.unconverged == verdict.points
    assert 'did not converge at 2N steps' in verdict.why


@pytest.mark.parametrize('claim', CLAIMS, ids=NAMES)
def test_convergence_is_unknown_where_it_was_not_checked(
    claim: Claim, worlds: dict[str, Results]
) -> None:
    def unchecked(survey: Survey) -> Survey:
        return dataclasses.replace(
            survey,
            plan=dataclasses.replace(survey.plan, check_steps=False),
            converged=np.zeros(len(survey), np.bool_),
        )

    verdict = claim.evaluate(changed(worlds[AGREES], unchecked))
    assert verdict is not None
    assert verdict.unconverged is None
    assert verdict.verdict == AGREES


def test_a_claim_without_its_diagram_has_no_verdict() -> None:
    nothing = Results(DIAGRAMS, {}, {}, {})
    assert all(claim.evaluate(nothing) is None for claim in CLAIMS)


def test_hysteresis_is_a_jump_without_a_step() -> None:
    x = np.linspace(0.0, 10.0, 101)
    smooth = (x / 10.0)[:, None] * np.ones(20)
    apart = smooth + 0.3 * ((x > 4.0) & (x < 6.0))[:, None]
    found = judging.jumps(smooth, x, Sweeps(x, smooth, apart))
    assert found.verdict == AGREES
    # 0.3 over the range 1.0 of both sweeps
    assert found.value['largest_hysteresis'] == pytest.approx(0.3)
    assert judging.jumps(smooth, x, Sweeps(x, smooth, smooth)).verdict == DOES_NOT


def test_chaos_that_changes_from_value_to_value_is_no_jump() -> None:
    rng = np.random.default_rng(7)
    chaos = rng.uniform(-1.0, 1.0, (200, 30))
    assert judging.jumps(chaos, np.linspace(0.0, 10.0, 200), None).verdict == DOES_NOT


@pytest.mark.parametrize(
    ('exponent', 'error', 'expected'),
    [
        (0.01, 1e-4, True),
        (0.01, 0.004, False),  # 2.5 standard errors
        (0.0015, 1e-5, False),  # less than 500 revolutions can tell
        (-0.01, 1e-5, False),
        (np.nan, 1e-5, False),
        (0.01, np.nan, False),
    ],
)
def test_positive_means_beyond_the_errors(exponent: float, error: float, expected: bool) -> None:
    survey = next(iter(world(AGREES).surveys.values()))[:1]
    survey = dataclasses.replace(
        survey, exponent=np.array([exponent]), standard_error=np.array([error])
    )
    assert judging.positive(survey).tolist() == [expected]


@pytest.mark.parametrize(
    ('low', 'high', 'expected'),
    [
        (0.0, 1.0, AGREES),
        (-0.09, 1.09, AGREES),  # within a slack of a tenth
        (0.4, 0.5, PARTLY),  # within, but an axis had been narrower
        (-2.0, 2.0, PARTLY),  # shares a quarter
        (-20.0, 20.0, DOES_NOT),  # covers the ticks forty times
        (1.2, 2.0, DOES_NOT),
        (np.nan, np.nan, DOES_NOT),
    ],
)
def test_ranges_against_ticks(low: float, high: float, expected: str) -> None:
    assert judging.against_ticks(np.array([low, high]), [0.0, 1.0], 'Z').verdict == expected


@given(
    low=st.floats(-10.0, 10.0),
    span=st.floats(1e-3, 10.0),
    scale=st.floats(1e-3, 1e3),
    shift=st.floats(-10.0, 10.0),
)
def test_a_verdict_on_ticks_does_not_depend_on_the_unit(
    low: float, span: float, scale: float, shift: float
) -> None:
    """Range and ticks scaled and shifted together; kept off the edges, where rounding decides."""
    values = np.array([low, low + span])
    inside, filled = (
        min(low, 1.0 - low - span) + judging.TICK_SLACK,
        span - judging.TICK_FILL,
    )
    union = max(low + span, 1.0) - min(low, 0.0)
    shared = max(0.0, min(low + span, 1.0) - max(low, 0.0)) / union - judging.TICK_OVERLAP
    assume(min(abs(inside), abs(filled), abs(shared)) > 1e-6)
    one = judging.against_ticks(values, [0.0, 1.0], 'Z')
    other = judging.against_ticks(scale * values + shift, [shift, scale + shift], 'Z')
    assert one.verdict == other.verdict


@given(
    values=arrays(np.float64, (6, 5), elements=st.floats(-1e3, 1e3)),
    row=st.integers(0, 5),
)
def test_amplitudes_with_nan_never_agree(values: NDArray[np.float64], row: int) -> None:
    x = np.arange(6.0)
    column = np.abs(values[:, 0])
    column[row] = np.nan
    with np.errstate(all='ignore'):
        assert judging.grows({'Y': column}, x).verdict != AGREES
        assert judging.unchanged({'Y': column}).verdict == DOES_NOT


@pytest.mark.parametrize('claim', CLAIMS, ids=NAMES)
def test_exponents_without_saltation_are_told_and_judge_nothing(
    claim: Claim, worlds: dict[str, Results]
) -> None:
    def jumping(survey: Survey) -> Survey:
        return dataclasses.replace(survey, naive_exponent=np.full(len(survey), 0.5))

    def smooth(survey: Survey) -> Survey:
        return dataclasses.replace(survey, naive_exponent=np.full(len(survey), np.nan))

    one = claim.evaluate(changed(worlds[AGREES], jumping))
    other = claim.evaluate(changed(worlds[AGREES], smooth))
    assert one is not None
    assert other is not None
    assert one.verdict == other.verdict == AGREES
    assert 'saltation' not in other.why
    over_exponents = ('range', 'chaos', 'hardly_positive', 'no_positive')
    if claim.rests_on == 'exponent' and any(name in claim.name for name in over_exponents):
        assert 'without saltation' in one.why
