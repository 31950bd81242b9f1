# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Whirl and shape of orbits that are known by construction: ellipses, trochoids."""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from monitor_signals import blocks, run, steady_angle, table
from vibration_monitor import MonitorConfig, VibrationMonitor
from vibration_monitor.indicators.whirl import forward_and_backward
from vibration_monitor.orbit_shape import NO_ORBIT, OrbitShape, orbit_shape

Circles = dict[int, complex]
"""Radius and start of each circle of an orbit by its order; negative orders whirl backward."""


def vectors_of(circles: Circles) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Return the vectors of y and z at orders 1 to 5 of an orbit given by its circles.

    y + i z = p exp(i k g) + q exp(-i k g): y has the vector p + conj(q), z has (p - conj(q)) / i.
    """
    forward = np.array([circles.get(k, 0) for k in range(1, 6)], complex)
    backward = np.array([circles.get(-k, 0) for k in range(1, 6)], complex)
    return forward + np.conj(backward), (forward - np.conj(backward)) / 1j


def shape_of(circles: Circles) -> OrbitShape:
    return orbit_shape(*vectors_of(circles), 1e-3)


def motion(circles: Circles, angle: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Return y + i z at these shaft angles."""
    total = np.zeros(len(angle), complex)
    for order, value in circles.items():
        total += value * np.exp(1j * order * angle)
    return total


def rows_of(circles: Circles, duration_s: float = 1.5) -> NDArray[np.void]:
    angle = steady_angle(duration_s, 352.0)
    orbit = motion(circles, angle)
    return table(angle, {'disk_y': np.real(orbit), 'disk_z': np.imag(orbit)})


@pytest.mark.parametrize(
    ('circles', 'turns', 'crossings'),
    [
        # circle and ellipses, both senses
        ({1: 1}, 1, 0),
        ({1: 1, -1: 0.6j}, 1, 0),
        ({1: 0.6, -1: 1}, -1, 0),
        # limacon: a dent below 2 b = a, an inner loop above
        ({1: 1, 2: 0.45}, 1, 0),
        ({1: 1, 2: 0.55}, 2, 1),
        ({1: 1, 2: 0.9j}, 2, 1),
        ({1: 0.5, 2: 1}, 2, 1),
        # two and three inner loops of a forward 3x and 4x: n b > a
        ({1: 1, 3: 0.3}, 1, 0),
        ({1: 1, 3: 0.4}, 3, 2),
        ({1: 1, 4: 0.3}, 4, 3),
        # hypotrochoids: a backward nx makes n + 1 outer loops once n b > a
        ({1: 1, -2: 0.45}, 1, 0),
        ({1: 1, -2: 0.55}, -2, 3),
        ({1: 1, -3: 0.4}, -3, 4),
        # the same, run through backward
        ({-1: 1, -2: 0.7}, -2, 1),
        ({-1: 1, 2: 0.7}, 2, 3),
        # a figure of eight: y = cos g, z = sin 2g
        ({1: 0.5, -1: 0.5, 2: 0.5, -2: -0.5}, 0, 1),
        # an ellipse at 1x with an elliptic 2x: the inner loop of a crack at half the critical speed
        ({1: 1, -1: 0.3, 2: 0.8, -2: 0.1}, 2, 1),
    ],
)
def test_loops_of_known_orbits(circles: Circles, turns: int, crossings: int) -> None:
    shape = shape_of(circles)
    assert (shape.turns, shape.crossings) == (turns, crossings)
    # through the whole monitor, scaled to micrometres
    config = MonitorConfig(extras=('orbit',))
    rows = rows_of({order: 1e-5 * value for order, value in circles.items()})
    record = run(VibrationMonitor(config), blocks(rows, 512))[0]
    assert record.value('disk/orbit_turns') == turns
    assert record.value('disk/orbit_crossings') == crossings


def crossings_by_brute_force(circles: Circles) -> int:
    """Count the crossings of a fine polygon, by the signs of the areas of triangles."""
    angle = 2 * np.pi * (np.arange(300) + 0.123) / 300
    orbit = motion(circles, angle)
    a, b = orbit, np.roll(orbit, -1)

    def side(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
        return np.asarray(np.imag(np.conj(q - p) * (r - p)) > 0)

    rows = (a[:, None], b[:, None])
    columns = (a[None], b[None])
    cross = (side(*rows, columns[0]) != side(*rows, columns[1])) & (
        side(*columns, rows[0]) != side(*columns, rows[1])
    )
    return int(np.count_nonzero(np.triu(cross, 2))) - int(cross[0, -1])


# a number of 5e-324 would become 0 where the orbit is scaled
RADIUS = st.just(0.0) | st.floats(1e-9, 1.0)
COEFFICIENT = st.tuples(RADIUS, st.floats(-math.pi, math.pi)).map(
    lambda polar: polar[0] * complex(math.cos(polar[1]), math.sin(polar[1]))
)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.filter_too_much])
@given(
    st.dictionaries(st.sampled_from([-3, -2, -1, 2, 3]), COEFFICIENT, min_size=1, max_size=3),
    st.sampled_from([0.5, 1.0, 2.0]),
)
@example(others={-1: 1, -3: 1}, first=0.5)
def test_crossings_and_turns_of_any_orbit(others: Circles, first: float) -> None:
    # without 1x a shaft revolution could run through the same orbit twice
    circles = {**others, 1: complex(first)}
    shape = shape_of(circles)
    angle = 2 * np.pi * np.arange(4096) / 4096
    velocity = motion({k: 1j * k * value for k, value in circles.items()}, angle)
    # near a cusp the polygon cannot say on which side it is
    assume(np.min(np.abs(velocity)) > 0.2 * np.max(np.abs(velocity)))
    turned = np.unwrap(np.angle(np.append(velocity, velocity[0])))
    assert shape.turns == round((turned[-1] - turned[0]) / (2 * math.pi))
    # Whitney: the number of crossings and the turning number differ in parity
    assert (shape.crossings + shape.turns) % 2 == 1
    # two parts of the orbit that all but touch are counted as the polygon has them, by two or none;
    # an orbit of odd orders is its own mirror image at the centre, where this happens twice
    most = 4 if all(order % 2 for order in circles) else 2
    assert abs(shape.crossings - crossings_by_brute_force(circles)) in range(0, most + 1, 2)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.filter_too_much])
@given(
    st.dictionaries(st.sampled_from([-2, -1, 1, 2]), COEFFICIENT, min_size=1),
    st.floats(-math.pi, math.pi),
    st.floats(0.01, 100.0),
)
def test_shape_does_not_depend_on_size_and_direction(
    circles: Circles, turn: float, size: float
) -> None:
    angle = 2 * np.pi * np.arange(512) / 512
    velocity = motion({k: 1j * k * value for k, value in circles.items()}, angle)
    assume(np.min(np.abs(velocity)) > 0.2 * np.max(np.abs(velocity)) > 0.02)
    factor = size * complex(math.cos(turn), math.sin(turn))
    moved = {order: factor * value for order, value in circles.items()}
    first = orbit_shape(*vectors_of(circles), 1e-9)
    second = orbit_shape(*vectors_of(moved), 1e-9)
    assert first.turns == second.turns
    assert first.axis_ratio == pytest.approx(second.axis_ratio, abs=1e-9, nan_ok=True)
    y, z = vectors_of(circles)
    mirrored = orbit_shape(np.conj(y), np.conj(z), 1e-9)
    assert mirrored.turns == -first.turns or first.turns == 0


def test_axis_ratio_is_that_of_the_ellipse_with_its_sense() -> None:
    # y = a cos g, z = b sin g
    for a, b in ((2.0, 1.0), (1.0, 1.0), (1.0, 0.0), (2.0, -1.0), (1.0, -1.0)):
        y, z = np.zeros(5, complex), np.zeros(5, complex)
        y[0], z[0] = a, -1j * b
        assert orbit_shape(y, z, 1e-3).axis_ratio == pytest.approx(b / a, abs=1e-12)


def test_an_orbit_below_the_floor_or_unknown_has_no_shape() -> None:
    y, z = vectors_of({1: 0.9e-3})
    assert orbit_shape(y, z, 1e-3) is NO_ORBIT
    assert orbit_shape(y, z, 0.8e-3).turns == 1
    y[3] = math.nan
    assert orbit_shape(y, z, 1e-6) is NO_ORBIT


@settings(deadline=None)
@given(COEFFICIENT, COEFFICIENT)
def test_whirl_gives_the_circles_back(forward: complex, backward: complex) -> None:
    y, z = vectors_of({2: forward, -2: backward})
    found = forward_and_backward(y, z)
    assert found[0][1] == pytest.approx(abs(forward), abs=1e-12)
    assert found[1][1] == pytest.approx(abs(backward), abs=1e-12)


def test_whirl_through_the_monitor() -> None:
    circles: Circles = {1: 2e-6, -1: 5e-7j, 2: 3e-7, -3: -1e-7}
    record = run(VibrationMonitor(MonitorConfig(extras=('whirl',))), blocks(rows_of(circles), 512))[
        0
    ]
    for order in (1, 2, 3, 4):
        for sense, sign in (('forward', 1), ('backward', -1)):
            expected = abs(circles.get(sign * order, 0))
            # side lobes of 1x (2.5e-5) at most
            found = record.value(f'disk/{sense}_order_{order}')
            assert found == pytest.approx(expected, abs=2.5e-5 * 2e-6)
    assert math.isnan(record.value('brg1/forward_order_1'))
