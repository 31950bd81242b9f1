# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""One window of whole revolutions, with the intermediate results that indicators share."""

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from vibration_monitor.indicators.spectrum import OrderSpectrum

Array = NDArray[np.float64]


@dataclass(eq=False)
class Window:
    """The samples of one window; derived quantities are computed on first use.

    `revolutions` (samples,) is the rising shaft angle in revolutions: its first value is at or
    before `start`, its last at or after start + count. `signals` (channels, samples) are in m or
    m/s^2, `load_y` (samples,) in m/s^2; both may hold NaN. `inside` are the samples with
    start <= angle < start + count.
    """

    start: int
    count: int
    revolutions: Array
    signals: Array
    load_y: Array
    inside: slice
    rate_hz: int
    channels: tuple[str, ...] = ()
    orders: tuple[float, ...] = ()
    """Orders of `vectors`."""
    names: tuple[str, ...] = ()
    hop: int = 1
    previous_start: int | None = None
    """Start of the previous window; None for the first of a run."""
    values: Array = field(default_factory=lambda: np.empty(0))
    """What has been computed so far, in the order of `names`; NaN for all others."""
    doubts: dict[str, str] = field(default_factory=dict)
    """Why an indicator's value, or a missing value, cannot vouch for a sound machine."""
    spectrum: 'OrderSpectrum | None' = None

    @cached_property
    def alive(self) -> NDArray[np.bool_]:
        """Which channels have no NaN and are not constant; (channels,)."""
        inside = self.signals[:, self.inside]
        moves: NDArray[np.bool_] = inside.max(axis=1) > inside.min(axis=1)
        return np.isfinite(self.signals).all(axis=1) & moves

    @cached_property
    def samples(self) -> dict[str, Array]:
        """The samples inside the window by channel; all NaN where the channel is not alive."""
        inside = self.signals[:, self.inside]
        dead = np.full(inside.shape[1], math.nan)
        rows = (row if ok else dead for row, ok in zip(inside, self.alive, strict=True))
        return dict(zip(self.channels, rows, strict=True))

    @cached_property
    def speed_rad_s(self) -> float:
        """Mean shaft speed: the angle of the window over its duration."""
        ends = np.array([self.start, self.start + self.count])
        after = np.clip(np.searchsorted(self.revolutions, ends), 1, len(self.revolutions) - 1)
        low, high = self.revolutions[after - 1], self.revolutions[after]
        first, last = after - 1 + (ends - low) / (high - low)
        return float(2 * math.pi * self.count * self.rate_hz / (last - first))

    @cached_property
    def load_m_s2(self) -> float:
        """Mean of `load_y`; NaN where a sample has none."""
        mean = float(np.mean(self.load_y[self.inside]))
        return mean if math.isfinite(mean) else math.nan

    @cached_property
    def vectors(self) -> NDArray[np.complex128]:
        """A exp(i phase) of each channel and order, phases relative to angle 0.

        In the unit of the channel, amplitudes zero-to-peak; NaN where the channel is not alive or
        the samples do not resolve the order; (channels, orders).
        """
        from vibration_monitor.vectors import highest_vector_order, order_vectors

        vectors = order_vectors(
            self.revolutions, self._finite, start=self.start, count=self.count, orders=self.orders
        )
        cycles_before = np.array(self.orders) * self.start % 1.0
        vectors *= np.exp(-2j * np.pi * cycles_before)
        resolved = highest_vector_order(self.revolutions, self.count)
        vectors[:, np.array(self.orders) > resolved] = complex(math.nan, math.nan)
        vectors[~self.alive] = complex(math.nan, math.nan)
        return vectors

    @cached_property
    def amplitudes(self) -> Array:
        """Magnitudes of the vectors; (channels, orders)."""
        return np.abs(self.vectors)

    def plane(self, plane: str) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """Return the vectors of the two displacements of a plane, y and z; (orders,) each."""
        y, z = (self.vectors[self.channels.index(f'{plane}_{axis}')] for axis in 'yz')
        return y, z

    @cached_property
    def tracked(self) -> Array:
        """The signals at equal angles; (channels, points)."""
        from vibration_monitor.order_tracking import points_per_revolution, resample

        tracked = resample(
            self.revolutions,
            self._finite,
            start=self.start,
            count=self.count,
            points=points_per_revolution(self.revolutions),
        )
        tracked[~self.alive] = math.nan
        return tracked

    @cached_property
    def _finite(self) -> Array:
        # always a copy: another memory layout would make numba compile the sums again, for 10 s
        return np.where(self.alive[:, np.newaxis], self.signals, 0.0)

    @property
    def indicators(self) -> dict[str, float]:
        """What has been computed so far, by name: the channels, then the planes, the window."""
        return dict(zip(self.names, self.values.tolist(), strict=True))

    @property
    def follows(self) -> bool:
        """Whether the previous window starts one hop before this one."""
        return self.previous_start is not None and self.start - self.previous_start == self.hop

    @property
    def step_revolutions(self) -> int:
        """Revolutions since the previous window; one hop where the angle started again."""
        if self.previous_start is None or self.start <= self.previous_start:
            return self.hop
        return self.start - self.previous_start
