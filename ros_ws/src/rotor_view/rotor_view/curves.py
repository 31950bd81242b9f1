# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Time series, collected and sent to rerun in columns."""

from collections.abc import Sequence

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from rotor_view import style


def time_column(offsets_ns: NDArray[np.int64]) -> rr.TimeColumn:
    """Return the flight-time index of rows; exact, since it goes through whole nanoseconds."""
    return rr.TimeColumn(style.TIMELINE, duration=offsets_ns.astype('timedelta64[ns]'))


class Curves:
    """Collects rows of named numbers by entity; `send` sends each entity as one set of columns.

    Names and colours are logged when an entity first appears or its names change.
    """

    def __init__(self, stream: rr.RecordingStream) -> None:
        self._stream = stream
        self._names: dict[str, tuple[str, ...]] = {}
        self._declared: dict[str, Sequence[style.Series]] = {}
        self._rows: dict[str, list[tuple[int, Sequence[float]]]] = {}
        self._drawn: set[str] = set()

    @property
    def drawn(self) -> set[str]:
        """Entities that have had a number so far."""
        return self._drawn

    def declare(self, path: str, series: Sequence[style.Series]) -> None:
        """Set the style of an entity's curves, which overrides that of their names."""
        self._declared[path] = series

    def add(self, path: str, offset_ns: int, names: Sequence[str], values: Sequence[float]) -> None:
        """Keep one row of an entity until `send`."""
        if self._names.get(path) != tuple(names):
            self._send_entity(path)
            self._log_names(path, names)
        self._rows.setdefault(path, []).append((offset_ns, values))

    def add_table(
        self,
        path: str,
        offsets_ns: NDArray[np.int64],
        names: Sequence[str],
        values: NDArray[np.floating],
    ) -> None:
        """Send many rows at once; `values` has shape (rows, names)."""
        if self._names.get(path) != tuple(names):
            self._log_names(path, names)
        if path not in self._drawn and np.isfinite(values).any():
            self._drawn.add(path)
        self._stream.send_columns(
            path,
            [time_column(offsets_ns)],
            rr.Scalars.columns(scalars=values.ravel()).partition([len(names)] * len(offsets_ns)),
        )

    def interrupt(self, parent: str, offset_ns: int) -> None:
        """Break the curves of all entities below `parent`: no line may bridge lost samples."""
        for path, names in self._names.items():
            if path.startswith(f'{parent}/'):
                missing = np.full((1, len(names)), np.nan, np.float32)
                self.add_table(path, np.array([offset_ns]), names, missing)

    def send(self) -> None:
        """Send what has been collected."""
        for path in list(self._rows):
            self._send_entity(path)

    def _send_entity(self, path: str) -> None:
        rows = self._rows.pop(path, [])
        if rows:
            offsets = np.array([offset for offset, _ in rows], np.int64)
            values = np.array([values for _, values in rows], np.float64)
            self.add_table(path, offsets, self._names[path], values)

    def _log_names(self, path: str, names: Sequence[str]) -> None:
        self._names[path] = tuple(names)
        series = self._declared.get(path) or style.series_of(path, list(names))
        self._stream.log(
            path,
            rr.SeriesLines(
                names=[one.name for one in series],
                colors=[one.colour for one in series],
                widths=[one.width for one in series],
                visible_series=[one.shown for one in series],
                # the average, rerun's default, would shrink a zoomed-out vibration to nothing
                aggregation_policy='MinMax',
            ),
            static=True,
        )
        if path.startswith(style.BY_WINDOW):  # a line through one window would not be seen
            self._stream.log(
                path,
                rr.SeriesPoints(
                    names=[one.name for one in series],
                    colors=[one.colour for one in series],
                    marker_sizes=[one.width for one in series],
                    visible_series=[one.shown for one in series],
                ),
                static=True,
            )
