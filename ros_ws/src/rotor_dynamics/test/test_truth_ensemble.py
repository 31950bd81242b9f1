# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The SIMD lanes against the readable model, scipy's DOP853, and tangents against differences.

Lengths are in units of the length scale, derivatives by tau unless said otherwise.
"""

import math
from collections.abc import Callable
from typing import Any

import hou_equations
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from rotor_common.constants import GRAVITY_M_S2
from rotor_dynamics import Ensemble, OperatingPoint, lyapunov_exponent
from rotor_dynamics.ensemble import engine_of, plant_of
from rotor_sim import RotorParameters
from rotor_sim.plant.compiled_plant import Instant
from rotor_sim.plant.elements import hou_crack
from rotor_sim.plant.force_source import Names, Term, Writer, follow
from rotor_sim.plant.hou2016 import hou2016
from rotor_sim.plant.parameters import VARIANTS

Array = NDArray[np.float64]
Revolutions = Callable[..., tuple[Array, Array]]

SPEED = 352.0
KINDS: dict[str, dict[str, Any]] = {
    '8 balls': {},
    '7 balls': {'ball_count': 7},
    '14 balls': {'ball_count': 14},  # 7 pairs: compiled with the 7 balls
    'clearance': {'clearance_m': 5e-6},
    'alpha 0.9': {'crack_half_angle_rad': 0.9},
    'alpha pi/2': {'crack_half_angle_rad': math.pi / 2},
    'alpha 0.05': {'crack_half_angle_rad': 0.05},
}
CASES = [(variant, kind) for variant in VARIANTS for kind in KINDS]
every_case = pytest.mark.parametrize(('variant', 'kind'), CASES)


@every_case
def test_the_engine_of_a_point_is_that_of_its_plant(variant: str, kind: str) -> None:
    where = point(variant, **KINDS[kind], crack_stiffness_ratio=0.0)
    assert engine_of(where) == plant_of(where).engine.text


def units(parameters: RotorParameters) -> Array:
    """What a state in units of the length scale is multiplied by to be in m and m/s."""
    return np.repeat([1.0, SPEED], 6) * parameters.length_scale_m


def point(variant: str, /, **changes: Any) -> OperatingPoint:
    return OperatingPoint(RotorParameters.hou2016(variant, **changes), SPEED, 3.0)


# --- states ---------------------------------------------------------------------------------


@every_case
def test_one_revolution_is_that_of_the_model(
    variant: str, kind: str, section_4_start: Array
) -> None:
    """Section 4's start and five wild ones, with the cage where it stands after 3 revolutions."""
    where = point(variant, **KINDS[kind])
    p, steps = where.parameters, 64
    wild = 1.5 * np.random.default_rng(0).standard_normal((5, 12))
    start = np.vstack([section_4_start, wild]) * units(p)
    ensemble = Ensemble([where] * len(start), steps, start, revolution=3)
    ensemble.advance(1)

    def drive(time_s: float) -> hou_equations.Drive:
        angle = SPEED * time_s
        cage = p.cage_ratio * (angle + 6.0 * math.pi)
        return hou_equations.Drive(angle, SPEED, 3.0 * GRAVITY_M_S2, cage_angle_rad=cage)

    expected, step_s = start, 2.0 * math.pi / SPEED / steps
    for step in range(steps):
        expected = hou_equations.rk4_step(p, expected, step * step_s, step_s, drive)
    difference = np.abs(ensemble.states - expected) / units(p)
    size = np.abs(expected / units(p)).max(axis=1, keepdims=True)
    # rounding only; wild contacts multiply it, 7e-13 of the largest number was seen
    assert (difference <= 3e-12 * size).all()


@every_case
def test_twenty_revolutions_are_those_of_the_live_kernel(
    variant: str, kind: str, run_revolutions: Revolutions
) -> None:
    """The stream is held to the equations by test_kernel_is_the_model."""
    where = point(variant, **KINDS[kind])
    ensemble = Ensemble([where] * 5, 128)
    ensemble.advance(20)
    _, expected = run_revolutions(where.parameters, SPEED, 3.0, steps=128, revolutions=20)
    # rounding only: 20 revolutions x 128 steps, motions without a positive exponent; 3e-12 seen
    states = ensemble.states / units(where.parameters)
    np.testing.assert_allclose(states, np.tile(expected, (5, 1)), rtol=0, atol=1e-11)


@pytest.mark.parametrize('count', [1, 5])  # one lane, and sixteen
@pytest.mark.parametrize(
    ('variant', 'expected'),
    [
        ('derived', (4.060844, 2.872539, 1.196027, 0.738812)),
        ('figure', (3.090793, -0.734131, 0.993563, -0.330060)),
    ],
)
def test_printed_states_after_20_revolutions(
    variant: str, expected: tuple[float, ...], count: int
) -> None:
    where = point(variant)
    ensemble = Ensemble([where] * count, 128)
    ensemble.advance(20)
    # printed to 6 decimals: half a unit, and as much again for another order of rounding
    states = ensemble.states[:, :4] / where.parameters.length_scale_m
    np.testing.assert_allclose(states, np.tile(expected, (count, 1)), rtol=0, atol=1e-6)


def dimensionless(p: RotorParameters, load_factor: float) -> Callable[[float, Array], list[float]]:
    """d(state)/d(tau) as docs/physics.md prints it, written down a second time; no `figure`."""
    natural = p.variant == 'natural'
    delta = p.disk_mass_kg * GRAVITY_M_S2 / (2.0 * p.shaft_stiffness_n_m)
    s2 = SPEED**2 * p.disk_mass_kg / (2.0 * p.shaft_stiffness_n_m)
    n, xi, alpha = p.disk_mass_kg / p.bearing_mass_kg, p.damping_ratio, p.crack_half_angle_rad
    kb = math.sqrt(delta) * p.contact_stiffness_n_m15 / (p.bearing_mass_kg * SPEED**2)
    cage = p.inner_radius_m / (p.inner_radius_m + p.outer_radius_m)

    def opening(theta: float) -> float:
        theta %= 2.0 * math.pi
        if natural and theta > 1.5 * math.pi + alpha:
            return 0.0
        away = min(theta, 2.0 * math.pi - theta)
        if away <= 0.5 * math.pi - alpha:
            return 1.0
        if away >= 0.5 * math.pi + alpha:
            return 0.0
        return 0.5 + 0.5 * math.cos((away - 0.5 * math.pi + alpha) * math.pi / (2.0 * alpha))

    def rates(tau: float, state: Array) -> list[float]:
        y, z, y1, z1, y2, z2, vy, vz, vy1, vz1, vy2, vz2 = state
        phi = math.atan(y / z) if natural else math.atan2(z, y)
        psi = tau + p.crack_angle_rad
        c, s = math.cos(psi), math.sin(psi)
        crack = opening(psi - phi) * p.crack_stiffness_ratio / (2.0 * s2)
        a, b = 2 * y - y1 - y2, 2 * z - z1 - z2
        unbalance = p.eccentricity_m / delta
        out = [vy, vz, vy1, vz1, vy2, vz2]
        out += [
            unbalance * math.cos(tau) + load_factor / s2 - 2 * xi * (2 * vy - vy1 - vy2)
            - a / (2 * s2) + crack * c * (c * a + s * b),
            unbalance * math.sin(tau) - 2 * xi * (2 * vz - vz1 - vz2)
            - b / (2 * s2) + crack * s * (c * a + s * b),
        ]  # fmt: skip
        if not natural:
            crack *= n
        for yi, zi, vyi, vzi in ((y1, z1, vy1, vz1), (y2, z2, vy2, vz2)):
            bend = c * (yi - y) + s * (zi - z)
            ay = 2 * n * xi * (vy - vyi) + n / (2 * s2) * (y - yi) + crack * c * bend
            az = 2 * n * xi * (vz - vzi) + n / (2 * s2) * (z - zi) + crack * s * bend
            for j in range(p.ball_count):
                ball = 2.0 * math.pi * j / p.ball_count + cage * tau
                pressed = yi * math.cos(ball) + zi * math.sin(ball) - p.clearance_m / delta
                ay -= kb * max(pressed, 0.0) ** 1.5 * math.cos(ball)
                az -= kb * max(pressed, 0.0) ** 1.5 * math.sin(ball)
            out += [ay + load_factor / s2, az]
        return out

    return rates


@pytest.mark.parametrize(
    ('variant', 'changes', 'steps', 'bound'),
    [
        # the order with contact is 3.4 to 4.1: 7e-6 at N = 1024, seen, is at most 7e-8 at 4096
        ('derived', {}, 4096, 1e-7),
        # six times that with clearance, where balls come and go
        ('derived', {'ball_count': 7, 'clearance_m': 2e-6}, 4096, 1e-6),
        ('derived', {'crack_half_angle_rad': 0.9, 'crack_stiffness_ratio': 0.3}, 4096, 1e-7),
        # a jump is seen up to a step late: K/(2 s^2) |a| = 0.6 x 3 of velocity by tau, over a step
        # of 4e-4, some crossings in a revolution
        ('natural', {}, 16384, 1e-3),
    ],
)
def test_one_revolution_is_that_of_dop853(
    variant: str, changes: dict[str, Any], steps: int, bound: float, section_4_start: Array
) -> None:
    where = point(variant, **changes)
    solution = solve_ivp(
        dimensionless(where.parameters, 3.0),
        (0.0, 2.0 * math.pi),
        section_4_start,
        'DOP853',
        rtol=1e-12,
        atol=1e-12,
    )
    ensemble = Ensemble([where] * 5, steps)
    ensemble.advance(1)
    state = ensemble.states[0] / units(where.parameters)
    np.testing.assert_allclose(state, solution.y[:, -1], rtol=0, atol=bound)


def test_divergence_is_nan_for_that_trajectory_alone() -> None:
    """Twice the step that RK4 bears: the bearings' modes grow without bound."""
    good = [point('derived', crack_stiffness_ratio=k) for k in (0.0, 0.1, 0.2, 0.3)]
    slow = OperatingPoint(RotorParameters.hou2016('derived'), 40.0, 3.0)
    alone, together = Ensemble([*good, good[0]], 128), Ensemble([*good, slow], 128)
    with np.errstate(all='raise'):  # nor does it warn
        together.advance(50)
    alone.advance(50)
    assert not np.isfinite(together.states[4]).any()
    assert np.array_equal(together.states[:4], alone.states[:4])
    assert np.isfinite(alone.states).all()
    tangents = together.advance_tangents(np.ones(12))
    assert not np.isfinite(tangents[4]).any()
    assert np.isfinite(tangents[:4]).all()


# --- the breathing function -----------------------------------------------------------------


def breathing(where: OperatingPoint, theta: Array) -> Array:
    """Return f and df/dtheta (2, ...) as the engine computes them."""
    _, crack = next(e for e in hou2016(where.parameters).named_elements() if e[0] == 'crack')
    writer = Writer(tangent=True)
    (f,) = follow(
        hou_crack.breathing,
        [
            Term('cosine', 'cosine_change'),
            Term('sine', 'sine_change'),
            1.0,
            Names('p', crack.coefficients()),
            Names('s', crack.structure()),
        ],
        writer,
        'crack',
    )
    code = compile('\n'.join(writer.lines), 'breathing', 'exec')
    found = []
    for cosine, sine in zip(np.cos(theta), np.sin(theta), strict=True):
        names = {
            'math': math,
            'cosine': cosine,
            'sine': sine,
            'cosine_change': -sine,
            'sine_change': cosine,
        }
        exec(code, names)  # noqa: S102 - the lines under test
        found.append([names[f.text], names[f.change]])
    return np.array(found).T


HALF_ANGLES = [0.01, 0.011, 0.03, 0.1, 0.29, 0.3, 0.5, math.pi / 6, 0.9, 1.2, 1.5, math.pi / 2]


@pytest.mark.parametrize(
    ('variant', 'half_angle'),
    [
        (variant, half_angle)
        for variant in ('derived', 'natural', 'figure')
        for half_angle in HALF_ANGLES
    ],
)
def test_breathing_is_that_of_the_model(variant: str, half_angle: float) -> None:
    """The three readings of eq. (4), one in each of these variants."""
    where = point(variant, crack_half_angle_rad=half_angle)
    convention = where.parameters.theta_convention
    edges = np.array([0.5 * math.pi - half_angle, 0.5 * math.pi + half_angle])
    edges = np.concatenate([edges, 2.0 * math.pi - edges, [0.0, 2.0 * math.pi]])
    # evenly, and within both slopes up to 1e-6 of their ends
    part = 1.0 - np.geomspace(1e-6, 1.0, 25)
    slopes = [m + half_angle * q for m in (0.5 * math.pi, 1.5 * math.pi) for q in (part, -part)]
    theta = np.concatenate([np.linspace(0.001, 6.282, 301), *slopes])
    theta = theta[np.abs(theta[:, None] - edges).min(axis=1) > 5e-7 * half_angle]
    f, rate = breathing(where, theta)
    expected = hou_equations.breathing(theta, half_angle, convention)
    # rounding of theta, 6e-16, over alpha
    np.testing.assert_allclose(f, expected, rtol=0, atol=1e-13 + 1e-15 / half_angle)
    # by differences, 1e-3 of alpha wide: (pi/2 1e-3)^2/6 = 4e-7 of the slope, pi/(4 alpha)
    step = 1e-3 * half_angle
    inside = np.abs(theta[:, None] - edges).min(axis=1) > step
    high, low = (
        hou_equations.breathing(theta + side * step, half_angle, convention) for side in (1.0, -1.0)
    )
    slope = (high - low) / (2.0 * step)
    np.testing.assert_allclose(rate[inside], slope[inside], rtol=0, atol=1e-6 / half_angle)


# --- tangents -------------------------------------------------------------------------------


def linear_matrix(p: RotorParameters) -> Array:
    """Return A of x' = A x (by tau) without contact and crack, off the paper's equations (5)."""
    coupling = np.array([[2.0, -1.0, -1.0], [-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])
    mass = np.array([p.disk_mass_kg, p.bearing_mass_kg, p.bearing_mass_kg])
    per_mass = np.kron(coupling / mass[:, None], np.eye(2))
    a = np.zeros((12, 12))
    a[:6, 6:] = np.eye(6)
    a[6:, :6] = -p.shaft_stiffness_n_m / SPEED**2 * per_mass
    a[6:, 6:] = -2.0 * p.damping_ratio * p.disk_mass_kg * per_mass
    return a


def test_tangents_of_a_linear_rotor_are_the_matrix_exponential() -> None:
    where = point('derived', contact_stiffness_n_m15=0.0, crack_stiffness_ratio=0.0)
    found = Ensemble([where] * 12, 4096).advance_tangents(np.eye(12), 3)
    exact = expm(linear_matrix(where.parameters) * 6.0 * math.pi).T
    # RK4 loses 7.9^5 (2 pi/4096)^4/120 x 6 pi = 3e-8 of the fastest mode, and its velocity is 7.9
    # times its displacement; it is damped to a sixth by then
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-7)


@every_case
def test_changes_of_accelerations_are_their_differences(variant: str, kind: str) -> None:
    """All kinds at wild states, off the jumps: a tangent is what RK4 makes of these changes."""
    where = point(variant, **KINDS[kind])
    p = where.parameters
    plant = plant_of(where)
    rng = np.random.default_rng(2)
    ratios = []
    for _ in range(30):
        state, change = rng.standard_normal((2, 12)) * p.length_scale_m
        state[6:] *= SPEED
        change[6:] *= SPEED
        at = Instant(float(rng.uniform(0.0, 2.0 * math.pi)), SPEED, (3.0 * GRAVITY_M_S2, 0.0))
        found = plant.jacobian(state, at) @ change
        high = plant.acceleration(state + 1e-6 * change, at)
        low = plant.acceleration(state - 1e-6 * change, at)
        expected = (high - low) / 2e-6
        ratios.append(np.abs(found - expected).max() / np.abs(expected).max())
    # rounding 1e-16/1e-6 and curvature 1e-12; among 30 states one may lie within 1e-6 of a jump
    # or of an end of a branch, where the slope bends
    assert np.sort(ratios)[-2] < 1e-8


def differences(
    points: list[OperatingPoint],
    states: Array,
    direction: Array,
    part: float,
    steps: int,
) -> tuple[Array, Array, Array]:
    """One revolution: central differences, tangents with and without saltation, each (n, 12).

    `direction` in length scales; the neighbours are `part` of it away on either side. All in one
    ensemble, which advances tangents of the neighbours that nobody looks at.
    """
    scale = np.array([p.parameters.length_scale_m for p in points])[:, None]
    step = part * scale * direction * np.repeat([1.0, SPEED], 6)
    rows = np.concatenate([states, states + step, states - step])
    tangents = np.tile(direction, (3, 1))
    found = []
    for saltation in (True, False):
        ensemble = Ensemble(points * 3, steps, rows, revolution=7)
        moved = ensemble.advance_tangents(tangents, saltation=saltation)
        found.append(moved[: len(points)])
    _, up, down = np.split(ensemble.states / np.repeat([1.0, SPEED], 6), 3)
    return (up - down) / (2.0 * part * scale), found[0], found[1]


def error(found: Array, expected: Array) -> Array:
    return np.asarray(np.linalg.norm(found - expected, axis=1) / np.linalg.norm(expected, axis=1))


def settled(points: list[OperatingPoint], revolutions: int = 200) -> Array:
    ensemble = Ensemble(points, 256)
    ensemble.advance(revolutions)
    return ensemble.states


@pytest.mark.parametrize('saltation', [True, False])
@pytest.mark.parametrize(
    'changes',
    [
        {},
        {'crack_stiffness_ratio': 0.3, 'clearance_m': 2e-6},
    ],
)
def test_tangents_of_derived_are_differences(
    changes: dict[str, Any], saltation: bool, section_4_start: Array
) -> None:
    """f is continuous: there is nothing to jump, asked or not. Other kinds: above."""
    where = point('derived', **changes)
    rng = np.random.default_rng(3)
    wild = rng.standard_normal((3, 12))
    states = np.vstack([section_4_start, wild]) * units(where.parameters)
    direction = rng.standard_normal(states.shape)
    finite, *found = differences([where] * len(states), states, direction, 1e-6, 512)
    # contact bends like the root of the displacement: an error of 1e-6^1.5, and rounding
    # 1e-16/1e-6; 1e-8 was seen, and 1e-4 would still tell a missing term
    assert (error(found[0 if saltation else 1], finite) < 1e-5).all()


def crossings(where: OperatingPoint, state: Array) -> tuple[int, int, int]:
    """Count in one revolution: flips of phi, entries and exits of theta > 3pi/2 + alpha, both."""
    p, steps = where.parameters, 4096
    ensemble = Ensemble([where], steps, state, revolution=7)
    y, z = ensemble.advance(1, steps)[0, :, :2].T
    tau = 2.0 * math.pi * np.arange(steps) / steps
    theta = np.mod(
        tau + p.crack_angle_rad - hou_equations.phase(y, z, p.phase_convention), 2.0 * math.pi
    )
    beyond = np.diff(theta > 1.5 * math.pi + p.crack_half_angle_rad)
    flips = np.diff(z < 0.0) & (p.phase_convention == 'arctan_y_over_z')
    return int(flips.sum()), int((beyond & ~flips).sum()), int((beyond & flips).sum())


@pytest.mark.slow
def test_saltation_makes_tangents_differences_where_f_jumps() -> None:
    """Aizerman and Gantmakher 1958. A neighbour must cross some steps earlier or later."""
    points = [
        point('natural', crack_stiffness_ratio=0.1),
        point('natural', crack_stiffness_ratio=0.2),
        point('figure', crack_stiffness_ratio=0.1),
        point('figure', crack_stiffness_ratio=0.2),
        point('figure_chaos', crack_stiffness_ratio=0.2),
    ]
    states = settled(points)
    found = [crossings(where, state) for where, state in zip(points, states, strict=True)]
    for (flips, pieces, both), where in zip(found, points, strict=True):
        assert pieces > 0
        natural = where.parameters.variant == 'natural'
        # with a flip theta may also leave `beyond`: one crossing, not two and not none
        assert (flips > 0) == (both > 0) == natural
    direction = np.random.default_rng(1).standard_normal(states.shape)
    finite, with_jumps, without = differences(points, states, direction, 5e-3, 2**19)
    # crossings are seen a step of 1.2e-5 late where they move by 5e-3, and contact bends: 1e-3 to
    # 1e-2 of the tangent, which falls with smaller steps; without jumps 0.02 to 0.34 is missing
    assert (error(with_jumps, finite) < 0.02).all()
    assert (error(with_jumps, finite) < 0.1 * error(without, finite)).all()


@pytest.mark.parametrize(
    ('variant', 'crack'), [('derived', 0.1), ('natural', 0.2), ('figure', 0.1)]
)
def test_exponents_add_up_to_the_trace(variant: str, crack: float) -> None:
    """Liouville: only the dampers are on the diagonal of the Jacobian, and a jump keeps volume.

    The jump I + (F+ - F-) grad(h)'/h' has the determinant 1: F jumps in the accelerations alone,
    h depends on the displacements alone.
    """
    where = point(variant, crack_stiffness_ratio=crack)
    p = where.parameters
    ratio = p.disk_mass_kg / p.bearing_mass_kg
    # disk: y'' has -2 xi (2 y' - ...), and z''; bearings: four times -2 xi m/m_b
    trace = -(2 * 4.0 + 4 * 2.0 * ratio) * p.damping_ratio
    found = lyapunov_exponent(
        p,
        speed_rad_s=SPEED,
        load_factor=3.0,
        transient_revolutions=100,
        revolutions=50,
        steps_per_revolution=1024,
        spectrum=True,
    )
    assert found.spectrum is not None
    # RK4 damps the modes near 14 a radian by 14^6 h^5/72 each: 9e-6 x 8 at h = 2 pi/1024
    assert found.spectrum.sum() == pytest.approx(trace, abs=1e-4)
    assert found.spectrum.shape == (12,)
    assert (np.diff(found.spectrum) <= 0.0).all()
    # the largest is that of one tangent, up to what 50 revolutions leave of the other directions
    assert found.spectrum[0] == pytest.approx(found.exponent, abs=3e-3)
