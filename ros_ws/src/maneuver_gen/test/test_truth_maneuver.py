# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Maneuvers against kinematics and the paper, never against their own output.

Sources: Hou et al. 2016, eq. (1); balance of forces in vertical flight and in the level turn.
Axes: a load factor is apparent gravity (g - a) over 9.81 along rotor +y = -z_body.
"""

import math

import numpy as np
import pytest

from maneuver_gen import flight_path_angle, load_grid, parse_maneuver
from maneuver_gen.curves import FloatArray
from maneuver_gen.maneuvers.climb_dive import (
    ClimbDive,
    RatePulse,
    vertical_plane_load_factor,
)
from maneuver_gen.maneuvers.turn import coordinated_turn_load_factor
from rotor_common.constants import GRAVITY_M_S2


def climb_dive(**changes: float) -> ClimbDive:
    config = parse_maneuver({'profile': 'climb_dive', **changes})
    assert isinstance(config, ClimbDive)
    return config


def load_factors(config: ClimbDive, duration_s: float = 20.0) -> FloatArray:
    return load_grid(config, duration_s)[:, 0] / 9.81


def test_gravity_is_the_paper_s() -> None:
    assert GRAVITY_M_S2 == 9.81


def test_level_flight_pushes_the_rotor_to_plus_y_with_one_g() -> None:
    grid = load_grid(parse_maneuver({'profile': 'constant'}), 1.0)
    assert (grid == [9.81, 0.0]).all()


def test_load_is_gravity_minus_the_acceleration_of_the_trajectory() -> None:
    """Fly the path in the earth frame, differentiate it twice, project on the body normal."""
    config = climb_dive(climb_angle_rad=0.6, dive_angle_rad=0.4)
    step_s = 1e-3
    times = np.arange(0.0, 30.0, step_s)
    angle = flight_path_angle(config, times)
    velocity = config.speed_m_s * np.stack((np.cos(angle), np.sin(angle)))  # forward, up
    acceleration = np.gradient(velocity, step_s, axis=1)
    apparent = np.array([[0.0], [-9.81]]) - acceleration
    down_in_the_airframe = np.stack((np.sin(angle), -np.cos(angle)))
    expected = (apparent * down_in_the_airframe).sum(axis=0)[::10]
    actual = load_grid(config, 30.0)[: len(expected), 0]
    # central differences err by h^2/6 v q'': the fastest is the push-over's rise, where
    # v q'' = 6 (0.9 g) / (0.27 s)^2 = 727 m/s^3, so 1.2e-4 m/s^2; the two ends are one-sided
    np.testing.assert_allclose(actual[1:-1], expected[1:-1], atol=1.3e-4)


def test_flight_path_angle_is_the_integral_of_the_rate() -> None:
    config = climb_dive()
    times = np.linspace(0.0, 20.0, 200_001)
    rate = config.flight_path_rate(times)
    integral = np.concatenate(([0.0], np.cumsum((rate[1:] + rate[:-1]) / 2.0) * 1e-4))
    # trapezoid rule: h^2/12 * change of slope, 1e-8/12 * 0.41 rad/s^2, summed over the pulses
    np.testing.assert_allclose(flight_path_angle(config, times), integral, atol=1e-9)


def test_loop_of_constant_rate() -> None:
    """A loop: rate v / g + 1 at the bottom, - 1 at the top, rate v / g halfway and on average."""
    rate, speed = 0.3, 100.0
    angle = np.radians(np.arange(360.0))
    load = vertical_plane_load_factor(angle, np.full(360, rate), speed)
    pull = rate * speed / 9.81
    # rounding of a few sums of order 1
    np.testing.assert_allclose(
        load[[0, 90, 180, 270]], [pull + 1, pull, pull - 1, pull], atol=1e-14
    )
    assert load.mean() == pytest.approx(pull, abs=1e-14)


def test_a_ballistic_path_is_weightless() -> None:
    """Free fall turns the path with -g cos(angle) / v: nothing is felt, wherever on the arc."""
    angle = np.linspace(-1.5, 1.5, 31)
    rate = -9.81 * np.cos(angle) / 150.0
    load = vertical_plane_load_factor(angle, rate, 150.0)
    assert np.abs(load).max() < 1e-15  # one rounding


def test_equation_1_without_the_weight() -> None:
    """Eq. (1): load w_maneuver v, so G = w_maneuver v / g while the rate is held, 0 when level."""
    config = climb_dive(weight=False)
    load = load_factors(config)
    paper = 0.1635 * 120.0 / 9.81
    pull_up = config.pulses()[0]
    held = round(100 * (pull_up.start_s + pull_up.transition_s)) + 1
    assert load[held] == pytest.approx(paper, rel=1e-15)
    assert load.max() == pytest.approx(paper, rel=1e-15)
    assert (load[:150] == 0.0).all()
    assert load[-1] == 0.0


def test_weight_adds_the_cosine_of_the_flight_path_angle() -> None:
    angle = flight_path_angle(climb_dive(), np.arange(2002) / 100.0)
    difference = load_factors(climb_dive()) - load_factors(climb_dive(weight=False))
    np.testing.assert_allclose(difference, np.cos(angle), atol=1e-14)  # rounding of 4 g


def test_default_flight_is_the_documented_one() -> None:
    """Level, 3 g, 0 to 0.3 g, 3 g, level, in about 20 s; the path ends level."""
    config = climb_dive()
    pull_up, push_over, pull_out = config.pulses()
    load = load_factors(config)
    times = np.arange(len(load)) / 100.0
    assert load[0] == load[-1] == 1.0
    for pulse in (pull_up, pull_out):
        inside = (times >= pulse.start_s) & (times <= pulse.end_s)
        # 1 + 2 at angle 0; at the end of the hold the angle has taken at most 1 - cos(0.36) = 0.064
        assert 2.94 < load[inside].max() < 3.0
    over = times[(times > push_over.start_s) & (times < push_over.end_s)]
    held = load[np.searchsorted(times, over[0] + 0.4) : np.searchsorted(times, over[-1] - 0.4)]
    assert held.min() > 0.0
    assert held.max() < 0.3
    assert 19.0 < pull_out.end_s + config.level_s < 20.0


def test_climb_and_dive_are_flown_at_their_angles() -> None:
    config = climb_dive(climb_angle_rad=0.5, dive_angle_rad=0.3, climb_s=1.0, dive_s=1.0)
    pull_up, push_over, pull_out = config.pulses()
    times = np.array([0.0, pull_up.end_s + 0.5, push_over.end_s + 0.5, pull_out.end_s, 1e5])
    angle = flight_path_angle(config, times)
    np.testing.assert_allclose(angle, [0.0, 0.5, -0.3, 0.0, 0.0], atol=1e-15)


def test_rate_pulse_by_hand() -> None:
    """Rise 1 s, hold 2 s, fall 1 s at 0.2 rad/s: turns 0.2 (1 + 2) rad, half in the middle."""
    pulse = RatePulse(start_s=10.0, rate_rad_s=0.2, transition_s=1.0, hold_s=2.0)
    times = np.array([9.0, 10.5, 11.0, 12.0, 13.0, 13.5, 14.0, 99.0])
    rate = [0.0, 0.1, 0.2, 0.2, 0.2, 0.1, 0.0, 0.0]
    # the integral of 3x^2 - 2x^3 to 1/2 is 1/8 - 1/32 = 3/32
    angle = [0.0, 0.2 * 3 / 32, 0.1, 0.3, 0.5, 0.2 * (3 - 3 / 32), 0.6, 0.6]
    np.testing.assert_allclose(pulse.rate(times), rate, atol=1e-15)
    np.testing.assert_allclose(pulse.angle(times), angle, atol=1e-15)
    assert pulse.end_s == 14.0


@pytest.mark.parametrize(
    ('bank_deg', 'load_factor'), [(0.0, 1.0), (45.0, math.sqrt(2.0)), (60.0, 2.0), (-60.0, 2.0)]
)
def test_coordinated_turn(bank_deg: float, load_factor: float) -> None:
    """1 / cos(bank): 60 degrees of bank are 2 g on either side, and nothing is lateral."""
    config = parse_maneuver({'profile': 'turn', 'bank_rad': math.radians(bank_deg)})
    grid = load_grid(config, 16.0)
    assert grid[800, 0] == pytest.approx(9.81 * load_factor, rel=1e-14)
    assert (grid[:, 1] == 0.0).all()
    assert grid[0, 0] == grid[-1, 0] == 9.81


def test_coordinated_turn_balances_the_centripetal_acceleration() -> None:
    """Without slip tan(bank) = a / g, and the load is the hypotenuse of g and a."""
    bank = np.linspace(-1.4, 1.4, 29)
    load = coordinated_turn_load_factor(bank)
    np.testing.assert_allclose(load, np.hypot(1.0, np.tan(bank)), rtol=1e-14)


def test_slip_is_the_only_lateral_load_of_a_turn() -> None:
    config = parse_maneuver(
        {'profile': 'turn', 'bank_rad': math.radians(60.0), 'slip_load_factor': -0.2}
    )
    grid = load_grid(config, 16.0)
    np.testing.assert_allclose(grid[800], [2.0 * 9.81, -0.2 * 9.81], rtol=1e-14)
    assert (grid[:151, 1] == 0.0).all()
    # halfway through rolling in: half the bank, half the slip
    np.testing.assert_allclose(grid[225], [9.81 / math.cos(math.radians(30.0)), -0.981], rtol=1e-14)


def test_sinusoid_by_hand() -> None:
    """2 + 1.5 sin(2 pi t / 4 s + pi/2): 3.5 at 0, 2 at 1 s, 0.5 at 2 s."""
    config = parse_maneuver(
        {
            'profile': 'sinusoid',
            'mean': 2.0,
            'amplitude': 1.5,
            'frequency_hz': 0.25,
            'phase_rad': math.pi / 2.0,
        }
    )
    grid = load_grid(config, 4.0)
    np.testing.assert_allclose(grid[[0, 100, 200, 300], 0] / 9.81, [3.5, 2.0, 0.5, 2.0], atol=1e-14)


def test_step_and_ramp_by_hand() -> None:
    step = load_grid(parse_maneuver({'profile': 'step', 'after': 3.0, 'at_s': 0.5}), 1.0)
    np.testing.assert_array_equal(step[:, 0], 9.81 * np.where(np.arange(102) < 50, 1.0, 3.0))
    ramp = load_grid(
        parse_maneuver({'profile': 'ramp', 'after': 5.0, 'start_s': 1.0, 'duration_s': 2.0}), 4.0
    )
    np.testing.assert_allclose(ramp[[0, 100, 150, 200, 300, 400], 0] / 9.81, [1, 1, 2, 3, 5, 5])


def test_sequence_by_hand() -> None:
    """1 g, then 3 g blended in over 0.4 s: halfway 2 g, a quarter in 1 + 2 * 5/32."""
    config = parse_maneuver(
        {
            'profile': 'sequence',
            'blend_s': 0.4,
            'segments': [
                {'duration_s': 2.0, 'maneuver': {'profile': 'constant'}},
                {'duration_s': 1.0, 'maneuver': {'profile': 'constant', 'load_factor': 3.0}},
                {
                    'duration_s': 1.0,
                    'maneuver': {'profile': 'ramp', 'before': 3.0, 'after': 4.0, 'duration_s': 1.0},
                },
            ],
        }
    )
    load = load_grid(config, 9.0)[:, 0] / 9.81
    at = [0, 199, 200, 210, 220, 240, 299, 350, 400, 900]
    # the ramp starts within its own segment and the last segment goes on
    expected = [1.0, 1.0, 1.0, 1.0 + 2.0 * 5.0 / 32.0, 2.0, 3.0, 3.0, 3.5, 4.0, 4.0]
    np.testing.assert_allclose(load[at], expected, rtol=1e-14)
