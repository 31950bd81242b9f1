# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""From a foreign file to blocks: units, rates, shaft, what the configuration says, refusals."""

import dataclasses
import hashlib
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from rotor_bringup.cli import app
from rotor_interfaces import topics
from rotor_interfaces.messages import sample_stamp_ns
from rotor_recording.errors import ImportFileError
from rotor_recording.importing.convert import ImportPlan, convert, write
from rotor_recording.reading import Recording, waveform_blocks

RATE_HZ = 2000
COUNT = 1000
TIME = np.arange(COUNT) / RATE_HZ
ANGLE = 2 * np.pi * 20.0 * TIME
SIGNAL = np.round(3.0 * np.sin(ANGLE), 6)


@pytest.fixture(scope='module')
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of five columns: time, acceleration in g, displacement in mil, tacho, and a hole."""
    path = tmp_path_factory.mktemp('import') / 'run 7.csv'
    hole = np.where(np.arange(COUNT) == 5, np.nan, SIGNAL)
    table = np.column_stack([TIME, SIGNAL, SIGNAL / 10, 2 * np.sin(ANGLE + 1.0), hole])
    np.savetxt(path, table, delimiter=',', header='t,acc,gap,tacho,hole', comments='')
    return path


@pytest.fixture
def plan(path: Path) -> ImportPlan:
    return ImportPlan(path, channels={'brg1_ay': 'acc'}, units={'': 'g'}, rate_hz=2000.0)


def changed(plan: ImportPlan, **changes: Any) -> ImportPlan:
    return dataclasses.replace(plan, **changes)


def test_units_become_si(plan: ImportPlan) -> None:
    both = {'brg1_ay': 'acc', 'disk_y': 'gap', 'disk_z': '3'}
    units = {'': 'mil', 'brg1_ay': 'g', 'disk_z': '0.5'}
    rows = convert(changed(plan, channels=both, units=units)).rows
    # 2^-24 from float32
    np.testing.assert_allclose(rows['brg1_ay'], 9.80665 * SIGNAL, rtol=6e-8)
    np.testing.assert_allclose(rows['disk_y'], 2.54e-6 * SIGNAL, rtol=6e-8)
    np.testing.assert_allclose(rows['disk_z'], 0.05 * SIGNAL, rtol=6e-8)
    assert rows.dtype.names == ('time', 'sample', 'brg1_ay', 'disk_y', 'disk_z')


def test_a_unit_that_is_not_stated_stays_unknown(plan: ImportPlan) -> None:
    imported = convert(changed(plan, units={}))
    np.testing.assert_array_equal(imported.rows['brg1_ay'], SIGNAL.astype(np.float32))
    assert imported.config['column_units'] == {'time': 's', 'sample': '1', 'brg1_ay': 'unknown'}
    assert imported.config['import']['channels']['brg1_ay'] == {
        'column': 'acc', 'unit': 'unknown', 'si_per_unit': 1.0,
    }  # fmt: skip
    assert any('the unit of brg1_ay is not known' in sentence for sentence in imported.warnings)


def test_without_a_shaft_there_is_no_angle_and_a_warning(plan: ImportPlan) -> None:
    imported = convert(plan)
    assert 'angle' not in (imported.rows.dtype.names or ())
    assert imported.config['import']['shaft'] == {'from': 'unknown'}
    assert ['there are no orders' in sentence for sentence in imported.warnings] == [True]


def test_a_given_speed_and_a_tacho_say_the_same(plan: ImportPlan) -> None:
    given = convert(changed(plan, speed_hz=20.0))
    np.testing.assert_allclose(given.rows['angle'], ANGLE, rtol=1e-14)
    assert given.warnings == ()
    measured = convert(changed(plan, tacho='tacho'))
    angle = measured.rows['angle']
    known = np.isfinite(angle)
    # the first pulse comes one radian before the second revolution; the rest is interpolation
    np.testing.assert_allclose(angle[known], ANGLE[known] + 1.0 - 2 * np.pi, atol=2e-3)
    shaft = measured.config['import']['shaft']
    assert shaft['samples_without_angle'] == int(np.count_nonzero(~known)) > 0
    assert shaft['slowest_hz'] == pytest.approx(20.0, rel=1e-4)
    assert shaft['from'] == 'tacho column tacho, 1 a revolution'


def test_a_tacho_that_covers_a_part_is_warned_about(tmp_path: Path) -> None:
    path = tmp_path / 'x.txt'
    tacho = np.where(TIME < 0.25, 0.0, np.sin(ANGLE))
    np.savetxt(path, np.column_stack([SIGNAL, tacho]))
    imported = convert(ImportPlan(path, {'brg1_ay': '1'}, {'': 'g'}, rate_hz=2000.0, tacho='2'))
    missing = imported.config['import']['shaft']['samples_without_angle']
    assert 500 < missing < 700
    words = f'the angle is missing in {missing} of 1000 samples'
    assert [words in sentence for sentence in imported.warnings] == [True]


def test_four_pulses_a_revolution_are_a_quarter_of_the_speed(plan: ImportPlan) -> None:
    shaft = convert(changed(plan, tacho='4', pulses_per_revolution=4)).config['import']['shaft']
    assert shaft['fastest_hz'] == pytest.approx(5.0, rel=1e-4)


def test_the_rate_may_come_from_a_time_column(plan: ImportPlan) -> None:
    imported = convert(changed(plan, rate_hz=None, time='t'))
    assert imported.rate_hz == RATE_HZ
    assert imported.config['import']['rate_from'] == 'time column t'


def test_rounded_times_are_good_and_uneven_ones_are_not(tmp_path: Path) -> None:
    path = tmp_path / 'x.txt'
    plan = ImportPlan(path, channels={'disk_y': '2'}, time='1')
    for digits, good in ((4, True), (2, False)):
        np.savetxt(path, np.column_stack([TIME, SIGNAL]), fmt=f'%.{digits}f')
        if good:
            assert convert(plan).rate_hz == RATE_HZ
        else:
            with pytest.raises(ImportFileError, match='half a sample of equal steps'):
                convert(plan)


def test_lost_samples_are_counted_and_stay_lost(plan: ImportPlan) -> None:
    imported = convert(changed(plan, channels={'brg1_ay': 'hole'}, speed_hz=20.0))
    assert imported.warnings == ('brg1_ay has 1 samples without a number',)
    assert np.flatnonzero(np.isnan(imported.rows['brg1_ay'])).tolist() == [5]


def test_the_recording_says_what_it_is(plan: ImportPlan, tmp_path: Path) -> None:
    imported = convert(changed(plan, speed_hz=20.0, source='A. Author, CC BY 4.0'))
    out = tmp_path / 'x.mcap'
    write(imported, out)
    recording = Recording(out)
    config = recording.config()
    assert config == json.loads(json.dumps(imported.config))
    assert config is not None
    said = config['import']
    assert said['file'] == 'run 7.csv'  # not the folder: it is nobody's business
    assert said['source'] == 'A. Author, CC BY 4.0'
    assert said['sha256'] == hashlib.sha256(plan.path.read_bytes()).hexdigest()
    assert said['load'] == 'unknown'
    blocks = list(waveform_blocks(recording))
    assert [len(block.rows) for block in blocks] == [256, 256, 256, 232]
    rows = np.concatenate([block.rows for block in blocks])
    assert rows.tobytes() == imported.rows.tobytes()
    epoch_ns = blocks[0].stamp_ns
    for block in blocks:
        assert block.stamp_ns == sample_stamp_ns(epoch_ns, block.first_sample, RATE_HZ)
        # the contract: since this message's stamp
        np.testing.assert_array_equal(block.rows['time'], np.arange(len(block.rows)) / RATE_HZ)
    assert recording.find(topics.CONFIG) == '/rotor/config'
    again = tmp_path / 'again.mcap'
    write(imported, again)
    assert again.read_bytes() == out.read_bytes()


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    'no channel': ({'channels': {}}, 'give --channel NAME=COLUMN'),
    'no name of a channel': ({'channels': {'x': '1'}}, 'x is no name of a channel'),
    'the load is no channel': ({'channels': {'load_y': '1'}}, 'is no name of a channel'),
    'no such column': ({'channels': {'brg1_ay': 'nil'}}, "no column 'nil'"),
    'no rate': ({'rate_hz': None}, 'give --rate-hz, or --time COLUMN'),
    'rate with a fraction': ({'rate_hz': 2000.5}, 'resample the file to 2001 Hz first'),
    'rate of nothing': ({'rate_hz': -1.0}, 'allowed: 1 to 1,000,000 Hz'),
    'rate NaN': ({'rate_hz': math.nan}, 'allowed: 1 to'),
    'two rates': ({'time': 't'}, '--time and --rate-hz'),
    'time that falls': ({'rate_hz': None, 'time': 'tacho'}, 'does not rise|half a sample'),
    'time that is lost': ({'rate_hz': None, 'time': 'hole'}, 'half a sample|does not rise'),
    'no such unit': ({'units': {'': 'furlong'}}, 'is given for brg1_ay, which is not known'),
    'unit of another kind': ({'units': {'': 'mm'}}, 'but brg1_ay is an acceleration'),
    'unit of nothing': ({'units': {'': '0'}}, 'a number other than 0'),
    'unit NaN': ({'units': {'': 'nan'}}, 'a number other than 0'),
    'unit of no channel': ({'units': {'disk_y': 'm'}}, "names 'disk_y', which no --channel gives"),
    'two speeds': ({'speed_hz': 20.0, 'tacho': '4'}, '--tacho and --speed-hz'),
    'speed of nothing': ({'speed_hz': 0.0}, 'above 0'),
    'speed NaN': ({'speed_hz': math.nan}, 'above 0'),
    'speed too fast for the samples': ({'speed_hz': 334.0}, '333.333 Hz'),
    'pulses without tacho': ({'pulses_per_revolution': 2}, 'no meaning without --tacho'),
    'no pulses': ({'tacho': '4', 'pulses_per_revolution': 0}, 'allowed: 1 to 10000'),
    'tacho with a hole': ({'tacho': 'hole'}, '1 samples without a number'),
}


@pytest.mark.parametrize('name', WRONG)
def test_wrong_options_end_in_one_sentence(plan: ImportPlan, name: str) -> None:
    changes, words = WRONG[name]
    with pytest.raises(ImportFileError, match=words) as refused:
        convert(changed(plan, **changes))
    assert '\n' not in str(refused.value)


@pytest.mark.slow
def test_series_of_different_length_are_refused(tmp_path: Path) -> None:
    from scipy.io import savemat

    path = tmp_path / 'x.mat'
    savemat(path, {'a': np.arange(5.0), 'b': np.arange(6.0), 'c': 1.0})
    plan = ImportPlan(path, channels={'disk_y': 'a', 'disk_z': 'b'}, rate_hz=10.0)
    with pytest.raises(ImportFileError, match='differ in length: disk_y 5, disk_z 6 samples'):
        convert(plan)
    with pytest.raises(ImportFileError, match='has 6 samples, the channels 5'):
        convert(changed(plan, channels={'disk_y': 'a'}, tacho='b'))


COMMANDS: dict[str, tuple[list[str], str]] = {
    'channel without column': (['--channel', 'brg1_ay'], 'is not NAME=VALUE'),
    'channel twice': (['--channel', 'disk_y=2', '--channel', 'disk_y=3'], 'gives disk_y twice'),
    'unit twice': (['--unit', 'g', '--unit', 'm'], 'gives a unit for all twice'),
    'another ending': (['--out', 'x.csv'], 'must end in .mcap'),
    'no file': ([], 'cannot be read'),
}


@pytest.mark.parametrize('name', COMMANDS)
def test_wrong_arguments_end_with_code_2(name: str, tmp_path: Path) -> None:
    options, words = COMMANDS[name]
    out = [] if '--out' in options else ['--out', str(tmp_path / 'x.mcap')]
    done = CliRunner().invoke(app, ['import', str(tmp_path / 'none.csv'), *out, *options])
    assert done.exit_code == 2
    assert words in ' '.join(done.stderr.split())
    assert list(tmp_path.iterdir()) == []
