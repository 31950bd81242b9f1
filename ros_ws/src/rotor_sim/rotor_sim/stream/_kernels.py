# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: PLR0917 - compiled functions take no keyword-only arguments
"""Compiled loops over the samples of a block."""

from collections.abc import Callable
from typing import Any, Protocol, TypeVar

import numba
import numpy as np
from numpy.typing import NDArray

from rotor_common import machine_code

Array = NDArray[np.float64]
Function = TypeVar('Function', bound=Callable[..., Any])

_TURN = 2.0 * np.pi


class _Decorator(Protocol):
    def __call__(self, function: Function, /) -> Function: ...


_OPTIONS: dict[str, Any] = {
    'cache': machine_code.can_be_kept(__file__),
    'fastmath': False,
    'error_model': 'numpy',
    'nogil': True,
}
_jit: _Decorator = numba.njit(**_OPTIONS)


@_jit
def first_outside(out: Array, size: int, limit: float) -> int:
    """Return the first row with a displacement that is not below `limit` (m), or n.

    `out` (n, columns) of one lane begins with `size` displacements. An acceleration that is not
    finite shows in the next row.
    """
    for n in range(out.shape[0]):
        outside = 0
        for column in range(size):
            outside += 0 if abs(out[n, column]) < limit else 1
        if outside > 0:
            return n
    return int(out.shape[0])


@_jit
def turn(
    turns: NDArray[np.int64],
    angles: Array,
    first: int,
    whole: int,
    rest: float,
    speed: float,
    increment: float,
    rate_hz: int,
) -> None:
    """Fill whole turns and the rest in [0, 2 pi) rad of a shaft at evenly spaced samples.

    `first` samples before the first of them it stood at (whole, rest) and its speed was `speed`
    (rad/s), which grows by `increment` a sample.
    """
    for n in range(len(angles)):
        k = float(first + n)
        angle = rest + k * (speed + 0.5 * k * increment) / rate_hz
        extra = np.floor(angle / _TURN)
        turns[n] = whole + int(extra)
        angles[n] = max(angle - extra * _TURN, 0.0)
