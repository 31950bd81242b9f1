# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: ANN001, ANN201, ANN202, D103, PLC0415 - as users write
"""The rotor in this project, in C, in scipy and in CyRK; `peers.py` times them.

Each library gets the fastest right-hand side it takes, and its method that was fastest here.

`*_orbit(crack, first, count, tolerance)` prepares and compiles, and returns a function that gives
states (n, count, 2 or more: Y, Z first) at tau = 2 pi (first + i) for each K of `crack` (n,).
`*_exponent(crack, first, count, tolerance)` returns one that gives the largest Lyapunov exponent
per unit tau for one K, over `count` revolutions after the `first` ones.
`tolerance` is relative and absolute; for fixed steps it is the length of a step in revolutions.
"""

import ctypes
import functools
import math
from collections.abc import Callable

import numpy as np
from c_peer import Rotor, c_library
from equations import (
    LOAD_FACTOR,
    ROTOR,
    SPEED_RAD_S,
    START,
    TURN,
    UNITS,
    Array,
    equations,
    growth,
)
from hou_equations import ball_angles

from rotor_common.constants import GRAVITY_M_S2
from rotor_dynamics import (
    Ensemble,
    OperatingPoint,
    Plan,
    Sweep,
    lyapunov_exponent,
    orbit_diagram,
)
from rotor_sim.plant.parameters import RotorParameters

Orbit = Callable[[], Array]
Exponent = Callable[[], float]

# --- this project


def rig_orbit(crack: Array, first: int, count: int, tolerance: float) -> Orbit:
    rotors = [ROTOR.model_copy(update={'crack_stiffness_ratio': K}) for K in crack]
    points = [OperatingPoint(rotor, SPEED_RAD_S, LOAD_FACTOR) for rotor in rotors]

    def run() -> Array:
        ensemble = Ensemble(points, round(1.0 / tolerance))
        ensemble.advance(first)
        return ensemble.advance(count, samples_per_revolution=1) / UNITS[[0, 1, 6, 7]]

    run()
    return run


def rig_exponent(crack: Array, first: int, count: int, tolerance: float) -> Exponent:
    rotor = ROTOR.model_copy(update={'crack_stiffness_ratio': crack[0]})

    def run() -> float:
        result = lyapunov_exponent(
            rotor,
            speed_rad_s=SPEED_RAD_S,
            load_factor=LOAD_FACTOR,
            transient_revolutions=0,
            revolutions=first + count,  # and leaves the first tenth out
            steps_per_revolution=round(1.0 / tolerance),
        )
        return result.exponent

    run()
    return run


def diagram_orbit(crack: Array, first: int, count: int, tolerance: float) -> Orbit:
    def run() -> Array:
        diagram = orbit_diagram(
            OperatingPoint(ROTOR, SPEED_RAD_S, LOAD_FACTOR),
            Sweep('K', crack),
            Plan(first, count, round(1.0 / tolerance)),
        )
        return np.stack([diagram.y, diagram.z], axis=-1) / ROTOR.length_scale_m

    run()
    return run


# --- plain C: peer.c, of fixed steps as this project


def c_rotor(r: RotorParameters) -> Rotor:
    balls, load = ball_angles(r, 0.0), LOAD_FACTOR * GRAVITY_M_S2
    rotor = Rotor(
        *(r.disk_mass_kg, r.bearing_mass_kg, r.shaft_stiffness_n_m, r.damping_ratio),
        *(r.crack_stiffness_ratio, r.crack_angle_rad, r.crack_half_angle_rad, r.clearance_m),
        *(r.eccentricity_m, r.contact_stiffness_n_m15, r.cage_ratio, SPEED_RAD_S, load),
        r.ball_count,
    )
    rotor.cos_ball[: len(balls)] = np.cos(balls).tolist()
    rotor.sin_ball[: len(balls)] = np.sin(balls).tolist()
    return rotor


def c_advance(rotor: Rotor, state: Array, turn: int, turns: int, steps: int) -> None:
    """Advance a state (12,) in SI in place, from revolution `turn` on; `steps` a revolution."""
    c_library().advance(
        ctypes.byref(rotor),
        state.ctypes.data_as(ctypes.c_void_p),
        ctypes.c_long(turn * steps),
        ctypes.c_long(turns * steps),
        ctypes.c_double(TURN / rotor.speed / steps),
    )


def c_orbit(crack: Array, first: int, count: int, tolerance: float) -> Orbit:
    steps = round(1.0 / tolerance)
    cracked = [ROTOR.model_copy(update={'crack_stiffness_ratio': K}) for K in crack]
    rotors = [c_rotor(rotor) for rotor in cracked]
    c_library()

    def one(rotor: Rotor) -> list[Array]:
        states = [START * UNITS]
        c_advance(rotor, states[0], 0, first, steps)
        for i in range(1, count):
            states.append(states[-1].copy())
            c_advance(rotor, states[-1], first + i - 1, 1, steps)
        return states

    return lambda: np.array([one(rotor) for rotor in rotors]) / UNITS


def c_exponent(crack: Array, first: int, count: int, tolerance: float) -> Exponent:
    cracked = ROTOR.model_copy(update={'crack_stiffness_ratio': crack[0]})
    rotor = c_rotor(cracked)

    def turn(n: int, x: Array) -> Array:
        pair = x.reshape(2, 12) * UNITS
        for state in pair:
            c_advance(rotor, state, n, 1, round(1.0 / tolerance))
        return np.ravel(pair / UNITS)

    return lambda: growth(turn, first, count)


# --- scipy and CyRK, right-hand side by numba


@functools.cache
def numba_equations():
    import numba

    jit = numba.njit(error_model='numpy', fastmath={'reassoc', 'contract', 'arcp', 'nsz'})
    limited = jit(lambda value: min(max(value, -0.5), 0.5))
    return equations(math.sin, math.cos, math.sqrt, abs, limited, jit)


@functools.cache
def numba_single():
    import numba

    f = numba_equations()
    single = numba.njit(lambda tau, x, K: np.array(f(tau, x, K)))
    single(0.0, START, 0.1)
    return single


@functools.cache
def numba_pair():
    import numba

    f = numba_equations()
    pair = numba.njit(lambda tau, x, K: np.array(f(tau, x[:12], K) + f(tau, x[12:], K)))
    pair(0.0, np.tile(START, 2), 0.1)
    return pair


def scipy_dop853_orbit(crack: Array, first: int, count: int, tolerance: float) -> Orbit:
    from scipy.integrate import ode

    solver = ode(numba_single())  # 4 times faster than solve_ivp
    solver.set_integrator('dop853', rtol=tolerance, atol=tolerance, nsteps=10**6)

    def one(K: float) -> list[Array]:
        solver.set_initial_value(START, 0.0).set_f_params(K)
        return [solver.integrate(TURN * (first + i)).copy() for i in range(count)]

    return lambda: np.array([one(K) for K in crack])


def scipy_dop853_exponent(crack: Array, first: int, count: int, tolerance: float) -> Exponent:
    from scipy.integrate import ode

    solver = ode(numba_pair()).set_f_params(crack[0])
    solver.set_integrator('dop853', rtol=tolerance, atol=tolerance, nsteps=10**6)

    def turn(n: int, x: Array) -> Array:
        return solver.set_initial_value(x, TURN * n).integrate(TURN * (n + 1)).copy()

    return lambda: growth(turn, first, count)


def scipy_lsoda_orbit(crack: Array, first: int, count: int, tolerance: float) -> Orbit:
    from scipy.integrate import odeint  # twice as fast as solve_ivp

    f = numba_single()
    tau = TURN * np.append(0, np.arange(first, first + count))
    options = {'tfirst': True, 'rtol': tolerance, 'atol': tolerance, 'mxstep': 10**6}
    return lambda: np.array([odeint(f, START, tau, (K,), **options)[1:] for K in crack])


def scipy_lsoda_exponent(crack: Array, first: int, count: int, tolerance: float) -> Exponent:
    from scipy.integrate import odeint

    f = numba_pair()
    options = {'tfirst': True, 'rtol': tolerance, 'atol': tolerance, 'mxstep': 10**6}

    def turn(n: int, x: Array) -> Array:
        return odeint(f, x, [TURN * n, TURN * (n + 1)], (crack[0],), **options)[1]

    return lambda: growth(turn, first, count)


CYRK_METHOD = 'Vern7'


@functools.cache
def cyrk_address(pair: bool):
    from CyRK import nb_diffeq_addr, nbsolve2_ivp
    from numba import carray

    f = numba_equations()

    def single(out, tau, x, K):
        for i, value in enumerate(f(tau, x, K[0])):
            out[i] = value

    def both(out, tau, x, K):
        two = carray(x, 24)
        for i, value in enumerate(f(tau, two[:12], K[0]) + f(tau, two[12:], K[0])):
            out[i] = value

    address = nb_diffeq_addr(both if pair else single)
    x = np.tile(START, 2 if pair else 1)
    nbsolve2_ivp(address, (0.0, 1.0), x, CYRK_METHOD, np.ones(1), False, np.ones(1), 1e-3, 1e-3)
    return address


def cyrk_orbit(crack: Array, first: int, count: int, tolerance: float) -> Orbit:
    from CyRK import nbsolve2_ivp

    address, tau = cyrk_address(pair=False), TURN * np.arange(first, first + count)

    def one(K: float) -> Array:
        span, K = (0.0, tau[-1]), np.array([K])
        done = nbsolve2_ivp(address, span, START, CYRK_METHOD, tau, False, K, tolerance, tolerance)
        return done.y.T.copy()

    return lambda: np.array([one(K) for K in crack])


def cyrk_exponent(crack: Array, first: int, count: int, tolerance: float) -> Exponent:
    from CyRK import nbsolve2_ivp

    address = cyrk_address(pair=True)

    def turn(n: int, x: Array) -> Array:
        tau = np.array([TURN * n, TURN * (n + 1)])
        span = (tau[0], tau[1])
        done = nbsolve2_ivp(
            address, span, x, CYRK_METHOD, tau[1:], False, crack[:1], tolerance, tolerance
        )
        return done.y[:, -1].copy()

    return lambda: growth(turn, first, count)
