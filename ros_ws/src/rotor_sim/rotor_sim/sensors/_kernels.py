# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: PLR0917 - compiled functions take no keyword-only arguments
"""The noisy arithmetic of the sensors, compiled; see docs/sensors.md for the equations.

Random numbers are functions of (seed, channel, effect, index) through Philox 4x32-10 (Salmon et
al. 2011), so neither blocks nor other effects change them. No fastmath: the same bits whatever
the block size.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from rotor_common.constants import LANES
from rotor_sim.sensors._noiseless_kernels import (
    BESIDE_LOAD,
    BIAS,
    CHANNELS,
    CROSS,
    DEVIATION,
    GAIN,
    KEYPHASOR,
    LOAD,
    OFF_SAMPLES,
    VIBRATIONS,
    WALK_STEP,
    cos_sin,
    inline,
    jit,
    pulse,
)

Array = NDArray[np.float64]

NOISE, JITTER, RECORDER, WALK, DROPOUT, MISSED, DOUBLE, INSTRUMENT = range(8)
"""Effects: each has its own stream of random numbers."""

SECTIONS = 2
"""Second-order sections of the low-pass filter."""

BEFORE, AFTER, LAST = range(9, 12)
RUNOUT = 12
SECTION = 18
AT_REST = SECTION + 5 * SECTIONS
STATE = AT_REST + 2 * SECTIONS
ROWS = STATE + 2 * SECTIONS
"""Rows of the parameters and states of the channels in `sense`, LANES numbers each. First `errors`,
see `_noiseless_kernels`; the random walk at the knots before and after the next sample; the
previous filtered sample; the factors of cos and sin of orders 1, 2, 3 in the runout; b0, b1, b2,
a1, a2 of the sections; their steady states for a constant input of 1; their states."""

TILE = 256
WALK_SAMPLES = TILE
"""Distance of the knots of a bias's random walk in samples; it is linear in between, and a tile
ends at a knot."""

_CELLS = 16
_TAIL_END = 8 << 23
_LOWEST_OCTAVE = -33
_OFFSET = np.uint64(np.float64(2.0**_LOWEST_OCTAVE).view(np.uint64) >> np.uint64(48))


_M0, _M1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_W0, _W1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
_LOW = np.uint64(0xFFFFFFFF)
_32, _48 = np.uint64(32), np.uint64(48)
_REST = np.uint64(0xFFFFFFFFFFFF)


def _cubics(low: Array, width: Array) -> Array:
    """Return cubics (cells, 4) in t = 0..1 that interpolate -ndtri at the Chebyshev nodes."""
    t = 0.5 - 0.5 * np.cos(np.pi * (np.arange(4) + 0.5) / 4.0)
    values = -ndtri(low.reshape(-1, 1) + width.reshape(-1, 1) * t)
    powers = np.vander(t, 4, increasing=True)
    return np.ascontiguousarray(np.linalg.solve(powers, values[..., None])[..., 0])


_OCTAVES = 2.0 ** np.arange(_LOWEST_OCTAVE, -5)[:, None] * np.ones(_CELLS)
_TAIL = _cubics(_OCTAVES * (1.0 + np.arange(_CELLS) / _CELLS), _OCTAVES / _CELLS)
_MIDDLE = _cubics(np.arange(256) / 512.0, np.full(256, 1.0 / 512.0))
"""-ndtri(p), within 2e-7: 256 equal cells of p = 0..1/2, and 16 in each octave for the first 8."""


@inline
def _philox(c0: Any, c1: Any, c2: Any, c3: Any, k0: Any, k1: Any) -> tuple[Any, Any, Any, Any]:
    """Return the four 32-bit words of Philox 4x32-10; all arguments are 32 bits in uint64."""
    for _ in range(10):
        a = _M0 * c0
        b = _M1 * c2
        c0 = (b >> _32) ^ c1 ^ k0
        c1 = b & _LOW
        c2 = (a >> _32) ^ c3 ^ k1
        c3 = a & _LOW
        k0 = (k0 + _W0) & _LOW
        k1 = (k1 + _W1) & _LOW
    return c0, c1, c2, c3


@inline
def _middle(word: Any) -> Any:
    """Return the normal quantile of (word + 1/2)/2^32, except in its tails; no branch."""
    w = np.uint32(word)
    low = w < np.uint32(0x80000000)
    small = w if low else np.uint32(0xFFFFFFFF) - w
    i = small >> np.uint32(23)
    t = (np.float64(np.int32(small & np.uint32(0x7FFFFF))) + 0.5) * 2.0**-23
    z = _MIDDLE[i, 0] + t * (_MIDDLE[i, 1] + t * (_MIDDLE[i, 2] + t * _MIDDLE[i, 3]))
    return -z if low else z


@inline
def _normal(word: Any) -> Any:
    """Return the standard normal quantile of (word + 1/2)/2^32: at most 6.3 in size."""
    w = np.int64(word)
    low = w < 0x80000000
    small = w if low else 0xFFFFFFFF - w
    if small >= _TAIL_END:
        return _middle(word)
    bits = np.float64((np.float64(small) + 0.5) * 2.0**-32).view(np.uint64)
    i = (bits >> _48) - _OFFSET
    t = np.float64(np.int64(bits & _REST)) * 2.0**-48
    z = _TAIL[i, 0] + t * (_TAIL[i, 1] + t * (_TAIL[i, 2] + t * _TAIL[i, 3]))
    return -z if low else z


@inline
def _is_tail(word: Any) -> Any:
    w = np.uint32(word)
    return w < np.uint32(_TAIL_END) or w > np.uint32(0xFFFFFFFF - _TAIL_END)


@inline
def _fill_words(
    seed: int, channel: int, effect: int, first_count: int, counts: int, words: Any
) -> None:
    k0 = np.uint64(seed) & _LOW
    k1 = np.uint64(seed) >> _32
    start = np.uint64(first_count)
    c2, c3 = np.uint64(channel), np.uint64(effect)
    for i in range(counts):
        count = start + np.uint64(i)
        a, b, c, d = _philox(count & _LOW, count >> _32, c2, c3, k0, k1)
        words[0, i] = a
        words[1, i] = b
        words[2, i] = c
        words[3, i] = d


@jit
def normals(seed: int, channel: int, effect: int, first: int, out: Array) -> None:
    """Fill `out` with standard normal numbers for the samples from `first` on."""
    start = first >> 2
    skip = first - 4 * start
    count = (skip + out.shape[0] + 3) >> 2
    words = np.empty((4, count), np.uint32)
    _fill_words(seed, channel, effect, start, count, words)
    for k in range(out.shape[0]):
        place = np.uint64(skip + k)
        out[k] = _normal(words[place & np.uint64(3), place >> np.uint64(2)])


@inline
def _word(seed: int, channel: int, effect: int, index: int) -> Any:
    count = np.uint64(index)
    w, _, _, _ = _philox(
        count & _LOW,
        count >> _32,
        np.uint64(channel),
        np.uint64(effect),
        np.uint64(seed) & _LOW,
        np.uint64(seed) >> _32,
    )
    return w


@jit
def uniform(seed: int, channel: int, effect: int, index: int) -> float:
    """Return one uniform number in (0, 1), an odd multiple of 2^-33."""
    return (np.float64(np.int64(_word(seed, channel, effect, index))) + 0.5) * 2.0**-32


@jit
def faulty_pulses(
    seed: int,
    turns: NDArray[np.int64],
    angle: Array,
    half_width: float,
    volt: float,
    faults: tuple[float, float, float],
    out: Array,
) -> None:
    """Write the voltage with missed and double pulses; `faults`: both probabilities, the offset.

    The pulse of turn k lies around the angle 2 pi k, the false one around 2 pi k + offset.
    """
    missed, double, offset = faults
    for n in range(angle.shape[0]):
        value = pulse(angle[n], half_width, volt)
        if value > 0.0:
            turn = turns[n] + 1 if angle[n] > math.pi else turns[n]
            if uniform(seed, KEYPHASOR, MISSED, turn) < missed:
                value = 0.0
        late = abs(angle[n] - offset)
        if late < half_width and uniform(seed, KEYPHASOR, DOUBLE, turns[n]) < double:
            value += pulse(late, half_width, volt)
        out[n] = value


@inline
def _couple(known: Array, clean: Array, tile: Array) -> None:
    """Write the quantities with their cross-axis sensitivity."""
    cross = known[CROSS * LANES : CROSS * LANES + CHANNELS]
    for n in range(clean.shape[0]):
        row = n * LANES
        for c in range(0, VIBRATIONS, 2):  # y and z of one place
            tile[row + c] = clean[n, c] + cross[c] * clean[n, c + 1]
            tile[row + c + 1] = clean[n, c + 1] + cross[c + 1] * clean[n, c]
        tile[row + KEYPHASOR] = clean[n, KEYPHASOR]
        tile[row + LOAD] = clean[n, LOAD] + cross[LOAD] * clean[n, BESIDE_LOAD]
        for c in range(CHANNELS, LANES):
            tile[row + c] = 0.0


@inline
def _standard_normals(seed: int, first: int, count: int, words: Any, tails: Any, z: Array) -> int:
    """Write a row of normal numbers for each sample from `first` on; return where in z they start.

    Each lane has the noise of its channel; the lane after the channels has the error of the
    sampling time. One Philox counter gives four rows.
    """
    k0 = np.uint64(seed) & _LOW
    k1 = np.uint64(seed) >> _32
    start = np.uint64(first >> 2)
    skip = first & 3
    groups = (skip + count + 3) >> 2
    for i in range(groups):
        counted = start + np.uint64(i)
        row = 4 * i * LANES
        for c in range(LANES):
            effect = np.uint64(JITTER if c == CHANNELS else NOISE)
            w0, w1, w2, w3 = _philox(counted & _LOW, counted >> _32, np.uint64(c), effect, k0, k1)
            words[row + c] = w0
            words[row + LANES + c] = w1
            words[row + 2 * LANES + c] = w2
            words[row + 3 * LANES + c] = w3
    found = 0
    for k in range(4 * groups * LANES):
        z[k] = _middle(words[k])
    for k in range(4 * groups * LANES):
        tails[found] = k
        found += _is_tail(words[k])
    for i in range(found):
        z[tails[i]] = _normal(words[tails[i]])
    return skip * LANES


@inline
def _step_walk(seed: int, knot: int, known: Array) -> None:
    for c in range(CHANNELS):
        known[BEFORE * LANES + c] = known[AFTER * LANES + c]
        if known[WALK_STEP * LANES + c] > 0.0:
            step = known[WALK_STEP * LANES + c] * _normal(_word(seed, c, WALK, knot))
            known[AFTER * LANES + c] += step


@inline
def _calibrate(first: int, known: Array, z: Array, cosine: Array, sine: Array, tile: Array) -> None:
    """Add the runout, multiply by the gain, add the bias with its random walk and the noise."""
    for n in range(cosine.shape[0]):
        part = (first + n) / WALK_SAMPLES
        c1, s1 = cosine[n], sine[n]
        c2, s2 = c1 * c1 - s1 * s1, 2.0 * s1 * c1
        c3, s3 = c2 * c1 - s2 * s1, s2 * c1 + c2 * s1
        row = n * LANES
        for c in range(LANES):
            k = RUNOUT * LANES + c
            value = tile[row + c] + (
                (known[k] * c1 + known[k + LANES] * s1)
                + (known[k + 2 * LANES] * c2 + known[k + 3 * LANES] * s2)
                + (known[k + 4 * LANES] * c3 + known[k + 5 * LANES] * s3)
            )
            before = known[BEFORE * LANES + c]
            drift = before + part * (known[AFTER * LANES + c] - before)
            value = known[GAIN * LANES + c] * value + (known[BIAS * LANES + c] + drift)
            tile[row + c] = value + known[DEVIATION * LANES + c] * z[row + c]


@inline
def _section(number: int, c: int, x: Any, known: Array) -> Any:
    """Return x filtered by one section of the filter of a lane."""
    k, state = (SECTION + 5 * number) * LANES + c, (STATE + 2 * number) * LANES + c
    y = known[k] * x + known[state]
    known[state] = known[k + LANES] * x - known[k + 3 * LANES] * y + known[state + LANES]
    known[state + LANES] = known[k + 2 * LANES] * x - known[k + 4 * LANES] * y
    return y


@inline
def _filter(started: bool, known: Array, z: Array, tile: Array) -> None:
    """Filter in transposed direct form II, like scipy's sosfilt, and add the sampling jitter.

    The jitter changes every value by the local slope times the error of its sampling time.
    """
    for n in range(tile.shape[0] // LANES):
        row = n * LANES
        error = z[row + CHANNELS]
        at_start = not started and n == 0
        for c in range(LANES):
            value = _section(1, c, _section(0, c, tile[row + c], known), known)
            rise = 0.0 if at_start else value - known[LAST * LANES + c]
            known[LAST * LANES + c] = value
            tile[row + c] = value + rise * (known[OFF_SAMPLES * LANES + c] * error)


@jit
def sense(
    seed: int,
    first: int,
    started: bool,
    known: Array,
    clean: Array,
    angle: Array,
    work: Array,
) -> None:
    """Fill `work` with the inputs of the converter, in tiles that fit the cache.

    The compiler vectorises over the channels of a sample if rows are flat, have 16 lanes and all
    indices into `known` are constants; with 12 lanes it does not.

    Args:
        seed: of the run.
        first: index of the first sample.
        started: whether there were earlier samples.
        known: (ROWS * LANES,), see ROWS; advanced.
        clean: (n, CHANNELS + 1).
        angle: (n,) of the shaft in rad.
        work: (n * LANES,).

    """
    size = (TILE + 8) * LANES
    words = np.empty(size, np.uint32)
    tails = np.empty(size + 1, np.int32)
    z = np.zeros(size)
    cosine, sine = np.zeros(TILE), np.zeros(TILE)
    turns = known[RUNOUT * LANES : SECTION * LANES].any()
    noisy = known[DEVIATION * LANES : (OFF_SAMPLES + 1) * LANES].any()
    start = 0
    while start < angle.shape[0]:
        place = (first + start) % WALK_SAMPLES
        stop = min(start + TILE - place, angle.shape[0])
        count = stop - start
        tile = work[start * LANES : stop * LANES]
        if place == 0:
            _step_walk(seed, (first + start) // WALK_SAMPLES, known)
        _couple(known, clean[start:stop], tile)
        if turns:
            cos_sin(angle[start:stop], cosine, sine)
        skip = 0
        if noisy:
            skip = _standard_normals(seed, first + start, count, words, tails, z)
        _calibrate(place, known, z[skip:], cosine[:count], sine[:count], tile)
        if not started and start == 0:
            for k in range(2 * SECTIONS * LANES):
                known[STATE * LANES + k] = known[AT_REST * LANES + k] * tile[k % LANES]
        _filter(started or start > 0, known, z[skip:], tile)
        start = stop


@jit
def dropouts(
    seed: int,
    first: int,
    rate_per_sample: Array,
    length: NDArray[np.int64],
    state: NDArray[np.int64],
    next_start: Array,
    work: Array,
) -> None:
    """Put NaN where a channel is lost: starts are a Poisson process, all lengths equal.

    state: (2, channels), number of the next start and the sample at which the loss ends;
    next_start: (channels,), time of the next start in samples.
    """
    for c in range(CHANNELS):
        if rate_per_sample[c] <= 0.0:
            continue
        for n in range(work.shape[0]):
            sample = first + n
            while next_start[c] <= sample:
                state[1, c] = sample + length[c]
                gap = -math.log(uniform(seed, c, DROPOUT, state[0, c])) / rate_per_sample[c]
                state[0, c] += 1
                next_start[c] += gap
            if sample < state[1, c]:
                work[n, c] = np.nan
