# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Files of an analysis: pictures (.png, .svg) and data (.npz, .parquet), chosen by the ending."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor_common.out_path import check_file
from rotor_dynamics.errors import AnalysisError

DOTS_PER_INCH = 150


@dataclass(frozen=True)
class SweepResult:
    """Result of an analysis; arrays are in SI units.

    `rows`: arrays of equal length, the columns of a table; `shared`: arrays that all rows have in
    common; `asked` and `found`: question and answer in JSON types; `sentences`: the answer in
    words; `draw` returns a matplotlib Figure; `failed`: there is no answer, as when every motion
    diverged.
    """

    asked: dict[str, Any]
    rows: dict[str, NDArray[Any]]
    shared: dict[str, NDArray[Any]]
    found: dict[str, Any]
    sentences: list[str]
    draw: Callable[[], Any]
    failed: bool = False


def check_paths(paths: list[Path]) -> None:
    """Raise ConfigError unless every path has a known ending and can be written."""
    for path in paths:
        check_file(path, _WRITERS)


def save(outcome: SweepResult, path: Path) -> None:
    """Write `outcome` to `path`, in the format of its ending; AnalysisError if that fails."""
    try:
        _WRITERS[path.suffix](outcome, path)
    except OSError as error:
        raise AnalysisError(f'--out {path} cannot be written: {error.strerror or error}') from None


def is_picture(path: Path) -> bool:
    """Return whether `save` draws into such a file."""
    return path.suffix in {'.png', '.svg'}


def _save_picture(outcome: SweepResult, path: Path) -> None:
    import matplotlib as mpl  # noqa: PLC0415 - slow

    # no date and no random names: the same result gives the same file
    metadata = {'Date': None} if path.suffix == '.svg' else {'Software': None}
    with mpl.rc_context({'svg.hashsalt': 'rotor-rig', 'svg.fonttype': 'none'}):
        outcome.draw().savefig(path, dpi=DOTS_PER_INCH, metadata=metadata)


def _save_npz(outcome: SweepResult, path: Path) -> None:
    asked = np.array(json.dumps(outcome.asked))
    np.savez_compressed(path, allow_pickle=False, asked=asked, **outcome.rows, **outcome.shared)


def _save_parquet(outcome: SweepResult, path: Path) -> None:
    import pyarrow as pa  # noqa: PLC0415 - slow, and for this ending alone
    from pyarrow import parquet  # noqa: PLC0415

    columns = {
        name: pa.array(list(array) if array.ndim > 1 else array)
        for name, array in outcome.rows.items()
    }
    shared = {name: array.tolist() for name, array in outcome.shared.items()}
    about = {'asked': json.dumps(outcome.asked), 'shared': json.dumps(shared)}
    parquet.write_table(pa.table(columns).replace_schema_metadata(about), path)


_WRITERS: dict[str, Callable[[SweepResult, Path], None]] = {
    '.png': _save_picture,
    '.svg': _save_picture,
    '.npz': _save_npz,
    '.parquet': _save_parquet,
}
