# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Every statement of the paper is judged, from data, and failures never count as agreement."""

import copy
import dataclasses
import json
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from paper_worlds import DIAGRAMS, FACTS, base, changed, diverged, world
from rotor_common.plain_data import without_nan
from rotor_dynamics import Survey
from rotor_paper import exponents, judging, run, spectra
from rotor_paper.claim import Claim, ClaimVerdict
from rotor_paper.claims import claims
from rotor_paper.figures import figures
from rotor_paper.judging import AGREES, DOES_NOT, PARTLY, Results, Sweeps

CLAIMS = claims(FACTS)
NAMES = [claim.name for claim in CLAIMS]

Change = Callable[[Survey, slice], Survey]


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


def only(results: Results, key: str, row: int, change: Change) -> Results:
    """Return results with one point of one diagram changed."""
    survey = change(results.surveys[key], slice(row, row + 1))
    return dataclasses.replace(results, surveys={**results.surveys, key: survey})


def unconverged(survey: Survey, rows: slice) -> Survey:
    converged = survey.converged.copy()
    converged[rows] = False
    return dataclasses.replace(survey, converged=converged)


def used(claim: Claim, results: Results, key: str) -> set[int]:
    every = range(len(results.surveys[key]))
    return set(every) if claim.rows is None else set(claim.rows(results, key).tolist())


@pytest.mark.parametrize('claim', CLAIMS, ids=NAMES)
def test_a_diverged_point_that_is_used_keeps_a_claim_from_agreeing(
    claim: Claim, worlds: dict[str, Results]
) -> None:
    results = worlds[AGREES]
    for key in claim.needs:
        rows = sorted(used(claim, results, key))
        for row in {rows[0], rows[len(rows) // 2], rows[-1]}:
            verdict = claim.evaluate(only(results, key, row, diverged))
            assert verdict is not None
            assert verdict.verdict != AGREES
            assert 'diverged' in verdict.why
            assert verdict.lost == 1


@pytest.mark.parametrize('claim', CLAIMS, ids=NAMES)
def test_a_point_that_is_not_used_changes_nothing(claim: Claim, worlds: dict[str, Results]) -> None:
    results = worlds[AGREES]
    before = claim.evaluate(results)
    for key in claim.needs:
        unused = sorted(set(range(len(results.surveys[key]))) - used(claim, results, key))
        for row in unused[:1] + unused[-1:]:
            for change in (diverged, unconverged):
                assert claim.evaluate(only(results, key, row, change)) == before


def test_a_resonance_without_a_value_near_it_is_not_found(worlds: dict[str, Results]) -> None:
    ends = worlds[AGREES].surveys['speed_at_G3'][np.array([0, -1])]  # 20 and 1000 rad/s
    coarse = Results(DIAGRAMS, {'speed_at_G3': ends}, {}, {})
    for claim in CLAIMS:
        if claim.name.startswith(('resonance', 'critical')):
            verdict = claim.evaluate(coarse)
            assert verdict is not None
            assert (verdict.verdict, verdict.points, verdict.lost) == (DOES_NOT, 0, 0)
            assert 'diverged' not in verdict.why


def test_claims_use_the_points_they_are_about(worlds: dict[str, Results]) -> None:
    """Values of the parameter by hand: 5 rad/s and 30/196 um apart."""
    results, named = worlds[AGREES], {claim.name: claim for claim in CLAIMS}

    def values(name: str) -> list[float]:
        key = named[name].needs[0]
        return sorted(results.swept(key)[list(used(named[name], results, key))])

    assert values('fig9_motion') == [431.0]
    assert values('fig9_z_range') == [431.0]
    np.testing.assert_allclose(values('fig15_quasi_periodic'), [0.1, 0.125])
    np.testing.assert_allclose(values('resonance_542'), np.arange(490.0, 596.0, 5.0))
    speeds = values('critical_speed')  # 263, 352, 431 and 542 rad/s, 10 % either side
    assert (speeds[0], speeds[-1]) == (240.0, 595.0)
    assert 300.0 not in speeds
    lowest = values('fig17_leading_orders')[0]
    assert 13e-6 < lowest < 13e-6 + 30e-6 / 196


@pytest.mark.parametrize('claim', CLAIMS, ids=NAMES)
def test_a_claim_does_not_agree_where_most_points_did_not_converge(
    claim: Claim, worlds: dict[str, Results]
) -> None:
    loose = changed(worlds[AGREES], lambda survey: unconverged(survey, slice(None)))
    verdict = claim.evaluate(loose)
    assert verdict is not None
    assert verdict.verdict == PARTLY
    assert verdict.unconverged == verdict.points
    assert 'did not converge at 2N steps' in verdict.why


def test_half_of_the_points_may_be_unconverged(worlds: dict[str, Results]) -> None:
    claim = next(claim for claim in CLAIMS if claim.name == 'fig14_chaos')
    for share, expected in ((98, AGREES), (99, PARTLY)):  # of 197
        survey = unconverged(worlds[AGREES].surveys['K'], slice(0, share))
        verdict = claim.evaluate(
            dataclasses.replace(worlds[AGREES], surveys={**worlds[AGREES].surveys, 'K': survey})
        )
        assert verdict is not None
        assert (verdict.verdict, verdict.unconverged) == (expected, share)


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
    assert 'not checked at 2N' in found.why
    assert judging.jumps(smooth, x, Sweeps(x, smooth, smooth)).verdict == DOES_NOT


def test_sweeps_that_differ_at_one_value_only_have_no_hysteresis() -> None:
    x = np.linspace(0.0, 10.0, 101)
    smooth = (x / 10.0)[:, None] * np.ones(20)
    for count, expected in ((1, DOES_NOT), (2, AGREES)):
        apart = smooth.copy()
        apart[50 : 50 + count] += 0.3
        assert judging.jumps(smooth, x, Sweeps(x, smooth, apart)).verdict == expected
    apart[50] = np.nan  # of two values one diverged
    assert judging.jumps(smooth, x, Sweeps(x, smooth, apart)).verdict == DOES_NOT


def test_sweeps_whose_own_halves_differ_as_much_have_no_hysteresis() -> None:
    """A section that drifts by 0.2 from half to half; sweeps 0.5 or 0.7 apart: 3 x 0.2 = 0.6."""
    x = np.linspace(0.0, 10.0, 101)
    drifting = (x / 10.0)[:, None] + 0.2 * (np.arange(20) >= 10)
    for by, expected in ((0.5, DOES_NOT), (0.7, AGREES)):
        found = judging.jumps(drifting, x, Sweeps(x, drifting, drifting + by))
        assert found.verdict == expected


def test_sweeps_over_chaos_have_no_hysteresis() -> None:
    """Independent sections of 50 points of one distribution, as both sweeps have in chaos."""
    rng = np.random.default_rng(11)
    up, down = rng.uniform(-1.0, 1.0, (2, 200, 50))
    x = np.linspace(0.0, 10.0, 200)
    found = judging.jumps(up, x, Sweeps(x, up, down))
    assert found.value['largest_hysteresis'] == 0.0
    assert found.verdict == DOES_NOT


def test_sweeps_that_diverged_have_no_hysteresis() -> None:
    x = np.linspace(0.0, 10.0, 5)
    lines, nothing = np.ones((5, 4)) * x[:, None], np.full((5, 4), np.nan)
    found = judging.jumps(lines, x, Sweeps(x, nothing, lines))
    assert np.isnan(found.value['largest_hysteresis'])
    assert 'not finite' in found.why


def test_chaos_that_changes_from_value_to_value_is_no_jump() -> None:
    rng = np.random.default_rng(7)
    chaos = rng.uniform(-1.0, 1.0, (200, 30))
    assert judging.jumps(chaos, np.linspace(0.0, 10.0, 200), None).verdict == DOES_NOT


def test_a_step_or_hysteresis_is_no_absence_of_a_jump() -> None:
    x = np.linspace(0.0, 10.0, 101)
    smooth = (x / 10.0)[:, None] * np.ones(20)
    for height, expected in ((0.0, AGREES), (0.03, AGREES), (0.08, PARTLY), (0.5, DOES_NOT)):
        stepped = smooth + height * (x > 5.0)[:, None]
        assert judging.no_jump(stepped, x, Sweeps(x, stepped, stepped)).verdict == expected
        apart = smooth + height * ((x > 4.0) & (x < 6.0))[:, None]
        assert judging.no_jump(smooth, x, Sweeps(x, smooth, apart)).verdict == expected
    nothing = np.full_like(smooth, np.nan)
    assert judging.no_jump(smooth, x, Sweeps(x, nothing, smooth)).verdict == DOES_NOT
    assert judging.no_jump(nothing, x, None).verdict == DOES_NOT


def test_a_spectrum_of_lines_is_not_continuous_and_one_of_noise_is() -> None:
    """1000 bins: 12 lines of three bins fill 4 %; noise fills all, with a tenth of the line."""
    rng = np.random.default_rng(3)
    lines = np.full(1000, 1e-6)
    for at in range(50, 650, 50):
        lines[at - 1 : at + 2] = [0.5, 1.0, 0.5]
    noise = np.maximum(lines, 0.1 * rng.uniform(size=1000))
    floors = spectra.continuum(np.array([lines, noise]))
    np.testing.assert_allclose(floors, [1e-6, 0.05], rtol=0.2)
    assert (floors >= spectra.CONTINUUM).tolist() == [False, True]


@pytest.mark.parametrize(('count', 'expected'), [(0, DOES_NOT), (1, PARTLY), (3, AGREES)])
def test_peaks_are_counted_above_the_scatter(count: int, expected: str) -> None:
    survey = base(DIAGRAMS['G_at_263'])
    x = DIAGRAMS['G_at_263'].swept(survey.points)
    exponent = np.where(np.arange(x.size) % 2, -0.0095, -0.01)  # scatter
    exponent[10 : 10 + 20 * count : 20] += 0.005
    found = exponents.peaks(dataclasses.replace(survey, exponent=exponent), x)
    assert (found.verdict, found.value['peaks']) == (expected, count)
    near = dataclasses.replace(survey, exponent=exponent + 0.004)
    assert exponents.peaks(near, x, near_zero=True).value['peaks'] == count
    assert exponents.peaks(survey, x, near_zero=True).value['peaks'] == 0


def test_figures_that_a_claim_compares_are_computed_together() -> None:
    every = figures(FACTS)
    groups = run._groups([every[number] for number in (5, 6, 14, 15, 16)], CLAIMS)
    assert [[figure.number for figure in group] for group in groups] == [[5, 6], [14, 16], [15]]


@pytest.mark.parametrize(
    ('exponent', 'error', 'finer', 'expected'),
    [
        (0.01, 1e-4, 0.012, True),
        (0.01, 0.004, 0.012, False),  # 2.5 standard errors
        (0.0015, 1e-5, 0.0015, False),  # less than 500 revolutions can tell
        (-0.01, 1e-5, 0.012, False),
        (np.nan, 1e-5, 0.012, False),
        (0.01, np.nan, 0.012, False),
        (0.01, 1e-4, -0.001, False),  # another sign with 2N steps
        (0.01, 1e-4, np.nan, False),  # diverged with 2N steps
    ],
)
def test_positive_means_beyond_the_errors_and_at_2n_too(
    exponent: float, error: float, finer: float, expected: bool
) -> None:
    survey = dataclasses.replace(
        base(DIAGRAMS['K'])[:1],
        exponent=np.array([exponent]),
        standard_error=np.array([error]),
        exponent_difference=np.abs([exponent - finer]),
    )
    assert exponents.positive(survey).tolist() == [expected]
    unchecked = dataclasses.replace(survey.plan, check_steps=False)
    survey = dataclasses.replace(survey, plan=unchecked)
    assert exponents.positive(survey).tolist() == [exponent == 0.01 and error == 1e-4]
    without = dataclasses.replace(
        survey,
        exponent=np.array([-1.0]),
        naive_exponent=survey.exponent,
    )
    naive = exponents.positive(exponents.naive(without))
    np.testing.assert_array_equal(naive, exponents.positive(survey))


@pytest.mark.parametrize(
    ('low', 'high', 'expected'),
    [
        (0.0, 1.0, AGREES),
        (-0.09, 1.09, AGREES),  # within a slack of a tenth
        (0.0, 0.5, AGREES),  # an axis fitted to its curve is filled by half or more
        (0.0, 0.49, PARTLY),  # within, but an axis had been narrower
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
    def without(exponent: Callable[[Survey], NDArray[np.float64]]) -> ClaimVerdict:
        def change(survey: Survey) -> Survey:
            return dataclasses.replace(survey, naive_exponent=exponent(survey))

        verdict = claim.evaluate(changed(worlds[AGREES], change))
        assert verdict is not None
        assert verdict.verdict == AGREES
        return verdict

    large = without(lambda survey: np.full(len(survey), 0.5))
    same = without(lambda survey: survey.exponent)
    none = without(lambda survey: np.full(len(survey), np.nan))
    assert 'saltation' not in none.why
    over_exponents = (
        *('range', 'chaos', 'hardly_positive', 'no_positive'),
        *('peaks', 'bifurcations', 'deeper_crack', 'less_stable'),
    )
    about_exponents = any(name in claim.name for name in over_exponents)
    if claim.rests_on == 'exponent' and about_exponents and not claim.name.endswith('_chaotic'):
        assert f'without saltation: {DOES_NOT} (' in large.why
        assert f'without saltation: {AGREES} ({none.why})' in same.why
        told = {'verdict': AGREES, **none.value}
        assert same.value == {**none.value, 'without_saltation': told}
    else:
        assert large.why == same.why == none.why
