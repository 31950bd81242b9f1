# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""`recover` and `verify` as commands: exit codes, JSON, and windows files that are whole or not."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from rotor_bringup.analysis import windows_file
from rotor_bringup.cli import app
from rotor_recording.reading import Recording
from rotor_rig.errors import ScenarioError
from rotor_rig.pipeline import record
from rotor_rig.scenario_model import load_scenario


@pytest.fixture(scope='module')
def flight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp('flight') / 'flight.mcap'
    for _ in record(load_scenario('level_healthy', duration_s=4.0), path):
        pass
    return path


def call(*words: object) -> tuple[int, str]:
    result = CliRunner().invoke(app, [str(word) for word in words], env={'COLUMNS': '300'})
    return result.exit_code, result.stdout


def test_a_whole_recording_verifies_with_0(flight: Path) -> None:
    code, out = call('verify', flight, '--json')
    said = json.loads(out)
    assert (code, said['ok']) == (0, True)
    assert {check['state'] for check in said['checks']} == {'good', 'not checked'}
    code, out = call('verify', flight)
    assert code == 0
    assert 'all there' in out


def test_a_damaged_recording_verifies_with_1_and_is_recovered(flight: Path, tmp_path: Path) -> None:
    path = tmp_path / 'a.mcap'
    path.write_bytes(flight.read_bytes()[:-1_000_000])
    code, out = call('verify', path, '--json')
    assert (code, json.loads(out)['ok']) == (1, False)
    code, out = call('recover', path, '--json')
    said = json.loads(out)
    assert code == 0
    assert said['recording'] == str(tmp_path / 'a_recovered')
    assert said['messages'] == sum(Recording(path).message_counts.values())
    assert said['lost_bytes'] > 0
    assert call('verify', said['recording'])[0] == 0
    assert call('recover', path)[0] == 2, 'never overwrites'


@pytest.mark.parametrize('verb', ['recover', 'verify'])
def test_what_cannot_be_read_ends_with_2(verb: str, tmp_path: Path) -> None:
    (tmp_path / 'a.mcap').write_bytes(b'nothing of the kind')
    for name in ('a.mcap', 'no.mcap'):
        assert call(verb, tmp_path / name)[0] == 2


def fail_while_writing(out: Path) -> None:
    with windows_file(out):
        raise ScenarioError('the recording ends here')


def test_an_analysis_that_fails_leaves_the_old_windows(flight: Path, tmp_path: Path) -> None:
    out = tmp_path / 'windows.json'
    assert call('analyze', flight, '--out', out)[0] == 0
    before = out.read_text()
    rows = json.loads(before)
    assert before == json.dumps(rows, indent=1)
    assert len(rows) == json.loads(call('analyze', flight, '--json')[1])['windows']
    with pytest.raises(ScenarioError):
        fail_while_writing(out)
    assert out.read_text() == before
    assert [path.name for path in tmp_path.iterdir()] == ['windows.json']
