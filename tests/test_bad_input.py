# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Bad input ends in one clear sentence, a non-zero exit and no traceback, before anything runs.

Every case goes through the command line's own entry point; a few also as a real process.
"""

import importlib
import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from typer.testing import CliRunner

from rig_support import Rig
from rotor_bringup.cli import app
from rotor_interfaces import ros

GOOD: dict[str, Any] = {
    'duration_s': 1.0,
    'maneuver': {'profile': 'constant', 'load_factor': 1.0},
}


def changed(**changes: Any) -> dict[str, Any]:
    return {**GOOD, **changes}


def maneuver(**keys: Any) -> dict[str, Any]:
    return changed(maneuver=keys)


# what stands in the scenario file, and what the sentence must contain
SCENARIOS: dict[str, tuple[dict[str, Any], list[str]]] = {
    'unknown key': (changed(durations=3), ['durations', 'duration_s']),
    'unknown nested key': (changed(speed={'inital_rad_s': 3}), ['speed.inital_rad_s', 'initial']),
    'no maneuver': ({'duration_s': 1.0}, ['maneuver', 'missing']),
    'duration zero': (changed(duration_s=0), ['duration_s = 0', 'above 0', '86400 s']),
    'duration text': (changed(duration_s='long'), ["duration_s = 'long'", 'number']),
    'duration NaN': (changed(duration_s=float('nan')), ['duration_s']),
    'name with a path': (changed(name='../x'), ['name', 'letters']),
    'block of 6 s': (changed(block_samples=65_536), ['block_samples = 65536', '2 s']),
    'seed negative': (changed(seed=-1), ['seed = -1', '0']),
    'seed fraction': (changed(seed=1.5), ['seed = 1.5', 'integer']),
    'rate too low': (changed(rate_hz=10), ['rate_hz = 10', '1000 to 200000 Hz']),
    'rate fraction': (changed(rate_hz=10240.5), ['rate_hz = 10240.5', 'integer']),
    'block of nothing': (changed(block_samples=0), ['block_samples = 0', '1 to']),
    'variant': (changed(variant='exact'), ['variant', "'derived'"]),
    'crack too deep': (
        changed(rotor={'crack_stiffness_ratio': 0.9}),
        ['crack_stiffness_ratio = 0.9', '0 to 0.5'],
    ),
    'crack negative': (
        changed(rotor={'crack_stiffness_ratio': -0.1}),
        ['crack_stiffness_ratio = -0.1', '0 to 0.5'],
    ),
    'rotor misspelt': (changed(rotor={'crack_ratio': 0.1}), ['crack_ratio']),
    'clearance in um': (changed(rotor={'clearance_m': 5.0}), ['clearance_m = 5', 'm']),
    'negative clearance': (changed(rotor={'clearance_m': -1e-6}), ['clearance_m', '0']),
    'mass zero': (changed(rotor={'disk_mass_kg': 0}), ['disk_mass_kg = 0', 'kg']),
    'two balls': (changed(rotor={'ball_count': 2}), ['ball_count = 2']),
    'rotor as list': (changed(rotor=[1, 2]), ['rotor']),
    'speed in rpm': (changed(speed={'initial_rad_s': 3361}), ['initial_rad_s = 3361', 'rad/s']),
    'standing still': (changed(speed={'initial_rad_s': 0}), ['initial_rad_s = 0', 'rad/s']),
    'ramps overlap': (
        changed(
            speed={
                'ramps': [
                    {'at_s': 0.0, 'to_rad_s': 400.0, 'acceleration_rad_s2': 1.0},
                    {'at_s': 1.0, 'to_rad_s': 300.0, 'acceleration_rad_s2': 1.0},
                ]
            }
        ),
        ['speed.ramps[1].at_s', '48'],
    ),
    'profile above the highest speed': (
        changed(speed={'initial_rad_s': 352.0, 'highest_rad_s': 300.0}),
        ['highest_rad_s = 300', '352'],
    ),
    'crack growth too deep': (
        changed(crack_growth=[{'at_s': 0.0, 'to': 0.8}]),
        ['crack_growth[0].to = 0.8', '0 to 0.5'],
    ),
    'noise negative': (
        changed(sensors={'displacement_noise_m': -1.0}),
        ['sensors.displacement_noise_m = -1', '0 to'],
    ),
    'imu too fast': (changed(sensors={'imu_rate_hz': 9000}), ['imu_rate_hz = 9000', '10240']),
    'window too short': (
        changed(monitor={'window_revolutions': 8}),
        ['monitor.window_revolutions = 8', '64'],
    ),
    'hop longer than the window': (
        changed(monitor={'hop_revolutions': 100}),
        ['hop_revolutions', '64'],
    ),
    'changes out of order': (
        changed(
            changes=[
                {'sample': 100, 'parameter': 'crack_stiffness_ratio', 'value': 0.1},
                {'sample': 10, 'parameter': 'crack_stiffness_ratio', 'value': 0.1},
            ]
        ),
        ['changes[1].sample = 10', '100'],
    ),
    'no profile': (maneuver(load_factor=1.0), ['maneuver', 'profile']),
    'unknown profile': (maneuver(profile='loop'), ['loop', 'climb_dive']),
    'load factor of 50': (
        maneuver(profile='constant', load_factor=50),
        ['maneuver.load_factor = 50', '-3 to 12'],
    ),
    'bank of 90 degrees': (maneuver(profile='turn', bank_rad=1.5708), ['bank_rad = 1.5708']),
    'flight faster than sound and pull of 1 rad/s': (
        maneuver(profile='climb_dive', speed_m_s=600, pull_rate_rad_s=0.9),
        ['load factor', '12'],
    ),
    'empty sequence': (maneuver(profile='sequence', segments=[]), ['segments', 'at least one']),
    'flight file absent': (
        maneuver(profile='recorded', path='nowhere.csv'),
        ['nowhere.csv'],
    ),
}

# the text of flight.csv, and what the sentence must contain
FLIGHTS: dict[str, tuple[str, list[str]]] = {
    'empty': ('', ['flight.csv']),
    'header only': ('time_s,load_factor\n', ['flight.csv']),
    'wrong columns': ('t,g\n0,1\n1,1\n', ['time_s', 'load_factor']),
    'text for a number': ('time_s,load_factor\n0,1\n1,up\n', ['line 3', 'up']),
    'time runs backwards': ('time_s,load_factor\n0,1\n2,1\n1,1\n', ['line 4', 'time_s']),
    'time stands still': ('time_s,load_factor\n0,1\n0,1\n', ['line 3', 'time_s']),
    'NaN': ('time_s,load_factor\n0,1\n1,nan\n', ['line 3', 'nan']),
    'not a flight': ('time_s,load_factor\n0,1\n1,40\n', ['line 3', '40', '12']),
    'a number missing': ('time_s,load_factor\n0,1\n1\n', ['line 3']),
    'too short': ('time_s,load_factor\n0,1\n0.5,1\n', ['0.5', '1']),
}

COMMANDS: dict[str, tuple[list[str], list[str]]] = {
    'unknown scenario': (['run', 'no_such'], ['no_such', 'climb_dive']),
    'negative rate': (['run', '--rate=-1'], ['--rate -1', '0 to 1000']),
    'NaN rate': (['run', '--rate', 'nan'], ['--rate nan']),
    'negative duration': (['run', '--duration=-5'], ['duration_s = -5']),
    'rate is text': (['run', '--rate', 'fast'], ['--rate', 'number']),
    'record into a file': (['run', '--record', 'empty.mcap'], ['--record empty.mcap']),
    'unknown option': (['run', '--fast'], ['--fast']),
    'unknown command': (['fly'], ['fly']),
    'no output named': (['simulate'], ['--out']),
    'output folder absent': (['simulate', '--out', 'no/such/folder/a.mcap'], ['no/such/folder']),
    'recording as CSV': (['simulate', '--out', 'x.csv'], ['--out x.csv', '.mcap', 'analyze']),
    'recording without ending': (['simulate', '--out', 'x'], ['--out x', '.mcap']),
    'recording into a folder': (['simulate', '--out', '.'], ['--out .', '.mcap']),
    'record into a name of a file': (['run', '--record', 'x.mcap'], ['--record x.mcap', 'folder']),
    'windows as text': (['analyze', 'empty.mcap', '--out', 'x.txt'], ['x.txt', '.json or .csv']),
    'windows into no folder': (['analyze', 'empty.mcap', '--out', 'no/x.csv'], ['no folder no']),
    'view as picture': (['view', 'empty.mcap', '--save', 'x.png'], ['--save x.png', '.rrd']),
    'picture as view': (
        ['view', 'empty.mcap', '--screenshot', 'x.rrd'],
        ['--screenshot x.rrd', '.png'],
    ),
    'import as CSV': (['import', 'x.mat', '--out', 'x.csv'], ['--out x.csv', '.mcap']),
    'diagram of no kind': (
        ['orbit-diagram', '--over', 'speed', '100', '200', '3', '--out', 'x.foo'],
        ['--out x.foo', '.png'],
    ),
    'exponent of no kind': (['lyapunov', '--out', 'x.txt'], ['--out x.txt', '.png']),
    'data set as a file': (['dataset', 'smoke', '--out', 'x.parquet'], ['x.parquet', 'folder']),
    'paper as a file': (['paper', '--out', 'x.pdf'], ['x.pdf', 'folder']),
    'evaluation as a file': (
        ['evaluate', 'threshold', '--suite', 'smoke', '--out', 'x.json'],
        ['x.json', 'folder'],
    ),
    'scenario from a device': (['scenario', 'show', '/dev/zero'], ['/dev/zero']),
    'show nothing': (['scenario', 'show', 'no_such.yaml'], ['no_such.yaml']),
    'analyze nothing': (['analyze', 'no_such.mcap'], ['no_such.mcap']),
    'replay nothing': (['replay', 'no_such.mcap'], ['no_such.mcap']),
    'replay backwards': (['replay', 'empty.mcap', '--rate=-1'], ['rate']),
    'view nothing': (['view', 'no_such.mcap', '--save', 'a.rrd'], ['no_such.mcap']),
    'check nothing': (['scenario', 'check', 'no_such.yaml'], ['no_such.yaml']),
}

FILES: dict[str, tuple[bytes, list[str]]] = {
    'empty': (b'', ['empty', 'recording.mcap']),
    'text': (b'hello, this is no recording\n' * 10, ['recording.mcap']),
    'magic only': (b'\x89MCAP0\r\n', ['recording.mcap']),
}


def assert_one_sentence(code: int, said: str, wanted: list[str]) -> None:
    assert code in (1, 2), said
    assert 'Traceback' not in said
    errors = [line for line in said.splitlines() if line.startswith('error: ')]
    assert len(errors) == 1 or 'Usage:' in said, said
    for word in wanted:
        assert word in said, (word, said)


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[int, str]]:
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> tuple[int, str]:
        result = CliRunner().invoke(app, list(arguments), env={'COLUMNS': '300'})
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result.exit_code, result.output

    return run


@pytest.mark.parametrize('case', SCENARIOS)
def test_scenario(command: Callable[..., tuple[int, str]], tmp_path: Path, case: str) -> None:
    data, wanted = SCENARIOS[case]
    (tmp_path / 'bad.yaml').write_text(yaml.safe_dump(data))
    assert_one_sentence(*command('scenario', 'check', 'bad.yaml'), wanted)


@pytest.mark.parametrize('case', FLIGHTS)
def test_flight_file(command: Callable[..., tuple[int, str]], tmp_path: Path, case: str) -> None:
    text, wanted = FLIGHTS[case]
    (tmp_path / 'flight.csv').write_text(text)
    (tmp_path / 'bad.yaml').write_text(
        yaml.safe_dump(maneuver(profile='recorded', path='flight.csv'))
    )
    assert_one_sentence(*command('simulate', 'bad.yaml', '--out', 'out.mcap'), wanted)
    assert not list(tmp_path.glob('out.mcap*')), 'nothing may have been written'


@pytest.mark.parametrize('case', COMMANDS)
def test_command(command: Callable[..., tuple[int, str]], tmp_path: Path, case: str) -> None:
    arguments, wanted = COMMANDS[case]
    (tmp_path / 'empty.mcap').write_bytes(b'')
    assert_one_sentence(*command(*arguments), wanted)
    assert [path.name for path in tmp_path.iterdir()] == ['empty.mcap'], 'nothing may be written'


@pytest.mark.parametrize('verb', ['analyze', 'replay', 'view --save a.rrd'])
@pytest.mark.parametrize('case', FILES)
def test_recording(
    command: Callable[..., tuple[int, str]], tmp_path: Path, case: str, verb: str
) -> None:
    content, wanted = FILES[case]
    (tmp_path / 'recording.mcap').write_bytes(content)
    assert_one_sentence(*command(*verb.split(), 'recording.mcap'), wanted[-1:])


@pytest.mark.parametrize(
    ('text', 'wanted'),
    [
        ('a: [1, 2', ['YAML', 'line']),
        ('just text', ['mapping']),
        ('- 1\n- 2\n', ['mapping']),
        ('1: 2\n', ['mapping']),
        ('', ['mapping']),
        ('seed: 010\n', ['bad.yaml', 'line 1', '8 in YAML 1.1', '10 in YAML 1.2', '0o10']),
        ('seed: 1\nduration_s: 1:30\n', ['line 2', '90']),
        ('name: yes\n', ['line 1', 'true', "'yes'"]),
        ('seed: 1_000\n', ['line 1', '1000']),
        ('seed: 1\nname: a\nseed: 2\n', ['line 3', 'seed', 'line 1']),
        ('duration_s: 2024-01-01\n', ['duration_s', '2024-01-01', 'number']),
        ('seed: !!python/name:os.system\n', ['line 1', 'tag']),
        ('maneuver: &a [*a]\n', ['line 1', 'alias *a']),
        ('a: &a [x, x]\nb: &b [' + '*a, ' * 400 + ']\nc: [' + '*b, ' * 400 + ']', ['line 3']),
        ('maneuver: ' + '[' * 300, ['line 1', '64']),
        ('seed: ' + '7' * 5000, ['line 1', '5000']),
        ('duration_s: 1e999', ['line 1', '1e999']),
        ('duration_s: .nan\nmaneuver: {profile: constant}', ['duration_s = nan', '86400']),
        ('seed: 1\n\tname: a\n', ['line 2', 'tab']),
        ('name: "\\ud800"', ['line 1']),
        ('a: 1\n---\nb: 1\n', ['line 2', 'document']),
        ('# ' + 'x' * 1_000_000, ['bad.yaml', '1 MB']),
    ],
)
@pytest.mark.parametrize('verb', ['check', 'show'])
def test_yaml(
    command: Callable[..., tuple[int, str]],
    tmp_path: Path,
    text: str,
    wanted: list[str],
    verb: str,
) -> None:
    (tmp_path / 'bad.yaml').write_text(text)
    code, said = command('scenario', verb, 'bad.yaml')
    assert_one_sentence(code, said, wanted)
    assert len(said) < 400


@pytest.mark.parametrize('path', ['/dev/zero', 'pipe', '.'])
def test_flight_that_is_no_file(
    command: Callable[..., tuple[int, str]], tmp_path: Path, path: str
) -> None:
    os.mkfifo(tmp_path / 'pipe')
    (tmp_path / 'bad.yaml').write_text(yaml.safe_dump(maneuver(profile='recorded', path=path)))
    for verb in (['simulate', '--out', 'out.mcap'], ['scenario', 'check']):
        assert_one_sentence(*command(*verb, 'bad.yaml'), ['cannot be read'])


def test_suite(command: Callable[..., tuple[int, str]], tmp_path: Path) -> None:
    (tmp_path / 'bad.yaml').write_text('base: smoke\ngrowth_s: 1:30\n')
    assert_one_sentence(*command('dataset', 'bad.yaml', '--out', 'data'), ['line 2', '90'])
    assert not (tmp_path / 'data').exists()


# node module, parameters, and what the sentence must contain
PARAMETERS: dict[str, tuple[str, list[str], list[str]]] = {
    'duration is text': (
        'maneuver_gen.node',
        ['duration_s:=long'],
        ["duration_s = 'long'", 'float'],
    ),
    'lead too long': ('maneuver_gen.node', ['lead_s:=100.0'], ['lead_s = 100', '0.1 to 10']),
    'maneuver is no JSON': ('maneuver_gen.node', ['config:=climb'], ['JSON']),
    'rate negative': ('rotor_sim.node', ['rate:=-1.0'], ['rate = -1', '0 to 1000']),
    'scenario is no JSON': ('rotor_sim.node', ['scenario:=climb'], ['JSON']),
    'crack too deep': (
        'rotor_sim.node',
        ['crack_stiffness_ratio:=0.9'],
        ['crack_stiffness_ratio', '0 to 0.5'],
    ),
    'hop of nothing': ('vibration_monitor.node', ['hop_revolutions:=0'], ['hop_revolutions']),
    'no folder': ('rotor_recording.recorder_node', [], ['path is empty']),
    'folder is a number': ('rotor_recording.recorder_node', ['path:=3'], ['path = 3', 'str']),
}


@pytest.fixture
def signals_as_before() -> Iterator[None]:
    """What a node does with signals ends with the test."""
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, [])
    handlers = {number: signal.getsignal(number) for number in ros.SIGNALS}
    yield
    for number, handler in handlers.items():
        signal.signal(number, handler)
    signal.pthread_sigmask(signal.SIG_SETMASK, mask)


@pytest.mark.usefixtures('domain', 'signals_as_before')
@pytest.mark.parametrize('case', PARAMETERS)
def test_node_parameter(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """In this process; test_environment.py, test_cosimulation.py and others run real ones."""
    module, parameters, wanted = PARAMETERS[case]
    monkeypatch.chdir(tmp_path)
    options = [option for parameter in parameters for option in ('-p', parameter)]
    code = importlib.import_module(module).main(['--ros-args', *options])
    assert_one_sentence(code, ''.join(capfd.readouterr()), wanted)


SLOW = pytest.mark.slow


@pytest.mark.parametrize(
    'number', ['abc', *(pytest.param(number, marks=SLOW) for number in ('500', '-1'))]
)
def test_ros_domain(rig: Rig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: str) -> None:
    monkeypatch.setattr('live_flight.private_domain', lambda: number)
    done = rig('run', '--record', tmp_path / 'recordings')
    assert_one_sentence(done.code, done.out + done.err, [f"ROS_DOMAIN_ID = '{number}'", '232'])


def test_as_a_real_process(rig: Rig, tmp_path: Path) -> None:
    bad = tmp_path / 'bad.yaml'
    bad.write_text(yaml.safe_dump(changed(duration_s=0)))
    done = rig('run', bad, '--record', tmp_path / 'recordings')
    assert_one_sentence(done.code, done.out + done.err, ['duration_s = 0'])
    assert not (tmp_path / 'recordings').exists()
