# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: PLR0917 - compiled functions take no keyword-only arguments
"""The equations of `model` and classical RK4, compiled: L rotors side by side in lanes.

One source, two widths: L = 1 is the stream of one rotor, L = 16 a fleet. No fastmath: nothing is
reassociated or contracted, NaN stays NaN, and all that a lane does is +, -, x, /, square roots and
choices, which IEEE 754 defines to the last bit. So a lane has the same bits alone and among others,
and on every processor.

Layout: one flat buffer, `b[row * L + lane]`. L and the number of balls are known to the compiler as
lengths of tuples. Only so (one buffer, one loop over lanes with everything inlined) does LLVM
vectorise. `cache=True` keeps the machine code on disk; every callee stands at module level.

No library function is called: cos and sin of shaft and cage come from `_cos_sin` at each sample
and are turned by half-steps from there; the breathing function is one of cos(theta), sin(theta).
The bearings are alike. Once they move alike, as after every start from rest, the second repeats the
first to the last bit and is not computed.
All of it stands in this file: the cache does not notice a change in another.
"""

import math
from collections.abc import Callable
from typing import Any, Protocol, TypeVar

import numba
import numpy as np
from numpy.typing import NDArray

from rotor_common import machine_code
from rotor_sim.plant.breathing import breathing_polynomial
from rotor_sim.plant.parameters import RotorParameters

Array = NDArray[np.float64]
Function = TypeVar('Function', bound=Callable[..., Any])

OUTPUTS = 16
"""Columns of a sampled row: six displacements (m), four bearing accelerations, load y and z
(m/s^2), contact force on journal 1 y, z and on journal 2 y, z (N)."""

(ANGLE, CAGE, SPEED, SPEED_INCREMENT, CRACK, CRACK_INCREMENT) = range(6)
DRIVES = 6
"""Columns of what drives a lane at a sample: shaft and cage angle, speed, crack; increments are
those over the sample, so that a jump at a sample never reaches into the one before."""

STATE = 0
(
    COS_SHAFT,
    SIN_SHAFT,
    COS_CAGE,
    SIN_CAGE,
    LOAD_Y,
    LOAD_Z,
    MIDDLE_LOAD_Y,
    MIDDLE_LOAD_Z,
    END_LOAD_Y,
    END_LOAD_Z,
) = range(12, 22)
SAMPLED = 22
"""Rows from here: accelerations of the bearings, contact forces over -K_b, at a step's start."""
DRIVE = SAMPLED + 8
_COEFFICIENTS = DRIVE + DRIVES
(
    CAGE_RATIO,
    STIFFNESS_DISK,
    STIFFNESS_BEARING,
    CRACK_DISK,
    CRACK_BEARING,
    COUPLING,
    DAMPING_DISK,
    DAMPING_BEARING,
    ECCENTRICITY,
    CONTACT,
    MINUS_CONTACT,
    CLEARANCE,
    CLEARANCE_BEHIND,
    LOAD_SCALE,
    FORCING_COS,
    FORCING_SIN,
    COS_CRACK,
    SIN_CRACK,
    PHASE_FROM_Z,
    PHASE_FLIP,
    LIMIT,
    LIMIT_BEYOND,
    BREATHING_RATE,
    GAP,
    BALLS,
) = range(_COEFFICIENTS, _COEFFICIENTS + 25)
"""Coefficients of a lane, see `pack`. From BALLS on: the cosines, then the sines of the pairs of
opposite balls, or of the balls if their number is odd; then the polynomial of the breathing."""

PAIRS_OF_EIGHT = 4
BREATHING_TERMS = 20
"""Of the polynomial of the breathing function; its error is below 1e-14."""

HALF_ROOT = math.sqrt(0.5)

_TURN = 2.0 * math.pi
_TWO_OVER_PI = 2.0 / math.pi
_QUARTER_TURN = 1.57079632673412561417  # the first 33 bits of pi/2, times a small integer exact
_QUARTER_TURN_REST = 6.07710050650619224932e-11
_ROUND = 1.5 * 2.0**52
"""Added and taken away again: rounds to the nearest integer."""
_TAN_EIGHTH_TURN = math.sqrt(2.0) - 1.0


class _Decorator(Protocol):
    def __call__(self, function: Function, /) -> Function: ...


_OPTIONS: dict[str, Any] = {
    'cache': machine_code.can_be_kept(__file__),
    'fastmath': False,
    'error_model': 'numpy',
    'nogil': True,
}
_jit: _Decorator = numba.njit(**_OPTIONS)
_inline: _Decorator = numba.njit(**_OPTIONS, forceinline=True)


def kind(parameters: RotorParameters) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the tuples `balls` and `curve` of `integrate`; lanes of one call share them.

    A half angle of 30 degrees, the paper's, has a closed form; then `curve` is empty. For others it
    is as long as the polynomial, or 1 where theta itself is needed: in a continued last branch.
    """
    count = parameters.ball_count
    directions = count // 2 if count % 2 == 0 else count
    if abs(parameters.crack_half_angle_rad - math.pi / 6.0) < 1e-12:
        terms = 0
    else:
        terms = 1 if parameters.theta_convention == 'last_branch' else BREATHING_TERMS
    return (0,) * directions, (0,) * terms


def alike(states: Array) -> tuple[int, ...]:
    """Return the tuple `alike` of `integrate` for the states (lanes, 12) it starts from.

    Empty unless in each lane both bearings are at the same place with the same velocity, bit for
    bit. They then stay so, since nothing in the equations tells one from the other.
    """
    first, second = states[:, [2, 3, 8, 9]], states[:, [4, 5, 10, 11]]
    return (0,) if first.tobytes() == second.tobytes() else ()


def pack(
    parameters: RotorParameters, forcing_n: float = 0.0, forcing_phase_rad: float = 0.0
) -> Array:
    """Return the coefficients of a lane, the rows from CAGE_RATIO on.

    `forcing_n` cos, sin(2 x shaft angle + `forcing_phase_rad`) is a force on the disk along y, z.
    """
    p = parameters
    balls, curve = kind(p)
    k, m, m_b = p.shaft_stiffness_n_m, p.disk_mass_kg, p.bearing_mass_kg
    polynomial = np.empty(0)
    match len(curve):
        case 0:
            limit, widest = math.sin(p.crack_half_angle_rad), 1.0
        case 1:
            limit, widest = p.crack_half_angle_rad, 0.5 * math.pi
        case terms:
            limit, widest = math.tan(0.5 * p.crack_half_angle_rad), 1.0
            polynomial, _ = breathing_polynomial(p.crack_half_angle_rad, terms)
    values = {
        CAGE_RATIO: p.cage_ratio,
        STIFFNESS_DISK: k / m,
        STIFFNESS_BEARING: k / m_b,
        CRACK_DISK: p.crack_scale * k / m,
        CRACK_BEARING: p.bearing_crack_scale * k / m_b,
        COUPLING: -float(p.coupling_sign),
        DAMPING_DISK: 2.0 * p.damping_ratio,
        DAMPING_BEARING: 2.0 * p.damping_ratio * m / m_b,
        ECCENTRICITY: p.eccentricity_m,
        CONTACT: p.contact_stiffness_n_m15 / m_b,
        MINUS_CONTACT: -p.contact_stiffness_n_m15,
        CLEARANCE: p.clearance_m,
        CLEARANCE_BEHIND: p.clearance_m if p.ball_count % 2 == 0 else math.inf,
        LOAD_SCALE: p.load_scale,
        FORCING_COS: forcing_n * math.cos(forcing_phase_rad) / m,
        FORCING_SIN: forcing_n * math.sin(forcing_phase_rad) / m,
        COS_CRACK: math.cos(p.crack_angle_rad),
        SIN_CRACK: math.sin(p.crack_angle_rad),
        PHASE_FROM_Z: float(p.phase_convention != 'atan2_z_y'),
        PHASE_FLIP: -1.0 if p.phase_convention == 'arctan_y_over_z' else 1.0,
        LIMIT: limit,
        LIMIT_BEYOND: widest if p.theta_convention == 'last_branch' else limit,
        BREATHING_RATE: 0.5 * math.pi / p.crack_half_angle_rad,
        GAP: float(p.theta_convention != 'gap_open'),
    }
    rows = [values[row] for row in range(_COEFFICIENTS, BALLS)]
    angles = 2.0 * np.pi * np.arange(len(balls)) / p.ball_count
    return np.concatenate([rows, np.cos(angles), np.sin(angles), polynomial])


@_inline
def _turned(x: float, y: float, c: float, s: float) -> Any:
    return x * c - y * s, x * s + y * c


@_inline
def _small_cos_sin(x: float) -> Any:
    """Return cos, sin for |x| <= pi/4, to one unit in the last place (polynomials of fdlibm)."""
    z = x * x
    sine = -2.50507602534068634195e-08 + z * 1.58969099521155010221e-10
    sine = -1.98412698298579493134e-04 + z * (2.75573137070700676789e-06 + z * sine)
    sine = -1.66666666666666324348e-01 + z * (8.33333333332248946124e-03 + z * sine)
    cosine = 2.08757232129817482790e-09 + z * -1.13596475577881948265e-11
    cosine = 2.48015872894767294178e-05 + z * (-2.75573143513906633035e-07 + z * cosine)
    cosine = 4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * cosine)
    return 1.0 - z * (0.5 - z * cosine), x + x * z * sine


@_inline
def _cos_sin(x: float) -> Any:
    """Return cos, sin for |x| < 1e6."""
    quarters = (x * _TWO_OVER_PI + _ROUND) - _ROUND
    c, s = _small_cos_sin((x - quarters * _QUARTER_TURN) - quarters * _QUARTER_TURN_REST)
    # quarters modulo 4 in 0..3
    q = quarters - 4.0 * ((0.25 * quarters - 0.375 + _ROUND) - _ROUND)
    odd = q == 1.0 or q == 3.0  # noqa: PLR1714 - compiled
    cosine, sine = s if odd else c, c if odd else s
    return -cosine if q == 1.0 or q == 2.0 else cosine, -sine if q > 1.0 else sine  # noqa: PLR1714


@_inline
def _angle(x: float, y: float, length: float) -> float:
    """Return u in -pi/2..pi/2 with tan(u/2) = y/(length + |x|) (arctan of fdlibm)."""
    # less an eighth of a turn where that is large
    a, d = abs(y), length + abs(x)
    large = a > _TAN_EIGHTH_TURN * d
    x = (a - d if large else a) / (a + d if large else d)
    z = x * x
    p = -3.65315727442169155270e-02 + z * 1.62858201153657823623e-02
    p = -5.83357013379057348645e-02 + z * (4.97687799461593236017e-02 + z * p)
    p = -7.69187620504482999495e-02 + z * (6.66107313738753120669e-02 + z * p)
    p = -1.11111104054623557880e-01 + z * (9.09088713343650656196e-02 + z * p)
    p = -1.99999999998764832476e-01 + z * (1.42857142725034663711e-01 + z * p)
    p = x - x * z * (3.33333333333329318027e-01 + z * p)
    u = 2.0 * (p + (0.25 * math.pi if large else 0.0))
    return -u if y < 0.0 else u


@_inline
def _direction(b: Array, i: int, L: int, y: float, z: float, cos_psi: float, sin_psi: float) -> Any:
    """Return r cos(theta), r sin(theta) and r > 0, with theta = psi - phi; phi = 0 at rest."""
    square = y * y + z * z
    moved = square > 0.0
    flip = b[i + PHASE_FLIP * L]
    flip = flip if z < 0.0 else 1.0
    from_z = b[i + PHASE_FROM_Z * L] > 0.0
    along = flip * z if from_z else y
    across = flip * y if from_z else z
    along = along if moved else 1.0
    cosine = cos_psi * along + sin_psi * across
    sine = sin_psi * along - cos_psi * across
    return cosine, sine, math.sqrt(square) if moved else 1.0


@_inline
def _breathing(
    b: Array,
    i: int,
    L: int,
    cosine: float,
    sine: float,
    r: float,
    balls: tuple[int, ...],
    curve: tuple[int, ...],
) -> Any:
    """Return two factors of f, eq. (4), where (cosine, sine) are r times those of theta.

    With u = asin(cos(theta)) the first is (1 + sin(pi u/(2 alpha)))/2 in |u| <= alpha, and 1 or 0
    outside. For theta in (3pi/2 + alpha, 2pi) the second is GAP, which may close the crack, and a
    higher LIMIT_BEYOND continues the last branch; elsewhere the second is 1.
    """
    limit, limit_beyond, gap = b[i + LIMIT * L], b[i + LIMIT_BEYOND * L], b[i + GAP * L]
    # `place` is sin(u), u itself or tan(u/2): each grows with u
    if len(curve) == 0:
        place = cosine / r
    elif len(curve) == 1:
        place = _angle(sine, cosine, r)
    else:
        place = cosine / (r + abs(sine))
    beyond = sine < 0.0 and place > limit
    place = min(max(place, -limit), limit_beyond if beyond else limit)
    if len(curve) == 0:  # alpha = 30 degrees: sin(3u) = 3 sin(u) - 4 sin(u)^3
        f = (0.5 + 1.5 * place) - (2.0 * place) * (place * place)
    elif len(curve) == 1:
        _, swing = _cos_sin(place * b[i + BREATHING_RATE * L])
        f = 0.5 + 0.5 * swing
    else:
        # even and odd terms apart, since each product waits for the one before
        square = place * place
        fourth = square * square
        odd, even = 0.0, 0.0
        for k in range(0, len(curve), 2):
            odd = odd * fourth + b[i + (BALLS + 2 * len(balls) + k) * L]
            even = even * fourth + b[i + (BALLS + 2 * len(balls) + k + 1) * L]
        f = 0.5 + place * (odd * square + even)
    return f, gap if beyond else 1.0


@_inline
def _hertz(q: float, clearance: float, behind: float) -> float:
    """Return the load over K_b of a ball at q minus that of the ball opposite.

    One root for both: never are both pressed. For an odd number of balls `behind` is infinite,
    and there is none opposite.
    """
    pressed = q - min(max(q, -behind), clearance)
    return pressed * math.sqrt(abs(pressed))


@_inline
def _contact(
    b: Array,
    i: int,
    L: int,
    y: float,
    z: float,
    cos_cage: float,
    sin_cage: float,
    balls: tuple[int, ...],
) -> Any:
    """Sum of pressed^1.5 (cos, sin) over the balls, eq. (2)."""
    clearance = b[i + CLEARANCE * L]
    behind = b[i + CLEARANCE_BEHIND * L]
    # in the frame of the cage the balls stand still
    q, p = _turned(y, z, cos_cage, -sin_cage)
    if len(balls) == PAIRS_OF_EIGHT:  # at 0, 45, 90 and 135 degrees: no direction is needed
        f0 = _hertz(q, clearance, behind)
        f1 = _hertz(HALF_ROOT * (q + p), clearance, behind)
        f2 = _hertz(p, clearance, behind)
        f3 = _hertz(HALF_ROOT * (p - q), clearance, behind)
        along, across = f0 + HALF_ROOT * (f1 - f3), f2 + HALF_ROOT * (f1 + f3)
    else:
        along, across = 0.0, 0.0
        for j in range(len(balls)):
            c = b[i + (BALLS + j) * L]
            s = b[i + (BALLS + len(balls) + j) * L]
            f = _hertz(q * c + p * s, clearance, behind)
            along += f * c
            across += f * s
    return _turned(along, across, cos_cage, sin_cage)


@_inline
def _accelerations(
    b: Array,
    i: int,
    L: int,
    u: float,
    sample_s: float,
    x: Any,
    v: Any,
    shaft: Any,
    cage: Any,
    load: Any,
    balls: tuple[int, ...],
    curve: tuple[int, ...],
) -> Any:
    """Return the six accelerations, eq. (5a-f), and the contact forces over K_b.

    `u` is the time since the sample over `sample_s`; shaft and cage are (cos, sin), load is (y, z).
    """
    y, z, y1, z1, y2, z2 = x
    vy, vz, vy1, vz1, vy2, vz2 = v
    cos_shaft, sin_shaft = shaft
    cos_cage, sin_cage = cage
    speed = b[i + (DRIVE + SPEED) * L] + u * b[i + (DRIVE + SPEED_INCREMENT) * L]
    slope = b[i + (DRIVE + SPEED_INCREMENT) * L] / sample_s
    crack = b[i + (DRIVE + CRACK) * L] + u * b[i + (DRIVE + CRACK_INCREMENT) * L]
    cos_psi, sin_psi = _turned(cos_shaft, sin_shaft, b[i + COS_CRACK * L], b[i + SIN_CRACK * L])
    cosine, sine, r = _direction(b, i, L, y, z, cos_psi, sin_psi)
    f, gap = _breathing(b, i, L, cosine, sine, r, balls, curve)
    crack *= gap

    ry1, rz1, ry2, rz2 = y - y1, z - z1, y - y2, z - z2
    vry1, vrz1, vry2, vrz2 = vy - vy1, vz - vz1, vy - vy2, vz - vz2
    load_y, load_z = b[i + LOAD_SCALE * L] * load[0], b[i + LOAD_SCALE * L] * load[1]
    # eq. (3a-c): the open crack takes away f dk n n', n = (cos psi, +-sin psi)
    turned_psi = sin_psi * b[i + COUPLING * L]
    bend1, bend2 = cos_psi * ry1 + turned_psi * rz1, cos_psi * ry2 + turned_psi * rz2

    k, c = b[i + STIFFNESS_DISK * L], b[i + DAMPING_DISK * L] * speed
    e, square = b[i + ECCENTRICITY * L], speed * speed
    twice_y, twice_z = _turned(cos_shaft, sin_shaft, cos_shaft, sin_shaft)
    force_y, force_z = _turned(twice_y, twice_z, b[i + FORCING_COS * L], b[i + FORCING_SIN * L])
    push_y = e * (square * cos_shaft + slope * sin_shaft) + force_y + load_y
    push_z = e * (square * sin_shaft - slope * cos_shaft) + force_z + load_z
    lost = f * (b[i + CRACK_DISK * L] * crack * (bend1 + bend2))
    ay = push_y - c * (vry1 + vry2) - k * (ry1 + ry2) + cos_psi * lost
    az = push_z - c * (vrz1 + vrz2) - k * (rz1 + rz2) + turned_psi * lost

    k, c = b[i + STIFFNESS_BEARING * L], b[i + DAMPING_BEARING * L] * speed
    hertz, cut = b[i + CONTACT * L], b[i + CRACK_BEARING * L] * crack
    fy1, fz1 = _contact(b, i, L, y1, z1, cos_cage, sin_cage, balls)
    fy2, fz2 = _contact(b, i, L, y2, z2, cos_cage, sin_cage, balls)
    lost1, lost2 = f * (cut * bend1), f * (cut * bend2)
    ay1 = load_y + k * ry1 + c * vry1 - hertz * fy1 - cos_psi * lost1
    az1 = load_z + k * rz1 + c * vrz1 - hertz * fz1 - turned_psi * lost1
    ay2 = load_y + k * ry2 + c * vry2 - hertz * fy2 - cos_psi * lost2
    az2 = load_z + k * rz2 + c * vrz2 - hertz * fz2 - turned_psi * lost2
    return (ay, az, ay1, az1, ay2, az2), (fy1, fz1, fy2, fz2)


@_inline
def _moved(x: Any, v: Any, h: float) -> Any:
    return (
        x[0] + h * v[0],
        x[1] + h * v[1],
        x[2] + h * v[2],
        x[3] + h * v[3],
        x[4] + h * v[4],
        x[5] + h * v[5],
    )


@_inline
def _end(x: float, k1: float, k2: float, k3: float, k4: float, h: float) -> float:
    return x + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)


@_inline
def _ends(x: Any, k1: Any, k2: Any, k3: Any, k4: Any, h: float) -> Any:
    return (
        _end(x[0], k1[0], k2[0], k3[0], k4[0], h),
        _end(x[1], k1[1], k2[1], k3[1], k4[1], h),
        _end(x[2], k1[2], k2[2], k3[2], k4[2], h),
        _end(x[3], k1[3], k2[3], k3[3], k4[3], h),
        _end(x[4], k1[4], k2[4], k3[4], k4[4], h),
        _end(x[5], k1[5], k2[5], k3[5], k4[5], h),
    )


@_inline
def _load(b: Array, i: int, L: int, row: int, alike: tuple[int, ...]) -> Any:
    i += row * L
    if len(alike) > 0:  # of equal values the compiler computes what follows once
        return b[i], b[i + L], b[i + 2 * L], b[i + 3 * L], b[i + 2 * L], b[i + 3 * L]
    return b[i], b[i + L], b[i + 2 * L], b[i + 3 * L], b[i + 4 * L], b[i + 5 * L]


@_inline
def _store(b: Array, i: int, L: int, row: int, x: Any) -> None:
    i += row * L
    b[i] = x[0]
    b[i + L] = x[1]
    b[i + 2 * L] = x[2]
    b[i + 3 * L] = x[3]
    b[i + 4 * L] = x[4]
    b[i + 5 * L] = x[5]


@_inline
def _store_four(b: Array, i: int, L: int, row: int, x: Any, first: int) -> None:
    i += row * L
    b[i] = x[first]
    b[i + L] = x[first + 1]
    b[i + 2 * L] = x[first + 2]
    b[i + 3 * L] = x[first + 3]


@_inline
def _pair(b: Array, i: int, L: int, row: int) -> Any:
    return b[i + row * L], b[i + (row + 1) * L]


@_inline
def _step(
    b: Array,
    lanes: tuple[int, ...],
    step: int,
    substeps: int,
    sample_s: float,
    balls: tuple[int, ...],
    curve: tuple[int, ...],
    alike: tuple[int, ...],
) -> None:
    """One RK4 step of every lane, the `step`-th after a sample."""
    L = len(lanes)
    h = sample_s / substeps
    half = 0.5 * h
    u0, u1, u2 = step / substeps, (step + 0.5) / substeps, (step + 1) / substeps
    # the speed is linear in a sample: over a half-step its mean is that in the middle
    mean1, mean2 = (step + 0.25) / substeps, (step + 0.75) / substeps
    for i in range(L):
        speed = b[i + (DRIVE + SPEED) * L]
        increment = b[i + (DRIVE + SPEED_INCREMENT) * L]
        turn1, turn2 = half * (speed + mean1 * increment), half * (speed + mean2 * increment)
        c, s = _small_cos_sin(turn1)
        shaft0 = _pair(b, i, L, COS_SHAFT)
        shaft1 = _turned(shaft0[0], shaft0[1], c, s)
        c, s = _small_cos_sin(turn2)
        shaft2 = _turned(shaft1[0], shaft1[1], c, s)
        ratio = b[i + CAGE_RATIO * L]
        c, s = _small_cos_sin(ratio * turn1)
        cage0 = _pair(b, i, L, COS_CAGE)
        cage1 = _turned(cage0[0], cage0[1], c, s)
        c, s = _small_cos_sin(ratio * turn2)
        cage2 = _turned(cage1[0], cage1[1], c, s)
        load0 = _pair(b, i, L, LOAD_Y)
        load1 = _pair(b, i, L, MIDDLE_LOAD_Y)
        load2 = _pair(b, i, L, END_LOAD_Y)

        x, v = _load(b, i, L, STATE, alike), _load(b, i, L, STATE + 6, alike)
        a, force = _accelerations(b, i, L, u0, sample_s, x, v, shaft0, cage0, load0, balls, curve)
        _store_four(b, i, L, SAMPLED, a, 2)
        _store_four(b, i, L, SAMPLED + 4, force, 0)
        v2, x2 = _moved(v, a, half), _moved(x, v, half)
        a2, _ = _accelerations(b, i, L, u1, sample_s, x2, v2, shaft1, cage1, load1, balls, curve)
        v3, x3 = _moved(v, a2, half), _moved(x, v2, half)
        a3, _ = _accelerations(b, i, L, u1, sample_s, x3, v3, shaft1, cage1, load1, balls, curve)
        v4, x4 = _moved(v, a3, h), _moved(x, v3, h)
        a4, _ = _accelerations(b, i, L, u2, sample_s, x4, v4, shaft2, cage2, load2, balls, curve)
        _store(b, i, L, STATE, _ends(x, v, v2, v3, v4, h))
        _store(b, i, L, STATE + 6, _ends(v, a, a2, a3, a4, h))
        b[i + COS_SHAFT * L], b[i + SIN_SHAFT * L] = shaft2
        b[i + COS_CAGE * L], b[i + SIN_CAGE * L] = cage2
        b[i + LOAD_Y * L], b[i + LOAD_Z * L] = load2


@_inline
def _put_load(b: Array, L: int, row: int, grids: Array, place: int, denominator: int) -> None:
    """Set two rows to the load at `place`/`denominator` of the grid, linear between its points."""
    index = place // denominator
    part = (place - index * denominator) / denominator
    following = index + 1 if part > 0.0 else index  # the last point of the grid has no successor
    for i in range(L):
        for axis in range(2):
            start = grids[i, index, axis]
            b[i + (row + axis) * L] = start + (grids[i, following, axis] - start) * part


@_inline
def _start_sample(b: Array, L: int, drives: Array, n: int) -> None:
    """Set what drives the lanes at sample n, and cos and sin of their angles."""
    for i in range(L):
        for column in range(DRIVES):
            b[i + (DRIVE + column) * L] = drives[i, n, column]
    for i in range(L):
        b[i + COS_SHAFT * L], b[i + SIN_SHAFT * L] = _cos_sin(b[i + (DRIVE + ANGLE) * L])
        b[i + COS_CAGE * L], b[i + SIN_CAGE * L] = _cos_sin(b[i + (DRIVE + CAGE) * L])


@_inline
def _write_state(b: Array, L: int, out: Array, n: int) -> None:
    for i in range(L):
        for column in range(6):
            out[i, n, column] = b[i + (STATE + column) * L]
        out[i, n, 10] = b[i + LOAD_Y * L]
        out[i, n, 11] = b[i + LOAD_Z * L]


@_inline
def _write_sampled(b: Array, L: int, out: Array, n: int) -> None:
    for i in range(L):
        for column in range(4):
            out[i, n, 6 + column] = b[i + (SAMPLED + column) * L]
            force = b[i + (SAMPLED + 4 + column) * L]
            out[i, n, 12 + column] = b[i + MINUS_CONTACT * L] * force


@_jit
def integrate(
    lanes: tuple[int, ...],
    balls: tuple[int, ...],
    curve: tuple[int, ...],
    alike: tuple[int, ...],
    coefficients: Array,
    states: Array,
    out: Array,
    rate_hz: int,
    sample_s: float,
    substeps: int,
    first_sample: int,
    drives: Array,
    grids: Array,
    grid_first: int,
    load_rate_hz: int,
) -> None:
    """Integrate out.shape[1] samples of `substeps` RK4 steps; advances `states` in place.

    Args:
        lanes: any tuple of L integers.
        balls: see `kind`.
        curve: see `kind`.
        alike: see `alike`.
        coefficients: (L, rows), see `pack`.
        states: (L, 12), at the first sample; at return at the sample after the last.
        out: (L, n, OUTPUTS), filled with each sample's row, accelerations from the equations.
        rate_hz: samples per second, for the place on the load grid.
        sample_s: 1/rate_hz in s.
        substeps: steps per sample; the shaft turns by at most pi/2 in one.
        first_sample: absolute index; may be negative only where `grids` is constant.
        drives: (L, n, DRIVES), angles in rad (below 1e6), speed in rad/s, crack as a ratio.
        grids: (L, points, 2) load in m/s^2, linear between points.
        grid_first: index of the point in row 0 of `grids`.
        load_rate_hz: grid points per second.

    """
    L = len(lanes)
    b = np.empty((_COEFFICIENTS + coefficients.shape[1]) * L)
    for i in range(L):
        for row in range(12):
            b[i + (STATE + row) * L] = states[i, row]
        for row in range(coefficients.shape[1]):
            b[i + (_COEFFICIENTS + row) * L] = coefficients[i, row]
    denominator = 2 * substeps * rate_hz
    for n in range(out.shape[1]):
        place = (first_sample + n) * 2 * substeps * load_rate_hz - grid_first * denominator
        _start_sample(b, L, drives, n)
        _put_load(b, L, LOAD_Y, grids, place, denominator)
        _write_state(b, L, out, n)
        for step in range(substeps):
            _put_load(b, L, MIDDLE_LOAD_Y, grids, place + load_rate_hz, denominator)
            place += 2 * load_rate_hz
            _put_load(b, L, END_LOAD_Y, grids, place, denominator)
            _step(b, lanes, step, substeps, sample_s, balls, curve, alike)
            if step == 0:
                _write_sampled(b, L, out, n)
    for i in range(L):
        for row in range(12):
            states[i, row] = b[i + (STATE + row) * L]


@_jit
def first_outside(out: Array, limit: float) -> int:
    """Return the first row with a displacement that is not below `limit` (m), or n.

    `out` is (n, OUTPUTS) of one lane. An acceleration that is not finite shows in the next row.
    """
    for n in range(out.shape[0]):
        outside = 0
        for column in range(6):
            outside += 0 if abs(out[n, column]) < limit else 1
        if outside > 0:
            return n
    return int(out.shape[0])


@_jit
def turn(
    turns: NDArray[np.int64],
    angles: Array,
    first: int,
    whole: int,
    rest: float,
    speed: float,
    increment: float,
    rate_hz: int,
) -> None:
    """Fill whole turns and the rest in [0, 2 pi) rad of a shaft at evenly spaced samples.

    `first` samples before the first of them it stood at (whole, rest) and its speed was `speed`
    (rad/s), which grows by `increment` a sample.
    """
    for n in range(len(angles)):
        k = float(first + n)
        angle = rest + k * (speed + 0.5 * k * increment) / rate_hz
        extra = np.floor(angle / _TURN)
        turns[n] = whole + int(extra)
        angles[n] = max(angle - extra * _TURN, 0.0)
