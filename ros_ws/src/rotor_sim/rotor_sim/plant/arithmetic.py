# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Functions for forces, written in the subset that the generator follows.

They call no library: additions, multiplications, divisions, square roots and choices give the same
bits on every processor and in every SIMD lane.
"""

import math
from math import sqrt
from typing import Any

from rotor_sim.plant.force_source import derivative

_TWO_OVER_PI = 2.0 / math.pi
_QUARTER_TURN = 1.57079632673412561417  # the first 33 bits of pi/2, times a small integer exact
_QUARTER_TURN_REST = 6.07710050650619224932e-11
_ROUND = 1.5 * 2.0**52
"""Added and taken away again: rounds to the nearest integer."""
_TAN_EIGHTH_TURN = math.sqrt(2.0) - 1.0


def turned(x: float, y: float, c: float, s: float) -> Any:
    """Return the vector (x, y) turned by the angle whose cosine and sine are c and s."""
    return x * c - y * s, x * s + y * c


def _power_1_5_change(x: float, dx: float) -> float:
    return 1.5 * sqrt(abs(x)) * dx


@derivative(_power_1_5_change)
def power_1_5(x: float) -> float:
    """Return x |x|^0.5, the law of Hertz for a point contact with the sign of x."""
    return x * sqrt(abs(x))


def small_cos_sin(x: float) -> Any:
    """Return cos, sin for |x| <= pi/4, to one unit in the last place (polynomials of fdlibm)."""
    z = x * x
    sine = -2.50507602534068634195e-08 + z * 1.58969099521155010221e-10
    sine = -1.98412698298579493134e-04 + z * (2.75573137070700676789e-06 + z * sine)
    sine = -1.66666666666666324348e-01 + z * (8.33333333332248946124e-03 + z * sine)
    cosine = 2.08757232129817482790e-09 + z * -1.13596475577881948265e-11
    cosine = 2.48015872894767294178e-05 + z * (-2.75573143513906633035e-07 + z * cosine)
    cosine = 4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * cosine)
    return 1.0 - z * (0.5 - z * cosine), x + x * z * sine


def _cos_sin_change(x: float, dx: float) -> Any:
    c, s = cos_sin(x)
    return -s * dx, c * dx


@derivative(_cos_sin_change)
def cos_sin(x: float) -> Any:
    """Return cos, sin for |x| < 1e6."""
    quarters = (x * _TWO_OVER_PI + _ROUND) - _ROUND
    c, s = small_cos_sin((x - quarters * _QUARTER_TURN) - quarters * _QUARTER_TURN_REST)
    # quarters modulo 4 in 0..3
    q = quarters - 4.0 * ((0.25 * quarters - 0.375 + _ROUND) - _ROUND)
    odd = q == 1.0 or q == 3.0  # noqa: PLR1714 - compiled
    cosine = s if odd else c
    sine = c if odd else s
    cosine = -cosine if q == 1.0 or q == 2.0 else cosine  # noqa: PLR1714 - compiled
    return cosine, -sine if q > 1.0 else sine


def half_angle(x: float, y: float, length: float) -> float:
    """Return u in -pi/2..pi/2 with tan(u/2) = y/(length + |x|) (arctan of fdlibm)."""
    # less an eighth of a turn where that is large
    a = abs(y)
    d = length + abs(x)
    large = a > _TAN_EIGHTH_TURN * d
    t = (a - d if large else a) / (a + d if large else d)
    z = t * t
    p = -3.65315727442169155270e-02 + z * 1.62858201153657823623e-02
    p = -5.83357013379057348645e-02 + z * (4.97687799461593236017e-02 + z * p)
    p = -7.69187620504482999495e-02 + z * (6.66107313738753120669e-02 + z * p)
    p = -1.11111104054623557880e-01 + z * (9.09088713343650656196e-02 + z * p)
    p = -1.99999999998764832476e-01 + z * (1.42857142725034663711e-01 + z * p)
    p = t - t * z * (3.33333333333329318027e-01 + z * p)
    u = 2.0 * (p + (0.25 * math.pi if large else 0.0))
    return -u if y < 0.0 else u
