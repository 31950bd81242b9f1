# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The load grid takes points in any order, knows how far it reaches, and forgets on request."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rotor_sim import LoadGrid, RotorError
from rotor_sim.errors import LoadConflictError
from rotor_sim.stream.load_grid import EARLY_LIMIT


def test_covers_up_to_its_last_point() -> None:
    grid = LoadGrid.from_points(np.zeros((3, 2)))
    assert grid.next_index == 3
    assert grid.covers(2048, 102_400)
    # 20 ms are 204.8 samples at 10 240 Hz
    assert grid.covers(204, 10_240)
    assert not grid.covers(205, 10_240)
    assert LoadGrid().covers(0, 10_240) is False


def test_window_and_discard() -> None:
    points = np.arange(10.0).reshape(5, 2)
    grid = LoadGrid.from_points(points)
    np.testing.assert_array_equal(grid.window(1, 3), points[1:4])
    grid.discard_before(2)
    grid.discard_before(1)
    np.testing.assert_array_equal(grid.window(2, 4), points[2:])
    assert grid.next_index == 5
    with pytest.raises(RotorError, match='holds points 2 to 4, but points 1 to 3 are needed'):
        grid.window(1, 3)
    with pytest.raises(RotorError, match='points 3 to 5 are needed'):
        grid.window(3, 5)
    grid.append(5, 1.0, 2.0)
    np.testing.assert_array_equal(grid.window(5, 5), [[1.0, 2.0]])


@pytest.mark.parametrize('index', [0, 2, 7])
def test_holes_and_repeats_are_refused(index: int) -> None:
    grid = LoadGrid.from_points([[9.81, 0.0]])
    with pytest.raises(RotorError, match=f'load point {index} cannot follow point 0'):
        grid.append(index, 9.81, 0.0)
    assert grid.next_index == 1


@pytest.mark.parametrize(
    ('y', 'z', 'sentence'),
    [
        (np.nan, 0.0, 'load_y = nan m/s^2 at load point 0 is out of range'),
        (0.0, np.inf, 'load_z = inf m/s^2 at load point 0 is out of range'),
        (-200.0, 0.0, 'load point 0 is out of range; allowed: -196.2 to 196.2 m/s^2'),
    ],
)
def test_impossible_loads_are_refused(y: float, z: float, sentence: str) -> None:
    grid = LoadGrid()
    with pytest.raises(RotorError, match=re.escape(sentence)):
        grid.append(0, y, z)
    assert grid.next_index == 0


def test_wrong_shape_is_refused() -> None:
    with pytest.raises(RotorError, match=r'shape \(points, 2\), not \(4,\)'):
        LoadGrid.from_points(np.zeros(4))


@given(st.permutations(range(12)), st.lists(st.integers(0, 11)))
def test_points_may_come_in_any_order_and_again(order: list[int], again: list[int]) -> None:
    grid = LoadGrid()
    for k in [*order, *again]:
        grid.take(k, float(k), -float(k))
    assert (grid.next_index, grid.early) == (12, 0)
    np.testing.assert_array_equal(grid.window(0, 11), [[k, -k] for k in range(12)])


@given(st.permutations(range(12)), st.integers(0, 11))
def test_nothing_beyond_a_hole_is_used(order: list[int], hole: int) -> None:
    grid = LoadGrid()
    for k in order:
        if k != hole:
            grid.take(k, float(k), 0.0)
    assert (grid.next_index, grid.early) == (hole, 11 - hole)
    with pytest.raises(RotorError, match='are needed'):
        grid.window(hole, hole)


@pytest.mark.parametrize('index', [0, 3])
def test_two_values_of_a_point_are_a_conflict(index: int) -> None:
    """In the grid as beyond a hole; the first value stays."""
    grid = LoadGrid.from_points([[1.0, 2.0]])
    grid.take(3, 1.0, 2.0)
    grid.take(index, 1.0, 2.0)
    with pytest.raises(LoadConflictError, match=rf'load point {index} came as \(1.0, 2.0\) and as'):
        grid.take(index, 3.0, 4.0)
    np.testing.assert_array_equal(grid.window(0, 0), [[1.0, 2.0]])


def test_points_far_beyond_a_hole_are_not_kept() -> None:
    grid = LoadGrid()
    for k in range(1, 5000):
        grid.take(k, 0.0, 0.0)
    assert grid.early == EARLY_LIMIT - 1
    with pytest.raises(RotorError, match='load_z = inf'):
        grid.take(1, 0.0, np.inf)
