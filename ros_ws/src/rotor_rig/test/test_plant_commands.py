# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""`rotor-rig plant`: what it says of a plant, in words, numbers and a picture."""

import json
import math
from pathlib import Path

import pytest
from typer.testing import CliRunner

from rotor_common.constants import GRAVITY_M_S2
from rotor_common.errors import RigError
from rotor_rig.plant_commands import app
from rotor_sim.plant.shipped import plant_names

RUBBED = """
description: A disk on a light shaft between two nodes.
nodes:
  left: {position_m: 0.0, mass_kg: 1.0}
  disk: {position_m: 0.3, mass_kg: 6.0}
  right: {position_m: 0.6, mass_kg: 1.0}
elements:
  - {kind: shaft_segment, node: left, other: disk, stiffness_n_m: 1.0e6}
  - {kind: shaft_segment, node: disk, other: right, stiffness_n_m: 1.0e6}
  - {kind: shaft_segment, node: left, stiffness_n_m: 1.0e8}
  - {kind: shaft_segment, node: right, stiffness_n_m: 1.0e8}
  - {kind: turning_force, name: coupling, node: left, amplitude_n: 3.0}
"""


def run(*arguments: str) -> str:
    done = CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert done.exit_code == 0
    return done.output


def test_list_has_every_plant_that_ships() -> None:
    assert list(json.loads(run('list', '--json'))) == plant_names()
    shown = run('list')
    assert all(name in shown for name in plant_names())


def test_show_gives_the_numbers_of_the_closed_form() -> None:
    found = json.loads(run('show', 'jeffcott', '--json'))
    natural = math.sqrt(8.95e5 / 6.0)
    assert found['static_deflection']['disk']['y'] == pytest.approx(6.0 * GRAVITY_M_S2 / 8.95e5)
    assert found['natural_frequencies'][0]['frequency_hz'] == pytest.approx(
        natural / (2 * math.pi), rel=1e-4
    )
    assert found['natural_frequencies'][0]['damping_ratio'] == pytest.approx(0.01, rel=2e-3)
    assert [each['speed_rad_s'] for each in found['critical_speeds']] == pytest.approx(
        [natural] * 2, rel=1e-4
    )
    assert found['degrees_of_freedom'] == ['disk.y', 'disk.z']
    assert found['live_parameters'] == {'unbalance_1.unbalance_kg_m': 3.0e-5}
    assert found['reduction'] is None


def test_show_says_what_a_reduced_plant_left_out() -> None:
    found = json.loads(run('show', 'overhung', '--highest-speed', '100', '--json'))
    kept, left_out = (found['reduction'][f'modes_{what}_hz'] for what in ('kept', 'left_out'))
    assert len(kept) == sum(name.startswith('mode_') for name in found['degrees_of_freedom'])
    assert max(kept) < min(left_out)
    assert len(found['static_deflection']) == len(found['nodes']) == 13
    shown = run('show', 'overhung', '--highest-speed', '100')
    assert f'Left out: {len(left_out)} modes' in shown
    assert 'No critical speed in the range' in shown


def test_show_prints_nodes_elements_and_modes_of_a_file(tmp_path: Path) -> None:
    path = tmp_path / 'mine.yaml'
    path.write_text(RUBBED)
    shown = run('show', str(path), '--speed', '100')
    for text in ('mine: A disk on a light shaft', 'coupling', 'stiffness_n_m = 1e+08',
                 '6 degrees of freedom', 'coupling.amplitude_n = 3',
                 'Natural frequencies at 100 rad/s', 'Critical speeds'):  # fmt: skip
        assert text in ' '.join(shown.split())


@pytest.mark.parametrize('name', ['hou2016', 'overhung', 'mine.yaml'])
def test_the_picture_names_what_is_on_the_rotor(name: str, tmp_path: Path) -> None:
    path = tmp_path / 'mine.yaml'
    path.write_text(RUBBED)
    source = str(path) if name == 'mine.yaml' else name
    pictures = [tmp_path / f'{k}.svg' for k in range(2)]
    for picture in pictures:
        run('show', source, '--highest-speed', '300', '--picture', str(picture))
    text = pictures[0].read_text()
    assert text == pictures[1].read_text()  # no dates, no random names
    words = {
        'hou2016': ['disk, 32.1 kg', 'ball_bearing_2', 'bearing_1, 4 kg', 'crack', 'unbalance'],
        'overhung': ['disk, 7.71 kg', 'housing_1, 3 kg', 'support_2', 'forward', 'speed [rpm]'],
        'mine.yaml': ['disk, 6 kg', 'coupling (turning_force)', 'shaft_segment_3'],
    }
    for word in words[name]:
        assert word in text


@pytest.mark.parametrize(
    ('arguments', 'sentence'),
    [
        (['show', 'fe_midpsan'], "plant 'fe_midpsan' is neither a file nor one of"),
        (['show', 'jeffcott', '--picture', 'rotor.gif'], '--picture rotor.gif must end in .png'),
        (['show', 'jeffcott', '--picture', 'none/r.png'], 'there is no folder none'),
    ],
)
def test_bad_input_ends_in_one_sentence(arguments: list[str], sentence: str) -> None:
    with pytest.raises(RigError, match=sentence):
        CliRunner().invoke(app, arguments, catch_exceptions=False)
