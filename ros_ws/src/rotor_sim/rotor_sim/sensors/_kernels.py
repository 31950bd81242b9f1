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

from rotor_sim.sensors._plain import (
    BIAS,
    CHANNELS,
    CROSS,
    DEVIATION,
    GAIN,
    OFF_SAMPLES,
    PROBES,
    WALK_STEP,
    inline,
    jit,
    pulse,
)

Array = NDArray[np.float64]

NOISE, JITTER, RECORDER, WALK, DROPOUT, MISSED, DOUBLE = range(7)
"""Effects: each has its own stream of random numbers."""

BEFORE, AFTER, LAST = range(3)
"""Rows of `memory`: the walk at the knots around the next sample; the filtered sample before."""

TILE = 256
WALK_SAMPLES = 256
"""The random walk of a bias has its knots at multiples of this sample and is linear between."""

_CELLS = 16
_TAIL_END = 8 << 23
_LOWEST_OCTAVE = -33
_OFFSET = np.uint64(np.float64(2.0**_LOWEST_OCTAVE).view(np.uint64) >> np.uint64(48))
_QUARTER, _PER_QUARTER = 0.5 * math.pi, 2.0 / math.pi
_S = tuple((-1.0) ** k / math.factorial(2 * k + 1) for k in range(1, 6))
_C = tuple((-1.0) ** k / math.factorial(2 * k) for k in range(1, 7))
"""Taylor terms of the sine and the cosine."""


_M0, _M1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_W0, _W1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
_LOW = np.uint64(0xFFFFFFFF)
_32, _48 = np.uint64(32), np.uint64(48)
_REST = np.uint64(0xFFFFFFFFFFFF)


def _cubics(low: Array, width: Array) -> Array:
    """Return the cubics (cells, 4) in t = 0..1 that meet -ndtri at the cells' Chebyshev nodes."""
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
    """Return the normal quantile of (word + 1/2)/2^32 but for its tails; no branch."""
    w = np.uint32(word)
    low = w < np.uint32(0x80000000)
    small = w if low else np.uint32(0xFFFFFFFF) - w
    i = small >> np.uint32(23)
    t = (np.float64(np.int32(small & np.uint32(0x7FFFFF))) + 0.5) * 2.0**-23
    z = _MIDDLE[i, 0] + t * (_MIDDLE[i, 1] + t * (_MIDDLE[i, 2] + t * _MIDDLE[i, 3]))
    return -z if low else z


@inline
def _normal(word: Any) -> Any:
    """Return the standard normal quantile of (word + 1/2)/2^32: 0 to 6.3 in size."""
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


@inline
def _add_normals(
    seed: int, channel: int, effect: int, first: int, scale: float, words: Any, z: Array, out: Any
) -> None:
    """Add `scale` times standard normal numbers to `out`, one for each sample from `first` on.

    `words` and `z` are room for (4, samples/4 + 2) numbers; a count of Philox makes a column.
    """
    start = first >> 2
    skip = first - 4 * start
    count = (skip + out.shape[0] + 3) >> 2
    _fill_words(seed, channel, effect, start, count, words)
    for j in range(4):
        for i in range(count):
            z[j, i] = _middle(words[j, i])
    for j in range(4):
        for i in range(count):
            if _is_tail(words[j, i]):
                z[j, i] = _normal(words[j, i])
    if skip == 0 and out.shape[0] == 4 * count:
        for i in range(count):
            for j in range(4):
                out[4 * i + j] += scale * z[j, i]
    else:
        for k in range(out.shape[0]):
            place = np.uint64(skip + k)
            out[k] += scale * z[place & np.uint64(3), place >> np.uint64(2)]


@jit
def normals(seed: int, channel: int, effect: int, first: int, out: Array) -> None:
    """Fill `out` with standard normal numbers for the samples from `first` on."""
    words = np.empty((4, (out.shape[0] >> 2) + 2), np.uint32)
    out[:] = 0.0
    _add_normals(seed, channel, effect, first, 1.0, words, np.empty(words.shape), out)


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

    The pulse of turn k lies around the angle 2 pi k; the false one follows it by the offset.
    """
    missed, double, offset = faults
    for n in range(angle.shape[0]):
        value = pulse(angle[n], half_width, volt)
        if value > 0.0:
            turn = turns[n] + 1 if angle[n] > math.pi else turns[n]
            if uniform(seed, CHANNELS - 2, MISSED, turn) < missed:
                value = 0.0
        late = abs(angle[n] - offset)
        if late < half_width and uniform(seed, CHANNELS - 2, DOUBLE, turns[n]) < double:
            value += pulse(late, half_width, volt)
        out[n] = value


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
    turned = np.int64(quarter)
    swap = turned & 1 == 1
    c = sine if swap else cosine
    s = cosine if swap else sine
    c = -c if (turned + 1) & 2 == 2 else c
    s = -s if turned & 2 == 2 else s
    return c, s


@inline
def _couple(errors: Array, runout: Array, clean: Array, angle: Array, work: Array) -> None:
    """Write the quantities with cross-axis and runout."""
    cross = errors[CROSS]
    for n in range(work.shape[0]):
        for c in range(0, 10, 2):  # y and z of one place
            work[n, c] = clean[n, c] + cross[c] * clean[n, c + 1]
            work[n, c + 1] = clean[n, c + 1] + cross[c + 1] * clean[n, c]
        work[n, 10] = clean[n, 10]
        work[n, 11] = clean[n, 11] + cross[11] * clean[n, 12]
    if runout.shape[0] > 0:
        for n in range(work.shape[0]):
            c1, s1 = _cos_sin(angle[n])
            c2, s2 = c1 * c1 - s1 * s1, 2.0 * s1 * c1
            c3, s3 = c2 * c1 - s2 * s1, s2 * c1 + c2 * s1
            for c in range(PROBES):
                work[n, c] += (
                    (runout[0, c] * c1 + runout[1, c] * s1)
                    + (runout[2, c] * c2 + runout[3, c] * s2)
                    + (runout[4, c] * c3 + runout[5, c] * s3)
                )


@inline
def _calibrate(seed: int, first: int, errors: Array, memory: Array, work: Array) -> None:
    """Multiply by the gain and add the bias with its random walk."""
    for n in range(work.shape[0]):
        knot = (first + n) // WALK_SAMPLES
        place = first + n - knot * WALK_SAMPLES
        if place == 0:
            for c in range(CHANNELS):
                memory[BEFORE, c] = memory[AFTER, c]
                if errors[WALK_STEP, c] > 0.0:
                    step = errors[WALK_STEP, c] * _normal(_word(seed, c, WALK, knot))
                    memory[AFTER, c] += step
        part = place / WALK_SAMPLES
        for c in range(CHANNELS):
            drift = memory[BEFORE, c] + part * (memory[AFTER, c] - memory[BEFORE, c])
            work[n, c] = errors[GAIN, c] * work[n, c] + (errors[BIAS, c] + drift)


@inline
def _low_pass(sections: Array, state: Array, work: Array) -> None:
    """Filter in place, transposed direct form II as scipy's sosfilt."""
    for n in range(work.shape[0]):
        for s in range(sections.shape[0]):
            for c in range(CHANNELS):
                x = work[n, c]
                y = sections[s, 0, c] * x + state[s, 0, c]
                state[s, 0, c] = sections[s, 1, c] * x - sections[s, 3, c] * y + state[s, 1, c]
                state[s, 1, c] = sections[s, 2, c] * x - sections[s, 4, c] * y
                work[n, c] = y


@inline
def _jitter(error: Array, errors: Array, memory: Array, started: bool, work: Array) -> None:
    """Move every value by the local slope times the error of its sampling time."""
    for n in range(work.shape[0]):
        for c in range(CHANNELS):
            value = work[n, c]
            rise = value - memory[LAST, c] if started or n > 0 else 0.0
            work[n, c] = value + rise * (errors[OFF_SAMPLES, c] * error[n])
            memory[LAST, c] = value


@jit
def sense(
    seed: int,
    first: int,
    started: bool,
    errors: Array,
    runout: Array,
    sections: Array,
    at_rest: Array,
    filter_state: Array,
    memory: Array,
    clean: Array,
    angle: Array,
    work: Array,
) -> None:
    """Fill `work` with what reaches the converter, in tiles that fit the cache.

    Args:
        seed: of the run.
        first: index of the first sample.
        started: whether samples came before.
        errors: (9, CHANNELS), see CROSS to STEPS.
        runout: (6, PROBES), factors of cos and sin of orders 1, 2, 3; (0, PROBES) for none.
        sections: (sections, 5, CHANNELS), b0, b1, b2, a1, a2; (0, 5, CHANNELS) for none.
        at_rest: (sections, 2, CHANNELS), state of the filter under a constant 1.
        filter_state: likewise; advanced.
        memory: (3, CHANNELS), see BEFORE to LAST; advanced.
        clean: (n, CHANNELS + 1).
        angle: (n,) of the shaft in rad.
        work: (n, CHANNELS).

    """
    words = np.empty((4, TILE // 4 + 2), np.uint32)
    z = np.empty(words.shape)
    error = np.empty(TILE)
    jittery = errors[OFF_SAMPLES].any()
    for start in range(0, work.shape[0], TILE):
        stop = min(start + TILE, work.shape[0])
        tile = work[start:stop]
        _couple(errors, runout, clean[start:stop], angle[start:stop], tile)
        _calibrate(seed, first + start, errors, memory, tile)
        for c in range(CHANNELS):
            if errors[DEVIATION, c] > 0.0:
                deviation = errors[DEVIATION, c]
                _add_normals(seed, c, NOISE, first + start, deviation, words, z, tile[:, c])
        if not started and start == 0:
            filter_state[:] = at_rest * tile[0]
        _low_pass(sections, filter_state, tile)
        if jittery:
            late = error[: stop - start]
            late[:] = 0.0
            _add_normals(seed, CHANNELS, JITTER, first + start, 1.0, words, z, late)
            _jitter(late, errors, memory, started or start > 0, tile)


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
    next_start: (channels,), its place in samples.
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
