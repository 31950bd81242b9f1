# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The pure parts of the view: spectrogram, orbit, geometry."""

import subprocess
import sys

import numpy as np
import pytest
import rerun as rr
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

import view_flight
from rotor_view import scene, spectrogram
from rotor_view.orbit import REVOLUTIONS, Orbit, round_up
from rotor_view.spectrogram import COLUMNS, MAX_ORDER, ROWS, Spectrogram

ORDERS = np.arange(385) / 64


def line_at(order: float) -> NDArray[np.float64]:
    return np.where(np.isclose(ORDERS, order), 10e-6, 1e-9)


def test_importing_the_monitor_does_not_import_rerun() -> None:
    code = 'import sys, vibration_monitor; sys.exit("rerun" in sys.modules)'
    assert subprocess.run([sys.executable, '-c', code], check=False).returncode == 0


def test_decibels_count_from_a_nanometre_and_keep_what_is_unknown() -> None:
    values = spectrogram.decibels(np.array([1e-9, 1e-6, 0.0, np.nan]))
    np.testing.assert_allclose(values, [0.0, 60.0, 0.0, np.nan], atol=1e-12)


def test_a_spectrum_colours_its_order_at_its_time() -> None:
    picture = Spectrogram()
    picture.add(10.0, ORDERS, line_at(3.0))
    bright = picture.picture().sum(axis=2).astype(int)
    row, column = np.unravel_index(bright.argmax(), bright.shape)
    assert row == ROWS - 1 - int(3.0 * ROWS / MAX_ORDER)
    columns = np.flatnonzero(bright[row] == bright.max())
    # the newest 2 s before 10 s, of 20 s
    assert columns.min() == int(8.0 / 20.0 * COLUMNS)
    assert columns.max() == int(10.0 / 20.0 * COLUMNS)
    assert column in columns


def test_the_whole_flight_stays_in_the_picture() -> None:
    picture = Spectrogram()
    for time_s in np.arange(1.0, 100.0):
        picture.add(float(time_s), ORDERS, line_at(1.0 if time_s < 50 else 2.0))
    assert picture.span_s == 160.0
    image = picture.picture().sum(axis=2).astype(int)
    assert image.shape == (ROWS, COLUMNS)
    for order, begin_s, end_s in ((1.0, 2.0, 48.0), (2.0, 52.0, 98.0)):
        row = ROWS - 1 - int(order * ROWS / MAX_ORDER)
        inside = slice(int(begin_s / 160 * COLUMNS), int(end_s / 160 * COLUMNS))
        assert (image[row, inside] == image.max()).all()
    assert not image[:, int(101 / 160 * COLUMNS) :].any()


@given(st.lists(st.floats(0.0, 1e5), min_size=1, max_size=50))
def test_any_times_fit_into_the_picture(times: list[float]) -> None:
    picture = Spectrogram()
    for time_s in sorted(times):
        picture.add(time_s, ORDERS, line_at(1.0))
    assert picture.span_s > max(times)
    assert picture.picture().shape == (ROWS, COLUMNS, 3)


@given(st.floats(1e-9, 1e9))
def test_round_up_takes_the_next_of_the_steps(value: float) -> None:
    scale = round_up(value)
    # steps are at most a factor of two apart; 1e-9 for a value that is a step itself
    assert value * (1 - 1e-8) <= scale <= value * 2.0 * (1 + 1e-8)
    assert min(abs(scale / 10.0 ** round(np.log10(scale / s)) / s - 1) for s in (1, 2, 3, 5)) < 1e-9


def memory_orbit() -> Orbit:
    return Orbit(rr.RecordingStream('test'))


def test_the_orbit_keeps_the_latest_revolutions() -> None:
    orbit = memory_orbit()
    for first in range(0, 4096, 256):
        orbit.add(view_flight.rows_of(first, 256))
    angle = orbit._rows[:, 0]
    step = view_flight.SPEED_RAD_S / view_flight.RATE_HZ
    assert angle[-1] - angle[0] <= 2 * np.pi * REVOLUTIONS < angle[-1] - angle[0] + step
    np.testing.assert_allclose(
        orbit._rows[:, 1], 10 * np.sin(angle) + 20 * np.sin(3 * angle), atol=1e-5
    )


def test_the_orbit_starts_anew_after_a_missing_value() -> None:
    orbit = memory_orbit()
    orbit.add(view_flight.rows_of(0, 1024))
    spoiled = view_flight.rows_of(1024, 256)
    spoiled['angle'][3] = np.nan
    orbit.add(spoiled)
    assert len(orbit._rows) == 0


def turned(quaternion: NDArray[np.floating], vector: NDArray[np.float64]) -> NDArray[np.float64]:
    axis, w = quaternion[:3].astype(np.float64), float(quaternion[3])
    across = np.cross(axis, vector)
    return vector + 2.0 * (w * across + np.cross(axis, across))


small = st.floats(-0.1, 0.1)


@given(small, small, st.sampled_from([-1.0, 1.0]))
def test_a_bent_shaft_half_ends_at_the_disk(y: float, z: float, side: float) -> None:
    drop = np.array([[0.0, y, z]], np.float32)
    bend = scene._bend(side, drop)
    along = np.array([-side * scene.HALF_LENGTH_M * float(bend['scale'][0, 0]), 0.0, 0.0])
    end = turned(bend['quaternion'][0], along)
    # float32 poses: 1e-7 of 0.3 m
    np.testing.assert_allclose(end, [-side * scene.HALF_LENGTH_M, y, z], atol=2e-7)


@given(st.floats(0.0, 1e6))
def test_the_shaft_turns_from_y_to_z(angle: float) -> None:
    quaternion = scene._about_x(np.array([angle]))[0]
    image = turned(quaternion, np.array([0.0, 1.0, 0.0]))
    # the remainder of 1e6 rad loses 1e-10, float32 keeps 1e-7
    np.testing.assert_allclose(image, [0.0, np.cos(angle), np.sin(angle)], atol=1e-6)


def test_a_ring_is_closed_and_its_faces_look_outwards() -> None:
    mesh = scene.ring(0.1, 0.2, 0.05, (1, 2, 3))
    assert mesh.vertex_positions is not None
    assert mesh.vertex_normals is not None
    corners = np.array(mesh.vertex_positions.as_arrow_array().to_pylist())
    normals = np.array(mesh.vertex_normals.as_arrow_array().to_pylist())
    faces = corners.reshape(-1, 3, 3)
    flux = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]) / 2.0
    outward = normals.reshape(-1, 3, 3)[:, 0]
    sign = np.sign((flux * outward).sum(axis=1))
    oriented = flux * sign[:, np.newaxis]
    # divergence theorem: a closed surface has no net area and encloses pi (R^2 - r^2) w,
    # less what 72 flat segments cut off (1 - sin(a)/a with a = 5 degrees: 0.13 %)
    np.testing.assert_allclose(oriented.sum(axis=0), 0.0, atol=1e-6)
    volume = (oriented * faces.mean(axis=1)).sum() / 3.0
    assert volume == pytest.approx(np.pi * (0.2**2 - 0.1**2) * 0.05, rel=2e-3)


def test_geometry_is_found_wherever_the_configuration_has_it() -> None:
    config = {'scenario': {'rotor': [{'x': 1}, {'crack_angle_rad': 2, 'ball_count': 9}]}}
    geometry = scene.Geometry.from_config(config)
    assert (geometry.crack_angle_rad, geometry.ball_count) == (2, 9)
    assert geometry.outer_radius_m == scene.Geometry().outer_radius_m


def test_the_cage_turns_at_the_ball_pass_order_of_the_paper() -> None:
    geometry = scene.Geometry()
    # physics.md section 1: N_b r_i / (r_i + r_o) = 3.0846
    assert geometry.ball_count * geometry.cage_ratio == pytest.approx(3.0846, abs=5e-5)
