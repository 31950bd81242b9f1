# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The mapping between frame `rotor` and the body frame of the airframe.

Frame `rotor`: x along the shaft, forward; y down in the airframe; z to the left wing.
Body frame: REP-103, x forward, y left, z up. Both are right-handed.
"""

import numpy as np
from numpy.typing import NDArray


def rotor_from_body(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return body-frame vectors, shape (..., 3), any unit, in frame `rotor`: (x, -z, y)."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.stack((x, -z, y), axis=-1)


def body_from_rotor(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return vectors of frame `rotor`, shape (..., 3), any unit, in the body frame: (x, z, -y)."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.stack((x, z, -y), axis=-1)
