# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Orbits of the disk and other planes: the latest revolutions over the whole flight.

z to the right, y (the load, down) downwards, so the shaft turns counter-clockwise.
"""

import math

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from rotor_interfaces.channels import is_channel, planes_of
from rotor_view import style
from rotor_view.units import Units

MAIN_PLANE = 'disk'
REVOLUTIONS = 4
MOST_ROWS = 1 << 16
_SMALLEST = 1e-30
_SCALE_STEPS = (1.0, 2.0, 3.0, 5.0)


def round_up(value: float) -> float:
    """Return the next of 1, 2, 3, 5, 10, 20, ... that is at least `value` (above 0)."""
    decade = 10.0 ** np.floor(np.log10(value))
    for step in (*_SCALE_STEPS, 10.0):
        if step * decade >= value * (1.0 - 1e-9):
            return float(step * decade)
    raise AssertionError(value)


class Orbit:
    """Keeps the rows of the latest revolutions and draws them, older ones paler."""

    def __init__(self, stream: rr.RecordingStream) -> None:
        self.plane = ''
        """Plane whose orbit is drawn: the disk's, else the first that has both directions."""
        self.drawn: set[str] = set()
        """Entities that have something to show."""
        self._stream = stream
        self.units = Units()
        self._unit = ''
        self._has_load = False
        self._rows: NDArray[np.float64] = np.empty((0, 3))
        self._ring = 0.0

    def clear(self) -> None:
        """Drop the rows: later rows are not connected to them."""
        self._rows = np.empty((0, 3))

    def add(self, rows: NDArray[np.void]) -> None:
        """Add rows with finite angle (rad, unwrapped) and both displacements of a plane."""
        names = rows.dtype.names or ()
        if not self.plane:
            planes = planes_of([name for name in names if is_channel(name)])
            self.plane = MAIN_PLANE if MAIN_PLANE in planes else next(iter(planes), '')
            self._has_load = 'load_y' in names
        y, z = f'{self.plane}_y', f'{self.plane}_z'
        if not {'angle', y, z} <= set(names):
            return
        self._unit, factor = self.units.of_channel(y)
        new = np.stack([rows['angle'], rows[z] * factor, rows[y] * factor], axis=1).astype(
            np.float64
        )
        if not np.isfinite(new).all():
            self.clear()
            return
        joined = np.concatenate([self._rows, new])
        oldest = joined[-1, 0] - 2.0 * np.pi * REVOLUTIONS
        # rows of a shaft that stands still, or turns back, never get old by angle
        self._rows = joined[joined[:, 0] >= oldest][-MOST_ROWS:]

    def log(self) -> None:
        """Log the orbit at the time that is set on the stream; nothing before one revolution."""
        angle = self._rows[:, 0]
        if len(angle) < 2 or angle[-1] - angle[0] < 2.0 * np.pi:
            return
        self.drawn.add(style.ORBIT)
        age = np.floor((angle[-1] - angle) / (2.0 * np.pi)).astype(int)
        cuts = np.flatnonzero(np.diff(age)) + 1
        strips = [
            self._rows[max(begin - 1, 0) : end, 1:]
            for begin, end in zip([0, *cuts], [*cuts, len(angle)], strict=True)
        ]
        fade = np.linspace(70, 255, len(strips)).astype(int)
        self._stream.log(
            f'{style.ORBIT}/path',
            rr.LineStrips2D(
                [strip.astype(np.float32) for strip in strips],
                colors=[(*style.ORBIT_COLOUR, int(alpha)) for alpha in fade],
                radii=rr.Radius.ui_points(1.2),
                draw_order=10.0,
            ),
        )
        turns = np.flatnonzero(np.diff(np.floor(angle / (2.0 * np.pi)))) + 1
        self._stream.log(
            f'{style.ORBIT}/angle_0',
            rr.Points2D(
                self._rows[turns, 1:],
                colors=style.ORBIT_MARK_COLOUR,
                radii=rr.Radius.ui_points(3.0),
                draw_order=20.0,
            ),
        )
        self._log_scale(float(np.abs(self._rows[:, 1:]).max()))

    def _log_scale(self, reach: float) -> None:
        """Log rings and axes if the scale must change; it grows at once and shrinks late."""
        if not _SMALLEST < reach < math.inf or 0.4 * self._ring <= reach <= self._ring:
            return
        self._ring = ring = round_up(1.1 * reach)
        circle = np.linspace(0.0, 2.0 * np.pi, 73)
        unit = np.stack([np.cos(circle), np.sin(circle)], axis=1)
        self._stream.log(
            f'{style.ORBIT}/scale',
            rr.LineStrips2D(
                [ring * unit, ring / 2 * unit, [[-ring, 0], [ring, 0]], [[0, -ring], [0, ring]]],
                colors=[(70, 75, 85)],
                radii=rr.Radius.ui_points(0.6),
            ),
        )
        self._stream.log(
            f'{style.ORBIT}/labels',
            rr.Points2D(
                [[0.0, ring], [ring, 0.0], [-ring * 0.707, -ring * 0.707]],
                labels=['+y: load' if self._has_load else '+y', '+z', f'{ring:g} {self._unit}'],
                colors=style.GREY,
                radii=rr.Radius.ui_points(0.0),
                show_labels=True,
            ),
        )
