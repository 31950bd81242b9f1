# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Full spectrum: forward and backward whirl in each plane.

Source: Goldman and Muszynska, Application of full spectrum to rotating machinery diagnostics,
Orbit 20 (1999) 17-21; Southwick, Using full spectrum plots, Orbit 14 (1993) 19-21.
"""

import numpy as np
from numpy.typing import NDArray

from vibration_monitor.indicators.family import OF_SOURCE, Family, Indicator
from vibration_monitor.indicators.window import Array, Window


class Whirl(Family):
    """How much of the motion in a plane whirls forward at each order, and how much backward.

    The ellipse of each order is the sum of two circles, y + i z = F exp(i X angle) + B exp(-i X
    angle). From the vectors: F = |Y + i Z| / 2, B = |Y - i Z| / 2. The half axes of the ellipse are
    F + B and |F - B|.
    """

    key = 'whirl'
    title = 'Full spectrum'
    needs = 'Two probes at right angles in one plane, with equal scale.'
    fooled_by = (
        'A scale error of one probe (1 % leaks 0.5 % of F into B) and a cross-axis; runout; '
        'unequal bearing stiffness, which makes backward 1x without any fault.'
    )
    source = 'Goldman and Muszynska, Orbit 20 (1999) 17-21; Southwick, Orbit 14 (1993) 19-21.'
    of = 'plane'
    indicators = (
        Indicator('forward_order_{order}', OF_SOURCE, 'abs(F), the radius of the forward circle'),
        Indicator('backward_order_{order}', OF_SOURCE, 'abs(B), that of the backward circle'),
    )

    def compute(self, window: Window) -> list[Array]:
        """Return both radii of each order, plane by plane."""
        count = len(self.config.orders)
        rows = []
        for plane in self.sources:
            y, z = window.plane(plane)
            rows.append(np.stack(forward_and_backward(y[:count], z[:count]), axis=1).ravel())
        return rows


def forward_and_backward(
    y: NDArray[np.complex128], z: NDArray[np.complex128]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the radii of the circles into which each order's ellipse splits.

    y + i z = forward exp(i (order angle + a)) + backward exp(-i (order angle + b)); forward is the
    sense of rotation, from y to z. The half axes of the ellipse are forward + backward and
    |forward - backward|.

    Args:
        y: vectors A exp(i phase) of the y direction, one an order, unit of the channel.
        z: the same of the z direction.

    """
    return np.abs(y + 1j * z) / 2, np.abs(y - 1j * z) / 2
