# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: PLR0917 - compiled functions take no keyword-only arguments
"""The equations of `model`, many trajectories side by side in SIMD lanes, and their tangent map.

Independent variable: tau, the shaft angle in rad, so that every lane takes the same steps whatever
its speed; lengths in m, velocities in m/rad. Speed, load and cage ratio of a lane are constant.

Layout: one flat buffer of groups; a group is so many rows of L lanes, `b[row * L + lane]`. L, the
number of balls and that of polynomial terms are known to the compiler as the lengths of tuples.
Only so (one buffer, one loop over lanes with everything inlined) does LLVM vectorise.

No transcendental is left in a step: cos and sin of the shaft come from a table of half-steps, those
of the cage from a rotation that starts afresh every revolution, and the breathing function is
written in cos(theta) and sin(theta). Opposite balls share one root.

fastmath without nnan and ninf: terms may be reassociated and contracted, NaN and infinity stay what
they are. Results differ from `_kernels` by rounding; the live stream does not come from here.
"""

import math
from collections.abc import Callable
from typing import Any, Protocol, TypeVar

import numba
import numpy as np
from numpy.typing import NDArray

from rotor_common import machine_code

Array = NDArray[np.float64]
Function = TypeVar('Function', bound=Callable[..., Any])

STATE = 0
TANGENT = 12
(
    COS_CAGE,
    SIN_CAGE,
    COS_CAGE_STEP,
    SIN_CAGE_STEP,
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
    CLEARANCE,
    CLEARANCE_BEHIND,
    LOAD,
    COS_CRACK,
    SIN_CRACK,
    PHASE_FROM_Z,
    PHASE_FLIP,
    SIN_HALF_ANGLE,
    HIGHEST_COSINE,
    GAP,
    JUMPS,
    REGION,
    NEXT_REGION,
    BALLS,
) = range(24, 52)
"""Rows of a group. From BALLS on: the cosines, then the sines of the pairs of opposite balls (of
the balls, if their number is odd), then the polynomial of the breathing, highest power first."""

PAIRS_OF_EIGHT = 4
HALF_ROOT = math.sqrt(0.5)

QUANTITIES = 4
"""Recorded of each lane: y, z in m and their derivatives in m/rad."""

_TWO_PI = 2.0 * math.pi


class _Decorator(Protocol):
    def __call__(self, function: Function, /) -> Function: ...


_OPTIONS: dict[str, Any] = {
    'cache': machine_code.can_be_kept(__file__),
    'fastmath': {'reassoc', 'contract', 'arcp', 'nsz'},
    'error_model': 'numpy',
    'nogil': True,
}
_jit: _Decorator = numba.njit(**_OPTIONS)
_inline: _Decorator = numba.njit(**_OPTIONS, forceinline=True)


@_inline
def _direction(b: Array, i: int, L: int, y: float, z: float, cos_psi: float, sin_psi: float) -> Any:
    """Return cos, sin of theta = psi - phi, and 1/r; phi = 0 at rest."""
    square = y * y + z * z
    moved = square > 0.0
    inverse = 1.0 / math.sqrt(square) if moved else 0.0
    flip = b[i + PHASE_FLIP * L] if z < 0.0 else 1.0
    from_z = b[i + PHASE_FROM_Z * L] > 0.0
    along = flip * z if from_z else y
    across = flip * y if from_z else z
    cos_phi = along * inverse if moved else 1.0
    sin_phi = across * inverse
    cos_theta = cos_psi * cos_phi + sin_psi * sin_phi
    sin_theta = sin_psi * cos_phi - cos_psi * sin_phi
    return cos_theta, sin_theta, inverse


@_inline
def _theta_change(
    b: Array, i: int, L: int, y: float, z: float, inverse: float, dy: float, dz: float
) -> float:
    """Return -dphi of a change of the disk's place: what it adds to theta."""
    change = (z * dy - y * dz) * inverse * inverse
    return -change if b[i + PHASE_FROM_Z * L] > 0.0 else change


@_inline
def _beyond(b: Array, i: int, L: int, cos_theta: float, sin_theta: float) -> bool:
    """Whether theta lies in (3pi/2 + alpha, 2pi), where the readings of eq. (4) differ."""
    return sin_theta < 0.0 and cos_theta > b[i + SIN_HALF_ANGLE * L]


@_inline
def _breathing(
    b: Array,
    i: int,
    L: int,
    cos_theta: float,
    sin_theta: float,
    beyond: bool,
    balls: tuple[int, ...],
    terms: tuple[int, ...],
) -> Any:
    """Return f of eq. (4) and df/dtheta.

    With u = asin(cos(theta)): f = 1 for u >= alpha, 0 for u <= -alpha, else
    (1 + sin(pi u/(2 alpha)))/2. `beyond` 3pi/2 + alpha GAP = 0 closes the crack, and
    HIGHEST_COSINE = 1 continues the last branch.
    """
    edge = b[i + SIN_HALF_ANGLE * L]
    highest = b[i + HIGHEST_COSINE * L] if beyond else edge
    c = min(max(cos_theta, -edge), highest)
    inside = c == cos_theta
    if len(terms) == 0:  # alpha = 30 degrees: sin(3u) = 3 sin(u) - 4 sin(u)^3
        f = 0.5 + c * (1.5 - 2.0 * c * c)
        rate = (6.0 * c * c - 1.5) * sin_theta
    else:
        # t = tan(u/2), in which sin(pi u/(2 alpha)) is smooth up to both ends
        t = c / (1.0 + math.sqrt(max(1.0 - c * c, 0.0)))
        square = t * t
        value = 0.0
        slope = 0.0
        for k in range(len(terms)):
            slope = slope * square + value
            value = value * square + b[i + (BALLS + 2 * len(balls) + k) * L]
        f = 0.5 + t * value
        # d(t P(t^2))/dt = P + 2 t^2 P'; dt/du = (1 + t^2)/2; du = -sign(sin(theta)) dtheta
        rate = 0.5 * (value + 2.0 * square * slope) * (1.0 + square)
        rate = rate if sin_theta < 0.0 else -rate
    gap = b[i + GAP * L] if beyond else 1.0
    return f * gap, rate * gap if inside else 0.0


@_inline
def _hertz(q: float, clearance: float, behind: float, dq: float) -> Any:
    """Return the load over K_b of a ball at q minus that of the ball opposite, and its change.

    One root for both: never are both pressed. For an odd number of balls `behind` is infinite,
    and there is none opposite.
    """
    pressed = q - min(max(q, -behind), clearance)
    root = math.sqrt(abs(pressed))
    return pressed * root, 1.5 * root * dq


@_inline
def _turned(x: float, y: float, c: float, s: float) -> Any:
    return x * c - y * s, x * s + y * c


@_inline
def _contact(
    b: Array,
    i: int,
    L: int,
    y: float,
    z: float,
    dy: float,
    dz: float,
    cos_cage: float,
    sin_cage: float,
    balls: tuple[int, ...],
) -> Any:
    """Sum of pressed^1.5 (cos, sin) over the balls, eq. (2): y, z, and their changes."""
    clearance = b[i + CLEARANCE * L]
    behind = b[i + CLEARANCE_BEHIND * L]
    # in the frame of the cage the balls stand still
    q, p = _turned(y, z, cos_cage, -sin_cage)
    dq, dp = _turned(dy, dz, cos_cage, -sin_cage)
    if len(balls) == PAIRS_OF_EIGHT:  # at 0, 45, 90 and 135 degrees: no direction is needed
        f0, df0 = _hertz(q, clearance, behind, dq)
        f1, df1 = _hertz(HALF_ROOT * (q + p), clearance, behind, HALF_ROOT * (dq + dp))
        f2, df2 = _hertz(p, clearance, behind, dp)
        f3, df3 = _hertz(HALF_ROOT * (p - q), clearance, behind, HALF_ROOT * (dp - dq))
        along, across = f0 + HALF_ROOT * (f1 - f3), f2 + HALF_ROOT * (f1 + f3)
        d_along, d_across = df0 + HALF_ROOT * (df1 - df3), df2 + HALF_ROOT * (df1 + df3)
    else:
        along, across, d_along, d_across = 0.0, 0.0, 0.0, 0.0
        for j in range(len(balls)):
            c = b[i + (BALLS + j) * L]
            s = b[i + (BALLS + len(balls) + j) * L]
            f, df = _hertz(q * c + p * s, clearance, behind, dq * c + dp * s)
            along += f * c
            across += f * s
            d_along += df * c
            d_across += df * s
    fy, fz = _turned(along, across, cos_cage, sin_cage)
    dfy, dfz = _turned(d_along, d_across, cos_cage, sin_cage)
    return fy, fz, dfy, dfz


@_inline
def _accelerations(
    b: Array,
    i: int,
    L: int,
    x: Any,
    v: Any,
    dx: Any,
    dv: Any,
    cos_tau: float,
    sin_tau: float,
    cos_cage: float,
    sin_cage: float,
    balls: tuple[int, ...],
    terms: tuple[int, ...],
) -> Any:
    """Return the six second derivatives by tau, eq. (5a-f) over w^2, and their changes.

    (dx, dv) is a tangent; who needs none ignores the changes, and the compiler drops them.
    """
    y, z, y1, z1, y2, z2 = x
    vy, vz, vy1, vz1, vy2, vz2 = v
    dy, dz, dy1, dz1, dy2, dz2 = dx
    dvy, dvz, dvy1, dvz1, dvy2, dvz2 = dv
    cos_psi, sin_psi = _turned(cos_tau, sin_tau, b[i + COS_CRACK * L], b[i + SIN_CRACK * L])
    cos_theta, sin_theta, inverse = _direction(b, i, L, y, z, cos_psi, sin_psi)
    beyond = _beyond(b, i, L, cos_theta, sin_theta)
    f, rate = _breathing(b, i, L, cos_theta, sin_theta, beyond, balls, terms)
    df = rate * _theta_change(b, i, L, y, z, inverse, dy, dz)

    # eq. (3a-c): what the crack takes away at f = 1 has the shape (yy, yz; yz, zz)
    yy, zz, yz = cos_psi * cos_psi, sin_psi * sin_psi, sin_psi * cos_psi * b[i + COUPLING * L]
    k, lost = b[i + STIFFNESS_DISK * L], b[i + CRACK_DISK * L]
    k_yy, k_zz, k_yz = k - lost * f * yy, k - lost * f * zz, -lost * f * yz
    k, cut = b[i + STIFFNESS_BEARING * L], b[i + CRACK_BEARING * L]
    s_yy, s_zz, s_yz = k - cut * f * yy, k - cut * f * zz, -cut * f * yz

    ry1, rz1, ry2, rz2 = y - y1, z - z1, y - y2, z - z2
    vry1, vrz1, vry2, vrz2 = vy - vy1, vz - vz1, vy - vy2, vz - vz2
    dry1, drz1, dry2, drz2 = dy - dy1, dz - dz1, dy - dy2, dz - dz2
    dvry1, dvrz1, dvry2, dvrz2 = dvy - dvy1, dvz - dvz1, dvy - dvy2, dvz - dvz2

    c, e, load = b[i + DAMPING_DISK * L], b[i + ECCENTRICITY * L], b[i + LOAD * L]
    ay = e * cos_tau + load - c * (vry1 + vry2) - k_yy * (ry1 + ry2) - k_yz * (rz1 + rz2)
    az = e * sin_tau - c * (vrz1 + vrz2) - k_yz * (ry1 + ry2) - k_zz * (rz1 + rz2)
    opened_y = lost * df * (yy * (ry1 + ry2) + yz * (rz1 + rz2))
    opened_z = lost * df * (yz * (ry1 + ry2) + zz * (rz1 + rz2))
    day = opened_y - c * (dvry1 + dvry2) - k_yy * (dry1 + dry2) - k_yz * (drz1 + drz2)
    daz = opened_z - c * (dvrz1 + dvrz2) - k_yz * (dry1 + dry2) - k_zz * (drz1 + drz2)

    c, hertz = b[i + DAMPING_BEARING * L], b[i + CONTACT * L]
    fy1, fz1, dfy1, dfz1 = _contact(b, i, L, y1, z1, dy1, dz1, cos_cage, sin_cage, balls)
    fy2, fz2, dfy2, dfz2 = _contact(b, i, L, y2, z2, dy2, dz2, cos_cage, sin_cage, balls)
    ay1 = s_yy * ry1 + s_yz * rz1 + c * vry1 - hertz * fy1 + load
    az1 = s_yz * ry1 + s_zz * rz1 + c * vrz1 - hertz * fz1
    ay2 = s_yy * ry2 + s_yz * rz2 + c * vry2 - hertz * fy2 + load
    az2 = s_yz * ry2 + s_zz * rz2 + c * vrz2 - hertz * fz2
    cut *= df
    day1 = s_yy * dry1 + s_yz * drz1 - cut * (yy * ry1 + yz * rz1) + c * dvry1 - hertz * dfy1
    daz1 = s_yz * dry1 + s_zz * drz1 - cut * (yz * ry1 + zz * rz1) + c * dvrz1 - hertz * dfz1
    day2 = s_yy * dry2 + s_yz * drz2 - cut * (yy * ry2 + yz * rz2) + c * dvry2 - hertz * dfy2
    daz2 = s_yz * dry2 + s_zz * drz2 - cut * (yz * ry2 + zz * rz2) + c * dvrz2 - hertz * dfz2
    return (ay, az, ay1, az1, ay2, az2), (day, daz, day1, daz1, day2, daz2)


@_inline
def _region(b: Array, i: int, L: int, y: float, z: float, cos_tau: float, sin_tau: float) -> float:
    """Return a number of the smooth piece of f, between which it jumps; 0 where it never does."""
    cos_psi, sin_psi = _turned(cos_tau, sin_tau, b[i + COS_CRACK * L], b[i + SIN_CRACK * L])
    cos_theta, sin_theta, _ = _direction(b, i, L, y, z, cos_psi, sin_psi)
    flipped = 4.0 if z < 0.0 and b[i + PHASE_FLIP * L] < 0.0 else 0.0
    beyond = b[i + JUMPS * L] if _beyond(b, i, L, cos_theta, sin_theta) else 0.0
    return flipped + beyond


@_inline
def _saltation(
    b: Array,
    i: int,
    L: int,
    cos_tau: float,
    sin_tau: float,
    balls: tuple[int, ...],
    terms: tuple[int, ...],
) -> None:
    """Give the tangent its jump where the trajectory went from one piece of f to another.

    d+ = d- + (F+ - F-) (grad h . d-)/h', with h = z where phi flips and h = theta elsewhere
    (Aizerman and Gantmakher 1958; Leine and Nijmeijer 2004, ch. 7). The crossing is placed at the
    end of the step in which it happens: an error of the order of the step.
    """
    y, z = b[i], b[i + L]
    vy, vz = b[i + 6 * L], b[i + 7 * L]
    dy, dz = b[i + TANGENT * L], b[i + (TANGENT + 1) * L]
    cos_psi, sin_psi = _turned(cos_tau, sin_tau, b[i + COS_CRACK * L], b[i + SIN_CRACK * L])
    cos_theta, sin_theta, inverse = _direction(b, i, L, y, z, cos_psi, sin_psi)
    beyond = _beyond(b, i, L, cos_theta, sin_theta)
    f, _ = _breathing(b, i, L, cos_theta, sin_theta, beyond, balls, terms)
    # as phi flips, theta leaves or enters the piece `beyond` too: 4 - 1 is still a flip
    flips = abs(b[i + NEXT_REGION * L] - b[i + REGION * L]) > 2.0
    if flips:
        beyond = _beyond(b, i, L, -cos_theta, -sin_theta)
        before, _ = _breathing(b, i, L, -cos_theta, -sin_theta, beyond, balls, terms)
        moved, rate = dz, vz
    else:
        before, _ = _breathing(b, i, L, cos_theta, sin_theta, not beyond, balls, terms)
        moved = _theta_change(b, i, L, y, z, inverse, dy, dz)
        rate = 1.0 + _theta_change(b, i, L, y, z, inverse, vy, vz)
    jump = (f - before) * moved / rate
    yy, zz, yz = cos_psi * cos_psi, sin_psi * sin_psi, sin_psi * cos_psi * b[i + COUPLING * L]
    bend_y, bend_z = 0.0, 0.0
    for bearing in (2, 4):
        ry, rz = y - b[i + bearing * L], z - b[i + (bearing + 1) * L]
        bend_y += ry
        bend_z += rz
        cut = b[i + CRACK_BEARING * L] * jump
        b[i + (TANGENT + 6 + bearing) * L] -= cut * (yy * ry + yz * rz)
        b[i + (TANGENT + 7 + bearing) * L] -= cut * (yz * ry + zz * rz)
    lost = b[i + CRACK_DISK * L] * jump
    b[i + (TANGENT + 6) * L] += lost * (yy * bend_y + yz * bend_z)
    b[i + (TANGENT + 7) * L] += lost * (yz * bend_y + zz * bend_z)


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
def _load(b: Array, i: int, L: int, row: int) -> Any:
    i += row * L
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
def _ends(x: Any, v: Any, a1: Any, a2: Any, a3: Any, a4: Any, h: float) -> Any:
    """Return x and x' after a classical RK4 step of x'' = a.

    The four stages of x' = v add up to h v + h^2/6 (a1 + a2 + a3).
    """
    middle = _moved(a2, a3, 1.0)
    position = _moved(_moved(x, v, h), _moved(a1, middle, 1.0), h * h / 6.0)
    return position, _moved(v, _moved(_moved(a1, a4, 1.0), middle, 2.0), h / 6.0)


@_inline
def _step(
    b: Array,
    lanes: tuple[int, ...],
    tangent: tuple[int, ...],
    k: int,
    h: float,
    cosines: Array,
    sines: Array,
    balls: tuple[int, ...],
    terms: tuple[int, ...],
) -> None:
    """One RK4 step of every lane from half-step 2k of the table."""
    L = len(lanes)
    half = 0.5 * h
    c0, s0 = cosines[2 * k], sines[2 * k]
    c1, s1 = cosines[2 * k + 1], sines[2 * k + 1]
    c2, s2 = cosines[2 * k + 2], sines[2 * k + 2]
    for i in range(L):
        cc0, sc0 = b[i + COS_CAGE * L], b[i + SIN_CAGE * L]
        cos_turn, sin_turn = b[i + COS_CAGE_STEP * L], b[i + SIN_CAGE_STEP * L]
        cc1, sc1 = _turned(cc0, sc0, cos_turn, sin_turn)
        cc2, sc2 = _turned(cc1, sc1, cos_turn, sin_turn)
        x, v = _load(b, i, L, STATE), _load(b, i, L, STATE + 6)
        d, w = x, v  # any tangent, if nobody looks at it
        if len(tangent) > 0:
            d, w = _load(b, i, L, TANGENT), _load(b, i, L, TANGENT + 6)
        a1, g1 = _accelerations(b, i, L, x, v, d, w, c0, s0, cc0, sc0, balls, terms)
        v2, w2 = _moved(v, a1, half), _moved(w, g1, half)
        x2, d2 = _moved(x, v, half), _moved(d, w, half)
        a2, g2 = _accelerations(b, i, L, x2, v2, d2, w2, c1, s1, cc1, sc1, balls, terms)
        v3, w3 = _moved(v, a2, half), _moved(w, g2, half)
        x3, d3 = _moved(x, v2, half), _moved(d, w2, half)
        a3, g3 = _accelerations(b, i, L, x3, v3, d3, w3, c1, s1, cc1, sc1, balls, terms)
        v4, w4 = _moved(v, a3, h), _moved(w, g3, h)
        x4, d4 = _moved(x, v3, h), _moved(d, w3, h)
        a4, g4 = _accelerations(b, i, L, x4, v4, d4, w4, c2, s2, cc2, sc2, balls, terms)
        x, v = _ends(x, v, a1, a2, a3, a4, h)
        _store(b, i, L, STATE, x)
        _store(b, i, L, STATE + 6, v)
        b[i + COS_CAGE * L] = cc2
        b[i + SIN_CAGE * L] = sc2
        if len(tangent) > 0:
            d, w = _ends(d, w, g1, g2, g3, g4, h)
            _store(b, i, L, TANGENT, d)
            _store(b, i, L, TANGENT + 6, w)
            b[i + NEXT_REGION * L] = _region(b, i, L, x[0], x[1], c2, s2)


@_inline
def _cross(
    b: Array,
    L: int,
    cos_tau: float,
    sin_tau: float,
    balls: tuple[int, ...],
    terms: tuple[int, ...],
) -> None:
    """Treat the lanes whose trajectory changed its region in this step."""
    for i in range(L):
        if b[i + NEXT_REGION * L] != b[i + REGION * L]:
            _saltation(b, i, L, cos_tau, sin_tau, balls, terms)
            b[i + REGION * L] = b[i + NEXT_REGION * L]


@_jit
def _start_revolution(b: Array, L: int, revolution: int) -> None:
    """Set the cage to where it stands after whole revolutions, from exact cos and sin."""
    for i in range(L):
        turns = b[i + CAGE_RATIO * L] * revolution
        angle = _TWO_PI * (turns - math.floor(turns))
        b[i + COS_CAGE * L] = math.cos(angle)
        b[i + SIN_CAGE * L] = math.sin(angle)


@_jit
def advance(
    buffer: Array,
    rows: int,
    lanes: tuple[int, ...],
    tangent: tuple[int, ...],
    saltation: bool,
    first_revolution: int,
    revolutions: int,
    cosines: Array,
    sines: Array,
    balls: tuple[int, ...],
    terms: tuple[int, ...],
    every: int,
    out: Array,
) -> None:
    """Integrate all groups of `buffer` over whole revolutions; one group after the other.

    Args:
        buffer: groups of `rows` rows of len(lanes) lanes, advanced in place.
        rows: rows of a group.
        lanes: any tuple as long as a row.
        tangent: empty, or of one element: the tangents are advanced too.
        saltation: whether the tangents jump where f does.
        first_revolution: where the cage stands, in revolutions since tau = 0.
        revolutions: how many.
        cosines: (2N + 1,) of tau at the half-steps of a revolution; N steps a revolution.
        sines: likewise.
        balls: (cos, sin) of each pair of opposite balls, or of each ball if their number is odd.
        terms: as long as the polynomial of the breathing function; empty for alpha = 30 degrees.
        every: steps between recorded samples, a divisor of N; 0 records nothing.
        out: (groups, samples, QUANTITIES, lanes), filled with the state before each of the steps.

    """
    L = len(lanes)
    steps = cosines.shape[0] // 2
    h = _TWO_PI / steps
    for group in range(buffer.shape[0] // (rows * L)):
        # a view of its own: indices from 0 are known not to be negative
        b = buffer[group * rows * L : (group + 1) * rows * L]
        sample = 0
        if len(tangent) > 0:
            for i in range(L):
                b[i + REGION * L] = _region(b, i, L, b[i], b[i + L], cosines[0], sines[0])
        for revolution in range(revolutions):
            _start_revolution(b, L, first_revolution + revolution)
            for k in range(steps):
                if every > 0 and k % every == 0:
                    for i in range(L):
                        out[group, sample, 0, i] = b[i]
                        out[group, sample, 1, i] = b[i + L]
                        out[group, sample, 2, i] = b[i + 6 * L]
                        out[group, sample, 3, i] = b[i + 7 * L]
                    sample += 1
                _step(b, lanes, tangent, k, h, cosines, sines, balls, terms)
                if len(tangent) > 0 and saltation:
                    _cross(b, L, cosines[2 * k + 2], sines[2 * k + 2], balls, terms)
