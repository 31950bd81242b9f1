# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The Campbell diagram of a plant and its critical speeds (Genta 2005, sections 1.3 and 4.2)."""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from rotor_sim.plant.compiled_plant import CompiledPlant, Instant
from rotor_sim.plant.modes import Modes, modes

Array = NDArray[np.float64]

_ON_THE_LINE = 1e-6
"""Of the speed: how near to it a frequency is at a critical speed."""


@dataclass(frozen=True)
class CriticalSpeed:
    """A speed at which a natural frequency is that of the shaft.

    `decay_rate_1_s` is positive where the mode decays; `whirl` as in `whirl_of`.
    """

    speed_rad_s: float
    decay_rate_1_s: float
    whirl: float


@dataclass(frozen=True)
class Campbell:
    """Natural frequencies over speed, slowest first, NaN where a speed has fewer.

    `speeds_rad_s` (s,), `frequencies_rad_s` and `whirls` (s, m); the critical speeds are those
    within the range of the speeds.
    """

    speeds_rad_s: Array
    frequencies_rad_s: Array
    whirls: Array
    critical_speeds: tuple[CriticalSpeed, ...]


def whirl_of(plant: CompiledPlant, shapes: NDArray[np.complex128]) -> Array:
    """Return for modes (m, n) from -1, circular backward, over 0, straight, to 1, forward.

    Forward is from y to z, as the shaft turns. It is the mean over the nodes, weighted with the
    squares of what they move.
    """
    coordinates = plant.plant.coordinates()
    everywhere = plant.assembly.all_displacements(shapes)
    axes = np.array([axis for _, axis in coordinates])
    y, z = everywhere[:, axes == 'y'], everywhere[:, axes == 'z']
    moved = np.sum(np.abs(y) ** 2 + np.abs(z) ** 2, axis=1)
    turned = 2.0 * np.sum((y * z.conj()).imag, axis=1)
    return np.divide(turned, moved, out=np.zeros(len(shapes)), where=moved > 0.0)


def campbell(
    plant: CompiledPlant,
    state: Array,
    speeds_rad_s: ArrayLike,
    load_m_s2: tuple[float, float] = (0.0, 0.0),
    on_progress: Callable[[int, int], Any] = lambda done, total: None,  # noqa: ARG005
) -> Campbell:
    """Return the vibrations about a state (2n,) at rest under a load, over rising speeds.

    A critical speed is looked for where a frequency, counted from the slowest, passes that of the
    shaft between two of the speeds.
    """
    speeds = np.asarray(speeds_rad_s, np.float64)

    @functools.cache
    def at(speed: float) -> Modes:
        return modes(plant, state, Instant(speed_rad_s=speed, load_m_s2=load_m_s2))

    found = []
    for k, speed in enumerate(speeds):
        found.append(at(float(speed)))
        on_progress(k + 1, len(speeds))
    count = max(len(each.frequencies_rad_s) for each in found)
    frequencies, whirls = np.full((2, len(speeds), count), np.nan)
    for k, each in enumerate(found):
        frequencies[k, : len(each.frequencies_rad_s)] = each.frequencies_rad_s
        whirls[k, : len(each.frequencies_rad_s)] = whirl_of(plant, each.shapes)

    def excess(speed: float, number: int) -> float:
        values = at(speed).frequencies_rad_s
        return float(values[number]) - speed if number < len(values) else np.nan

    critical = []
    above = frequencies - speeds[:, np.newaxis]
    for k, number in zip(*np.nonzero(above[:-1] * above[1:] < 0.0), strict=True):
        speed = float(brentq(excess, speeds[k], speeds[k + 1], args=(int(number),), rtol=1e-12))
        if abs(excess(speed, int(number))) > _ON_THE_LINE * speed:
            continue  # no mode passes here: one more or less is overdamped
        mode = at(speed)
        whirl = float(whirl_of(plant, mode.shapes[number : number + 1])[0])
        critical.append(CriticalSpeed(speed, float(mode.decay_rates_1_s[number]), whirl))
    critical.sort(key=lambda each: each.speed_rad_s)
    return Campbell(speeds, frequencies, whirls, tuple(critical))
