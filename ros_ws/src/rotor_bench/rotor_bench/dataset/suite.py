# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The plan of a suite: virtual machines, and every flight of each as a scenario with labels."""

import dataclasses
import functools
import hashlib
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from maneuver_gen.load_grid import load_grid
from rotor_bench.dataset.draws import WHOLE_SUITE, balanced, generator
from rotor_bench.dataset.maneuvers import Pilot, speed_program
from rotor_bench.dataset.sensing import sensors
from rotor_bench.dataset.suite_config import Group, NoisePreset, SuiteConfig, load_suite
from rotor_bench.errors import DatasetError
from rotor_common.constants import GRAVITY_M_S2, LANES
from rotor_rig.scenario_model import Scenario

HIGHEST_SEED = 2**62


@dataclass(frozen=True)
class Grid:
    """One flight of the grid: its level of each factor."""

    role: Literal['reference', 'test']
    family: str
    speed_program: str
    confounder: str = 'none'
    crack: Literal['healthy', 'constant', 'growing'] = 'healthy'
    crack_stiffness_ratio: float = 0.0
    decoy: bool = False
    """Healthy, and as long as a flight with a growing crack, so that the length reveals nothing."""


@dataclass(frozen=True)
class Rotor:
    """What stays the same over all flights of a machine."""

    number: int
    group: str
    split: Literal['train', 'test']
    speed_rad_s: float
    eccentricity_m: float
    clearance_m: float
    shaft_stiffness_n_m: float
    damping_ratio: float
    crack_half_angle_rad: float
    misalignment_n: float
    misalignment_phase_rad: float
    crack_angle_rad: float
    encoder: bool
    noise: NoisePreset


@dataclass(frozen=True)
class Flight:
    """One flight of one virtual machine; the fields determine everything about it.

    `scenario` and `labels` are computed on first use: a plan has thousands of flights.
    """

    suite: SuiteConfig
    seed: int
    rotor: Rotor
    grid: Grid
    number: int

    @property
    def machine(self) -> int:
        """Number of the machine in the suite."""
        return self.rotor.number

    @property
    def role(self) -> Literal['reference', 'test']:
        """Whether the flight is for fitting the machine's baseline, or a test."""
        return self.grid.role

    @property
    def split(self) -> Literal['train', 'test']:
        """Split of the suite that the machine belongs to."""
        return self.rotor.split

    @property
    def duration_s(self) -> float:
        """Length of the flight, s."""
        is_long = self.grid.crack == 'growing' or self.grid.decoy
        return self.suite.growth_s if is_long else self.suite.flight_s

    @property
    def name(self) -> str:
        """A name for the flight's file that reveals nothing about it."""
        text = f'{self.suite.name}/{self.seed}/{self.machine}/{self.number}'
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    @functools.cached_property
    def scenario(self) -> Scenario:
        """The flight as a scenario, which can also run on its own."""
        suite, rotor, grid = self.suite, self.rotor, self.grid
        draw = self._draw(0)
        return Scenario.from_mapping(
            {
                'name': self.name,
                'duration_s': self.duration_s,
                'rate_hz': suite.rate_hz,
                'block_samples': suite.block_samples,
                'steps_per_revolution': suite.steps_per_revolution,
                'settle_revolutions': suite.settle_revolutions,
                'speed': {
                    **speed_program(
                        grid.speed_program, rotor.speed_rad_s, self.duration_s, suite.speed, draw
                    ),
                    # one for the whole suite: machines of the same steps a sample fly in lock-step
                    'highest_rad_s': suite.machine.speed_rad_s[1] * suite.speed.highest(),
                },
                'maneuver': Pilot(suite.maneuver, draw).flight(grid.family, self.duration_s),
                'seed': int(draw.integers(HIGHEST_SEED)),
                **self._rotor_keys(),
                'sensors': sensors(
                    rotor.noise,
                    suite.sensors,
                    generator(suite.name, self.seed, rotor.number, WHOLE_SUITE + 1),
                    encoder=rotor.encoder,
                    fault=self._change.sensor_fault,
                ),
            }
        )

    @functools.cached_property
    def labels(self) -> dict[str, Any]:
        """Labels that a detector must not know, as a flat mapping."""
        rotor, grid = self.rotor, self.grid
        return {
            'group': rotor.group,
            'crack': grid.crack,
            'crack_stiffness_ratio': grid.crack_stiffness_ratio,
            'decoy': grid.decoy,
            'maneuver': grid.family,
            'held_out_family': grid.family in self.suite.held_out_families,
            'speed_program': grid.speed_program,
            'speed_rad_s': rotor.speed_rad_s,
            'confounder': grid.confounder,
            **dataclasses.asdict(self._change),
            'crack_angle_rad': rotor.crack_angle_rad,
            'shaft_stiffness_n_m': rotor.shaft_stiffness_n_m,
            'damping_ratio': rotor.damping_ratio,
            'crack_half_angle_rad': rotor.crack_half_angle_rad,
            'noise': rotor.noise,
            'encoder': rotor.encoder,
            **_load_labels(self.scenario),
            'seed': self.scenario.seed,
        }

    def _draw(self, purpose: int) -> np.random.Generator:
        return generator(self.suite.name, self.seed, self.machine, self.number, purpose)

    def _rotor_keys(self) -> dict[str, Any]:
        grid, change = self.grid, self._change
        growth = {'at_s': 0.0, 'to': grid.crack_stiffness_ratio, 'over_s': self.duration_s}
        growing = grid.crack == 'growing'
        return {
            'rotor': {
                'crack_stiffness_ratio': 0.0 if growing else grid.crack_stiffness_ratio,
                'crack_angle_rad': self.rotor.crack_angle_rad,
                'eccentricity_m': change.eccentricity_m,
                'clearance_m': change.clearance_m,
                'shaft_stiffness_n_m': self.rotor.shaft_stiffness_n_m,
                'damping_ratio': self.rotor.damping_ratio,
                'crack_half_angle_rad': self.rotor.crack_half_angle_rad,
            },
            'crack_growth': [growth] if growing else [],
            'forcing': {
                'amplitude_n': change.forcing_n,
                'phase_rad': self.rotor.misalignment_phase_rad,
            },
        }

    @functools.cached_property
    def _change(self) -> 'Change':
        """The rotor of this flight after its confounder has changed it."""
        table, rotor, draw = self.suite.changes, self.rotor, self._draw(1)
        same = Change(rotor.eccentricity_m, rotor.clearance_m, rotor.misalignment_n, '')
        match self.grid.confounder:
            case 'eccentricity':
                factor = float(draw.uniform(*table.eccentricity_factor))
                return dataclasses.replace(same, eccentricity_m=factor * same.eccentricity_m)
            case 'clearance':
                step = float(draw.uniform(*table.clearance_step_m))
                return dataclasses.replace(same, clearance_m=same.clearance_m + step)
            case 'misalignment':
                step = float(draw.uniform(*table.misalignment_step_n))
                return dataclasses.replace(same, forcing_n=same.forcing_n + step)
            case 'sensor_fault':
                faults = self.suite.sensors.faults
                fault = faults[draw.integers(len(faults))]
                return dataclasses.replace(same, sensor_fault=fault)
        return same


@dataclass(frozen=True)
class Change:
    """Rotor and sensors of one flight, after what its confounder changed."""

    eccentricity_m: float
    clearance_m: float
    forcing_n: float
    sensor_fault: str


@dataclass(frozen=True)
class Machine:
    """A virtual machine: its reference flights, then its tests in an order that reveals nothing."""

    number: int
    split: str
    flights: tuple[Flight, ...]


def plan_suite(name: str | SuiteConfig, seed: int = 0) -> tuple[Machine, ...]:
    """Return the machines of a suite: a shipped name, a YAML file or a description.

    The same description and seed give the same plan. Raises DatasetError or ConfigError.
    """
    suite = name if isinstance(name, SuiteConfig) else load_suite(name)
    if not 0 <= seed < HIGHEST_SEED:
        raise DatasetError(f'seed = {seed} is out of range; allowed: 0 to 2^62')
    machines: list[Machine] = []
    for index, group in enumerate(suite.groups):
        machines += _Planner(suite, seed, group, index, len(machines)).machines()
    return tuple(machines)


def batches(machines: Sequence[Machine]) -> Iterator[tuple[Machine, ...]]:
    """Yield up to LANES machines at a time whose flights have the same durations, in order."""
    for _, alike in itertools.groupby(machines, _durations):
        yield from itertools.batched(alike, LANES)


def _durations(machine: Machine) -> tuple[float, ...]:
    return tuple(flight.duration_s for flight in machine.flights)


class _Planner:
    """Plans the machines of one group."""

    def __init__(
        self, suite: SuiteConfig, seed: int, group: Group, index: int, first_machine: int
    ) -> None:
        self._suite = suite
        self._seed = seed
        self._group = group
        self._design = generator(suite.name, seed, WHOLE_SUITE + index)
        self._first = first_machine
        self._families = suite.families_of(held_out=group.held_out)
        table = suite.machine
        self._ladders = balanced(
            group.machines,
            (len(table.eccentricities_m), len(table.clearances_m), len(table.misalignments_n), 2),
            self._design,
        )
        self._strata = self._design.permutation(group.machines)
        self._healthy = self._grid(group.healthy, ())
        self._cracked = self._grid(group.cracked, suite.crack_stiffness_ratios)
        self._growing = balanced(
            group.machines * group.growing, (len(suite.speed_programs),), self._design
        )

    def machines(self) -> Iterator[Machine]:
        """Yield the machines of the group."""
        for place in range(self._group.machines):
            rotor = self._rotor(place)
            flights = tuple(
                Flight(self._suite, self._seed, rotor, grid, number)
                for number, grid in enumerate(self._wanted(rotor.number, place))
            )
            yield Machine(rotor.number, self._group.split, flights)

    def _grid(self, per_machine: int, cracks: Sequence[float]) -> list[Grid]:
        """Return the group's cracked tests, or healthy ones without `cracks`, by machine."""
        suite, ladder = self._suite, cracks or (0.0,)
        factors = (ladder, self._families, suite.speed_programs, suite.confounders)
        rows = balanced(
            per_machine * self._group.machines, [len(levels) for levels in factors], self._design
        )
        return [
            Grid(
                'test',
                self._families[family],
                suite.speed_programs[program],
                suite.confounders[confounder],
                'constant' if cracks else 'healthy',
                ladder[crack],
            )
            for crack, family, program, confounder in rows
        ]

    def _wanted(self, machine: int, place: int) -> list[Grid]:
        """Return the flights of one machine in their order."""
        group, suite = self._group, self._suite

        def part(rows: list[Any], count: int) -> list[Any]:
            return rows[place * count : (place + 1) * count]

        tests = part(self._healthy, group.healthy) + part(self._cracked, group.cracked)
        long = [
            grid
            for (program,) in part(self._growing, group.growing)
            for grid in self._growing_and_decoy(suite.speed_programs[program])
        ]
        draw = generator(suite.name, self._seed, machine)
        order, long_order = draw.permutation(len(tests)), draw.permutation(len(long))
        return [
            *(Grid('reference', r.family, r.speed_program) for r in suite.references),
            *(tests[i] for i in order),
            *(long[i] for i in long_order),
        ]

    def _growing_and_decoy(self, program: str) -> tuple[Grid, Grid]:
        """Return a flight with a growing crack, and a healthy one of the same kind and length."""
        growing = Grid('test', 'mixed', program, 'none', 'growing', self._suite.growth_to)
        return growing, Grid('test', 'mixed', program, decoy=True)

    def _rotor(self, place: int) -> Rotor:
        number, group, table = self._first + place, self._group, self._suite.machine
        draw = generator(self._suite.name, self._seed, number, WHOLE_SUITE)
        eccentricity, clearance, misalignment, encoder = self._ladders[place]
        slow, fast = table.speed_rad_s
        share = (self._strata[place] + draw.random()) / group.machines
        return Rotor(
            number=number,
            group=group.name,
            split=group.split,
            speed_rad_s=float(slow + share * (fast - slow)),
            eccentricity_m=table.eccentricities_m[eccentricity],
            clearance_m=table.clearances_m[clearance],
            shaft_stiffness_n_m=float(draw.uniform(*table.shaft_stiffness_n_m)),
            damping_ratio=float(draw.uniform(*table.damping_ratio)),
            crack_half_angle_rad=float(draw.uniform(*table.crack_half_angle_rad)),
            misalignment_n=table.misalignments_n[misalignment],
            misalignment_phase_rad=float(draw.uniform(0.0, 2.0 * np.pi)),
            crack_angle_rad=float(draw.uniform(0.0, 2.0 * np.pi)),
            encoder=bool(encoder),
            noise=group.noise[place % len(group.noise)],
        )


def _load_labels(scenario: Scenario) -> dict[str, float]:
    """Return the least and the greatest load factor of a flight, and their difference."""
    factors = load_grid(scenario.maneuver, scenario.duration_s)[:, 0] / GRAVITY_M_S2
    least, greatest = float(factors.min()), float(factors.max())
    return {
        'load_factor_min': least,
        'load_factor_max': greatest,
        'load_factor_range': greatest - least,
    }
