# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The text around a plant's equations: Runge-Kutta steps, streams, revolutions and saltation."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from rotor_sim.plant import arithmetic
from rotor_sim.plant.force_source import Term, Writer, follow

_HEAD = '''"""Engine of a plant, written by rotor_sim.plant.generator; not to be edited."""

import math

import numba
import numpy as np

OPTIONS = dict(cache=CACHE, fastmath=False, error_model='numpy', nogil=True)
jit = numba.njit(**OPTIONS)
inline = numba.njit(**OPTIONS, forceinline=True)
'''


@dataclass(frozen=True)
class Shape:
    """Numbers that the text depends on: degrees of freedom, rotations, rows of the buffer."""

    size: int
    canonical: tuple[int, ...]
    rotations: int
    live: int
    records: int
    switches: int
    rows: Any


def module(shape: Shape, equations: str) -> str:
    """Return the text of the module with these equations of motion."""
    parts = [
        _HEAD,
        _function('small_cos_sin', arithmetic.small_cos_sin, ['x']),
        _function('cos_sin', arithmetic.cos_sin, ['x']),
        _function('turned', arithmetic.turned, ['x', 'y', 'c', 's']),
        equations,
        _vectors(shape),
        _stream(shape),
        _revolutions(shape),
    ]
    return '\n\n'.join(part.strip('\n') for part in parts) + '\n'


def _function(name: str, function: Callable[..., Any], arguments: Sequence[str]) -> str:
    writer = Writer(tangent=False)
    result = follow(function, [Term(argument) for argument in arguments], writer, name)
    body = ''.join(f'    {line}\n' for line in writer.lines)
    returned = ', '.join(term.text for term in result)
    return f'@inline\ndef {name}({", ".join(arguments)}):\n{body}    return {returned}\n'


def _each(count: int, item: Callable[[int], str], between: str = ', ') -> str:
    return between.join(item(k) for k in range(count))


def _vector(count: int, item: Callable[[int], str]) -> str:
    return f'({_each(count, item)},)' if count else '()'


def _vectors(shape: Shape) -> str:
    """Return the arithmetic of vectors as long as there are degrees of freedom."""
    n, state, canonical = shape.size, shape.rows.state, shape.canonical
    put = _each(n, lambda k: f'    b[i + (row + {k}) * L] = x[{k}]', '\n')
    return f"""
@inline
def moved(x, v, h):
    return {_vector(n, lambda k: f'x[{k}] + h * v[{k}]')}


@inline
def ends(x, v, a1, a2, a3, a4, h):
    # the four stages of x' = v add up to h v + h^2/6 (a1 + a2 + a3)
    middle = moved(a2, a3, 1.0)
    place = moved(moved(x, v, h), moved(a1, middle, 1.0), h * h / 6.0)
    return place, moved(v, moved(moved(a1, a4, 1.0), middle, 2.0), h / 6.0)


@inline
def fetch(b, i, L, row):
    return {_vector(n, lambda k: f'b[i + (row + {k}) * L]')}


@inline
def fetch_alike(b, i, L, row):
    # of equal values the compiler computes what follows once
    return {_vector(n, lambda k: f'b[i + (row + {canonical[k]}) * L]')}


@inline
def put(b, i, L, row, x):
{put}


STATE = {state}
VELOCITY = {state + n}
"""


def _stream(shape: Shape) -> str:
    n, r, m, rows = shape.size, shape.rotations, shape.live, shape.rows
    angles, load, drive = rows.angles, rows.load, rows.drive

    def half_step(k: int, number: int) -> str:
        ratio = '' if k == 0 else f'b[i + {rows.ratios + k} * L] * '
        before = f'c{k}_{number - 1}, s{k}_{number - 1}'
        return (
            f'        c, s = small_cos_sin({ratio}turn{number})\n'
            f'        c{k}_{number}, s{k}_{number} = turned({before}, c, s)'
        )

    begin = _each(
        r,
        lambda k: (
            f'        c{k}_0, s{k}_0 = b[i + {angles + 2 * k} * L], b[i + {angles + 2 * k + 1} * L]'
        ),
        '\n',
    )
    first = _each(r, lambda k: half_step(k, 1), '\n')
    second = _each(r, lambda k: half_step(k, 2), '\n')
    kept = _each(
        r,
        lambda k: (
            f'        b[i + {angles + 2 * k} * L], b[i + {angles + 2 * k + 1} * L] = c{k}_2, s{k}_2'
        ),
        '\n',
    )

    def turns(number: int) -> str:
        return _vector(r, lambda k: f'c{k}_{number}, s{k}_{number}')

    live = _each(
        m,
        lambda k: f', b[i + {drive + 2 + 2 * k} * L] + u * b[i + {drive + 3 + 2 * k} * L]',
        '',
    )
    records = _each(
        shape.records, lambda k: f'        b[i + {rows.records + k} * L] = records[{k}]', '\n'
    )
    columns = r + 2 + 2 * m
    return f"""
@inline
def drive_at(b, i, L, u, sample_s):
    increment = b[i + {drive + 1} * L]
    return (b[i + {drive} * L] + u * increment, increment / sample_s{live})


@inline
def stream_step(b, lanes, step, substeps, sample_s, alike):
    L = len(lanes)
    h = sample_s / substeps
    half = 0.5 * h
    u0, u1, u2 = step / substeps, (step + 0.5) / substeps, (step + 1) / substeps
    # the speed is linear in a sample: over a half-step its mean is that in the middle
    mean1, mean2 = (step + 0.25) / substeps, (step + 0.75) / substeps
    for i in range(L):
        speed = b[i + {drive} * L]
        increment = b[i + {drive + 1} * L]
        turn1, turn2 = half * (speed + mean1 * increment), half * (speed + mean2 * increment)
{begin}
{first}
{second}
        load0 = (b[i + {load} * L], b[i + {load + 1} * L])
        load1 = (b[i + {load + 2} * L], b[i + {load + 3} * L])
        load2 = (b[i + {load + 4} * L], b[i + {load + 5} * L])
        turns0, turns1, turns2 = {turns(0)}, {turns(1)}, {turns(2)}
        drive0 = drive_at(b, i, L, u0, sample_s)
        drive1 = drive_at(b, i, L, u1, sample_s)
        drive2 = drive_at(b, i, L, u2, sample_s)
        if len(alike) > 0:
            x, v = fetch_alike(b, i, L, STATE), fetch_alike(b, i, L, VELOCITY)
        else:
            x, v = fetch(b, i, L, STATE), fetch(b, i, L, VELOCITY)
        a1, records = acceleration(b, i, L, x, v, turns0, drive0, load0)
{records}
        v2, x2 = moved(v, a1, half), moved(x, v, half)
        a2, _ = acceleration(b, i, L, x2, v2, turns1, drive1, load1)
        v3, x3 = moved(v, a2, half), moved(x, v2, half)
        a3, _ = acceleration(b, i, L, x3, v3, turns1, drive1, load1)
        v4, x4 = moved(v, a3, h), moved(x, v3, h)
        a4, _ = acceleration(b, i, L, x4, v4, turns2, drive2, load2)
        x, v = ends(x, v, a1, a2, a3, a4, h)
        put(b, i, L, STATE, x)
        put(b, i, L, VELOCITY, v)
{kept}
        b[i + {load} * L], b[i + {load + 1} * L] = load2


@inline
def put_load(b, L, row, grids, place, denominator):
    # the load at place/denominator of the grid, linear between its points
    index = place // denominator
    part = (place - index * denominator) / denominator
    following = index + 1 if part > 0.0 else index  # the last point has no successor
    for i in range(L):
        for axis in range(2):
            start = grids[i, index, axis]
            b[i + (row + axis) * L] = start + (grids[i, following, axis] - start) * part


@inline
def start_sample(b, L, drives, n):
    for i in range(L):
        for column in range({columns - r}):
            b[i + ({drive} + column) * L] = drives[i, n, {r} + column]
    for i in range(L):
        for k in range({r}):
            c, s = cos_sin(drives[i, n, k])
            b[i + ({angles} + 2 * k) * L] = c
            b[i + ({angles} + 2 * k + 1) * L] = s


@jit
def stream(lanes, alike, coefficients, ratios, states, out, rate_hz, sample_s, substeps,
           first_sample, drives, grids, grid_first, load_rate_hz):
    L = len(lanes)
    b = np.empty(({rows.coefficients} + coefficients.shape[1]) * L)
    for i in range(L):
        for row in range({2 * n}):
            b[i + row * L] = states[i, row]
        for row in range({r}):
            b[i + ({rows.ratios} + row) * L] = ratios[i, row]
        for row in range(coefficients.shape[1]):
            b[i + ({rows.coefficients} + row) * L] = coefficients[i, row]
    denominator = 2 * substeps * rate_hz
    for n in range(out.shape[1]):
        place = (first_sample + n) * 2 * substeps * load_rate_hz - grid_first * denominator
        start_sample(b, L, drives, n)
        put_load(b, L, {load}, grids, place, denominator)
        for i in range(L):
            for column in range({n}):
                out[i, n, column] = b[i + column * L]
        for step in range(substeps):
            put_load(b, L, {load + 2}, grids, place + load_rate_hz, denominator)
            place += 2 * load_rate_hz
            put_load(b, L, {load + 4}, grids, place, denominator)
            stream_step(b, lanes, step, substeps, sample_s, alike)
            if step == 0:
                for i in range(L):
                    for column in range({shape.records}):
                        out[i, n, {n} + column] = b[i + ({rows.records} + column) * L]
    for i in range(L):
        for row in range({2 * n}):
            states[i, row] = b[i + row * L]
"""


def _revolutions(shape: Shape) -> str:
    n, r, m, rows = shape.size, shape.rotations, shape.live, shape.rows
    angles = rows.angles
    others = range(1, r)

    def later(number: int) -> str:
        return '\n'.join(
            f'        c{k}_{number}, s{k}_{number} = turned(c{k}_{number - 1}, s{k}_{number - 1}, '
            f'b[i + {rows.half_turns + 2 * k} * L], b[i + {rows.half_turns + 2 * k + 1} * L])'
            for k in others
        )

    begin = '\n'.join(
        f'        c{k}_0, s{k}_0 = b[i + {angles + 2 * k} * L], b[i + {angles + 2 * k + 1} * L]'
        for k in others
    )
    kept = '\n'.join(
        f'        b[i + {angles + 2 * k} * L], b[i + {angles + 2 * k + 1} * L] = c{k}_2, s{k}_2'
        for k in others
    )

    def turns(number: int) -> str:
        return _vector(r, lambda k: f'c{k}_{number}, s{k}_{number}')

    live = _each(m, lambda k: f', b[i + {rows.drive + 2 + 2 * k} * L]', '')
    sides = ''
    if shape.switches:
        put = _each(
            shape.switches,
            lambda k: (
                f'            b[i + {rows.sides + shape.switches + k} * L] = '
                f'1.0 if h[{k}] >= 0.0 else -1.0'
            ),
            '\n',
        )
        sides = f"""
            h = switches(b, i, L, x, v, turns2, drive)
{put}"""
    text = f"""
TANGENT = {rows.tangent}
TANGENT_VELOCITY = {rows.tangent + n}


@inline
def constant_drive(b, i, L):
    return (b[i + {rows.drive} * L], 0.0{live})


@inline
def revolution_step(b, lanes, alike, tangent, k, cosines, sines):
    L = len(lanes)
    c0_0, s0_0 = cosines[2 * k], sines[2 * k]
    c0_1, s0_1 = cosines[2 * k + 1], sines[2 * k + 1]
    c0_2, s0_2 = cosines[2 * k + 2], sines[2 * k + 2]
    for i in range(L):
        h = b[i + {rows.step} * L]
        half = 0.5 * h
{begin}
{later(1)}
{later(2)}
        turns0, turns1, turns2 = {turns(0)}, {turns(1)}, {turns(2)}
        drive = constant_drive(b, i, L)
        load = (b[i + {rows.load} * L], b[i + {rows.load + 1} * L])
        if len(alike) > 0:
            x, v = fetch_alike(b, i, L, STATE), fetch_alike(b, i, L, VELOCITY)
        else:
            x, v = fetch(b, i, L, STATE), fetch(b, i, L, VELOCITY)
        if len(tangent) > 0:
            d, w = fetch(b, i, L, TANGENT), fetch(b, i, L, TANGENT_VELOCITY)
            a1, g1 = acceleration_tangent(b, i, L, x, v, d, w, turns0, drive, load)
            v2, w2 = moved(v, a1, half), moved(w, g1, half)
            x2, d2 = moved(x, v, half), moved(d, w, half)
            a2, g2 = acceleration_tangent(b, i, L, x2, v2, d2, w2, turns1, drive, load)
            v3, w3 = moved(v, a2, half), moved(w, g2, half)
            x3, d3 = moved(x, v2, half), moved(d, w2, half)
            a3, g3 = acceleration_tangent(b, i, L, x3, v3, d3, w3, turns1, drive, load)
            v4, w4 = moved(v, a3, h), moved(w, g3, h)
            x4, d4 = moved(x, v3, h), moved(d, w3, h)
            a4, g4 = acceleration_tangent(b, i, L, x4, v4, d4, w4, turns2, drive, load)
            d, w = ends(d, w, g1, g2, g3, g4, h)
            put(b, i, L, TANGENT, d)
            put(b, i, L, TANGENT_VELOCITY, w)
            x, v = ends(x, v, a1, a2, a3, a4, h){sides}
        else:
            a1, _ = acceleration(b, i, L, x, v, turns0, drive, load)
            v2, x2 = moved(v, a1, half), moved(x, v, half)
            a2, _ = acceleration(b, i, L, x2, v2, turns1, drive, load)
            v3, x3 = moved(v, a2, half), moved(x, v2, half)
            a3, _ = acceleration(b, i, L, x3, v3, turns1, drive, load)
            v4, x4 = moved(v, a3, h), moved(x, v3, h)
            a4, _ = acceleration(b, i, L, x4, v4, turns2, drive, load)
            x, v = ends(x, v, a1, a2, a3, a4, h)
        put(b, i, L, STATE, x)
        put(b, i, L, VELOCITY, v)
{kept}


@jit
def start_revolution(b, L, revolution):
    # from exact cos and sin of where the other rotations stand after whole revolutions
    for i in range(L):
        for k in range({r}):
            turns = b[i + ({rows.ratios} + k) * L] * revolution
            angle = 2.0 * math.pi * (turns - math.floor(turns))
            b[i + ({angles} + 2 * k) * L] = math.cos(angle)
            b[i + ({angles} + 2 * k + 1) * L] = math.sin(angle)
"""
    cross = _saltation(shape) if shape.switches else ''
    start_sides, after_step = '', ''
    if shape.switches:
        start_sides = """
        if len(tangent) > 0:
            start_revolution(b, L, first_revolution)
            for i in range(L):
                take_sides(b, i, L)"""
        after_step = """
                if len(tangent) > 0 and saltation:
                    cross(b, L, cosines[2 * k + 2], sines[2 * k + 2])"""
    return f"""{text}
{cross}

@jit
def revolve(buffer, rows, lanes, alike, tangent, saltation, first_revolution, revolutions,
            cosines, sines, every, observed, out):
    L = len(lanes)
    steps = cosines.shape[0] // 2
    for group in range(buffer.shape[0] // (rows * L)):
        # a view of its own: indices from 0 are known not to be negative
        b = buffer[group * rows * L : (group + 1) * rows * L]
        sample = 0{start_sides}
        for revolution in range(revolutions):
            start_revolution(b, L, first_revolution + revolution)
            for k in range(steps):
                if every > 0 and k % every == 0:
                    for quantity in range(len(observed)):
                        for i in range(L):
                            out[group, sample, quantity, i] = b[i + observed[quantity] * L]
                    sample += 1
                revolution_step(b, lanes, alike, tangent, k, cosines, sines){after_step}
"""


def _saltation(shape: Shape) -> str:
    """Return the jump of the tangents where the state crosses a surface.

    d+ = d- + (F+ - F-) (grad h . d-)/h' (Aizerman and Gantmakher 1958; Leine and Nijmeijer 2004,
    ch. 7). The crossing is found by Newton's method on the parabola that ends at the state; F+ and
    F- are the accelerations a little after and before it. Where the force does not jump they are
    the same, and so are d+ and d-.
    """
    n, r, rows, count = shape.size, shape.rotations, shape.rows, shape.switches
    here = _vector(
        r, lambda k: f'b[i + {rows.angles + 2 * k} * L], b[i + {rows.angles + 2 * k + 1} * L]'
    )
    now = _vector(
        r,
        lambda k: (
            'cosine, sine'
            if k == 0
            else f'b[i + {rows.angles + 2 * k} * L], b[i + {rows.angles + 2 * k + 1} * L]'
        ),
    )
    back = _each(
        r,
        lambda k: (
            f'    c, s = small_cos_sin(-back * drive[0] * b[i + {rows.ratios + k} * L])\n'
            f'    c{k}, s{k} = turned(turns[{2 * k}], turns[{2 * k + 1}], c, s)'
        ),
        '\n',
    )
    rates = _vector(
        r,
        lambda k: (
            f'-drive[0] * b[i + {rows.ratios + k} * L] * s{k}, '
            f'drive[0] * b[i + {rows.ratios + k} * L] * c{k}'
        ),
    )
    add = _each(n, lambda k: f'w[{k}] + (later[{k}] - earlier[{k}]) * factor')
    crossings = _each(
        count,
        lambda k: (
            f'    if b[i + {rows.sides + count + k} * L] != b[i + {rows.sides + k} * L]:\n'
            f'        w = jumped(b, i, L, {k}, x, v, a, d, w, turns, drive, load, step)'
        ),
        '\n',
    )
    keep = _each(
        count,
        lambda k: f'    b[i + {rows.sides + k} * L] = b[i + {rows.sides + count + k} * L]',
        '\n',
    )
    differ = _each(
        count,
        lambda k: f'b[i + {rows.sides + count + k} * L] != b[i + {rows.sides + k} * L]',
        ' or ',
    )
    first = _each(
        count,
        lambda k: f'    b[i + {rows.sides + k} * L] = 1.0 if h[{k}] >= 0.0 else -1.0',
        '\n',
    )
    return f"""
@inline
def state_before(b, i, L, back, x, v, a, turns, drive):
    # where the state was `back` seconds ago, and how its rotations moved
{back}
    place = moved(moved(x, v, -back), a, 0.5 * back * back)
    return place, moved(v, a, -back), {_vector(r, lambda k: f'c{k}, s{k}')}, {rates}


@jit
def jumped(b, i, L, number, x, v, a, d, w, turns, drive, load, step):
    back, moving, rate = 0.0, 0.0, 0.0
    for _ in range(6):
        x0, v0, turns0, dturns = state_before(b, i, L, back, x, v, a, turns, drive)
        h, change = switch_rates(b, i, L, x0, v0, v0, a, turns0, dturns, drive)
        rate = change[number]
        if rate == 0.0:
            return w
        back += h[number] / rate
    if not -0.01 * step <= back <= 1.01 * step:  # it only touched the surface
        return w
    x0, v0, turns0, dturns = state_before(b, i, L, back, x, v, a, turns, drive)
    still = {_vector(2 * r, lambda _: '0.0')}
    _, change = switch_rates(b, i, L, x0, v0, d, w, turns0, still, drive)
    factor = change[number] / rate
    beside = 1e-6 * step
    x0, v0, turns0, _ = state_before(b, i, L, back + beside, x, v, a, turns, drive)
    earlier, _ = acceleration(b, i, L, x0, v0, turns0, drive, load)
    x0, v0, turns0, _ = state_before(b, i, L, back - beside, x, v, a, turns, drive)
    later, _ = acceleration(b, i, L, x0, v0, turns0, drive, load)
    return ({add},)


@jit
def cross_lane(b, i, L, cosine, sine):
    turns = {now}
    drive = constant_drive(b, i, L)
    load = (b[i + {rows.load} * L], b[i + {rows.load + 1} * L])
    step = b[i + {rows.step} * L]
    x, v = fetch(b, i, L, STATE), fetch(b, i, L, VELOCITY)
    d, w = fetch(b, i, L, TANGENT), fetch(b, i, L, TANGENT_VELOCITY)
    a, _ = acceleration(b, i, L, x, v, turns, drive, load)
{crossings}
    put(b, i, L, TANGENT_VELOCITY, w)
{keep}


@inline
def cross(b, L, cosine, sine):
    for i in range(L):
        if {differ}:
            cross_lane(b, i, L, cosine, sine)


@inline
def take_sides(b, i, L):
    turns = {here}
    x, v = fetch(b, i, L, STATE), fetch(b, i, L, VELOCITY)
    h = switches(b, i, L, x, v, turns, constant_drive(b, i, L))
{first}
"""
