# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: PLR0917 - compiled functions take no keyword-only arguments
"""The inner loops of `vectors`, `order_tracking` and `orbit_shape`, compiled.

No fastmath: nothing is reassociated, and NaN stays NaN.

The samples are worked on in pieces of fixed length from the window's first sample on, so that the
bits depend on the window alone.
"""

import math
from collections.abc import Callable
from typing import Any, Protocol, TypeVar

import numba
import numpy as np
from numpy.typing import NDArray

from rotor_common import machine_code
from vibration_monitor.spectrum import BLACKMAN_HARRIS

Function = TypeVar('Function', bound=Callable[..., Any])


class _Decorator(Protocol):
    def __call__(self, function: Function, /) -> Function: ...


_OPTIONS: dict[str, Any] = {
    'cache': machine_code.can_be_kept(__file__),
    'fastmath': False,
    'error_model': 'numpy',
}
_jit: _Decorator = numba.njit(**_OPTIONS)

PIECE = 512
_A0, _A1, _A2, _A3 = BLACKMAN_HARRIS


@_jit
def windowed_sums(
    revolutions: NDArray[np.float64],
    signals: NDArray[np.float64],
    start: float,
    count: int,
    products: NDArray[np.int64],
    places: NDArray[np.int64],
    remainders: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the windowed sums of each signal and of a constant 1.

    Weights g = w (step of the angle before and after). Row 0 is the sum of g x, rows 2 j + 1 and
    2 j + 2 that of g x cos and g x sin of order j. The carrier of an order is u^bin v, where
    u = exp(i a), v = exp(i remainder a), and the angle a makes one turn over the window.

    Args:
        revolutions: shaft angle of each sample in revolutions, rising; (samples,).
        signals: finite values; (signals, samples).
        start: angle in revolutions at which the window starts.
        count: number of revolutions in the window.
        products: entry p + 1 in the list of powers is entry products[p, 0] times products[p, 1];
            entry 0 is u.
        places: index of the power of each order in that list, -1 for u^0; (orders,).
        remainders: order * count less its power; (orders,).

    Returns:
        (signals, 1 + 2 orders) and (1 + 2 orders,).

    """
    orders = len(places)
    sums = np.zeros((len(signals), 1 + 2 * orders))
    totals = np.zeros(1 + 2 * orders)
    carriers = np.zeros((1 + 2 * orders, PIECE))
    values = np.zeros(PIECE)
    powers = np.zeros((len(products) + 1, 2, PIECE))
    rest = np.zeros((2, PIECE))
    scale = 2.0 * math.pi / count
    first = 1
    while first < len(revolutions) - 1:
        length = min(PIECE, len(revolutions) - 1 - first)
        _fill_turn(powers[0], revolutions, first, length, start, scale)
        for p in range(len(products)):
            _multiply(powers[products[p, 0]], powers[products[p, 1]], powers[p + 1], length)
        for i in range(length):
            c = powers[0, 0, i]
            # cos 2a = 2 c^2 - 1, cos 3a = 4 c^3 - 3 c
            window = ((4.0 * _A3 * c + 2.0 * _A2) * c + (_A1 - 3.0 * _A3)) * c + (_A0 - _A2)
            carriers[0, i] = window * (revolutions[first + i + 1] - revolutions[first + i - 1])
        for j in range(orders):
            if remainders[j] != 0.0:
                _fill_turn(rest, revolutions, first, length, start, scale * remainders[j])
                if places[j] >= 0:
                    _multiply(powers[places[j]], rest, rest, length)
                _weigh(carriers, rest, j, length)
            else:
                _weigh(carriers, powers[places[j]], j, length)
        for row in range(len(carriers)):
            totals[row] += _sum(carriers[row], length)
        for k in range(len(signals)):
            _add_products(sums[k], signals[k, first : first + length], values, carriers)
        first += length
    return sums, totals


@_jit
def _fill_turn(
    turn: NDArray[np.float64],
    revolutions: NDArray[np.float64],
    first: int,
    length: int,
    start: float,
    scale: float,
) -> None:
    """Fill `turn` with cosine and sine of scale * (angle - start), rotated from sample to sample.

    A step is below 0.02 rad (1/6 of 64 revolutions): the omitted terms are below 1e-16.
    """
    angle = scale * (revolutions[first] - start)
    cosine, sine = math.cos(angle), math.sin(angle)
    turn[0, 0], turn[1, 0] = cosine, sine
    for i in range(1, length):
        step = scale * (revolutions[first + i] - revolutions[first + i - 1])
        square = step * step
        c = 1.0 - square * (0.5 - square * (1.0 / 24.0 - square / 720.0))
        s = step * (1.0 - square * (1.0 / 6.0 - square / 120.0))
        cosine, sine = cosine * c - sine * s, cosine * s + sine * c
        turn[0, i], turn[1, i] = cosine, sine


@_jit
def _multiply(
    a: NDArray[np.float64], b: NDArray[np.float64], product: NDArray[np.float64], length: int
) -> None:
    """Multiply complex numbers given as rows of real and imaginary parts."""
    for i in range(length):
        x, y, c, s = a[0, i], a[1, i], b[0, i], b[1, i]
        product[0, i], product[1, i] = x * c - y * s, x * s + y * c


@_jit
def _weigh(
    carriers: NDArray[np.float64], turn: NDArray[np.float64], order: int, length: int
) -> None:
    for i in range(length):
        carriers[2 * order + 1, i] = carriers[0, i] * turn[0, i]
        carriers[2 * order + 2, i] = carriers[0, i] * turn[1, i]


@_jit
def _add_products(
    sums: NDArray[np.float64],
    signal: NDArray[np.float64],
    values: NDArray[np.float64],
    carriers: NDArray[np.float64],
) -> None:
    # a copy that the compiler knows to be contiguous
    for i in range(len(signal)):
        values[i] = signal[i]
    for row in range(len(carriers)):
        sums[row] += _dot(values, carriers[row], len(signal))


@_jit
def _dot(a: NDArray[np.float64], b: NDArray[np.float64], length: int) -> float:
    """Return the sum of a b by eight independent sums, so that none waits for the one before."""
    s0, s1, s2, s3, s4, s5, s6, s7 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    whole = length - length % 8
    for i in range(0, whole, 8):
        s0 += a[i] * b[i]
        s1 += a[i + 1] * b[i + 1]
        s2 += a[i + 2] * b[i + 2]
        s3 += a[i + 3] * b[i + 3]
        s4 += a[i + 4] * b[i + 4]
        s5 += a[i + 5] * b[i + 5]
        s6 += a[i + 6] * b[i + 6]
        s7 += a[i + 7] * b[i + 7]
    for i in range(whole, length):
        s0 += a[i] * b[i]
    return ((s0 + s4) + (s1 + s5)) + ((s2 + s6) + (s3 + s7))


@_jit
def _sum(a: NDArray[np.float64], length: int) -> float:
    total = 0.0
    for i in range(length):
        total += a[i]
    return total


@_jit
def count_crossings(points: NDArray[np.complex128]) -> int:
    """Return how often the closed polygon through `points` crosses itself."""
    n = len(points)
    crossings = 0
    for i in range(n - 2):
        a, b = points[i], points[i + 1]
        # the last side meets the first in a corner
        for j in range(i + 2, n if i else n - 1):
            c, d = points[j], points[(j + 1) % n]
            if _left(a, b, c) != _left(a, b, d) and _left(c, d, a) != _left(c, d, b):
                crossings += 1
    return crossings


@_jit
def _left(a: complex, b: complex, c: complex) -> bool:
    """Say whether c lies to the left of the line from a to b."""
    u, v = b - a, c - a
    return u.real * v.imag - u.imag * v.real > 0.0


@_jit
def quintic_spline(
    coefficients: NDArray[np.float64], places: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return splines of degree 5 with a knot at each sample.

    The six B-splines between two knots, in powers of the position between them (de Boor, A
    practical guide to splines, 1978).

    Args:
        coefficients: of the B-spline centred on each sample, with two more before and three
            after; (signals, samples + 5).
        places: in samples, from 0 to samples - 1; (points,).

    Returns:
        (signals, points).

    """
    values = np.empty((len(coefficients), len(places)))
    for n in range(len(places)):
        cell = int(places[n])
        t = places[n] - cell
        t2, u = t * t, 1.0 - t
        t4 = t2 * t2
        w0 = u * u * u * u * u
        w1 = 26.0 - 50.0 * t + 20.0 * t2 + 20.0 * t2 * t - 20.0 * t4 + 5.0 * t4 * t
        w2 = 66.0 - 60.0 * t2 + 30.0 * t4 - 10.0 * t4 * t
        w3 = 26.0 + 50.0 * t + 20.0 * t2 - 20.0 * t2 * t - 20.0 * t4 + 10.0 * t4 * t
        w4 = 1.0 + 5.0 * t + 10.0 * t2 + 10.0 * t2 * t + 5.0 * t4 - 5.0 * t4 * t
        w5 = t4 * t
        for k in range(len(coefficients)):
            row = coefficients[k]
            outer = w0 * row[cell] + w5 * row[cell + 5]
            inner = w2 * row[cell + 2] + w3 * row[cell + 3]
            values[k, n] = (outer + inner + (w1 * row[cell + 1] + w4 * row[cell + 4])) / 120.0
    return values
