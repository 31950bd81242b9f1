# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Rotors side by side: what must not change a bit, refusals, the cache and the machine code."""

import json
import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rotor_dynamics import Ensemble, OperatingPoint
from rotor_dynamics.ensemble import LARGEST_STEP, steps_needed
from rotor_dynamics.errors import AnalysisError
from rotor_sim import RotorParameters
from rotor_sim.plant.parameters import VARIANTS

Array = NDArray[np.float64]
STEPS = 128
few = settings(max_examples=15, deadline=None)  # the first example may compile


@st.composite
def operating_points(draw: st.DrawFn) -> OperatingPoint:
    """Any variant, crack, clearance and bearing angle that one kernel serves."""
    parameters = RotorParameters.hou2016(
        draw(st.sampled_from(list(VARIANTS))),
        crack_stiffness_ratio=draw(st.floats(0.0, 0.3)),
        clearance_m=draw(st.sampled_from([0.0, 3e-6])),
        crack_angle_rad=draw(st.floats(-6.0, 6.0)),
        inner_radius_m=draw(st.floats(0.03, 0.05)),
    )
    return OperatingPoint(parameters, draw(st.floats(250.0, 900.0)), draw(st.floats(-10.0, 10.0)))


def crowd(least: int, most: int) -> st.SearchStrategy[list[OperatingPoint]]:
    return st.lists(operating_points(), min_size=least, max_size=most)


def after(points: list[OperatingPoint], revolutions: int = 2) -> Array:
    ensemble = Ensemble(points, STEPS)
    ensemble.advance(revolutions)
    return ensemble.states


# --- what must not change a bit -------------------------------------------------------------


@few
@given(crowd(5, 20), crowd(16, 35), st.data())
def test_neighbours_have_no_influence(
    ours: list[OperatingPoint], others: list[OperatingPoint], data: st.DataObject
) -> None:
    """Other neighbours, another place in the group, another group, spare lanes or none."""
    place = data.draw(st.integers(0, len(others) - 1))
    moved = [*others[:place], ours[0], *others[place:]]
    assert np.array_equal(after(moved)[place], after(ours)[0], equal_nan=True)


@few
@given(crowd(2, 4))
def test_few_have_no_influence_either(points: list[OperatingPoint]) -> None:
    alone = np.concatenate([after([point]) for point in points])
    assert np.array_equal(after(points), alone, equal_nan=True)


@few
@given(crowd(5, 20), st.randoms(use_true_random=False))
def test_order_of_the_points_is_the_order_of_the_results(
    points: list[OperatingPoint], random: Any
) -> None:
    order = list(range(len(points)))
    random.shuffle(order)
    permuted = after([points[i] for i in order])
    assert np.array_equal(permuted, after(points)[order], equal_nan=True)


@few
@given(
    st.lists(st.integers(0, 3), min_size=1, max_size=4),
    st.integers(0, 10**6),
    st.sampled_from([1, 6]),
)
def test_calls_may_be_split_anywhere(parts: list[int], revolution: int, count: int) -> None:
    """The cage too: it starts each revolution from the count of revolutions alone."""
    where = OperatingPoint(RotorParameters.hou2016('natural'), 352.0, 3.0)
    whole = Ensemble([where] * count, STEPS, revolution=revolution)
    split = Ensemble([where] * count, STEPS, revolution=revolution)
    record = whole.advance(sum(parts), 4)
    pieces = [split.advance(part, 4) for part in parts]
    assert np.array_equal(np.concatenate(pieces, axis=1), record)
    assert np.array_equal(split.states, whole.states)
    assert split.revolution == whole.revolution == revolution + sum(parts)
    # a record is a look, no touch
    unseen = Ensemble([where] * count, STEPS, revolution=revolution)
    unseen.advance(sum(parts))
    assert np.array_equal(unseen.states, whole.states)


@pytest.mark.parametrize('count', [1, 6])
def test_tangents_may_be_split_and_do_not_touch_the_states(count: int) -> None:
    where = OperatingPoint(RotorParameters.hou2016('figure'), 352.0, 3.0)
    whole, split = (Ensemble([where] * count, STEPS) for _ in range(2))
    first = np.random.default_rng(0).standard_normal((count, 12))
    moved = first
    for _ in range(5):
        moved = split.advance_tangents(moved)
    at_once = whole.advance_tangents(first, 5)
    # each call turns derivatives by time into those by angle: two roundings a call
    largest = np.abs(at_once).max()
    np.testing.assert_allclose(moved, at_once, rtol=0, atol=1e-14 * largest)
    # the same bits with tangents and without
    assert np.array_equal(whole.states, after([where] * count, 5))
    # linear: a power of two is exact
    again = Ensemble([where] * count, STEPS)
    assert np.array_equal(again.advance_tangents(4.0 * first, 5), 4.0 * at_once)


def test_cage_forgets_no_revolution() -> None:
    """A cage of 401/1040 of the speed stands after 10^6 revolutions as at the start."""
    parameters = RotorParameters.hou2016()
    assert parameters.cage_ratio == pytest.approx(401 / 1040, abs=1e-15)
    where = OperatingPoint(parameters, 352.0, 3.0)
    states = []
    for revolution in (0, 1040, 1000 * 1040, 1):
        ensemble = Ensemble([where], STEPS, revolution=revolution)
        ensemble.advance(1)
        states.append(ensemble.states[0] / (parameters.length_scale_m * 352.0))
    # 4e2 and 4e5 turns of the cage, each rounded to 1e-16, and contact multiplies by about 10
    np.testing.assert_allclose(states[1], states[0], rtol=0, atol=1e-11)
    np.testing.assert_allclose(states[2], states[0], rtol=0, atol=1e-8)
    assert np.abs(states[3] - states[0]).max() > 1e-4


# --- states and records ---------------------------------------------------------------------


@few
@given(crowd(1, 20), st.integers(0, 2**31))
def test_states_come_back(points: list[OperatingPoint], seed: int) -> None:
    states = np.random.default_rng(seed).standard_normal((len(points), 12))
    ensemble = Ensemble(points, STEPS, states)
    assert np.array_equal(ensemble.states[:, :6], states[:, :6])
    # over the speed and times the speed: two roundings
    np.testing.assert_allclose(ensemble.states, states, rtol=5e-16, atol=0)
    ensemble.states = states[:1]
    np.testing.assert_allclose(ensemble.states, np.tile(states[0], (len(points), 1)), rtol=5e-16)
    got = ensemble.states
    got[:] = 0.0
    assert ensemble.states.all()  # a copy


def test_start_of_every_point_is_that_of_the_reference_values(section_4_start: Array) -> None:
    points = [OperatingPoint(RotorParameters.hou2016(v), 352.0, 3.0) for v in VARIANTS]
    for state, point in zip(Ensemble(points, STEPS).states, points, strict=True):
        np.testing.assert_array_equal(state, section_4_start * point.parameters.length_scale_m)


@pytest.mark.parametrize('count', [1, 17])
def test_record_holds_the_states_before_the_steps(count: int) -> None:
    where = OperatingPoint(RotorParameters.hou2016(), 352.0, 3.0)
    ensemble = Ensemble([where] * count, STEPS)
    start = ensemble.states
    record = ensemble.advance(3, 8)
    assert record.shape == (count, 24, 4)
    middle = Ensemble([where] * count, STEPS)
    middle.advance(2)
    for sample, states in ((0, start), (16, middle.states)):
        np.testing.assert_array_equal(record[:, sample], states[:, [0, 1, 6, 7]])
    # velocities are the slopes of displacements, in m/s: central differences over 2/128 turns,
    # (2 pi/128)^2/6 of a third derivative that is 15^2 of them at most
    fine = Ensemble([where] * count, STEPS).advance(2, STEPS)[:, STEPS:]
    slope = (fine[:, 2:, :2] - fine[:, :-2, :2]) / (2.0 * 2.0 * math.pi / STEPS / 352.0)
    size = np.abs(fine[..., 2:]).max()
    np.testing.assert_allclose(slope, fine[:, 1:-1, 2:], rtol=0, atol=0.1 * size)
    assert ensemble.advance(0, 8).shape == (count, 0, 4)
    assert ensemble.advance(1).shape == (count, 0, 4)


# --- steps and refusals ---------------------------------------------------------------------


@given(st.floats(1.0, 1e4), st.sampled_from([128, 256, 512, 1024]), operating_points())
def test_steps_double_until_the_bearings_are_resolved(
    speed: float, asked: int, point: OperatingPoint
) -> None:
    mode = point.parameters.fastest_mode_rad_s
    point = OperatingPoint(point.parameters, speed, point.load_factor)
    if asked == 128 and point.parameters.clearance_m > 0.0:
        return  # refused: below
    steps = steps_needed(point, asked)
    angle = 2.0 * math.pi * mode / speed  # of the fastest mode in a revolution
    assert steps % asked == 0
    assert math.log2(steps // asked).is_integer()
    assert angle / steps <= LARGEST_STEP * (1.0 + 1e-12)
    assert steps == asked or angle / (steps // 2) > LARGEST_STEP * (1.0 - 1e-12)


def one_sentence(raised: pytest.ExceptionInfo[AnalysisError]) -> bool:
    text = str(raised.value)
    return '\n' not in text and '. ' not in text and len(text) < 250


@pytest.mark.parametrize(
    ('steps', 'clearance_m', 'expected'),
    [
        (127, 0.0, r'steps_per_revolution = 127 does not serve; allowed: '),
        (64, 0.0, r'steps_per_revolution = 64 does not serve; allowed: .* from 128 to 131072'),
        (128, 1e-6, r'128 does not serve with clearance_m = 1e-06 m; allowed: .* from 256 to'),
        (255, 1e-6, 'does not serve with clearance_m'),
        (262144, 0.0, 'does not serve'),
        (0, 0.0, 'does not serve'),
        (-256, 0.0, 'does not serve'),
        (257, 0.0, 'does not serve'),
        (130, 0.0, 'allowed: multiples of 64 from 128'),  # 64 samples a revolution are recorded
    ],
)
def test_steps_that_do_not_serve_are_refused(steps: int, clearance_m: float, expected: str) -> None:
    point = OperatingPoint(RotorParameters.hou2016(clearance_m=clearance_m), 352.0, 3.0)
    with pytest.raises(AnalysisError, match=expected) as raised:
        steps_needed(point, steps)
    assert one_sentence(raised)


@pytest.mark.parametrize(
    ('speed', 'load', 'expected'),
    [
        (0.0, 3.0, r'speed_rad_s = 0 rad/s is out of range; allowed: 1 to 1e4'),
        (-352.0, 3.0, 'speed_rad_s = -352 rad/s'),
        (1.1e4, 3.0, 'speed_rad_s = 11000 rad/s'),
        (math.nan, 3.0, 'speed_rad_s = nan'),
        (math.inf, 3.0, 'speed_rad_s = inf'),
        (352.0, 20.1, r'load_factor = 20\.1 is out of range; allowed: -20 to 20'),
        (352.0, -math.inf, 'load_factor = -inf'),
        (352.0, math.nan, 'load_factor = nan'),
    ],
)
def test_bad_operating_points_are_refused(speed: float, load: float, expected: str) -> None:
    with pytest.raises(AnalysisError, match=expected) as raised:
        OperatingPoint(RotorParameters.hou2016(), speed, load)
    assert one_sentence(raised)


@pytest.mark.parametrize(
    ('changes', 'kinds'),
    [
        ([], 0),
        ([{}, {'ball_count': 9}], 2),
        ([{}, {'crack_half_angle_rad': 0.5}, {'ball_count': 9}], 3),
    ],
)
def test_points_of_different_kinds_are_refused(changes: list[dict[str, Any]], kinds: int) -> None:
    points = [OperatingPoint(RotorParameters.hou2016(**change), 352.0, 3.0) for change in changes]
    with pytest.raises(AnalysisError, match=f'{len(points)} points of {kinds} kinds') as raised:
        Ensemble(points, STEPS)
    assert one_sentence(raised)


def test_samples_that_do_not_divide_the_steps_are_refused() -> None:
    ensemble = Ensemble([OperatingPoint(RotorParameters.hou2016(), 352.0, 3.0)], STEPS)
    with pytest.raises(AnalysisError, match='= 60 does not divide the 128 steps') as raised:
        ensemble.advance(1, 60)
    assert one_sentence(raised)
    assert ensemble.revolution == 0


# --- the cache and the machine code ---------------------------------------------------------

SCRIPT = """
import collections, json, re
from llvmlite import binding
from rotor_sim import RotorParameters
from rotor_dynamics import Ensemble, OperatingPoint
point = OperatingPoint(RotorParameters.hou2016(), 352.0, 3.0)
ensemble = Ensemble([point] * 5, 128)
ensemble.advance(1)
revolve = ensemble._plant.module.revolve
stats = revolve.stats
hits, misses = sum(stats.cache_hits.values()), sum(stats.cache_misses.values())
asm = '' if hits else next(iter(revolve.inspect_asm().values()))
roots = collections.Counter(re.findall(r'v?sqrt[ps]d', asm))
avx2 = bool(binding.get_host_cpu_features().get('avx2'))
print(json.dumps([hits, misses, dict(roots), avx2, ensemble.states[0].tolist()]))
"""


@pytest.mark.slow
def test_second_process_finds_vectorised_code_on_disk(tmp_path: Path) -> None:
    environment = {**os.environ, 'NUMBA_CACHE_DIR': str(tmp_path)}

    def run() -> tuple[list[Any], int]:
        done = subprocess.run(
            [sys.executable, '-c', SCRIPT],
            env=environment,
            check=True,
            capture_output=True,
            text=True,
        )
        return json.loads(done.stdout), len(list(tmp_path.rglob('*.nbc')))

    (hits, misses, roots, avx2, state), files = run()
    assert (hits, misses) == (0, 1)
    (second_hits, second_misses, _, _, second_state), second_files = run()
    assert (second_hits, second_misses) == (1, 0)
    assert second_files == files > 0
    assert second_state == state
    if not avx2 or 'NUMBA_CPU_NAME' in os.environ:
        pytest.skip('the registers of four are those of AVX2')
    # four stages, each with the disk's distance and four pairs of balls in one of two like bearings
    assert roots.get('vsqrtpd', 0) >= 4 * (1 + 4)
    assert not roots.get('vsqrtsd')
    assert not roots.get('sqrtsd')
