# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A fleet gives the bytes that every simulator gives alone, and fails as one."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rotor_sim import IntegrationError, LoadGrid, RotorError, RotorSimConfig, RotorSimulator
from rotor_sim.stream import fleet
from rotor_sim.stream.simulator import SimulatedBlock

ConstantGrid = Callable[[float, float], LoadGrid]


def lane(i: int) -> dict[str, Any]:
    """Everything that may differ from lane to lane does, every fourth half angle too."""
    return {
        'settle_revolutions': i % 3,
        'seed': i,
        'rotor': {
            'clearance_m': 1e-6 * (i % 5),
            'crack_stiffness_ratio': 0.02 * (i % 7),
            'eccentricity_m': 1e-6 * i,
            'crack_angle_rad': 0.15 * i,
            'crack_half_angle_rad': 0.4 if i % 4 == 3 else math.pi / 6,
        },
        'speed': {
            'initial_rad_s': 250.0 + 5.0 * i,
            'highest_rad_s': 420.0,
            'ramps': [{'at_s': 0.003 * i, 'to_rad_s': 380.0, 'acceleration_rad_s2': 90.0}],
        },
        'crack_growth': [{'at_s': 0.01, 'to': 0.25, 'over_s': 0.01 * i}],
        'forcing': {'amplitude_n': 20.0 * i, 'phase_rad': 0.3 * i - 4.0},
        'sensors': {'displacement_noise_m': 1e-7 * (i % 2)},
        'changes': [{'sample': 300 + i, 'parameter': 'crack_stiffness_ratio', 'value': 0.1}],
    }


def simulator(mapping: dict[str, Any]) -> RotorSimulator:
    return RotorSimulator(RotorSimConfig.from_mapping(mapping))


def flight(i: int, points: int = 20) -> LoadGrid:
    k = np.arange(points)
    return LoadGrid.from_points(
        np.column_stack([9.81 * (1.5 + np.sin(k / 3 + i)), np.cos(k / 2 + 2 * i)])
    )


def said(block: SimulatedBlock) -> tuple[Any, ...]:
    """Everything that a block says, rows as bytes."""
    return (
        block.first_sample,
        block.rows.tobytes(),
        block.truth_rows.tobytes(),
        block.shaft_angle_rad,
        block.shaft_speed_rad_s,
        block.truth,
        block.imu,
    )


def assert_alike(
    mappings: Sequence[dict[str, Any]], grids: Sequence[LoadGrid], blocks: Sequence[int]
) -> None:
    together = [simulator(mapping) for mapping in mappings]
    alone = [simulator(mapping) for mapping in mappings]
    for count in blocks:
        results = fleet.advance(together, count, grids)
        for i, one in enumerate(alone):
            assert said(results[i]) == said(one.advance(count, grids[i])), i
            assert together[i].state.tobytes() == one.state.tobytes(), i


@pytest.mark.parametrize('count', [1, 3, 4, 17, 33])
def test_fleet_gives_the_bytes_of_every_simulator_alone(count: int) -> None:
    assert_alike([lane(i) for i in range(count)], [flight(i) for i in range(count)], [333, 1, 500])


def test_split_into_blocks_does_not_show_in_a_fleet() -> None:
    count = 6
    whole = [simulator(lane(i)) for i in range(count)]
    parts = [simulator(lane(i)) for i in range(count)]
    grids = [flight(i) for i in range(count)]
    expected = fleet.advance(whole, 801, grids)
    for n in (1, 299, 501):
        fleet.advance(parts, n, grids)
    for i in range(count):
        assert parts[i].state.tobytes() == whole[i].state.tobytes()
        assert len(expected[i].rows) == 801


numbers = st.fixed_dictionaries(
    {
        'speed': st.floats(20.0, 1000.0),
        'to': st.floats(20.0, 1000.0),
        'crack': st.floats(0.0, 0.4),
        'clearance': st.sampled_from([0.0, 5e-7, 2e-5]),
        'eccentricity': st.floats(0.0, 1e-4),
        'forcing': st.floats(0.0, 1e3),
        'phase': st.floats(-6.0, 6.0),
        'load': st.floats(-9.0, -0.1) | st.just(0.0) | st.floats(0.1, 9.0),
        'variant': st.sampled_from(['derived', 'natural', 'figure', 'figure_chaos']),
    }
)


@settings(max_examples=20, deadline=None)
@given(lanes=st.lists(numbers, min_size=4, max_size=9), n=st.integers(1, 150))
def test_any_lanes_give_the_bytes_that_they_give_alone(lanes: list[dict[str, Any]], n: int) -> None:
    mappings = [
        {
            'settle_revolutions': 0,
            'variant': x['variant'],
            'rotor': {
                'crack_stiffness_ratio': x['crack'],
                'clearance_m': x['clearance'],
                'eccentricity_m': x['eccentricity'],
            },
            'speed': {
                'initial_rad_s': x['speed'],
                'highest_rad_s': 1000.0,
                'ramps': [{'at_s': 0.001, 'to_rad_s': x['to'], 'acceleration_rad_s2': 2000.0}],
            },
            'forcing': {'amplitude_n': x['forcing'], 'phase_rad': x['phase']},
        }
        for x in lanes
    ]
    grids = [LoadGrid.from_points([[9.81 * x['load'], x['load']]] * 5) for x in lanes]
    assert_alike(mappings, grids, [n, 7])


def test_fleet_must_go_in_step(constant_grid: ConstantGrid) -> None:
    grid = constant_grid(1.0, 0.1)
    base = {'settle_revolutions': 0}
    one, two = simulator(base), simulator(base)
    fast = simulator({**base, 'rate_hz': 20_480})
    with pytest.raises(RotorError, match=r'2 simulators cannot use 1 load grids'):
        fleet.advance([one, two], 10, [grid])
    with pytest.raises(RotorError, match='occurs twice'):
        fleet.advance([one, one], 10, [grid, grid])
    with pytest.raises(RotorError, match=r'simulators\[1\]: rate_hz = 20480, but .* is 10240'):
        fleet.advance([one, fast], 10, [grid, grid])
    two.advance(10, grid)
    with pytest.raises(RotorError, match=r'simulators\[1\]: next_sample = 10, but .* is 0'):
        fleet.advance([one, two], 10, [grid, grid])
    with pytest.raises(RotorError, match=r'simulators\[0\]: n_samples = 0'):
        fleet.advance([one], 0, [grid])
    short = LoadGrid.from_points([[9.81, 0.0]] * 2)
    with pytest.raises(RotorError, match=r'simulators\[1\]: the load grid holds points 0 to 1'):
        fleet.advance([one, simulator(base)], 300, [grid, short])
    assert one.next_sample == 0
    assert fleet.advance([], 10, []) == []


def test_divergence_of_one_names_it_and_moves_none() -> None:
    """The others go on without it, with the bytes that they would have had anyway."""
    falling = {'settle_revolutions': 0, 'rotor': {'contact_stiffness_n_m15': 0.0}}
    mappings = [lane(i) for i in (0, 1, 2)] + [falling] + [lane(i) for i in (4, 5)]
    grids = [flight(i, 60) for i in range(6)]
    # without load at first: a start that needs no bearing
    points = np.zeros((60, 2))
    points[1:, 0] = 98.1
    grids[3] = LoadGrid.from_points(points)
    simulators = [simulator(mapping) for mapping in mappings]
    fleet.advance(simulators, 100, grids)
    before = [s.state.tobytes() for s in simulators]
    with pytest.raises(
        IntegrationError, match=r'simulators\[3\]: the rotor diverged at sample \d+'
    ):
        fleet.advance(simulators, 2000, grids)
    assert [s.state.tobytes() for s in simulators] == before
    assert {s.next_sample for s in simulators} == {100}
    del simulators[3], grids[3], mappings[3]
    results = fleet.advance(simulators, 500, grids)
    for mapping, grid, result in zip(mappings, grids, results, strict=True):
        alone = simulator(mapping)
        alone.advance(100, grid)
        assert said(result) == said(alone.advance(500, grid))
