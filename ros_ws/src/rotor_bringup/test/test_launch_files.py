# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The launch files build the right nodes.

`launch` and `launch_ros` are in no package registry, so stand-ins with the same names note what
the files build. (With the real ones, from source, all four were started and stopped by hand.)
"""

import ast
import importlib.util
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import yaml

from rotor_common.errors import RigError
from rotor_common.leftovers import remove_leftovers
from rotor_rig.scenario_model import DEFAULT_SCENARIO

SOURCES = Path(__file__).resolve().parents[2]
LAUNCH_FILES = sorted(SOURCES.glob('*/launch/*.launch.py'))
NODE_MODULES = {
    'maneuver_gen': 'maneuver_gen/maneuver_gen/node.py',
    'rotor_sim': 'rotor_sim/rotor_sim/node.py',
    'vibration_monitor': 'vibration_monitor/vibration_monitor/node.py',
    'recorder': 'rotor_recording/rotor_recording/recorder_node.py',
    'viewer': 'rotor_view/rotor_view/viewer_node.py',
}


class Noted:
    """Stands in for any class or function of launch: keeps what it was called with."""

    def __init__(self, *positional: Any, **named: Any) -> None:
        self.positional = positional
        self.named = named


class LaunchConfiguration(Noted):
    """Stands in for the value of a launch argument."""

    def perform(self, context: dict[str, str]) -> str:
        return context[self.positional[0]]


@pytest.fixture
def stand_ins(monkeypatch: pytest.MonkeyPatch) -> dict[str, type[Noted]]:
    """Put the stand-ins where the launch files import them from; return the classes by name."""
    return put_stand_ins(monkeypatch)


def put_stand_ins(monkeypatch: pytest.MonkeyPatch) -> dict[str, type[Noted]]:
    contents = {
        'launch': ['LaunchContext', 'LaunchDescription'],
        'launch.actions': ['DeclareLaunchArgument', 'EmitEvent', 'OpaqueFunction', 'Shutdown'],
        'launch.events': ['matches_action'],
        'launch.events.process': ['SignalProcess'],
        'launch.substitutions': ['LaunchConfiguration', 'PathJoinSubstitution'],
        'launch_ros': [],
        'launch_ros.actions': ['Node'],
        'launch_ros.substitutions': ['FindPackageShare'],
    }
    classes: dict[str, type[Noted]] = {'LaunchConfiguration': LaunchConfiguration}
    for module_name, names in contents.items():
        module = ModuleType(module_name)
        for name in names:
            classes.setdefault(name, type(name, (Noted,), {}))
            setattr(module, name, classes[name])
        monkeypatch.setitem(sys.modules, module_name, module)
    return classes


def description_of(path: Path) -> list[Any]:
    """Return the entities of the launch description that a launch file generates."""
    spec = importlib.util.spec_from_file_location(path.name.replace('.', '_'), path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    entities = module.generate_launch_description().positional[0]
    assert isinstance(entities, list)
    return entities


def declared_arguments(entities: list[Any], classes: dict[str, type[Noted]]) -> dict[str, Any]:
    """Return the defaults of the declared arguments by name."""
    return {
        entity.positional[0]: entity.named['default_value']
        for entity in entities
        if isinstance(entity, classes['DeclareLaunchArgument'])
    }


def declared_parameters(node: str) -> set[str]:
    """Return the names that a node's source passes to ros.declare."""
    tree = ast.parse((SOURCES / NODE_MODULES[node]).read_text())
    return {
        call.args[1].value
        for call in ast.walk(tree)
        if isinstance(call, ast.Call)
        and isinstance(call.func, ast.Attribute)
        and call.func.attr == 'declare'
        and isinstance(call.args[1], ast.Constant)
        and isinstance(call.args[1].value, str)
    }


def is_console_script(package: str, executable: str) -> bool:
    return f"'{executable} = {package}." in (SOURCES / package / 'setup.py').read_text()


def test_every_package_with_a_node_has_a_launch_file() -> None:
    assert {path.parent.parent.name for path in LAUNCH_FILES} == {
        'maneuver_gen', 'rotor_bringup', 'rotor_sim', 'vibration_monitor'
    }  # fmt: skip


@pytest.mark.parametrize('package', ['maneuver_gen', 'rotor_sim', 'vibration_monitor'])
def test_a_single_node_gets_its_parameter_file(
    package: str, stand_ins: dict[str, type[Noted]]
) -> None:
    entities = description_of(SOURCES / package / 'launch' / f'{package}.launch.py')
    (node,) = [entity for entity in entities if isinstance(entity, stand_ins['Node'])]
    assert node.named['package'] == package
    assert is_console_script(package, node.named['executable'])
    assert node.named['parameters'][0].positional == ('params_file',)

    share, folder, file = declared_arguments(entities, stand_ins)['params_file'].positional[0]
    assert share.positional == (package,)
    sections = yaml.safe_load((SOURCES / package / folder / file).read_text())
    assert list(sections) == [f'/**/{package}']
    parameters = sections[f'/**/{package}']['ros__parameters']
    assert set(parameters) <= declared_parameters(package)


@pytest.fixture
def context(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """The arguments of rig.launch.py as somebody might give them; its file goes to tmp_path."""
    monkeypatch.setattr(tempfile, 'tempdir', str(tmp_path))
    return {
        'scenario': DEFAULT_SCENARIO,
        'duration': '3',
        'rate': '2',
        'record': str(tmp_path / 'bag'),
        'namespace': 'rig_1',
    }


def rig_nodes(classes: dict[str, type[Noted]], context: dict[str, str]) -> list[Any]:
    entities = description_of(SOURCES / 'rotor_bringup' / 'launch' / 'rig.launch.py')
    assert set(declared_arguments(entities, classes)) == set(context)
    (opaque,) = [entity for entity in entities if isinstance(entity, classes['OpaqueFunction'])]
    nodes = opaque.named['function'](context)
    assert isinstance(nodes, list)
    return nodes


def test_the_rig_starts_four_nodes_with_the_parameters_of_the_scenario(
    stand_ins: dict[str, type[Noted]], context: dict[str, str]
) -> None:
    nodes = rig_nodes(stand_ins, context)
    assert {node.named['executable'] for node in nodes} == {
        'maneuver_gen_node', 'rotor_sim_node', 'vibration_monitor_node', 'recorder_node'
    }  # fmt: skip
    assert all(is_console_script(node.named['package'], node.named['executable']) for node in nodes)

    (file,) = {node.named['parameters'][0] for node in nodes}
    sections = yaml.safe_load(Path(file).read_text())
    assert set(sections) == {f'/**/{node}' for node in NODE_MODULES}
    for node in NODE_MODULES:
        parameters = sections[f'/**/{node}']['ros__parameters']
        assert set(parameters) <= declared_parameters(node)
    simulator = sections['/**/rotor_sim']['ros__parameters']
    assert (simulator['duration_s'], simulator['rate']) == (3.0, 2.0)
    assert sections['/**/recorder']['ros__parameters']['path'] == context['record']
    assert len({sections[f'/**/{node}']['ros__parameters']['run_id'] for node in NODE_MODULES}) == 1
    assert all('__ns:=/rig_1' in node.named['arguments'] for node in nodes)


def test_the_end_of_the_simulator_ends_the_monitor_first(
    stand_ins: dict[str, type[Noted]], context: dict[str, str]
) -> None:
    nodes = {node.named['executable']: node for node in rig_nodes(stand_ins, context)}
    first = nodes.pop('rotor_sim_node').named['on_exit']
    assert isinstance(first, stand_ins['EmitEvent'])
    target = first.named['event'].named['process_matcher'].positional[0]
    assert target is nodes['vibration_monitor_node']
    assert all(isinstance(node.named['on_exit'], stand_ins['Shutdown']) for node in nodes.values())


LAUNCHED = """
import sys, pytest, test_launch_files as launch
nodes = launch.rig_nodes(launch.put_stand_ins(pytest.MonkeyPatch()), {
    'scenario': launch.DEFAULT_SCENARIO, 'duration': '3', 'rate': '1', 'record': 'bag',
    'namespace': '',
})
print(nodes[0].named['parameters'][0], flush=True)
sys.stdin.read()
"""


@pytest.mark.slow
@pytest.mark.parametrize('is_killed', [False, True])
def test_the_folder_of_a_launch_goes_with_it_or_at_the_next_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_killed: bool
) -> None:
    monkeypatch.setattr(tempfile, 'tempdir', str(tmp_path))
    with subprocess.Popen(
        [sys.executable, '-c', LAUNCHED],
        cwd=Path(__file__).parent,
        env={**os.environ, 'TMPDIR': str(tmp_path)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as launched:
        assert launched.stdin is not None
        assert launched.stdout is not None
        folder = Path(launched.stdout.readline().strip()).parent
        assert folder.parent == tmp_path
        remove_leftovers()
        assert folder.exists(), 'it is in use'
        if is_killed:
            launched.kill()
        launched.stdin.close()
        launched.wait(300)
    assert folder.exists() == is_killed
    remove_leftovers()
    assert not folder.exists()


def test_a_wrong_scenario_starts_nothing(
    stand_ins: dict[str, type[Noted]], context: dict[str, str]
) -> None:
    with pytest.raises(RigError, match='nowhere'):
        rig_nodes(stand_ins, {**context, 'scenario': 'nowhere'})
