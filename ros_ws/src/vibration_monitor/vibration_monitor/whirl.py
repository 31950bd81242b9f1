# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Full spectrum: how much of a motion in a plane whirls forward, how much backward.

Source: Goldman and Muszynska, Application of full spectrum to rotating machinery diagnostics,
Orbit 20 (1999) 17-21; Southwick, Using full spectrum plots, Orbit 14 (1993) 19-21.
"""

import numpy as np
from numpy.typing import NDArray


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
