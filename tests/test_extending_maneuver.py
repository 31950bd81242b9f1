# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""docs/extending/maneuver.md as a reader follows it: the file, the flight, the name."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest

from extending_support import RIG, blocks, install, page, run
from maneuver_gen import ManeuverError, load_grid, parse_maneuver
from maneuver_gen.registry import maneuver_names
from rotor_common.errors import ConfigError
from rotor_recording.reading import Recording, waveform_blocks
from rotor_rig.scenario_model import load_scenario

PAGE = page('maneuver')
PULL_UP = {'profile': 'pull_up:PullUp', 'peak': 4.0, 'duration_s': 0.6}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the page's reader, who stands in it."""
    (tmp_path / 'pull_up.py').write_text(blocks('maneuver', 'python')[0], 'utf-8')
    (tmp_path / 'flight.yaml').write_text(blocks('maneuver', 'yaml')[0], 'utf-8')
    (tmp_path / 'pyproject.toml').write_text(blocks('maneuver', 'toml')[0], 'utf-8')
    monkeypatch.chdir(tmp_path)
    monkeypatch.delitem(sys.modules, 'pull_up', raising=False)
    return tmp_path


def closed_form(times_s: np.ndarray) -> np.ndarray:
    """1 + 3 sin^2(pi (t - 0.2 s) / 0.6 s) while it lasts, which is the raised cosine."""
    inside = (times_s > 0.2) & (times_s < 0.8)
    return 1.0 + 3.0 * np.where(inside, np.sin(np.pi * (times_s - 0.2) / 0.6) ** 2, 0.0)


@pytest.mark.usefixtures('folder')
def test_the_load_grid_is_the_closed_form() -> None:
    grid = load_grid(parse_maneuver(PULL_UP), 1.0)
    np.testing.assert_allclose(grid[:, 0], 9.81 * closed_form(np.arange(102) / 100.0), rtol=1e-14)
    assert (grid[:, 1] == 0.0).all()


@pytest.mark.usefixtures('folder')
def test_a_sequence_has_it_as_a_segment() -> None:
    """Level, then the pull-up, whose time starts anew and whose peak is 0.5 s later."""
    parts = [{'duration_s': 1.0, 'maneuver': m} for m in ({'profile': 'constant'}, PULL_UP)]
    data = {'profile': 'sequence', 'blend_s': 0.1, 'segments': parts}
    config = parse_maneuver(data)
    assert load_grid(config, 2.0)[150, 0] == pytest.approx(4.0 * 9.81, rel=1e-14)
    assert parse_maneuver(config.model_dump_json()) == config


@pytest.mark.usefixtures('folder')
def test_the_python_example_prints_what_it_says(capsys: pytest.CaptureFixture[str]) -> None:
    example = blocks('maneuver', 'python')[1]
    exec(compile(example, 'maneuver.md', 'exec'), {})  # noqa: S102 - our own documentation
    assert capsys.readouterr().out.strip() == example.partition('  # ')[2].strip()


@pytest.mark.slow
def test_the_commands_of_the_page_fly_it(folder: Path) -> None:
    check, simulate, _ = re.findall('^rotor-rig (.*)$', PAGE, re.MULTILINE)
    run(*RIG, *check.split())
    shown = run(*RIG, 'scenario', 'show', 'flight.yaml')
    assert 'profile: pull_up:PullUp' in shown
    assert 'start_s: 0.2' in shown
    run(*RIG, *simulate.split())
    rows = np.concatenate([b.rows for b in waveform_blocks(Recording(folder / 'flight.mcap'))])
    assert len(rows) >= 10_240  # one second
    grid = 9.81 * closed_form(np.arange(102) / 100.0)
    wanted = np.interp(np.arange(len(rows)) / 10_240, np.arange(102) / 100.0, grid)
    np.testing.assert_allclose(rows['load_y'], wanted, rtol=1e-6)  # float32, no sensor noise
    assert load_scenario('flight.mcap').maneuver == parse_maneuver(PULL_UP)


@pytest.mark.slow
def test_installed_it_has_a_name(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    site = install(folder, tmp_path_factory.mktemp('site'))
    elsewhere = tmp_path_factory.mktemp('elsewhere') / 'flight.yaml'
    elsewhere.write_text('maneuver: {profile: pull_up, peak: 4.0}')
    (folder / 'pull_up.py').unlink()
    run(*RIG, 'scenario', 'check', str(elsewhere), path=site)
    assert 'profile: pull_up\n' in run(*RIG, 'scenario', 'show', str(elsewhere), path=site)
    names = 'from maneuver_gen.registry import maneuver_names; print(maneuver_names())'
    assert "'pull_up', 'ramp'" in run(sys.executable, '-c', names, path=site)
    assert 'pull_up' not in maneuver_names()


BROKEN = {
    'no such file': ('nowhere:PullUp', '', "cannot be loaded: No module named 'nowhere'"),
    'no such class': ('mine:PullDown', '', "cannot be loaded: module 'mine' has no attribute"),
    'a mistake in it': ('mine:PullUp', 'class PullUp(Maneuver): pass', "'Maneuver' is not defined"),
    'no maneuver': ('mine:PullUp', 'class PullUp: pass', 'is no maneuver: mine:PullUp must be'),
    'no load': (
        'mine:Bare',
        'from maneuver_gen import Maneuver\nclass Bare(Maneuver): profile: str = "bare"',
        'derives from maneuver_gen.Maneuver and has load_factors',
    ),
    'by way of another module': (
        'mine:PullUp',
        'from pull_up import PullUp',
        "write 'pull_up:PullUp'",
    ),
}


@pytest.mark.parametrize('case', BROKEN)
def test_a_class_that_cannot_be_flown_is_told(case: str, folder: Path) -> None:
    profile, code, sentence = BROKEN[case]
    (folder / 'mine.py').write_text(code)
    sys.modules.pop('mine', None)
    with pytest.raises(ConfigError) as caught:
        parse_maneuver({'profile': profile, 'peak': 4.0})
    assert sentence in str(caught.value)
    assert str(caught.value).startswith('maneuver')
    assert str(folder) not in sys.path


@pytest.mark.parametrize(
    ('returned', 'sentence'),
    [
        ('times_s[1:]', r'of shape \(101,\) for 102 times; it must be \(102,\) or \(102, 2\)'),
        ('13.0 + 0.0 * times_s', r'gives a load factor of 13 at 0 s; allowed: -3 to 12'),
        ('np.where(times_s < 0.5, 1.0, np.nan)', r'a load factor of nan at 0.5 s; allowed'),
        ('np.column_stack((times_s, 9 * times_s))', r'a lateral load factor of 3.06 at 0.34 s'),
    ],
)
def test_a_load_that_cannot_be_is_told(returned: str, sentence: str, folder: Path) -> None:
    code = blocks('maneuver', 'python')[0]
    broken = re.sub(r'        return .*', f'        return {returned}', code)
    (folder / 'pull_up.py').write_text(broken, 'utf-8')
    with pytest.raises(ManeuverError, match=sentence):
        load_grid(parse_maneuver(PULL_UP), 1.0)


@pytest.mark.usefixtures('folder')
def test_wrong_parameters_are_told_as_the_page_says() -> None:
    with pytest.raises(ConfigError) as caught:
        parse_maneuver({**PULL_UP, 'peak': 40.0})
    sentence = 'maneuver.peak = 40.0 is out of range; allowed: -3 to 12 ('
    assert str(caught.value).startswith(sentence)
    assert sentence in PAGE
