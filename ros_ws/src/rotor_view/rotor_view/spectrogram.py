# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A spectrogram (order over flight time) of fixed size, in bounded memory."""

import numpy as np
from numpy.typing import NDArray

COLUMNS = 400
ROWS = 160
MAX_ORDER = 6.0
FIRST_SPAN_S = 20.0
LOWEST_DB = 10.0
HIGHEST_DB = 90.0
NANOMETRE = 1e-9
HOLD_S = 2.0
"""A window colours the time back to the one before it, but never more than this."""

_ANCHORS = np.array(
    [
        (12, 10, 30), (58, 15, 95), (122, 28, 109), (186, 54, 85),
        (231, 93, 47), (250, 154, 32), (248, 214, 90), (255, 255, 220),
    ],
    dtype=np.float64,
)  # fmt: skip


def decibels(amplitude: NDArray[np.floating], reference: float = NANOMETRE) -> NDArray[np.float64]:
    """Return 20 log10(amplitude / reference), zero where it is below that, NaN where it is NaN."""
    ratio = np.asarray(amplitude, np.float64) / reference
    return 20.0 * np.log10(np.maximum(ratio, 1.0))


def colours(values_db: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Return RGB of shape (..., 3): dark to bright from LOWEST_DB to HIGHEST_DB; NaN is black."""
    share = (np.asarray(values_db, np.float64) - LOWEST_DB) / (HIGHEST_DB - LOWEST_DB)
    place = np.clip(np.nan_to_num(share), 0.0, 1.0) * (len(_ANCHORS) - 1)
    steps = np.arange(len(_ANCHORS))
    rgb = np.stack([np.interp(place, steps, _ANCHORS[:, c]) for c in range(3)], axis=-1)
    rgb[np.isnan(values_db)] = 0.0
    return rgb.astype(np.uint8)


class Spectrogram:
    """Collects order spectra; when the flight outgrows the picture, pairs of columns merge.

    `span_s` is the time the picture covers, from 0: 20 s, then 40 s, 80 s and so on; `reference`
    is the amplitude of 0 dB.
    """

    def __init__(self, reference: float = NANOMETRE) -> None:
        self._reference = reference
        self.span_s = FIRST_SPAN_S
        self._values = np.full((ROWS, COLUMNS), np.nan)
        self._newest_s = 0.0

    def add(
        self, time_s: float, orders: NDArray[np.floating], amplitude: NDArray[np.floating]
    ) -> None:
        """Add the spectrum of the window that ends at `time_s`; amplitude in SI, zero to peak."""
        while time_s >= self.span_s:
            pairs = self._values.reshape(ROWS, COLUMNS // 2, 2)
            self._values = np.full((ROWS, COLUMNS), np.nan)
            self._values[:, : COLUMNS // 2] = np.fmax(pairs[..., 0], pairs[..., 1])
            self.span_s *= 2.0
        start_s = max(self._newest_s, time_s - HOLD_S)
        self._newest_s = time_s
        scale = COLUMNS / self.span_s
        held = slice(min(int(start_s * scale), int(time_s * scale)), int(time_s * scale) + 1)
        column = self._rows(np.asarray(orders, np.float64), decibels(amplitude, self._reference))
        self._values[:, held] = np.fmax(self._values[:, held], column[:, np.newaxis])

    def _rows(
        self, orders: NDArray[np.float64], values_db: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the largest value in each row of the picture, order 0 at the bottom."""
        rows = np.full(ROWS, np.nan)
        inside = (orders >= 0.0) & (orders < MAX_ORDER)
        place = (orders[inside] * (ROWS / MAX_ORDER)).astype(int)
        np.fmax.at(rows, ROWS - 1 - place, values_db[inside])
        return rows

    @property
    def is_empty(self) -> bool:
        """Whether nothing has been added yet."""
        return self._newest_s == 0.0

    def picture(self) -> NDArray[np.uint8]:
        """Return the picture, shape (ROWS, COLUMNS, 3)."""
        return colours(self._values)
