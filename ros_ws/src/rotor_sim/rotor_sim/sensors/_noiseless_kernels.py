# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: PLR0917, FURB136 - compiled functions take positions; min and max lose NaN
"""Compiled arithmetic of the sensors that needs no random numbers; see `_kernels` for the rest."""

import math
from collections.abc import Callable
from typing import Any, Protocol, TypeVar

import numba
import numpy as np
from numpy.typing import NDArray

from rotor_common import machine_code
from rotor_common.constants import LANES
from rotor_interfaces import channels
from rotor_interfaces.waveform import WAVEFORM_DTYPE

Array = NDArray[np.float64]
Function = TypeVar('Function', bound=Callable[..., Any])

COLUMNS = tuple(channel.name for channel in channels.CHANNELS if channel.noise_group)
"""Columns of the sensors with noise, in the order of the rows: the vibrations come first."""

CHANNELS = len(COLUMNS)
VIBRATIONS = len(channels.CHANNEL_COLUMNS)
ACCELERATIONS = COLUMNS.index(channels.ACCELERATION_COLUMNS[0])
"""Index of the first acceleration."""
KEYPHASOR, LOAD = COLUMNS.index('keyphasor'), COLUMNS.index('load_y')
BESIDE_LOAD = CHANNELS
"""Index of load_z after the channels; no sensor measures it."""

OUT_LOAD = VIBRATIONS
OUT_FORCE = OUT_LOAD + 2
"""Columns of the integrator's output: vibrations in this order, load in y and z, contact forces."""

TIME, SAMPLE, ANGLE = map(tuple(channels.COLUMN_UNITS).index, ('time', 'sample', 'angle'))
"""Indices in a row viewed as float64."""
FIRST = WAVEFORM_DTYPE.fields[COLUMNS[0]][1] // 4  # type: ignore[index]
"""Index of the first of COLUMNS in a row viewed as float32."""

CROSS, GAIN, BIAS, WALK_STEP, DEVIATION, OFF_SAMPLES, RANGE, STEP, STEPS = range(9)
"""Rows of `errors`: share of the other axis; gain; bias; standard deviations of a step of the
random walk, of the noise of a sample, and of the sampling time in samples; range (infinite: none);
step of the converter (0: none) and its inverse."""

_TWO_PI = 2.0 * math.pi
_QUARTER, _PER_QUARTER = 0.5 * math.pi, 2.0 / math.pi
_S = tuple((-1.0) ** k / math.factorial(2 * k + 1) for k in range(1, 6))
_C = tuple((-1.0) ** k / math.factorial(2 * k) for k in range(1, 7))
"""Taylor terms of the sine and the cosine."""


class _Decorator(Protocol):
    def __call__(self, function: Function, /) -> Function: ...


_OPTIONS: dict[str, Any] = {
    'cache': machine_code.can_be_kept(__file__),
    'fastmath': False,
    'error_model': 'numpy',
}
jit: _Decorator = numba.njit(**_OPTIONS)
inline: _Decorator = numba.njit(**_OPTIONS, forceinline=True)


@inline
def pulse(angle: float, half_width: float, volt: float) -> float:
    offset = angle - _TWO_PI if angle > math.pi else angle
    part = offset / half_width
    inside = 1.0 - part * part
    if inside <= 0.0:
        return 0.0
    return volt * (inside * inside)


@inline
def _cos_sin(angle: float) -> tuple[float, float]:
    """Return cosine and sine within 1e-11 for angles of a few turns, without calls."""
    quarter = np.floor(angle * _PER_QUARTER + 0.5)
    r = angle - quarter * _QUARTER
    q = r * r
    sine = _S[4] * q + _S[3]
    cosine = _C[5] * q + _C[4]
    for k in range(3):
        sine = sine * q + _S[2 - k]
    for k in range(4):
        cosine = cosine * q + _C[3 - k]
    sine = (sine * q + 1.0) * r
    cosine = cosine * q + 1.0
    turned = np.int32(quarter)
    swap = turned & 1 == 1
    c = sine if swap else cosine
    s = cosine if swap else sine
    c = -c if (turned + 1) & 2 == 2 else c
    s = -s if turned & 2 == 2 else s
    return c, s


@inline
def cos_sin(angle: Array, cosine: Array, sine: Array) -> None:
    """Write cosine and sine of each angle."""
    for n in range(angle.shape[0]):
        cosine[n], sine[n] = _cos_sin(angle[n])


@jit
def lay_out(
    first: int,
    rate: float,
    half_width: float,
    volt: float,
    turns: NDArray[np.int64],
    angle: Array,
    out: Array,
    acceleration: Array,
    clean: Array,
    heads: Array,
    values: NDArray[np.float32],
) -> None:
    """Write the true quantities and the rows of the truth.

    Args:
        first: index of the first sample.
        rate: samples per second.
        half_width: of a pulse of the key-phasor in rad.
        volt: height of the pulse in V.
        turns: (n,) whole turns of the shaft.
        angle: (n,) the rest of its angle in rad.
        out: (n, 12 or more), the integrator's output.
        acceleration: (n, 4) of the housings; (0, 4): those of the journals in `out` are used.
        clean: (n, CHANNELS + 1), filled with the columns of the rows and load_z.
        heads: (n, 9), the rows as float64: time, sample, angle, and the rest.
        values: (n, 18), the rows as float32.

    """
    for n in range(angle.shape[0]):
        for c in range(VIBRATIONS):
            clean[n, c] = out[n, c]
        if acceleration.shape[0] > 0:
            for c in range(VIBRATIONS - ACCELERATIONS):
                clean[n, ACCELERATIONS + c] = acceleration[n, c]
        clean[n, KEYPHASOR] = pulse(angle[n], half_width, volt)
        clean[n, LOAD] = out[n, OUT_LOAD]
        clean[n, BESIDE_LOAD] = out[n, OUT_LOAD + 1]
        heads[n, TIME] = n / rate
        heads[n, SAMPLE] = first + n
        heads[n, ANGLE] = turns[n] * _TWO_PI + angle[n]
        for c in range(CHANNELS):
            values[n, FIRST + c] = clean[n, c]


@jit
def housing(matrices: Array, state: Array, force: Array, out: Array) -> None:
    """Step the housings of both bearings in y and z, four equal oscillators driven by -force.

    Args:
        matrices: (4, 3), see `housing.Housing`.
        state: (4, 3), displacement, velocity and the force of the previous sample; advanced.
        force: (n, 4), contact force on the journals at the samples in N.
        out: (n, 4), filled with the accelerations in m/s^2.

    """
    phi, gamma0, gamma1 = matrices[:2, :2], matrices[:2, 2], matrices[2, :2]
    stiffness, damping, gain = matrices[3, 0], matrices[3, 1], matrices[3, 2]
    for n in range(force.shape[0]):
        for c in range(4):
            x, v, before = state[c, 0], state[c, 1], state[c, 2]
            now = -force[n, c]
            state[c, 0] = phi[0, 0] * x + phi[0, 1] * v + gamma0[0] * before + gamma1[0] * now
            state[c, 1] = phi[1, 0] * x + phi[1, 1] * v + gamma0[1] * before + gamma1[1] * now
            state[c, 2] = now
            out[n, c] = gain * now - stiffness * state[c, 0] - damping * state[c, 1]


@jit
def convert(
    errors: Array, active: NDArray[np.bool_], work: Array, values: NDArray[np.float32]
) -> None:
    """Clip to the range, round to the steps of the converter, and write the rows.

    `errors` (9 * LANES,) and `work` (n * LANES,) are flat; `values` (n, 18) are the rows as
    float32; only active columns are written.
    """
    for n in range(values.shape[0]):
        row = n * LANES
        for c in range(LANES):
            value = work[row + c]
            step = errors[STEP * LANES + c]
            full = errors[RANGE * LANES + c]
            rounded = step * np.floor(value * errors[STEPS * LANES + c] + 0.5)
            value = rounded if step > 0.0 else value
            high = full - step
            # comparisons: NaN stays NaN
            value = -full if value < -full else value
            work[row + c] = high if value > high else value
        for c in range(CHANNELS):
            if active[c]:
                values[n, FIRST + c] = work[row + c]


@jit
def decimate(
    kept: Array, taps: Array, starts: NDArray[np.int64], phases: NDArray[np.int64], out: Array
) -> None:
    """Write the sum of taps[phase] times kept[start:] (samples, 4) for each output.

    The number of taps is even; even and odd ones are summed separately, the oldest first.
    """
    for m in range(out.shape[0]):
        a, b, c, d = 0.0, 0.0, 0.0, 0.0
        e, f, g, h = 0.0, 0.0, 0.0, 0.0
        phase = phases[m]
        window = kept[starts[m] : starts[m] + taps.shape[1]]
        for k in range(taps.shape[1] // 2):
            even, odd = taps[phase, 2 * k], taps[phase, 2 * k + 1]
            a += even * window[2 * k, 0]
            b += even * window[2 * k, 1]
            c += even * window[2 * k, 2]
            d += even * window[2 * k, 3]
            e += odd * window[2 * k + 1, 0]
            f += odd * window[2 * k + 1, 1]
            g += odd * window[2 * k + 1, 2]
            h += odd * window[2 * k + 1, 3]
        out[m, 0], out[m, 1], out[m, 2], out[m, 3] = a + e, b + f, c + g, d + h
