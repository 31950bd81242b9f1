# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Draw waveform rows: curves, poses of the rig, orbit and load."""

from collections.abc import Callable

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from rotor_common.constants import GRAVITY_M_S2, NANOSECONDS
from rotor_view import scene, style
from rotor_view.curves import Curves
from rotor_view.orbit import Orbit
from rotor_view.thinning import NewestRows
from rotor_view.units import Units

FRAME_S = 0.1
"""Orbit and load arrow are drawn this often in flight time."""


class Waveform:
    """Draws the rows of one run, batch after batch.

    Args:
        stream: to which the rows are logged.
        curves: what draws the curves.
        rig: what draws the rotor.
        sent: called after each table of curves, which are large.
        is_thin: of all but the newest rows draw only the envelope of the curves.

    """

    def __init__(
        self,
        stream: rr.RecordingStream,
        curves: Curves,
        rig: scene.Rig,
        sent: Callable[[], None],
        *,
        is_thin: bool,
    ) -> None:
        self.orbit = Orbit(stream)
        self.units = Units()
        self.channels: dict[str, tuple[str, ...]] = {}
        """Entities of the waveform with their channels."""
        self._stream = stream
        self._curves = curves
        self._rig = rig
        self._sent = sent
        self._newest = NewestRows() if is_thin else None

    def add(self, offsets: NDArray[np.int64], rows: NDArray[np.void]) -> None:
        """Draw the next rows; `offsets` is flight time in ns."""
        if self._newest is None:
            self._draw(offsets, rows)
        else:
            for old in self._newest.push(offsets, rows):
                self._send_channels(*old)
        for frame in _frames(offsets):
            load_factor = _load_factor(rows[frame])
            if load_factor is not None:
                middle_ns = int(offsets[frame][0] + offsets[frame][-1]) // 2
                self._curves.add(style.LOAD_SENSOR, middle_ns, ['n'], [load_factor])

    def finish(self) -> None:
        """Draw the rows still held: no connected rows will follow."""
        newest = self._newest.take() if self._newest else None
        if newest is not None:
            self._draw(*newest)

    def interrupt(self, offset_ns: int) -> None:
        """Break curves and orbit where samples are missing."""
        self.finish()
        self._curves.interrupt(style.WAVEFORM, offset_ns)
        self.orbit.clear()

    def _draw(self, offsets: NDArray[np.int64], rows: NDArray[np.void]) -> None:
        self._at(int(offsets[0]))
        self._send_channels(offsets, rows)
        poses = slice(None, None, scene.POSE_EVERY)
        self._rig.send(offsets[poses], rows[poses])
        for frame in _frames(offsets):
            self._at(int(offsets[frame][-1]))
            self.orbit.add(rows[frame])
            self.orbit.log()
            load_factor = _load_factor(rows[frame])
            if load_factor is not None:
                self._rig.draw_load(load_factor)

    def _at(self, offset_ns: int) -> None:
        self._stream.set_time(style.TIMELINE, duration=np.timedelta64(offset_ns, 'ns'))

    def _send_channels(self, offsets: NDArray[np.int64], rows: NDArray[np.void]) -> None:
        for path, channels in style.channel_groups(rows.dtype.names or ()).items():
            self.channels[path] = tuple(channels)
            factors = [self.units.of_channel(name)[1] for name in channels]
            table = np.stack([rows[name] for name in channels], axis=1) * np.array(
                factors, np.float32
            )
            self._curves.add_table(path, offsets, channels, table.astype(np.float32))
            self._sent()


def _frames(offsets: NDArray[np.int64]) -> list[slice]:
    """Return the rows of each frame that is drawn."""
    count = max(1, round((offsets[-1] - offsets[0]) / (FRAME_S * NANOSECONDS)))
    parts = np.array_split(np.arange(len(offsets)), min(count, len(offsets)))
    return [slice(int(part[0]), int(part[-1]) + 1) for part in parts]


def _load_factor(rows: NDArray[np.void]) -> float | None:
    """Return the mean load factor that the airframe's sensor measured, None without one."""
    if 'load_y' not in (rows.dtype.names or ()):
        return None
    mean_m_s2 = float(np.mean(rows['load_y'], dtype=np.float64))
    # rounded, or the axis of a steady flight would zoom in on the rounding of float32
    return round(mean_m_s2 / GRAVITY_M_S2, 4)
