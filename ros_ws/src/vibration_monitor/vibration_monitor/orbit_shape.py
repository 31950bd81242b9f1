# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Shape of the orbit of one revolution: loops, flatness, sense.

The orbit is the synchronous average of y + i z with its whole orders 1 to 5. Two whole numbers
tell its loops: how often its direction turns round in a revolution (the turning number; Whitney,
Compositio Mathematica 4 (1937) 276-284), and how often it crosses itself.

Inner loops in the orbit at 1/2 and 1/3 of the critical speed are known signs of a breathing crack:
Gasch, A survey of the dynamic behaviour of a simple rotating shaft with a transverse crack, Journal
of Sound and Vibration 160 (1993) 313-332.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vibration_monitor._kernels import count_crossings

ORBIT_ORDERS = (1.0, 2.0, 3.0, 4.0, 5.0)
_POINTS = 128
_FIRST_ANGLE_RAD = 0.02


@dataclass(frozen=True)
class OrbitShape:
    """Loops and flatness of an orbit.

    `turns` is the turning number, positive in the sense of rotation: 1 for an ellipse, 1 + n with
    n inner loops, 1 - n with n outer ones. `crossings` counts the points where the orbit crosses
    itself: n for n loops that do not cross one another. `axis_ratio` is that of the 1x ellipse,
    (forward - backward) / (forward + backward): 1 a forward circle, 0 a line, -1 a backward circle.
    """

    turns: float
    crossings: float
    axis_ratio: float


NO_ORBIT = OrbitShape(math.nan, math.nan, math.nan)


def orbit_shape(y: NDArray[np.complex128], z: NDArray[np.complex128], floor: float) -> OrbitShape:
    """Return the shape of the orbit y + i z; all NaN where there is none.

    Args:
        y: vectors A exp(i phase) of the y direction at `ORBIT_ORDERS`; (5,).
        z: the same of the z direction.
        floor: an orbit whose largest circle is smaller has no shape, only noise (unit of y).

    """
    forward, backward = (y + 1j * z) / 2, np.conj(y - 1j * z) / 2
    size = float(np.max(np.abs(np.concatenate((forward, backward)))))
    if not size >= floor:
        return NO_ORBIT
    # the circles of the orbit by their orders -5 to 5, where the inverse FFT wants them
    circles = np.zeros(_POINTS, np.complex128)
    orders = np.arange(1, len(ORBIT_ORDERS) + 1)
    circles[orders], circles[-orders] = forward, backward
    signed = np.fft.fftfreq(_POINTS, 1 / _POINTS)
    # corners off the axes, where symmetric orbits cross: a crossing in a corner is uncertain
    circles *= np.exp(1j * signed * _FIRST_ANGLE_RAD)
    velocity = np.fft.ifft(1j * signed * circles)
    turned = np.angle(np.roll(velocity, -1) * np.conj(velocity))
    first_forward, first_backward = abs(forward[0]), abs(backward[0])
    total = first_forward + first_backward
    return OrbitShape(
        turns=float(round(float(np.sum(turned)) / (2 * math.pi))),
        crossings=float(count_crossings(np.fft.ifft(circles))),
        axis_ratio=(first_forward - first_backward) / total if total > 0 else math.nan,
    )
