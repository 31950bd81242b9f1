# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Random draws seeded by their place in the suite, and grids that use every level equally often."""

import itertools
import zlib
from collections.abc import Sequence

import numpy as np

WHOLE_SUITE = 2**32
"""Place of the draws for a whole group, above every machine's number."""


def generator(suite: str, seed: int, *place: int) -> np.random.Generator:
    """Return a counter-based generator keyed by suite, seed and place, such as machine and flight.

    No draw at one place changes those at another, so a plan does not depend on the order in which
    it is made.
    """
    key = np.random.SeedSequence([zlib.crc32(suite.encode()), seed, *place])
    return np.random.Generator(np.random.Philox(key))


def balanced(count: int, sizes: Sequence[int], draw: np.random.Generator) -> list[tuple[int, ...]]:
    """Return `count` rows of levels, factor i having `sizes[i]` of them.

    Each row is the combination whose levels, and pairs of levels, were used least so far; ties
    are drawn. So levels and pairs of levels are used about equally often, in every stretch of rows.
    """
    rows = np.array(list(itertools.product(*(range(size) for size in sizes))), np.int64)
    ones = [np.zeros(size) for size in sizes]
    pairs = {
        (i, j): np.zeros((sizes[i], sizes[j]))
        for i, j in itertools.combinations(range(len(sizes)), 2)
    }
    used = np.zeros(len(rows))
    result = []
    for _ in range(count):
        cost = used / len(rows) + 1e-6 * draw.random(len(rows))
        for i, counts in enumerate(ones):
            cost += counts[rows[:, i]] * sizes[i]
        for (i, j), table in pairs.items():
            cost += table[rows[:, i], rows[:, j]] * sizes[i] * sizes[j]
        best = int(np.argmin(cost))
        row = tuple(rows[best].tolist())
        used[best] += 1.0
        for i, counts in enumerate(ones):
            counts[row[i]] += 1.0
        for (i, j), table in pairs.items():
            table[row[i], row[j]] += 1.0
        result.append(row)
    return result
