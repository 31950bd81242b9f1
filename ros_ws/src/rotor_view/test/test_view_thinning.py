# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A picture of a long flight: the newest rows whole, the reach of all before them."""

import numpy as np

from rotor_common.constants import NANOSECONDS
from rotor_view.thinning import KEPT_S, NewestRows, envelope

RATE_HZ = 1000


def batch(first: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    index = first + np.arange(count)
    rows = np.zeros(count, [('sample', 'f8'), ('disk_z', 'f4')])
    rows['sample'] = index
    rows['disk_z'] = np.sin(index * 0.7)
    return index * (NANOSECONDS // RATE_HZ), rows


def test_the_envelope_reaches_as_far_as_the_rows() -> None:
    offsets, rows = batch(0, 1000)
    rows['disk_z'][137] = 5.0
    rows['disk_z'][150] = np.nan
    times, thin = envelope(offsets, rows)
    assert len(times) == len(thin) == 20
    assert np.array_equal(thin['disk_z'][2:4], [np.nanmin(rows['disk_z'][100:200]), 5.0])
    assert times[2] == times[3] == offsets[100]


def test_what_is_held_does_not_grow_and_every_row_is_told_once() -> None:
    newest, old = NewestRows(), 0
    for first in range(0, 60_000, 700):
        old += sum(len(rows) for _, rows in newest.push(*batch(first, 700)))
    held = newest.take()
    assert held is not None
    assert held[1]['sample'][-1] == 60_199
    assert len(held[1]) == KEPT_S * RATE_HZ + 1
    assert old < 60_000 / 20
    assert newest.take() is None
