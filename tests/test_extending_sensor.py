# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""docs/extending/sensor.md as a reader follows it: the file, the flight, the name."""

import math
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from extending_support import RIG, blocks, installed, page, run
from maneuver_gen.load_grid import load_grid
from rotor_common.errors import ConfigError
from rotor_interfaces.waveform import WAVEFORM_DTYPE
from rotor_rig import results
from rotor_rig.scenario_model import Scenario, load_scenario
from rotor_sim import LoadGrid, RotorError, RotorSimulator
from rotor_sim.sensors import SensorConfig
from rotor_sim.stream import fleet

PICKUP = {'instrument': 'velocity_pickup:VelocityPickup', 'corner_hz': 5.0}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the page's reader, who stands in it."""
    (tmp_path / 'velocity_pickup.py').write_text(blocks('sensor', 'python')[0], 'utf-8')
    (tmp_path / 'flight.yaml').write_text(blocks('sensor', 'yaml')[0], 'utf-8')
    monkeypatch.chdir(tmp_path)
    for module in ('velocity_pickup', 'mine'):
        monkeypatch.delitem(sys.modules, module, raising=False)
    return tmp_path


def flown(
    *instruments: Any, block_samples: int = 256, count: int = 2048
) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows and the true rows of a short flight with noisy probes."""
    scenario = Scenario.from_mapping(
        {
            'name': 'short',
            'maneuver': {'profile': 'constant'},
            'settle_revolutions': 20,
            'sensors': {'displacement_noise_m': 1e-7, 'instruments': list(instruments)},
        }
    )
    simulator = RotorSimulator(scenario.rotor_sim())
    grid = LoadGrid.from_points(load_grid(scenario.maneuver, 1.0))
    made = []
    while simulator.next_sample < count:
        made.append(simulator.advance(min(block_samples, count - simulator.next_sample), grid))
    return tuple(np.concatenate([getattr(b, of) for b in made]) for of in ('rows', 'truth_rows'))  # type: ignore[return-value]


@pytest.mark.usefixtures('folder')
def test_the_column_is_the_closed_form() -> None:
    """v_n = g (a_n + q a_(n-1) + q^2 a_(n-2) + ...), g = (1 - q)/w, q = exp(-w/rate)."""
    rows, truth = flown(PICKUP)
    corner = 2.0 * math.pi * 5.0
    kept = math.exp(-corner / 10_240)
    weights = (1.0 - kept) / corner * kept ** np.arange(len(rows))
    wanted = np.convolve(truth['brg1_az'].astype(float), weights)[: len(rows)]
    np.testing.assert_allclose(
        rows['brg1_velocity'], wanted, rtol=1e-6, atol=1e-7 * abs(wanted).max()
    )


@pytest.mark.usefixtures('folder')
def test_all_else_is_as_without_it() -> None:
    (rows, truth), (bare, bare_truth) = flown(PICKUP), flown()
    assert bare.dtype == truth.dtype == WAVEFORM_DTYPE
    assert truth.tobytes() == bare_truth.tobytes()
    assert rows.dtype.names == (*(WAVEFORM_DTYPE.names or ()), 'brg1_velocity')
    assert all(rows[name].tobytes() == bare[name].tobytes() for name in bare.dtype.names or ())


@pytest.mark.usefixtures('folder')
def test_the_bytes_do_not_depend_on_the_length_of_blocks() -> None:
    noisy = {**PICKUP, 'noise_m_s': 1e-4}
    first, second, quiet = flown(noisy), flown(noisy, block_samples=77), flown(PICKUP)
    same = [name for name in first[0].dtype.names or () if name != 'time']  # in its block
    assert all(first[0][name].tobytes() == second[0][name].tobytes() for name in same)
    noise = first[0]['brg1_velocity'].astype(float) - quiet[0]['brg1_velocity']
    assert noise.std() == pytest.approx(1e-4, rel=0.05)  # 2048 numbers: 1.6 % standard deviation


@pytest.mark.usefixtures('folder')
def test_a_fleet_measures_the_same_bytes() -> None:
    """Each rotor with an instrument of its own, whose state starts anew."""
    scenario, grid = load_scenario('flight.yaml'), LoadGrid.from_points([(9.81, 0.0)] * 20)
    simulators = [RotorSimulator(scenario.rotor_sim()) for _ in range(3)]
    alone = simulators[0].advance(64, grid)
    for block in fleet.advance(simulators[1:], 64, [grid, grid]):
        assert block.rows.tobytes() == alone.rows.tobytes()


@pytest.mark.usefixtures('folder')
def test_a_scenario_without_instruments_is_written_as_ever() -> None:
    assert 'instruments' not in SensorConfig().model_dump(mode='json')
    config = SensorConfig.from_mapping({'instruments': [PICKUP]})
    assert SensorConfig.from_mapping(config.model_dump(mode='json')) == config
    assert config.with_preset('realistic').instruments == config.instruments
    assert config.column_units['brg1_velocity'] == 'm/s'
    alone = SensorConfig.from_mapping({'instruments': [PICKUP['instrument']]}).instruments[0]
    assert alone.model_dump()['corner_hz'] == 2.0


@pytest.mark.slow
def test_the_commands_of_the_page_measure_with_it(folder: Path) -> None:
    check, simulate, analyze, _ = re.findall('^rotor-rig (.*)$', page('sensor'), re.MULTILINE)
    run(*RIG, *check.split())
    assert 'velocity_pickup:VelocityPickup' in run(*RIG, 'scenario', 'show', 'flight.yaml')
    run(*RIG, *simulate.split())
    (folder / 'try_it.py').write_text(blocks('sensor', 'python')[1], 'utf-8')
    assert run(sys.executable, 'try_it.py') == blocks('sensor', 'text')[0]
    assert load_scenario('flight.mcap').sensors == load_scenario('flight.yaml').sensors
    (folder / 'velocity_pickup.py').write_text('raise SystemExit("imported")')
    run(*RIG, *analyze.split())  # nothing that a recording names is imported
    assert results.recording('flight.mcap')['brg1_velocity'].units == 'm/s'


@pytest.mark.slow
def test_installed_it_has_a_name(tmp_path: Path) -> None:
    site = installed('sensor', 'velocity_pickup', tmp_path)
    scenario = tmp_path / 'flight.yaml'
    text = 'maneuver: {profile: constant}\nsensors: {instruments: [velocity_%s]}\n'
    scenario.write_text(text % 'pickup')
    shown = run(*RIG, 'scenario', 'show', str(scenario), path=site)
    assert 'instrument: velocity_pickup\n' in shown
    find = 'from rotor_sim.sensors.instrument import find_instrument as f; f("velocity_pikup")'
    told = f'try: exec({find!r})\nexcept Exception as e: print(e)'
    assert "did you mean 'velocity_pickup'?" in run(sys.executable, '-c', told, path=site)


STRAIN = """
import numpy as np
from rotor_sim.sensors import Instrument
class Strain(Instrument):
    columns = {'shaft_y': 'm', 'strain': '1'}
    instrument: str = 'strain'
    def measure(self, rows):
        return np.column_stack((2 * rows['disk_y'], np.full(len(rows), np.nan, np.float32)))
"""


def test_a_vibration_channel_of_it_is_monitored(folder: Path) -> None:
    (folder / 'mine.py').write_text(STRAIN)
    changes = {'maneuver': {'profile': 'constant'}, 'sensors': {'instruments': ['mine:Strain']}}
    flight = results.simulate(results.scenario('climb_dive', **changes), duration_s=2.0)
    np.testing.assert_allclose(flight['shaft_y_rms'], 2.0 * flight['disk_y_rms'], rtol=1e-6)
    assert np.isnan(flight['strain']).all()
    assert (flight['strain'].units, flight['shaft_y'].units) == ('1', 'm')


WRONG = {
    'no such name': (
        'strain_gauge',
        '',
        "instrument = 'strain_gauge' is not known here; installed",
    ),
    'no such file': ('nowhere:Strain', '', "cannot be loaded: No module named 'nowhere'"),
    'no sensor': ('mine:Strain', 'class Strain: pass', 'must be a class that derives from'),
    'no measure': ('mine:Strain', STRAIN.replace('measure', 'read'), 'and has measure'),
    'taken': ('mine:Strain', STRAIN.replace("'strain'", "'disk_y'"), "'disk_y' already"),
    'kept': ('mine:Strain', STRAIN.replace("'strain'", "'load_z'"), 'is reserved'),
    'no name': ('mine:Strain', STRAIN.replace("'strain'", "'a/b'"), 'must be letters'),
    'no unit': ('mine:Strain', STRAIN.replace("'1'", '1'), 'must have a unit'),
    'another unit': ('mine:Strain', STRAIN.replace("'m'", "'mm'"), 'channel in m, but is in mm'),
    'no columns': ('mine:Strain', re.sub('columns = .*', 'columns = {}', STRAIN), 'no columns'),
    'no mapping': (3, '', 'an instrument is a name, or a mapping with the key instrument'),
    'no number': (
        {**PICKUP, 'corner_hz': 500.0},
        '',
        'sensors.instruments[0].corner_hz = 500.0 is out of range; allowed: 0.1 to 100 Hz (-3 dB)',
    ),
}


@pytest.mark.parametrize('case', WRONG)
def test_a_wrong_instrument_is_told(case: str, folder: Path) -> None:
    named, code, sentence = WRONG[case]
    (folder / 'mine.py').write_text(code)
    with pytest.raises(ConfigError) as caught:
        SensorConfig.from_mapping({'instruments': [named]}, 'sensors')
    assert sentence in str(caught.value)
    assert str(caught.value).startswith('sensors.instruments')
    assert str(folder) not in sys.path


def test_a_column_stands_in_one_instrument_only(folder: Path) -> None:
    (folder / 'mine.py').write_text(STRAIN)
    with pytest.raises(ConfigError, match="a column 'shaft_y' already"):
        SensorConfig.from_mapping({'instruments': ['mine:Strain', 'mine:Strain']})


@pytest.mark.parametrize(
    ('returned', 'sentence'),
    [
        (
            "rows['disk_y']",
            r'gives float32 of shape \(256,\); it must be float32 of shape \(256, 2',
        ),
        ('np.zeros((len(rows), 2))', r'gives float64 of shape \(256, 2\)'),
        ('None', 'gives a NoneType'),
        ("rows['nothing']", 'fails at sample 0: ValueError: no field of name nothing'),
        ("rows['disk_y'].fill(0)", 'fails at sample 0: ValueError: assignment destination is'),
    ],
)
def test_a_measurement_that_cannot_be_is_told(returned: str, sentence: str, folder: Path) -> None:
    (folder / 'mine.py').write_text(re.sub('return .*', f'return {returned}', STRAIN))
    with pytest.raises(RotorError, match=f'the instrument mine:Strain {sentence}'):
        flown('mine:Strain')
