# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""docs/extending/element.md as a reader follows it: the file, the plant, the name."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest

from extending_support import blocks, installed, page, run
from rotor_common.errors import ConfigError
from rotor_sim.plant import CompiledPlant, Instant, Plant

MOUNT = {
    'kind': 'hardening_mount:HardeningMount',
    'node': 'disk',
    'stiffness_n_m': 1e6,
    'hardening_m': 1e-3,
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the page's reader, who stands in it."""
    (tmp_path / 'hardening_mount.py').write_text(blocks('element', 'python')[0], 'utf-8')
    monkeypatch.chdir(tmp_path)
    monkeypatch.delitem(sys.modules, 'hardening_mount', raising=False)
    return tmp_path


def plant(**changes: object) -> CompiledPlant:
    nodes = {'disk': {'mass_kg': 10.0}}
    return CompiledPlant(Plant.from_mapping({'nodes': nodes, 'elements': [{**MOUNT, **changes}]}))


@pytest.mark.usefixtures('folder')
def test_the_example_prints_what_it_says(capsys: pytest.CaptureFixture[str]) -> None:
    example = blocks('element', 'python')[1]
    exec(compile(example, 'element.md', 'exec'), {})  # noqa: S102 - our own documentation
    said = re.findall(r'print\(.*# (.*)', example)
    assert capsys.readouterr().out.splitlines() == said


@pytest.mark.usefixtures('folder')
def test_force_and_tangent_are_those_of_the_closed_form() -> None:
    state = np.array([3e-4, -2e-4, 0.0, 0.0])
    r = state[:2]
    share = r @ r / 1e-6
    found = plant()
    np.testing.assert_allclose(found.acceleration(state), -1e5 * (1 + share) * r, rtol=1e-14)
    expected = -1e5 * ((1 + share) * np.eye(2) + 2.0 * np.outer(r, r) / 1e-6)
    np.testing.assert_allclose(found.jacobian(state)[:, :2], expected, rtol=1e-14)
    softer = Instant(live={'hardening_mount_1.stiffness_n_m': 5e5})
    np.testing.assert_allclose(
        found.acceleration(state, softer), 0.5 * found.acceleration(state), rtol=1e-15
    )


@pytest.mark.usefixtures('folder')
def test_bad_values_are_refused_like_any_other() -> None:
    with pytest.raises(ConfigError, match=r'hardening_m = 2\.0 is out of range'):
        plant(hardening_m=2.0)
    with pytest.raises(ConfigError, match=r"'shaft' is no node of the plant"):
        plant(node='shaft')


def test_an_entry_point_names_it(tmp_path: Path) -> None:
    site = installed('element', 'hardening_mount', tmp_path)
    script = (
        'from rotor_sim.plant.registry import element_kinds, find_element; '
        "print('hardening_mount' in element_kinds(), find_element('hardening_mount').__name__)"
    )
    assert run(sys.executable, '-c', script, path=site, cwd=tmp_path) == 'True HardeningMount\n'


def test_the_table_of_parts_has_it() -> None:
    assert '(element.md)' in page('README')
