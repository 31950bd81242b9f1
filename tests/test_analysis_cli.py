# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""orbit-diagram, waterfall, lyapunov and poincare: answers, files, refusals, Ctrl-C."""

import json
import re
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from live_flight import CLI
from pyarrow import parquet
from typer.testing import CliRunner

import rotor_dynamics
from rig_support import Rig
from rotor_bringup.cli import app
from rotor_common.exit_code import ExitCode
from rotor_dynamics import Plan, survey, sweep, sweep_runs
from rotor_dynamics.ensemble import Ensemble, OperatingPoint
from rotor_sim.plant.parameters import RotorParameters

Command = Callable[..., tuple[int, str]]

SHORT = ('--transient', '30', '--revolutions', '16')
OVER_K = ('--over', 'K', '0', '0.3', '5')


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    """Run a command in an empty folder, in this process."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: object) -> tuple[int, str]:
        words = [str(argument) for argument in arguments]
        result = CliRunner().invoke(app, words, env={'COLUMNS': '300'})
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result.exit_code, result.output

    return run


def numbers(path: Path) -> dict[str, np.ndarray[Any, Any]]:
    with np.load(path) as arrays:
        return dict(arrays)


def test_an_orbit_diagram_is_the_survey_in_every_file(command: Command, tmp_path: Path) -> None:
    files = [f'k.{ending}' for ending in ('png', 'svg', 'npz', 'parquet')]
    out = [word for file in files for word in ('--out', file)]
    code, said = command('orbit-diagram', *OVER_K, *SHORT, *out)
    assert code == 0, said
    assert all(f'wrote {file}' in said for file in files)
    values = np.linspace(0.0, 0.3, 5)
    points = sweep(RotorParameters(), 'K', values, speed_rad_s=352.0, load_factor=3.0)
    wanted = survey(points, Plan(transient_revolutions=30, revolutions=16))
    found = numbers(tmp_path / 'k.npz')
    table = parquet.read_table(tmp_path / 'k.parquet')
    assert table.num_rows == 5
    for name in ('y', 'z', 'velocity_y', 'mean_z', 'label', 'converged', 'difference'):
        np.testing.assert_array_equal(found[name], getattr(wanted, name))
        np.testing.assert_array_equal(np.array(table[name].to_pylist()), getattr(wanted, name))
    np.testing.assert_array_equal(found['values'], values)
    asked = json.loads(str(found['asked']))
    assert asked['over'] == 'crack_stiffness_ratio'
    assert asked['parameters'] == RotorParameters().model_dump()
    assert json.loads(table.schema.metadata[b'asked']) == asked
    assert (tmp_path / 'k.png').read_bytes().startswith(b'\x89PNG')
    picture = (tmp_path / 'k.svg').read_text('utf-8')
    assert 'crack stiffness ratio K' in picture
    assert 'the same start at every value' in picture


@pytest.mark.slow
def test_the_same_command_writes_the_same_bytes(command: Command, tmp_path: Path) -> None:
    for name in ('a', 'b'):
        (tmp_path / name).mkdir()
        out = [word for end in ('png', 'svg') for word in ('--out', f'{name}/k.{end}')]
        assert command('orbit-diagram', *OVER_K, *SHORT, *out)[0] == 0
    for ending in ('png', 'svg'):
        assert (tmp_path / f'a/k.{ending}').read_bytes() == (
            tmp_path / f'b/k.{ending}'
        ).read_bytes()


def test_without_a_name_the_picture_is_named_after_the_command(
    command: Command, tmp_path: Path
) -> None:
    code, said = command('orbit-diagram', *OVER_K, *SHORT, '--no-check')
    assert code == 0, said
    assert [path.name for path in tmp_path.iterdir()] == ['orbit-diagram.png']


@pytest.mark.parametrize('direction', ['up', 'down'])
@pytest.mark.parametrize('name', ['orbit-diagram', 'waterfall'])
def test_a_continuation_says_that_it_is_one(command: Command, name: str, direction: str) -> None:
    code, said = command(
        name, *OVER_K, *SHORT, '--direction', direction, '--out', 'k.svg', '--json'
    )
    assert code == 0, said
    assert json.loads(said)['direction'] == direction
    picture = Path('k.svg').read_text('utf-8')
    assert f'continued {direction}wards' in picture
    assert 'not checked at 2N' in picture


def test_a_waterfall_has_orders_and_amplitudes(command: Command, tmp_path: Path) -> None:
    code, said = command(
        'waterfall',
        '--over',
        'speed',
        '300',
        '400',
        '3',
        *SHORT,
        '--out',
        'w.npz',
        '--out',
        'w.svg',
    )
    assert code == 0, said
    found = numbers(tmp_path / 'w.npz')
    assert found['amplitude_z'].shape == (3, len(found['orders']))
    assert found['orders'][:2].tolist() == [0.0, 1.0 / 16.0]
    picture = (tmp_path / 'w.svg').read_text('utf-8')
    assert 'frequency [rad/s]' in picture
    assert 'Hann window, zero-to-peak' in picture


def test_the_exponent_of_the_reference_point(command: Command) -> None:
    # physics.md: -0.0115 at 352 rad/s, and a scatter of 0.002 between 500-revolution exponents
    code, said = command('lyapunov', '--json')
    assert code == 0, said
    found = json.loads(said)
    assert abs(found['exponent'] + 0.0115) < 0.002
    assert 0.0 < found['standard_error'] < 0.002
    assert found['converged'] is True


def test_the_spectrum_adds_up_to_what_the_dampers_take(command: Command) -> None:
    code, said = command(
        'lyapunov', '--json', '--spectrum', '--steps', '1024', '--transient', '50',
        '--revolutions', '50', '--no-check',
    )  # fmt: skip
    assert code == 0, said
    # The trace of eq. (6) is -8 xi (1 + m/m_b) everywhere. RK4 damps the bearings' modes besides,
    # by (w h)^6: 1 % of the sum at N = 256, 4^-5 of that here.
    wanted = -8.0 * 0.01 * (1.0 + 32.1 / 4.0)
    assert sum(json.loads(said)['spectrum']) == pytest.approx(wanted, rel=5e-5)


def test_the_two_methods_agree(command: Command) -> None:
    estimates = [
        json.loads(command('lyapunov', '--json', '--no-check', '--method', method)[1])
        for method in ('tangent', 'two-trajectories')
    ]
    first, second = estimates
    error = np.hypot(first['standard_error'], second['standard_error'])
    assert abs(first['exponent'] - second['exponent']) < 2.0 * error
    assert 'converged' not in first


def test_exponents_over_a_parameter(command: Command) -> None:
    code, said = command(
        'lyapunov',
        *OVER_K,
        '--transient',
        '100',
        '--revolutions',
        '100',
        '--json',
        '--out',
        'l.svg',
    )
    assert code == 0, said
    found = json.loads(said)
    assert len(found['exponent']) == len(found['standard_error']) == 5
    assert max(found['exponent']) < 0.0  # derived is never chaotic in K (physics.md, section 3)
    assert 'standard errors' in Path('l.svg').read_text('utf-8')


def test_a_motion_has_a_label_with_evidence(command: Command, tmp_path: Path) -> None:
    code, said = command('poincare', '--out', 'p.npz', '--out', 'p.svg', '--json')
    assert code == 0, said
    found = json.loads(said)
    assert found['label'] == 'quasi-periodic'  # the ball-pass order, see physics.md
    assert {'zero_one', 'line_share', 'exponent', 'standard_error'} <= found['evidence'].keys()
    arrays = numbers(tmp_path / 'p.npz')
    assert arrays['orbit_z'].shape == (300, 64)
    np.testing.assert_array_equal(arrays['orbit_z'][:, 0], arrays['z'])
    # physics.md, section 4, derived at 352 rad/s
    scale = float(arrays['length_scale_m'])
    assert arrays['y'].min() / scale == pytest.approx(4.11, abs=0.01)
    assert arrays['y'].max() / scale == pytest.approx(4.41, abs=0.01)
    picture = (tmp_path / 'p.svg').read_text('utf-8')
    assert all(word in picture for word in ('orbit', 'phase portrait', 'section', 'spectrum'))


@pytest.mark.slow
def test_sections_over_a_parameter(command: Command) -> None:
    code, said = command(
        'poincare', *OVER_K, '--transient', '100', '--revolutions', '100', '--out', 'p.svg'
    )
    assert code == 0, said
    assert Path('p.svg').read_text('utf-8').count('crack stiffness ratio K = ') == 5


@pytest.mark.parametrize('variant', ['figure', 'figure_chaos'])
def test_reconstructions_are_called_so(command: Command, variant: str) -> None:
    code, said = command(
        'orbit-diagram', *OVER_K, *SHORT, '--variant', variant, '--out', 'k.svg', '--json'
    )
    assert code == 0, said
    assert json.loads(said)['note'] == 'empirical reconstruction'
    assert 'empirical reconstruction' in Path('k.svg').read_text('utf-8')


def test_changed_parameters_stand_in_picture_and_data(command: Command) -> None:
    code, said = command(
        'orbit-diagram', *OVER_K, *SHORT, '--set', 'clearance=5e-6', '--set', 'ball_count=9',
        '--load', '1', '--out', 'k.svg', '--json',
    )  # fmt: skip
    assert code == 0, said
    found = json.loads(said)
    assert found['parameters']['clearance_m'] == 5e-6
    assert found['parameters']['ball_count'] == 9
    assert found['load_factor'] == 1.0
    picture = Path('k.svg').read_text('utf-8')
    assert all(text in picture for text in ('clearance = 5', 'ball_count = 9', 'G = 1'))


def test_one_value_is_a_range_too(command: Command) -> None:
    code, said = command('orbit-diagram', '--over', 'G', '3', '3', '1', *SHORT, '--json')
    assert code == 0, said
    assert json.loads(said)['values'] == [3.0]


# arguments, and what the sentence must contain
REFUSED: dict[str, tuple[str, list[str]]] = {
    'no range': ('orbit-diagram', ['--over']),
    'unknown parameter': ('orbit-diagram --over mass 0 1 3', ["'mass'", 'clearance']),
    'a whole number': ('orbit-diagram --over ball_count 6 9 4', ["'ball_count'"]),
    'empty range': ('waterfall --over K 0.3 0 10', ['0.3 to 0', 'empty']),
    'nothing between': ('waterfall --over K 0.1 0.1 10', ['empty']),
    'no values': ('lyapunov --over K 0 0.3 0', ['COUNT = 0', '1 to 1000000']),
    'fewer than none': ('lyapunov --over K 0 0.3 -5', ['COUNT = -5']),
    'half a value': ('lyapunov --over K 0 0.3 2.5', ['COUNT = 2.5']),
    'NaN range': ('poincare --over K nan 0.3 5', ['START = nan']),
    'endless range': ('poincare --over K 0 inf 5', ['STOP = inf']),
    'text range': ('poincare --over K 0 much 5', ['STOP = much']),
    'too many values': ('orbit-diagram --over K 0 0.3 1000000', ['1000000 values']),
    'beyond the parameter': (
        'orbit-diagram --over K 0 0.9 5',
        ['crack_stiffness_ratio = ', '0 to 0.5'],
    ),
    'beyond the variant': (
        'orbit-diagram --over K 0 0.5 5 --variant figure',
        ['crack_stiffness_ratio = 0.5', 'figure'],
    ),
    'negative clearance': ('orbit-diagram --over clearance -1e-6 1e-6 3', ['clearance_m = -1e-06']),
    'standing still': ('orbit-diagram --over speed 0 1000 5', ['speed_rad_s = 0']),
    'speed twice': ('orbit-diagram --over speed 100 200 5 --speed 3', ['--speed', '--over']),
    'load twice': ('orbit-diagram --over G 0 2 5 --load 3', ['--load', '--over']),
    'set what is swept': ('orbit-diagram --over K 0 0.3 5 --set K=0.1', ['--set', '--over']),
    'set without a value': ('lyapunov --set K', ['--set K', 'NAME=VALUE']),
    'set an unknown name': ('lyapunov --set crack=0.1', ['crack']),
    'set text': ('lyapunov --set K=deep', ['crack_stiffness_ratio', 'deep']),
    'set the speed': ('lyapunov --set speed=300', ['--speed']),
    'set the variant': ('lyapunov --set variant=natural', ['--variant']),
    'unknown variant': ('lyapunov --variant exact', ['exact', 'derived']),
    'negative speed': ('lyapunov --speed=-352', ['speed_rad_s = -352']),
    'NaN speed': ('lyapunov --speed nan', ['speed_rad_s = nan']),
    'load of 100': ('lyapunov --load 100', ['load_factor = 100']),
    'negative steps': ('lyapunov --steps=-256', ['steps_per_revolution = -256', '128']),
    'no steps': ('orbit-diagram --over K 0 0.3 5 --steps 0', ['steps_per_revolution = 0']),
    'N too small': ('orbit-diagram --over K 0 0.3 5 --steps 64', ['steps_per_revolution = 64']),
    'N too small for the clearance': (
        'orbit-diagram --over clearance 0 1e-5 5 --steps 128',
        ['steps_per_revolution = 128', 'clearance'],
    ),
    'negative transient': ('poincare --transient=-1', ['transient', '-1']),
    'no revolutions': ('poincare --revolutions 0', ['revolutions = 0']),
    'no exponent': ('lyapunov --revolutions 0', ['--revolutions 0', '50']),
    'a short exponent': ('lyapunov --revolutions 10', ['10', '50']),
    'unknown method': ('lyapunov --method guess', ['guess', 'tangent']),
    'method of a sweep': (
        'lyapunov --over K 0 0.3 5 --method two-trajectories',
        ['--method', '--over'],
    ),
    'spectrum of a sweep': ('lyapunov --over K 0 0.3 5 --spectrum', ['--spectrum', '--over']),
    'unknown direction': ('orbit-diagram --over K 0 0.3 5 --direction left', ['left', 'down']),
    'unknown ending': ('lyapunov --out result.docx', ['result.docx', '.png', '.parquet']),
    'no ending': ('lyapunov --out result', ['--out result']),
    'folder absent': ('lyapunov --out no/such/folder/a.png', ['no/such/folder']),
    'second file bad': ('lyapunov --out a.png --out b.txt', ['b.txt']),
    'a folder as file': ('lyapunov --out folder.png', ['folder.png', 'folder']),
    'cache in a file': (
        'orbit-diagram --over K 0 0.3 5 --cache file.txt/cache',
        ['file.txt/cache', 'cannot be made'],
    ),
    'cache at one point': ('lyapunov --cache c', ['--cache', 'one point']),
    'no jobs': ('orbit-diagram --over K 0 0.3 5 --jobs 0', ['--jobs 0', '1 or more']),
    'jobs of a scheduler': (
        'orbit-diagram --over K 0 0.3 5 --jobs 2 --scheduler tcp://127.0.0.1:1',
        ['--jobs', '--scheduler'],
    ),
    'no address': ('orbit-diagram --over K 0 0.3 5 --scheduler here', ["'here'", 'tcp://']),
    'cache of a continuation': (
        'waterfall --over K 0 0.3 5 --direction up --cache c',
        ['--cache', '--direction up'],
    ),
    'more sections than fit': ('poincare --over K 0 0.3 100', ['100', '25', '.npz']),
}


@pytest.mark.parametrize('case', REFUSED)
def test_bad_arguments_are_one_sentence_before_anything_is_computed(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, case: str
) -> None:
    arguments, wanted = REFUSED[case]
    (tmp_path / 'folder.png').mkdir()
    (tmp_path / 'file.txt').write_text('')
    for name in ('survey', 'lyapunov_exponent', 'poincare_section', 'continuation'):
        monkeypatch.setattr(sweep_runs, name, lambda *_, **__: pytest.fail('it computed'))
    code, said = command(*arguments.split())
    assert code == 2, said
    errors = [line for line in said.splitlines() if line.startswith('error: ')]
    assert len(errors) == 1 or 'Usage:' in said, said
    assert 'Traceback' not in said
    for word in wanted:
        assert word in said, (word, said)
    assert sorted(path.name for path in tmp_path.iterdir()) == ['file.txt', 'folder.png']


def test_the_sentence_of_a_real_process(rig: Rig, tmp_path: Path) -> None:
    done = rig('orbit-diagram', *OVER_K, '--out', tmp_path / 'nowhere' / 'a.png')
    assert done.code == 2
    assert done.out == ''
    assert done.err.count('\n') == 1
    assert done.err.startswith('error: --out ')


def test_the_command_line_starts_without_what_only_analyses_need() -> None:
    code = (
        'import sys, rotor_bringup.cli; '
        'print([name for name in ("matplotlib", "distributed", "dask", "numba", "pyarrow", "scipy")'
        ' if name in sys.modules])'
    )
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == '[]'


@pytest.mark.slow
def test_ctrl_c_keeps_what_is_done_and_a_repeated_run_goes_on(rig: Rig, tmp_path: Path) -> None:
    arguments = ['orbit-diagram', '--over', 'K', '0', '0.3', '256', '--transient', '100',
                 '--revolutions', '60', '--jobs', '1']  # fmt: skip
    cache = tmp_path / 'cache'
    kept = [*arguments, '--cache', str(cache), '--out', str(tmp_path / 'kept.npz')]
    process = subprocess.Popen(
        [*CLI, *kept],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        stdin=subprocess.DEVNULL,
    )
    deadline = time.monotonic() + 300.0
    while not list(cache.glob('*.npz')):
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline, 'no chunk was done'
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    interrupted = time.monotonic()
    out, err = process.communicate(timeout=300.0)
    assert process.returncode == 130, err
    assert time.monotonic() - interrupted < 10.0, 'Ctrl-C must not wait for the chunk'
    assert out == ''
    assert 'of 256 points are done; they are kept in' in err.replace('\n', ' ')
    assert err.count('\n') == 1
    assert not (tmp_path / 'kept.npz').exists()
    before = {path: path.stat().st_mtime_ns for path in cache.glob('*.npz')}
    assert 1 <= len(before) < 4

    assert rig(*kept).code == 0
    after = {path: path.stat().st_mtime_ns for path in cache.glob('*.npz')}
    assert len(after) == 4
    assert {path: after[path] for path in before} == before, 'nothing is computed twice'
    assert rig(*arguments, '--out', tmp_path / 'fresh.npz').code == 0
    first, second = numbers(tmp_path / 'kept.npz'), numbers(tmp_path / 'fresh.npz')
    assert first.keys() == second.keys()
    for name, array in first.items():
        assert array.tobytes() == second[name].tobytes(), name


@pytest.mark.parametrize(
    ('options', 'sentence'),
    [
        (('--against', 'speed', 100, 200, 2), 'a map over speed_rad_s and itself is a line'),
        (('--against', 'K', 0, 0.1, 2, '--set', 'K=0.2'), '--set crack_stiffness_ratio has no'),
        (('--against', 'G', 0, 3, 2, '--load', 2), '--load has no meaning, since --against'),
        (('--against', 'G', 3, 0, 2), '--against: the range from 3 to 0 is empty'),
        (('--against', 'size', 0, 1, 2), "'size' is nothing to sweep over"),
        ((), "Missing option '--against'"),
    ],
)
def test_a_map_needs_two_parameters(
    command: Command, options: tuple[object, ...], sentence: str
) -> None:
    code, said = command('map', '--over', 'speed', 300, 400, 2, *options)
    assert code == 2
    assert sentence in said


def test_a_map_is_the_surveys_of_its_points(command: Command, tmp_path: Path) -> None:
    """Each point of the grid has the exponent that a sweep along one side gives it."""
    code, said = command(
        *('map', '--over', 'K', 0, 0.2, 3, '--against', 'G', 1, 3, 2, *SHORT, '--no-check'),
        *('--out', tmp_path / 'map.npz'),
    )
    assert code == 0, said
    with np.load(tmp_path / 'map.npz') as found:
        assert list(found['load_factor']) == [1.0, 3.0] * 3
        assert found['crack_stiffness_ratio'].tolist() == [0.0, 0.0, 0.1, 0.1, 0.2, 0.2]
        asked = json.loads(str(found['asked']))
        plan = Plan(
            asked['transient_revolutions'],
            asked['revolutions'],
            exponent_revolutions=asked['exponent_revolutions'],
            check_steps=False,
        )
        rotor = RotorParameters.hou2016('derived')
        points = sweep(rotor, 'K', [0.0, 0.1, 0.2], speed_rad_s=352.0, load_factor=3.0)
        alone = survey(points, plan)
        # up to 4 points run by other machine code, equal to rounding
        np.testing.assert_allclose(found['exponent'][1::2], alone.exponent, atol=1e-9)


PAGE = Path(__file__).parents[1] / 'docs' / 'analyses.md'
SMALLER = {
    'orbit-diagram': SHORT,
    'waterfall': SHORT,
    'lyapunov': ('--transient', '30', '--revolutions', '50'),
    'poincare': SHORT,
    'map': SHORT,
}


def documented(language: str) -> list[str]:
    return re.findall(rf'```{language}\n(.*?)```', PAGE.read_text('utf-8'), re.DOTALL)


@pytest.mark.slow
@pytest.mark.parametrize('line', documented('bash')[0].splitlines())
def test_the_documented_commands_run(command: Command, line: str) -> None:
    program, name, *options = shlex.split(line)
    assert program == 'rotor-rig'
    for sweeping in {'--over', '--against'} & set(options):
        count = options.index(sweeping) + 4
        options[count] = str(min(int(options[count]), 8))
    code, said = command(name, *options, *SMALLER[name])
    assert code == 0, said
    assert 'wrote ' in said


@pytest.mark.slow
def test_the_documented_python_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (code,) = documented('python')
    exec(compile(code, str(PAGE), 'exec'), {})  # noqa: S102 - the page's own example
    assert ' +- ' in capsys.readouterr().out
    assert list((tmp_path / 'results').glob('*.npz'))


def test_every_command_and_function_is_documented() -> None:
    page = PAGE.read_text('utf-8')
    for name in SMALLER:
        assert f'| `{name}` |' in page
    for name in (
        *('orbit_diagram', 'waterfall', 'lyapunov_exponent', 'poincare_section'),
        *('parameter_map', 'survey'),
    ):
        assert name in rotor_dynamics.__all__
        assert name in page


# --- motions that diverge -----------------------------------------------------------------------

DIVERGED = ('--variant', 'figure', '--set', 'K=0.3')
"""docs/physics.md: figure diverges from K = 0.2875 at 352 rad/s, G = 3."""
BRIEF = ('--transient', '60', '--revolutions', '60')


def parsed(said: str) -> dict[str, Any]:
    """Return the JSON of a command, which must not hold what JSON does not have."""

    def refuse(token: str) -> None:
        raise AssertionError(f'{token} in the JSON')

    found: dict[str, Any] = json.loads(said, parse_constant=refuse)
    return found


def revolution_it_leaves() -> int:
    """How many revolutions stay within 1000 static deflections, by the integrator alone."""
    rotor = RotorParameters.hou2016('figure', crack_stiffness_ratio=0.3)
    alone = Ensemble([OperatingPoint(rotor, 352.0, 3.0)], 256)
    count = 0
    while np.abs(alone.advance(1, 64)[0, :, :2]).max() <= 1000.0 * rotor.length_scale_m:
        count += 1
    return count


@pytest.mark.parametrize('options', [(), ('--no-check',), ('--spectrum',)])
@pytest.mark.parametrize('method', ['tangent', 'two-trajectories'])
def test_an_exponent_of_a_motion_that_diverged_is_no_answer(
    command: Command, method: str, options: tuple[str, ...]
) -> None:
    if options == ('--spectrum',) and method != 'tangent':
        return
    asked = ('lyapunov', *DIVERGED, *BRIEF, '--method', method, *options, '--out', 'e.npz')
    code, said = command(*asked)
    assert code == ExitCode.CHECK_FAILED
    assert f'the motion diverged, it left the model in revolution {revolution_it_leaves()}' in said
    assert 'nan' not in said
    code, said = command(*asked, '--json')
    assert code == ExitCode.CHECK_FAILED
    found = parsed(said)
    assert (found['exponent'], found['standard_error']) == (None, None)
    assert found['diverged_at'] == revolution_it_leaves()


def test_a_picture_of_an_exponent_that_is_none_says_so(command: Command) -> None:
    assert command('lyapunov', *DIVERGED, *BRIEF, '--no-check', '--out', 'e.svg')[0] == 1
    assert 'no exponent: diverged in revolution' in Path('e.svg').read_text('utf-8')


@pytest.mark.slow
def test_a_motion_that_diverges_while_the_exponent_is_computed(command: Command) -> None:
    """No transient and few revolutions recorded: it leaves among those of the exponent."""
    code, said = command(
        'poincare', *DIVERGED, '--transient', '0', '--revolutions', '16', '--steps', '4096'
    )
    leaves = int(re.search(r'left the model in revolution (\d+)', said)[1])  # type: ignore[index]
    assert code == ExitCode.CHECK_FAILED
    assert said.startswith('diverged motion')
    code, said = command('lyapunov', *DIVERGED, '--transient', '0', '--steps', '4096')
    assert code == ExitCode.CHECK_FAILED
    assert f'left the model in revolution {leaves}' in said


SWEEPS = {
    'orbit-diagram': (),
    'orbit-diagram up': ('--direction', 'up'),
    'waterfall': ('--no-check',),
    'lyapunov': ('--no-check',),
    'poincare': ('--no-check',),
    'map': ('--no-check', '--against', 'G', '3', '3.1', '2'),
}


@pytest.mark.slow
@pytest.mark.parametrize('name', SWEEPS)
@pytest.mark.parametrize(('first', 'gone'), [('0.1', 1), ('0.29', 2)])
def test_sweeps_count_what_diverged(command: Command, name: str, first: str, gone: int) -> None:
    """Some are counted, all are no answer."""
    options = (*SWEEPS[name], *BRIEF, '--variant', 'figure', '--out', 'o.npz')
    asked = (name.split(maxsplit=1)[0], '--over', 'K', first, '0.3', '2', *options)
    code, said = command(*asked)
    loads = 2 if name == 'map' else 1
    assert code == (ExitCode.CHECK_FAILED if gone == 2 else ExitCode.DONE), said
    assert f'{gone * loads} of {2 * loads} ' in said
    assert 'diverged' in said
    assert 'nan' not in said
    code, said = command(*asked, '--json')
    assert code == (ExitCode.CHECK_FAILED if gone == 2 else ExitCode.DONE)
    found = parsed(said)
    assert found['diverged'] == gone * loads
    assert np.sum(np.array(found['label']) == 'diverged') == gone * loads
    if name != 'map':
        assert [left is not None for left in found['diverged_at']] == [gone == 2, True]


@pytest.mark.slow
def test_a_motion_that_changes_with_the_step_is_undecided_and_says_why(command: Command) -> None:
    """figure around K = 0.225 at 256 steps: whatever the label, it does not contradict."""
    code, said = command(
        *('poincare', '--over', 'K', '0.2', '0.25', '6', '--variant', 'figure'),
        *('--transient', '300', '--out', 'o.npz', '--json'),
    )
    assert code == 0, said
    found = parsed(said)
    for label, reason, exponent, error in zip(
        *(found[name] for name in ('label', 'reason', 'exponent', 'standard_error')), strict=True
    ):
        assert label != 'chaotic' or exponent > 3.0 * error
        assert (label == 'undecided') == bool(reason)
