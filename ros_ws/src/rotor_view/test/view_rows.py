# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Reading back what a view has logged, with rerun's own reader."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rerun.chunk import RrdReader

Logged = tuple[NDArray[np.int64], list[Any]]


def logged(file: Path) -> dict[str, Logged]:
    """Return flight time (ns) and values of each `entity component`; static ones have no time."""
    found: dict[str, tuple[list[int], list[Any]]] = {}
    for chunk in RrdReader(str(file)).stream():
        batch = chunk.to_record_batch()
        names = batch.schema.names
        times: list[int] = []
        if 'flight_time' in names:
            times = batch.column(names.index('flight_time')).cast('int64').to_pylist()
        for index, name in enumerate(names):
            if name not in ('flight_time', 'rerun.controls.RowId'):
                entry = found.setdefault(f'{chunk.entity_path} {name}', ([], []))
                entry[0].extend(times)
                entry[1].extend(batch.column(index).to_pylist())
    return {key: (np.array(times, np.int64), values) for key, (times, values) in found.items()}


def curve(found: dict[str, Logged], path: str) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return time (ns) and values, shape (rows, curves), of an entity, in order of time."""
    times, values = found[f'/{path} Scalars:scalars']
    order = np.argsort(times, kind='stable')
    return times[order], np.array(values, np.float64)[order]


def lines(found: dict[str, Logged]) -> list[str]:
    """Return the lines of the log, in order of time."""
    rows: list[tuple[int, str]] = []
    for source in ('alarm', 'health', 'view'):
        times, values = found.get(f'/log/{source} TextLog:text', (np.empty(0, np.int64), []))
        rows += [(int(t), value[0]) for t, value in zip(times, values, strict=True) if value]
    return [text for _, text in sorted(rows, key=lambda row: row[0])]
