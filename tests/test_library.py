# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The library: datasets with units, the same bytes as the pipeline, and the code of its page."""

import re
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
import xarray

import rotor_rig as rig
from rotor_common.errors import RigError
from rotor_common.plain_data import parse_yaml
from rotor_dynamics import survey, sweep
from rotor_recording.reading import Recording
from rotor_rig import pipeline
from rotor_rig.scenario_model import Scenario
from vibration_monitor.monitor import VibrationMonitor

PAGE = (Path(__file__).parents[1] / 'docs' / 'library.md').read_text('utf-8')
ROTOR = rig.RotorParameters.hou2016()
POINT = rig.OperatingPoint(ROTOR, 352.0, 3.0)
SHORT = rig.Plan(5, 16, exponent_revolutions=50, highest_order=4.0, check_steps=False)
K = rig.Sweep('K', [0.0, 0.1])


@pytest.fixture(scope='module')
def scenario() -> Scenario:
    return rig.scenario('climb_dive', K=0.15, duration_s=2.0, seed=3)


@pytest.fixture(scope='module')
def steps(scenario: Scenario) -> list[pipeline.PipelineStep]:
    return list(pipeline.simulate(scenario))


@pytest.fixture(scope='module')
def flight(scenario: Scenario) -> xarray.Dataset:
    return rig.simulate(scenario)


def indicators(flight: xarray.Dataset) -> xarray.Dataset:
    return flight.drop_dims(['time', 'block_time', 'load_time'])


def studies() -> list[xarray.Dataset]:
    return [
        rig.orbit_diagram(POINT, K, SHORT),
        rig.waterfall(POINT, K, SHORT),
        rig.lyapunov_diagram(POINT, K, SHORT),
        rig.parameter_map(POINT, (K, rig.Sweep('G', [1.0, 3.0])), SHORT),
        rig.poincare_section(POINT, SHORT),
    ]


def test_the_page_lists_what_there_is() -> None:
    listed = re.findall(r'^\| `(\w+)` \| [^|]*\|$', PAGE, re.MULTILINE)
    assert sorted(listed) == sorted(rig.__all__)
    assert all(getattr(rig, name).__doc__ for name in rig.__all__)


@pytest.mark.slow
def test_the_code_of_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mpl.use('Agg')
    monkeypatch.chdir(tmp_path)
    known: dict[str, Any] = {}
    for code in re.findall(r'```python\n(.*?)```', PAGE, re.DOTALL):
        exec(code, known)  # noqa: S102 - our own page
    assert len(known['table']) == known['found'].sizes['window_time'] > 0
    assert known['waveform'].shape == (known['flight'].sizes['time'], 4)
    assert 'disk_z_rms' in known['rms']
    back = xarray.load_dataset('flight.nc')
    xarray.testing.assert_equal(back, known['flight'])
    xarray.testing.assert_identical(rig.monitor(back), rig.monitor(known['flight']))


def test_the_bytes_are_those_of_the_pipeline(
    flight: xarray.Dataset, steps: list[pipeline.PipelineStep]
) -> None:
    rows = np.concatenate([step.block.rows for step in steps])
    for name in rows.dtype.names or ():
        column = 'time_in_block' if name == 'time' else name
        assert flight[column].values.tobytes() == rows[name].tobytes(), name
    records = [record for step in steps for record in step.records]
    assert flight.sizes['window_time'] == len(records) > 1
    for name in records[0].names:
        found = flight[name.replace('/', '_').replace('.', '_')]
        assert found.indicator == name
        assert found.values.tobytes() == np.array([r.value(name) for r in records]).tobytes(), name
    truth = [step.block.truth['crack_stiffness_ratio'] for step in steps]
    assert flight.truth_crack_stiffness_ratio.values.tolist() == truth == [0.15] * len(steps)
    again = Scenario.from_mapping(parse_yaml(flight.attrs['scenario']))
    assert again.plain()['rotor']['crack_stiffness_ratio'] == 0.15


def test_monitor_of_a_flight_is_what_the_flight_says(flight: xarray.Dataset) -> None:
    xarray.testing.assert_equal(rig.monitor(flight), indicators(flight))
    part = rig.monitor(flight.sel(time=slice(0.5, None)))
    assert 0 < part.sizes['window_time'] < flight.sizes['window_time']
    with pytest.raises(RigError, match='no waveform to monitor'):
        rig.monitor(indicators(flight))


def test_a_recording_gives_the_same(
    scenario: Scenario, flight: xarray.Dataset, tmp_path: Path
) -> None:
    path = tmp_path / 'flight.mcap'
    for _ in pipeline.record(scenario, path):
        pass
    found = rig.recording(path)
    for name in found.variables:
        assert found[name].values.tobytes() == flight[name].values.tobytes(), name
    said = rig.analyze(path)
    xarray.testing.assert_equal(said, indicators(flight))
    xarray.testing.assert_identical(rig.monitor(Recording(path)), said)
    xarray.testing.assert_equal(rig.monitor(found), said)
    watch = VibrationMonitor(scenario.monitor)
    records = list(pipeline.analyze(Recording(path), watch))
    assert said.disk_z_rms.values.tolist() == [r.value('disk_z/rms') for r in records]


def test_every_variable_has_a_unit_and_survives_netcdf(
    flight: xarray.Dataset, tmp_path: Path
) -> None:
    for number, result in enumerate([flight, *studies()]):
        for name, variable in result.variables.items():
            assert variable.attrs.get('units'), name
        path = tmp_path / f'{number}.nc'
        result.to_netcdf(path)
        xarray.testing.assert_equal(xarray.load_dataset(path), result)
        if number:
            assert len(result.to_dataframe())
    assert flight.disk_z.units == 'm'
    assert flight.brg1_ay_rms.units == 'm/s^2'


def test_studies_are_the_survey() -> None:
    expected = survey(sweep(ROTOR, 'K', [0.0, 0.1], speed_rad_s=352.0, load_factor=3.0), SHORT)
    orbit, waterfall, exponents, grid, section = studies()
    for found, names in (
        (orbit, ('y', 'z', 'label', 'length_scale_m')),
        (waterfall, ('amplitude_y', 'amplitude_z')),
        (exponents, ('exponent', 'standard_error', 'label')),
    ):
        assert found.crack_stiffness_ratio.values.tolist() == [0.0, 0.1]
        for name in names:
            np.testing.assert_array_equal(found[name], getattr(expected, name))
    assert grid.exponent.dims == ('crack_stiffness_ratio', 'load_factor')
    assert section.orbit_z.shape == (16, 64)


@pytest.mark.parametrize(
    ('changes', 'sentence'),
    [
        ({'crack_stifness_ratio': 0.1}, "did you mean 'crack_stiffness_ratio'"),
        ({'K': 0.7}, 'allowed: 0 to 0.5'),
        ({'qqq': 1}, 'allowed: K, '),
    ],
)
def test_a_wrong_change_is_one_sentence(changes: dict[str, Any], sentence: str) -> None:
    with pytest.raises(RigError, match=sentence):
        rig.scenario('climb_dive', **changes)


def test_changes_reach_the_run() -> None:
    changed = rig.scenario('climb_dive', clearance=1e-6, speed_rad_s=300.0, seed=7).plain()
    assert changed['rotor']['clearance_m'] == 1e-6
    assert changed['speed']['initial_rad_s'] == 300.0
    assert changed['seed'] == 7
    # what the monitor knows of the rotor follows the rotor
    heavier = rig.scenario('climb_dive', disk_mass_kg=40.0).plain()['monitor']['crack']
    critical = rig.scenario('climb_dive').plain()['monitor']['crack']['rigid_critical_speed_rad_s']
    assert heavier['rigid_critical_speed_rad_s'] < critical
