# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Time a step of plants of growing size, and how fast beams of finite elements run.

    python benchmarks/plants.py [--markdown FILE]

Sixteen rotors side by side in the stream, one core. The first rows are the paper's rotor with more
and more masses on soft springs below its bearings; ratios are to the step of its 6 degrees of
freedom in the same turn, medians of TURNS. The last rows are the plants that ship; `real time` is
simulated seconds per second of 16 rotors at RATE_HZ, without sensors and writing.
"""

import argparse
import math
import statistics
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import report
from rich.console import Console

from rotor_common.constants import LANES, LOAD_RATE_HZ
from rotor_sim import RotorParameters
from rotor_sim.plant import CompiledPlant, Instant, Plant, static_equilibrium
from rotor_sim.plant.elements.shaft_segment import ShaftSegment
from rotor_sim.plant.hou2016 import hou2016
from rotor_sim.plant.modes import modes
from rotor_sim.plant.plant import Node
from rotor_sim.plant.shipped import plant_named

TURNS = 5
SAMPLES = 1000
RATE_HZ = 10_240
SPEED_RAD_S = 200.0
LOAD_M_S2 = (9.81, 0.0)
EXTRA_NODES = (0, 1, 2, 4, 8, 12)
SHIPPED = ('fe_midspan', 'fe_offset', 'fe_two_disks', 'overhung')
STEPS_PER_PERIOD = 18
"""Of the fastest mode, as in a run."""


def with_masses(count: int) -> Plant:
    """Return the paper's rotor with `count` more masses on soft springs at its bearings."""
    plant = hou2016(RotorParameters())
    nodes = dict(plant.nodes) | {f'mass_{k}': Node(mass_kg=4.0) for k in range(count)}
    springs = tuple(
        ShaftSegment(node=f'bearing_{1 + k % 2}', other=f'mass_{k}', stiffness_n_m=1e6)
        for k in range(count)
    )
    return Plant(nodes=nodes, elements=(*plant.elements, *springs))


class Stream:
    """Sixteen equal rotors from rest, at constant speed."""

    def __init__(self, plant: Plant) -> None:
        self.plant = CompiledPlant(plant)
        rest = static_equilibrium(self.plant, LOAD_M_S2)
        fastest = modes(self.plant, rest, Instant(load_m_s2=LOAD_M_S2)).frequencies_rad_s[-1]
        self.substeps = math.ceil(STEPS_PER_PERIOD * fastest / (2.0 * math.pi * RATE_HZ))
        columns = len(self.plant.ratios) + 2 + 2 * len(self.plant.live)
        self._drives = np.zeros((LANES, SAMPLES, columns))
        times_s = np.arange(SAMPLES) / RATE_HZ
        for column, ratio in enumerate(self.plant.ratios):
            self._drives[:, :, column] = np.mod(ratio * SPEED_RAD_S * times_s, 2.0 * math.pi)
        self._drives[:, :, len(self.plant.ratios)] = SPEED_RAD_S
        self._drives[:, :, len(self.plant.ratios) + 2 :: 2] = list(self.plant.live.values())
        self._states = np.tile(rest, (LANES, 1))

    def run(self) -> None:
        """Integrate SAMPLES samples from rest; raises SystemExit if a rotor diverges."""
        plant, states = self.plant, self._states.copy()
        out = np.empty((LANES, SAMPLES, plant.size))
        points = SAMPLES * LOAD_RATE_HZ // RATE_HZ + 3
        plant.module.stream(
            (0,) * LANES,
            (),
            np.tile(plant.coefficients, (LANES, 1)),
            np.tile(plant.ratios, (LANES, 1)),
            states,
            out,
            RATE_HZ,
            1.0 / RATE_HZ,
            self.substeps,
            0,
            self._drives,
            np.tile(np.array(LOAD_M_S2), (LANES, points, 1)),
            0,
            LOAD_RATE_HZ,
        )
        if not np.isfinite(states).all():
            raise SystemExit('a rotor diverged; nothing to time')

    @property
    def steps(self) -> int:
        """Steps of one rotor in a run, times the rotors."""
        return LANES * SAMPLES * self.substeps


def rows_of(streams: dict[str, Stream]) -> list[Sequence[str]]:
    """Time all in turn; return the table."""
    for stream in streams.values():
        stream.run()  # compiles
    turns = [{name: report.timed(s.run)[0] for name, s in streams.items()} for _ in range(TURNS)]
    first = next(iter(streams))
    rows: list[Sequence[str]] = [
        ('plant', 'degrees of freedom', 'ns/step', 'to 6', 'steps a sample', 'real time')
    ]
    for name, stream in streams.items():
        per_step = [turn[name] / stream.steps for turn in turns]
        base = [turn[first] / streams[first].steps for turn in turns]
        ratio = statistics.median(a / b for a, b in zip(per_step, base, strict=True))
        faster = LANES * SAMPLES / RATE_HZ / statistics.median(turn[name] for turn in turns)
        rows.append(
            (
                name,
                str(stream.plant.size),
                f'{1e9 * statistics.median(per_step):.0f}',
                f'{ratio:.2f}',
                str(stream.substeps),
                f'{faster:.0f}x',
            )
        )
    return rows


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description='Time plants of growing size.')
    parser.add_argument('--markdown', type=Path, help='replace the table in this page')
    options = parser.parse_args()
    report.use_one_core()
    streams = {f'paper, {count} more masses': Stream(with_masses(count)) for count in EXTRA_NODES}
    streams |= {name: Stream(plant_named(name)) for name in SHIPPED}
    rows = rows_of(streams)
    report.show(Console(), rows)
    if options.markdown is not None:
        report.write_markdown(options.markdown, 'plants.py', rows)


if __name__ == '__main__':
    main()
