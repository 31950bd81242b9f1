# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: ANN001, ANN201, ANN202, D103, PLC0415 - as users write
"""The rotor in jitcode, diffrax and heyoka, which take it as symbols; see `numeric_solvers`."""

import functools
import math

import numpy as np
from equations import START, TURN, Array, as_it_is, equations
from numeric_solvers import Exponent, Orbit

# --- jitcode: symbols to C


def jitcode_compiled(kind: str, tolerance: float):
    import jitcode
    from symengine import Symbol, cos, sin, sqrt

    def magnitude(x):  # Abs, Min and Max have no derivative that it could compile
        return sqrt(x * x + 1e-30)

    def limited(x):
        return 0.5 * (magnitude(x + 0.5) - magnitude(x - 0.5))

    K = Symbol('K')
    f = equations(sin, cos, sqrt, magnitude, limited, as_it_is)
    f = f(jitcode.t, [jitcode.y(i) for i in range(12)], K)
    more = {'n_lyap': 1} if kind == 'jitcode_lyap' else {}
    system = getattr(jitcode, kind)(f, control_pars=[K], verbose=False, **more)
    system.compile_C()
    system.set_integrator('dopri5', rtol=tolerance, atol=tolerance)
    return system


def jitcode_orbit(crack: Array, first: int, count: int, tolerance: float) -> Orbit:
    system = jitcode_compiled('jitcode', tolerance)

    def one(K: float) -> list[Array]:
        system.set_parameters(K)
        system.set_initial_value(START, 0.0)
        return [system.integrate(TURN * (first + i)).copy() for i in range(count)]

    return lambda: np.array([one(K) for K in crack])


def jitcode_exponent(crack: Array, first: int, count: int, tolerance: float) -> Exponent:
    system = jitcode_compiled('jitcode_lyap', tolerance)

    def run() -> float:
        system.set_parameters(crack[0])
        system.set_initial_value(START, 0.0)
        local = [system.integrate(TURN * (n + 1))[1][0] for n in range(first + count)]
        return float(np.mean(local[first:]))

    return run


# --- diffrax: JAX on the CPU


@functools.cache
def jax_equations():
    import jax
    import jax.numpy as jnp

    jax.config.update('jax_enable_x64', True)

    def magnitude(x):  # sqrt has no derivative at 0
        return jnp.maximum(jnp.abs(x), 1e-30)

    f = equations(jnp.sin, jnp.cos, jnp.sqrt, magnitude, lambda x: jnp.clip(x, -0.5, 0.5), as_it_is)
    return lambda tau, x, K: jnp.stack(f(tau, x, K))


def diffrax_orbit(crack: Array, first: int, count: int, tolerance: float) -> Orbit:
    f = jax_equations()
    import diffrax
    import jax

    def one(K):
        solution = diffrax.diffeqsolve(
            *(diffrax.ODETerm(f), diffrax.Dopri8(), 0.0, tau[-1], None, START, K),
            saveat=diffrax.SaveAt(ts=tau),
            stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance),
            max_steps=None,
        )
        return solution.ys

    tau = TURN * np.arange(first, first + count)
    compiled = jax.jit(jax.vmap(one)).lower(crack).compile()
    return lambda: np.asarray(compiled(crack))


def diffrax_exponent(crack: Array, first: int, count: int, tolerance: float) -> Exponent:
    f = jax_equations()
    import diffrax
    import jax
    import jax.numpy as jnp

    def tangent(tau, state, K):
        return jax.jvp(lambda x: f(tau, x, K), state[:1], state[1:])

    def turn(state, n):
        solution = diffrax.diffeqsolve(
            *(diffrax.ODETerm(tangent), diffrax.Dopri8(), TURN * n, TURN * (n + 1)),
            *(None, state, crack[0]),
            stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance),
            max_steps=None,
        )
        x, v = solution.ys[0][-1], solution.ys[1][-1]
        norm = jnp.linalg.norm(v)
        return (x, v / norm), jnp.log(norm)

    def exponent(start):
        _, logs = jax.lax.scan(turn, start, jnp.arange(first + count))
        return logs[first:].mean() / TURN

    start = (jnp.asarray(START), jnp.ones(12))
    compiled = jax.jit(exponent).lower(start).compile()
    return lambda: float(compiled(start))


# --- heyoka: Taylor series, compiled by LLVM


def heyoka_system(*, tangent: bool):
    import heyoka as hy

    def magnitude(x):
        return hy.relu(x) + hy.relu(-x)

    def limited(x):
        return hy.relu(x + 0.5) - hy.relu(x - 0.5) - 0.5

    x = hy.make_vars(*[f'x{i}' for i in range(12)])
    f = equations(hy.sin, hy.cos, hy.sqrt, magnitude, limited, as_it_is)(hy.time, x, hy.par[0])
    system = list(zip(x, f, strict=True))
    if tangent:
        v = hy.make_vars(*[f'v{i}' for i in range(12)])
        rates = [hy.sum([hy.diff(f[i], x[j]) * v[j] for j in range(12)]) for i in range(12)]
        system.extend(zip(v, rates, strict=True))
    return system


HEYOKA_START = START + 1e-9
"""Off the points where a ball just touches: there the series does not exist, and gives NaN."""


def heyoka_orbit(
    crack: Array, first: int, count: int, tolerance: float, longest: float = math.inf
) -> Orbit:
    import heyoka as hy

    lanes = min(len(crack), hy.recommended_simd_size())
    start = np.repeat(HEYOKA_START[:, None], lanes, axis=1)
    solver = hy.taylor_adaptive_batch(
        heyoka_system(tangent=False), state=start, pars=np.zeros((1, lanes)), tol=tolerance
    )

    def some(K: Array) -> Array:
        solver.set_time(0.0)
        solver.state[:], solver.pars[:], states = start, K, []
        for i in range(count):
            solver.propagate_until(TURN * (first + i), max_delta_t=longest)
            states.append(solver.state.T.copy())
        return np.stack(states, axis=1)

    return lambda: np.concatenate([some(K) for K in np.split(crack, len(crack) // lanes)])


def heyoka_exponent(
    crack: Array, first: int, count: int, tolerance: float, longest: float = math.inf
) -> Exponent:
    import heyoka as hy

    start = np.append(HEYOKA_START, np.full(12, math.sqrt(1.0 / 12.0)))
    solver = hy.taylor_adaptive(
        heyoka_system(tangent=True), state=start.copy(), pars=[crack[0]], tol=tolerance
    )

    def run() -> float:
        solver.time, solver.state[:], total = 0.0, start, 0.0
        for n in range(first + count):
            solver.propagate_until(TURN * (n + 1), max_delta_t=longest)
            norm = float(np.linalg.norm(solver.state[12:]))
            solver.state[12:] /= norm
            total += math.log(norm) if n >= first else 0.0
        return total / (TURN * count)

    return run
