# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The mapping between frame `rotor` and the body frame."""

import numpy as np
import pytest

from maneuver_gen import load_grid, parse_maneuver
from maneuver_gen.frames import body_from_rotor, rotor_from_body

FORWARD, LEFT, UP = np.eye(3)  # REP-103


@pytest.mark.parametrize(('body', 'rotor'), [(FORWARD, 0), (-UP, 1), (LEFT, 2)])
def test_axes(body: np.ndarray, rotor: int) -> None:
    """Rotor +x is forward, +y is down (-z_body), +z is left (+y_body)."""
    np.testing.assert_array_equal(rotor_from_body(body), np.eye(3)[rotor])
    np.testing.assert_array_equal(body_from_rotor(np.eye(3)[rotor]), body)


def test_the_rotor_frame_is_right_handed() -> None:
    x, y, z = (body_from_rotor(axis) for axis in np.eye(3))
    np.testing.assert_array_equal(np.cross(x, y), z)


def test_there_and_back_for_any_shape() -> None:
    vectors = np.arange(24.0).reshape(2, 4, 3)
    np.testing.assert_array_equal(body_from_rotor(rotor_from_body(vectors)), vectors)
    assert rotor_from_body(vectors).shape == (2, 4, 3)


def test_gravity_in_level_flight_is_plus_y() -> None:
    """Gravity points to -z_body, so the load of level flight is +9.81 along rotor y."""
    load_y, load_z = load_grid(parse_maneuver({'profile': 'constant'}), 1.0)[0]
    np.testing.assert_array_equal(rotor_from_body(-9.81 * UP), [0.0, load_y, load_z])
