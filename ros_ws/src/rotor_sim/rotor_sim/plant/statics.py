# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Static equilibrium of a plant under a constant load, the start of every run."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rotor_sim.errors import IntegrationError
from rotor_sim.plant.compiled_plant import CompiledPlant, Instant

Array = NDArray[np.float64]

_ITERATIONS = 400
_CONVERGED = 1e-12
_ROUNDING = 1e-9
"""Of the load: below it the search ends once it gains nothing, as rounding lets stiff parts."""
_LONGEST_STEP_M = 1e-4
"""Of the search where nothing holds the rotor, as in the clearance of a bearing."""
_LEAST_DAMPING = 1e-12
"""Of the stiffness: where a ball alone carries, nothing holds the journal sideways."""
_ACCEPTED = 1e-6
_ACCEPTED_AT_A_JUMP = 0.5
"""Of the load: where the force jumps, it may be in balance on neither side (Filippov)."""


def static_equilibrium(
    plant: CompiledPlant,
    load_m_s2: tuple[float, float],
    angle_rad: float = 0.0,
    live: Mapping[str, float] | None = None,
) -> Array:
    """Return the state (2n,) at rest in m and m/s: forces in balance, velocities 0.

    The shaft stands still at `angle_rad`, so the unbalance does not act. `load_m_s2` is (y, z) in
    frame `rotor`; without load the rotor is put at the origin, in a clearance one of many places.
    Found by pseudo-transient continuation (Kelley and Keyes, SIAM J. Numer. Anal.
    35 (1998) 508): implicit steps of x' = acceleration(x), longer as the balance comes near. Where
    the balance lies on a jump of the force, the nearest place found is returned. What is out of
    balance is measured as the root of a'M a: of a linear plant each step makes it smaller.

    Raises:
        IntegrationError: nothing holds the rotor, or the search did not converge.

    """
    n = plant.size
    at = Instant(angle_rad, load_m_s2=load_m_s2, live=live)
    state = np.zeros(2 * n)
    mass = plant.assembly.linear.mass / np.max(plant.assembly.linear.mass)
    missing = plant.acceleration(state, at)
    size = _length(missing, mass)
    if size == 0.0 or load_m_s2 == (0.0, 0.0):
        return state
    best, smallest = state, np.inf
    damping = float(np.max(np.abs(plant.jacobian(state, at)[:, :n]))) or 1.0
    least = _LEAST_DAMPING * damping
    for _ in range(_ITERATIONS):
        norm = _length(missing, mass)
        if _ROUNDING * size >= smallest <= norm:
            break
        if norm < smallest:
            best, smallest = state.copy(), norm
        if norm <= _CONVERGED * size:
            break
        slope = plant.jacobian(state, at)[:, :n]
        step = np.linalg.solve(damping * np.eye(n) - slope, missing)
        state[:n] += step
        following = plant.acceleration(state, at)
        if not np.isfinite(following).all():
            break
        change = _length(following, mass) / norm
        damping *= min(change, 2.0) if change > 1.0 else max(0.7 * change, 0.1)
        damping = max(damping, least, change * norm / _LONGEST_STEP_M)
        missing = following
    accepted = _ACCEPTED_AT_A_JUMP if plant.engine.switches else _ACCEPTED
    if not smallest <= accepted * size:
        raise IntegrationError(
            f'no equilibrium under a load of ({load_m_s2[0]:g}, {load_m_s2[1]:g}) m/s^2: nothing '
            'holds the rotor, or too loosely; give its nodes springs or bearings'
        )
    return best


def _length(acceleration: Array, mass: Array) -> float:
    return float(np.sqrt(acceleration @ mass @ acceleration))
