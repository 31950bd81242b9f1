# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The load on its fixed grid: 100 points a second, linear in between, live and offline alike."""

from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor_common.constants import GRAVITY_M_S2, LOAD_RATE_HZ
from rotor_interfaces.topics import MANEUVER_LOAD
from rotor_sim.errors import LoadConflictError, RotorError

LOAD_LIMIT_M_S2 = 20.0 * GRAVITY_M_S2
"""Far outside any flight: a larger load is a mistake in units."""
EARLY_LIMIT = MANEUVER_LOAD.depth
"""Early points are kept this far ahead of the next one; a publisher keeps no more either."""


class LoadGrid:
    """Apparent gravity per unit mass in frame `rotor`, (y, z) in m/s^2, at k x 10 ms from k = 0.

    Points are appended in order, or taken in any order; old ones can be discarded in a long run.
    """

    def __init__(self) -> None:
        self._points: list[tuple[float, float]] = []
        self._early: dict[int, tuple[float, float]] = {}
        self._first = 0

    @classmethod
    def from_points(cls, points: ArrayLike) -> Self:
        """Return the grid of an array (n, 2) of (load_y, load_z) in m/s^2 from k = 0 on.

        Raises RotorError for another shape or a value that `append` refuses.
        """
        array = np.asarray(points, np.float64)
        if array.ndim != 2 or array.shape[1] != 2:
            raise RotorError(f'a load grid is an array of shape (points, 2), not {array.shape}')
        grid = cls()
        if (np.abs(array) <= LOAD_LIMIT_M_S2).all():
            grid._points = [(load_y, load_z) for load_y, load_z in array.tolist()]
            return grid
        for k, (load_y, load_z) in enumerate(array.tolist()):
            grid.append(k, load_y, load_z)  # says which point is impossible
        return grid

    @property
    def next_index(self) -> int:
        """Index k of the next point of the grid; 0 while it is empty."""
        return self._first + len(self._points)

    @property
    def early(self) -> int:
        """Number of points that came early and wait until a hole before them is filled."""
        return len(self._early)

    def append(self, index: int, load_y: float, load_z: float) -> None:
        """Append point `index` (m/s^2); raises RotorError for a hole or an impossible load."""
        if index != self.next_index:
            raise RotorError(
                f'load point {index} cannot follow point {self.next_index - 1}: the grid has no '
                'holes and points come in order'
            )
        self.take(index, load_y, load_z)

    def take(self, index: int, load_y: float, load_z: float) -> None:
        """Take point `index` (m/s^2), in any order; a known one may come again.

        A point after a hole waits until the hole is filled; one that is EARLY_LIMIT or more ahead
        is ignored. Raises RotorError for an impossible load, LoadConflictError for another value
        of a known point.
        """
        known = self._known(index)
        if known is None and not self.next_index <= index < self.next_index + EARLY_LIMIT:
            return
        for name, value in (('load_y', load_y), ('load_z', load_z)):
            if not abs(value) <= LOAD_LIMIT_M_S2:
                raise RotorError(
                    f'{name} = {value:g} m/s^2 at load point {index} is out of range; allowed: '
                    f'{-LOAD_LIMIT_M_S2:g} to {LOAD_LIMIT_M_S2:g} m/s^2'
                )
        if known is not None and known != (load_y, load_z):
            raise LoadConflictError(
                f'load point {index} came as {known} and as {(load_y, load_z)} m/s^2 (y, z): two '
                'sources publish maneuver/load, and nobody can tell which is right'
            )
        if known is None:
            self._early[index] = (float(load_y), float(load_z))
        while (point := self._early.pop(self.next_index, None)) is not None:
            self._points.append(point)

    def _known(self, index: int) -> tuple[float, float] | None:
        """Return a known point, None if it has not come yet or has been discarded."""
        if self._first <= index < self.next_index:
            return self._points[index - self._first]
        return self._early.get(index)

    def covers(self, sample_end: int, rate_hz: int) -> bool:
        """Say whether the grid reaches the time sample_end/rate_hz."""
        return self.next_index > -(-sample_end * LOAD_RATE_HZ // rate_hz)

    def window(self, first: int, last: int) -> NDArray[np.float64]:
        """Return points first..last (inclusive) as (n, 2), for example for one block.

        Raises RotorError if a point has not come yet or has been discarded.
        """
        if first < self._first or last >= self.next_index:
            raise RotorError(
                f'the load grid holds points {self._first} to {self.next_index - 1}, but points '
                f'{first} to {last} are needed'
            )
        return np.array(self._points[first - self._first : last + 1 - self._first], np.float64)

    def discard_before(self, index: int) -> None:
        """Forget the points before `index`, so that a run of hours needs no more memory."""
        count = min(max(index - self._first, 0), len(self._points))
        del self._points[:count]
        self._first += count
