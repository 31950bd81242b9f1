# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The Hann window of spectra."""

import numpy as np
from numpy.typing import NDArray


def hann(count: int) -> NDArray[np.float64]:
    """Return the periodic Hann window, peak 1: side lobes -31 dB, main lobe 2 bins either side."""
    return np.asarray(0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(count) / count))
