# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The plan of a suite: balanced, split, independent of order, references healthy and covering."""

import itertools
import pickle
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from maneuver_gen.load_grid import load_grid
from rotor_bench.dataset.draws import balanced, generator
from rotor_bench.dataset.suite import Flight, Machine, batches, plan_suite
from rotor_bench.dataset.suite_config import SuiteConfig, load_suite, shipped_suites
from rotor_bench.errors import DatasetError
from rotor_common.constants import LANES
from rotor_common.errors import RigError
from rotor_rig.scenario_model import Scenario

STANDARD = plan_suite('standard')
SMOKE = plan_suite('smoke')


def flights(machines: Iterable[Machine]) -> list[Flight]:
    return [flight for machine in machines for flight in machine.flights]


def flown_as(group: str, crack: str) -> list[Flight]:
    return [
        flight
        for flight in flights(STANDARD)
        if flight.rotor.group == group and flight.role == 'test' and flight.grid.crack == crack
    ]


def changed(**keys: Any) -> SuiteConfig:
    return SuiteConfig.from_mapping({**load_suite('smoke').plain(), **keys})


def test_the_standard_suite_is_as_large_as_it_says() -> None:
    assert len(flights(STANDARD)) >= 600
    realistic = [f for f in flights(STANDARD) if f.rotor.noise == 'realistic']
    healthy_s = sum(
        f.duration_s
        for f in realistic
        if f.split == 'test' and f.role == 'test' and f.grid.crack == 'healthy'
    )
    assert healthy_s >= 30 * 3600
    growing = [f for f in realistic if f.grid.crack == 'growing']
    assert len(growing) == 12
    for flight in growing:
        (growth,) = flight.scenario.crack_growth
        assert (growth.at_s, growth.over_s, growth.to) == (0.0, 600.0, 0.1)
        assert flight.scenario.rotor.crack_stiffness_ratio == 0.0


@pytest.mark.parametrize('name', ['smoke', 'standard'])
def test_every_growing_crack_has_a_healthy_flight_that_looks_the_same(name: str) -> None:
    machines = [m for m in plan_suite(name) if m.flights[0].rotor.group == 'growth']
    first = set()
    for machine in machines:
        suite = machine.flights[0].suite
        pair = [f for f in machine.flights if f.duration_s != suite.flight_s]
        assert pair == list(machine.flights[-2:])
        first.add(pair[0].grid.crack)
        healthy, growing = sorted(pair, key=lambda flight: flight.grid.crack, reverse=True)
        assert (healthy.grid.crack, growing.grid.crack) == ('healthy', 'growing')
        assert healthy.duration_s == growing.duration_s == suite.growth_s
        assert (healthy.labels['decoy'], growing.labels['decoy']) == (True, False)
        assert healthy.scenario.crack_growth == ()
        assert healthy.scenario.rotor.crack_stiffness_ratio == 0.0
        for label in ('maneuver', 'speed_program', 'confounder', 'eccentricity_m', 'clearance_m',
                      'forcing_n', 'noise', 'encoder'):  # fmt: skip
            assert healthy.labels[label] == growing.labels[label]
        assert healthy.scenario.maneuver != growing.scenario.maneuver  # drawn anew
    assert len(first) == 2 or len(machines) < 10  # the order says nothing
    decoys = [f for f in flights(plan_suite(name)) if f.grid.decoy]
    assert len(decoys) == len(machines)


@pytest.mark.parametrize('group', ['train', 'test'])
@pytest.mark.parametrize('crack', ['healthy', 'constant'])
def test_levels_and_pairs_of_levels_are_used_about_equally_often(group: str, crack: str) -> None:
    chosen = [f.grid for f in flown_as(group, crack)]
    factors: dict[str, Callable[[Any], Any]] = {
        'crack': lambda g: g.crack_stiffness_ratio,
        'family': lambda g: g.family,
        'speed': lambda g: g.speed_program,
        'confounder': lambda g: g.confounder,
    }
    for one in factors.values():
        counts = Counter(map(one, chosen)).values()
        assert max(counts) - min(counts) <= 2
    for one, other in itertools.combinations(factors.values(), 2):
        pairs = Counter((one(g), other(g)) for g in chosen)
        levels = len({one(g) for g in chosen}) * len({other(g) for g in chosen})
        assert len(pairs) == levels
        assert max(pairs.values()) - min(pairs.values()) <= 2


def test_every_depth_meets_every_maneuver_equally_often() -> None:
    cells = Counter(
        (f.grid.crack_stiffness_ratio, f.grid.family) for f in flown_as('test', 'constant')
    )
    assert set(cells.values()) == {6}
    assert len(cells) == 6 * 8


@pytest.mark.slow
@settings(deadline=None)
@given(st.integers(0, 60), st.lists(st.integers(1, 5), min_size=1, max_size=4), st.integers(0, 9))
def test_every_stretch_of_a_balanced_grid_is_balanced(
    count: int, sizes: list[int], seed: int
) -> None:
    rows = balanced(count, sizes, generator('any', seed, 0))
    assert len(rows) == count
    for place, size in enumerate(sizes):
        counts = np.bincount([row[place] for row in rows], minlength=size)
        assert len(counts) == size
        # pairs come first: a level may lag by what it takes to even out its pairs
        assert np.ptp(counts) <= 2


def test_the_splits_share_no_machine_no_seed_and_no_held_out_family() -> None:
    for machine in STANDARD:
        assert {flight.split for flight in machine.flights} == {machine.split}
    numbers = [machine.number for machine in STANDARD]
    assert numbers == list(range(len(STANDARD)))
    held_out = set(load_suite('standard').held_out_families)
    flown = {
        split: {f.grid.family for f in flights(STANDARD) if f.split == split}
        for split in ('train', 'test')
    }
    assert not held_out & flown['train']
    assert held_out <= flown['test']
    for flight in flights(SMOKE):
        assert flight.labels['held_out_family'] == (flight.grid.family in held_out)
    seeds = [flight.scenario.seed for flight in flights(SMOKE)]
    names = [flight.name for flight in flights(STANDARD)]
    assert len(set(seeds)) == len(seeds)
    assert len(set(names)) == len(names)


def test_references_are_healthy_unchanged_and_cover_what_the_tests_do() -> None:
    for machine in STANDARD[::16]:
        references = [f for f in machine.flights if f.role == 'reference']
        assert [f.number for f in references] == [0, 1, 2]
        loads: list[float] = []
        speeds: list[float] = []
        for flight in references:
            scenario = flight.scenario
            assert flight.labels['crack'] == 'healthy'
            assert flight.labels['confounder'] == 'none'
            assert scenario.rotor.crack_stiffness_ratio == 0.0
            assert scenario.rotor.eccentricity_m == machine.flights[0].rotor.eccentricity_m
            loads += (load_grid(scenario.maneuver, flight.duration_s)[:, 0] / 9.81).tolist()
            speeds += reached(scenario)
        assert min(loads) <= 1.0
        assert max(loads) >= 5.0
        for flight in machine.flights[3:]:
            assert min(speeds) <= min(reached(flight.scenario))
            assert max(speeds) >= max(reached(flight.scenario))


def reached(scenario: Scenario) -> list[float]:
    return [scenario.speed.initial_rad_s, *(ramp.to_rad_s for ramp in scenario.speed.ramps)]


@pytest.mark.slow
def test_a_confounder_changes_its_own_quantity_and_no_other() -> None:
    quantity_of = {
        'eccentricity': 'eccentricity_m',
        'clearance': 'clearance_m',
        'misalignment': 'forcing_n',
    }
    seen = set()
    for machine in STANDARD[::20]:
        rotor = machine.flights[0].rotor
        usual = {
            'eccentricity_m': rotor.eccentricity_m,
            'clearance_m': rotor.clearance_m,
            'forcing_n': rotor.misalignment_n,
        }
        for flight in machine.flights:
            confounder = flight.grid.confounder
            seen.add(confounder)
            for name, value in usual.items():
                if name == quantity_of.get(confounder):
                    assert flight.labels[name] > value
                else:
                    assert flight.labels[name] == value
            assert bool(flight.labels['sensor_fault']) == (confounder == 'sensor_fault')
            parameters = flight.scenario.rotor
            assert parameters.eccentricity_m == flight.labels['eccentricity_m']
            assert parameters.clearance_m == flight.labels['clearance_m']
            assert flight.scenario.forcing.amplitude_n == flight.labels['forcing_n']
            faulty = flight.scenario.sensors != machine.flights[0].scenario.sensors
            assert faulty == (confounder == 'sensor_fault')
    assert seen == {'none', 'eccentricity', 'clearance', 'misalignment', 'sensor_fault'}


def test_every_sensor_fault_changes_something() -> None:
    table = load_suite('standard')
    healthy = {}
    for fault in table.sensors.faults:
        suite = changed(
            sensors={**table.plain()['sensors'], 'faults': [fault]}, confounders=['sensor_fault']
        )
        machine = plan_suite(suite)[0]
        reference, test = machine.flights[0].scenario, machine.flights[3].scenario
        assert test.sensors != reference.sensors
        healthy[fault] = test.sensors.model_dump_json()
    assert len(set(healthy.values())) == len(table.sensors.faults)


def test_a_plan_does_not_depend_on_order_or_process() -> None:
    again = plan_suite('smoke')
    last = again[-1].flights[-1].scenario  # asked for first
    assert last == SMOKE[-1].flights[-1].scenario
    for one, other in zip(flights(again), flights(SMOKE), strict=True):
        copy = pickle.loads(pickle.dumps(one))  # noqa: S301 - our own
        assert copy.scenario == other.scenario
        assert copy.labels == other.labels


def test_another_seed_is_another_plan() -> None:
    other = plan_suite('smoke', seed=1)
    assert not {f.scenario.seed for f in flights(other)} & {f.scenario.seed for f in flights(SMOKE)}
    assert other[0].flights[0].rotor.speed_rad_s != SMOKE[0].flights[0].rotor.speed_rad_s


def test_more_machines_leave_the_draws_of_a_flight_alone() -> None:
    group = load_suite('smoke').plain()['groups'][0]
    few, many = (plan_suite(changed(groups=[{**group, 'machines': count}])) for count in (2, 5))
    assert few[1].flights[0].scenario.seed == many[1].flights[0].scenario.seed
    assert few[1].flights[0].scenario.maneuver == many[1].flights[0].scenario.maneuver


def test_the_flown_as_a_machine_come_in_no_telling_order() -> None:
    first = [machine.flights[3].grid.crack for machine in STANDARD if machine.number < 192]
    # 7 of 11 are healthy, or 4 of 8: four sigma
    assert 0.4 < first.count('healthy') / len(first) < 0.8


def test_batches_hold_machines_that_can_fly_together() -> None:
    groups = list(batches(STANDARD))
    assert [machine for group in groups for machine in group] == list(STANDARD)
    for group in groups:
        assert len(group) <= LANES
        assert len({tuple(f.duration_s for f in machine.flights) for machine in group}) == 1
    one_each = [machine.flights[0] for machine in STANDARD]
    assert {f.scenario.rotor_sim().substeps() for f in [*flights(SMOKE), *one_each]} == {2}


@pytest.mark.slow
def test_maneuvers_load_the_rotor_as_their_names_say() -> None:
    for flight in flights(STANDARD[::8]):
        least, greatest = flight.labels['load_factor_min'], flight.labels['load_factor_max']
        match flight.grid.family:
            case 'level':
                assert least == greatest == 1.0
            case 'pulls_3g' | 'pulls_5g' | 'pulls_9g':
                wanted = float(flight.grid.family.removeprefix('pulls_').removesuffix('g'))
                assert greatest == pytest.approx(wanted, abs=1e-9)
                assert len(flight.scenario.plain()['maneuver']['segments']) >= 7
            case 'climb_dive':
                assert 2.4 < greatest < 3.7
                assert -0.15 < least < 0.55  # cos of the climb angle takes up to 0.12 more
            case _:
                assert greatest - least >= 1.0


@pytest.mark.parametrize('name', shipped_suites())
def test_every_shipped_suite_can_be_planned(name: str) -> None:
    assert load_suite(name).name == name
    assert load_suite(name).description.endswith('.')
    plan = plan_suite(name)
    assert plan[-1].flights[-1].scenario.duration_s == load_suite(name).growth_s


BAD = {
    'unknown name': ('standrad', ['standrad', 'smoke']),
    'unknown key': ('{base: smoke, flights: 3}', ['flights']),
    'unknown family': ('{base: smoke, families: [hover]}', ['families']),
    'range backwards': ('{base: smoke, speed: {steady: [1.1, 0.9]}}', ['speed.steady']),
    'out of range': ('{base: smoke, machine: {speed_rad_s: [1.0, 9.0]}}', ['speed_rad_s', '50']),
    'half a group': ('{base: smoke, groups: [{name: a, machines: 0}]}', ['groups[0].split']),
    'everything held out': ('{base: smoke, families: [gusts]}', ['held_out_families']),
    'not YAML': ('{base: [}', ['line 1']),
    'a list': ('[1, 2]', ['mapping']),
    'base of itself': ('{base: bad.yaml}', ['base']),
}


@pytest.mark.parametrize('case', BAD)
def test_a_bad_suite_is_one_sentence(tmp_path: Path, case: str) -> None:
    text, words = BAD[case]
    source = text
    if case != 'unknown name':
        (tmp_path / 'bad.yaml').write_text(text)
        source = str(tmp_path / 'bad.yaml')
    with pytest.raises(RigError) as error:
        plan_suite(source)
    for word in words:
        assert word in str(error.value)
    assert '\n' not in str(error.value)


def test_a_noise_preset_needs_its_factor() -> None:
    sensors = load_suite('smoke').plain()['sensors'] | {'noise_factors': {'quiet': 0.5}}
    with pytest.raises(RigError, match="'realistic' of group 'train' has no factor"):
        changed(sensors=sensors)


def test_a_bad_seed_is_one_sentence() -> None:
    with pytest.raises(DatasetError, match='seed = -1 is out of range'):
        plan_suite('smoke', seed=-1)


def test_an_own_suite_changes_single_keys_of_another(tmp_path: Path) -> None:
    path = tmp_path / 'mine.yaml'
    path.write_text(
        '{base: smoke, name: mine, flight_s: 30.0, changes: {eccentricity_factor: [3, 4]}}'
    )
    suite, base = load_suite(str(path)), load_suite('smoke')
    assert suite.flight_s == 30.0
    assert suite.changes.eccentricity_factor == (3.0, 4.0)
    assert suite.changes.clearance_step_m == base.changes.clearance_step_m
    assert suite.groups == base.groups
