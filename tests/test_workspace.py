# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The furniture of the workspace agrees with the code: dependencies, manifests, data, headers."""

import ast
import fnmatch
import importlib.util
import re
import subprocess
import sys
import tomllib
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parent.parent
SOURCES = ROOT / 'ros_ws' / 'src'
PACKAGES = tuple(tomllib.loads((SOURCES.parent / 'packages.toml').read_text())['packages'])
MAY_IMPORT = {package: set(PACKAGES[:place]) for place, package in enumerate(PACKAGES)}
"""Bottom first: imports run downwards only."""
ROS_ADAPTERS = ('*.node', '*_node', 'rotor_interfaces.ros',
                'rotor_interfaces.run_topics', 'rotor_bringup.live',
                'rotor_bringup.composed')  # fmt: skip
"""The only modules that may import rclpy."""
DISTRIBUTION = {
    'PIL': 'pillow',
    'mcap_ros2': 'mcap-ros2-support',
    'mpl_toolkits': 'matplotlib',
    'rerun': 'rerun-sdk',
    'rerun_cli': 'rerun-sdk',
    'yaml': 'pyyaml',
}
"""Where a module's name is not that of the distribution that brings it."""
ROS_PACKAGE = re.compile(r'rclpy|launch|launch_ros|ament_index_python|\w+_(msgs|interfaces)')
ROSDEP_KEYS = {
    'numpy': 'python3-numpy',
    'pillow': 'python3-pil',
    'pyyaml': 'python3-yaml',
    'scipy': 'python3-scipy',
}


def setup_arguments(package: str) -> dict[str, Any]:
    """Return the literal arguments of setup() in a package's setup.py."""
    tree = ast.parse((SOURCES / package / 'setup.py').read_text())
    call = next(
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and getattr(node.func, 'id', '') == 'setup'
    )
    wanted = {'version', 'install_requires', 'extras_require', 'entry_points', 'python_requires'}
    return {
        keyword.arg: ast.literal_eval(keyword.value)
        for keyword in call.keywords
        if keyword.arg in wanted
    }


def manifest(package: str) -> ET.Element:
    """Return the parsed package.xml."""
    return ET.parse(SOURCES / package / 'package.xml').getroot()  # noqa: S314 - our own file


def modules(package: str) -> Iterator[tuple[str, ast.Module]]:
    """Yield (dotted name, syntax tree) of every module of a package."""
    for path in sorted((SOURCES / package / package).rglob('*.py')):
        parts = path.relative_to(SOURCES / package).with_suffix('').parts
        name = '.'.join(parts).removesuffix('.__init__')
        yield name, ast.parse(path.read_text())


def imported(tree: ast.AST) -> set[str]:
    """Return the top-level names of everything that is imported absolutely, anywhere."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition('.')[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module.partition('.')[0])
    return found


def message_packages(tree: ast.AST) -> set[str]:
    """Return the packages of message types that are named in text, such as std_msgs/msg/String."""
    texts = (
        node.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    )
    matches = (re.fullmatch(r'(\w+)/msg/\w+', text) for text in texts)
    return {match[1] for match in matches if match}


def imports_of(package: str) -> set[str]:
    """Return what the modules of a package import, the package itself and Python aside."""
    found = set().union(*(imported(tree) for _, tree in modules(package)))
    return found - {package} - set(sys.stdlib_module_names)


def requirement_names(requirements: list[str]) -> set[str]:
    """Return the canonical names of requirements."""
    return {canonicalize_name(Requirement(text).name) for text in requirements}


@pytest.mark.parametrize('package', PACKAGES)
def test_manifest_is_complete(package: str) -> None:
    root = manifest(package)
    assert root.get('format') == '3'
    assert root.findtext('name') == package
    assert root.findtext('license') == 'Apache-2.0'
    assert root.findtext('maintainer') == 'The cracked rotor rig authors'
    assert root.findtext('export/build_type') == 'ament_python'
    assert root.findtext('version') == setup_arguments(package)['version']
    folder = SOURCES / package
    assert (folder / 'resource' / package).is_file()
    assert (folder / package / 'py.typed').is_file()
    assert (folder / 'setup.cfg').read_text().count(f'$base/lib/{package}\n') == 2
    assert list((folder / 'test').glob('test_*.py')), 'a package without tests'


@pytest.mark.slow
def test_package_files_are_those_of_the_template() -> None:
    done = subprocess.run(
        [sys.executable, ROOT / 'scripts' / 'package_files.py', '--check'],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert {path.parent.name for path in SOURCES.glob('*/package.xml')} == set(PACKAGES)


def test_all_packages_have_one_version_and_python_range() -> None:
    declared = [setup_arguments(package) for package in PACKAGES]
    assert len({arguments['version'] for arguments in declared}) == 1
    assert len({arguments['python_requires'] for arguments in declared}) == 1


@pytest.mark.parametrize('package', PACKAGES)
def test_setup_declares_exactly_what_is_imported(package: str) -> None:
    wanted = {
        canonicalize_name(DISTRIBUTION.get(name, name))
        for name in imports_of(package)
        if not ROS_PACKAGE.fullmatch(name) or name in PACKAGES
    }
    assert requirement_names(setup_arguments(package)['install_requires']) == wanted


@pytest.mark.slow
def test_test_extra_declares_what_tests_import() -> None:
    folders = [ROOT / 'tests', ROOT / 'docs', ROOT / 'benchmarks']
    folders += [SOURCES / package / 'test' for package in PACKAGES]
    paths = [path for folder in folders for path in folder.rglob('*.py')]
    used = set().union(*(imported(ast.parse(path.read_text())) for path in paths))
    used -= {path.stem for path in paths} | set(PACKAGES) | set(sys.stdlib_module_names)
    declared = requirement_names(setup_arguments('rotor_bringup')['extras_require']['test'])
    for package in PACKAGES:
        declared |= requirement_names(setup_arguments(package)['install_requires'])
    peers = (ROOT / 'benchmarks/requirements.txt').read_text().splitlines()
    declared |= requirement_names([line for line in peers if not line.startswith('#')])
    names = {canonicalize_name(DISTRIBUTION.get(name, name)) for name in used}
    assert {name for name in names if not ROS_PACKAGE.fullmatch(name.replace('-', '_'))} <= declared


@pytest.mark.parametrize('package', PACKAGES)
def test_manifest_depends_on_exactly_what_is_used(package: str) -> None:
    used = {name for name in imports_of(package) if ROS_PACKAGE.fullmatch(name)}
    used |= MAY_IMPORT[package] & imports_of(package)
    used = used.union(*(message_packages(tree) for _, tree in modules(package)))
    for path in (SOURCES / package / 'launch').glob('*.launch.py'):
        used |= {
            name for name in imported(ast.parse(path.read_text())) if ROS_PACKAGE.fullmatch(name)
        }
    requirements = requirement_names(setup_arguments(package)['install_requires'])
    used |= {key for name, key in ROSDEP_KEYS.items() if name in requirements}
    declared = {element.text for element in manifest(package).findall('exec_depend')}
    assert declared == used


@pytest.mark.parametrize('package', PACKAGES)
def test_own_packages_are_required_in_this_very_version(package: str) -> None:
    arguments = setup_arguments(package)
    own = [text for text in arguments['install_requires'] if text.partition('=')[0] in PACKAGES]
    assert all(text.endswith(f'=={arguments["version"]}') for text in own), own


@pytest.mark.parametrize('package', PACKAGES)
def test_imports_run_one_way(package: str) -> None:
    assert imports_of(package) & set(PACKAGES) <= MAY_IMPORT[package]


IN_CIRCLES = {
    'rotor_dynamics.sweep_commands': {'rotor_dynamics.sweep_runs'},
    'rotor_dynamics.sweep_runs': {'rotor_dynamics.sweep_commands'},
}
"""Modules that still import one another."""


def imports_that_run(tree: ast.AST, known: Collection[str]) -> Iterator[str]:
    """Yield the known modules that are imported, by functions too, but not for types alone."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and getattr(node.test, 'id', '') == 'TYPE_CHECKING':
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                names = (f'{node.module}.{alias.name}', node.module or '')
                yield from [name for name in names if name in known][:1]
        yield from imports_that_run(node, known)


@pytest.mark.parametrize('package', PACKAGES)
def test_modules_do_not_import_one_another_in_a_circle(package: str) -> None:
    """An import in a function counts; one for the type checker does not, since it never runs."""
    trees = dict(modules(package))
    found = {name: set(imports_that_run(tree, trees)) - {name} for name, tree in trees.items()}
    while leaves := {name for name, others in found.items() if not others}:
        found = {name: others - leaves for name, others in found.items() if name not in leaves}
    while tops := found.keys() - set().union(*found.values()):
        found = {name: others for name, others in found.items() if name not in tops}
    assert found == {name: v for name, v in IN_CIRCLES.items() if name.startswith(package)}


def test_only_adapters_import_ros() -> None:
    guilty = [
        name
        for package in PACKAGES
        for name, tree in modules(package)
        if any(
            'rclpy' in imported(statement)
            for statement in tree.body
            if isinstance(statement, ast.Import | ast.ImportFrom)
        )
        and not any(fnmatch.fnmatch(name, pattern) for pattern in ROS_ADAPTERS)
    ]
    assert guilty == []


WITHOUT_ROS = """
import importlib, sys

class NoRos:
    def find_spec(self, name, path=None, target=None):
        root = name.partition('.')[0]
        if root == 'rclpy' or root.endswith('_msgs'):
            raise ModuleNotFoundError(f'{name} is hidden', name=name)

sys.meta_path.insert(0, NoRos())
for name in sys.argv[1:]:
    importlib.import_module(name)
"""


@pytest.mark.slow
def test_pure_modules_import_without_ros() -> None:
    names = [
        name
        for package in PACKAGES
        for name, _ in modules(package)
        if not any(fnmatch.fnmatch(name, pattern) for pattern in ROS_ADAPTERS)
    ]
    assert len(names) > len(PACKAGES)
    done = subprocess.run(
        [sys.executable, '-c', WITHOUT_ROS, *names], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def console_scripts() -> list[tuple[str, str]]:
    """Return (command, target) of every console script of every package."""
    return [
        (command.strip(), target.strip())
        for package in PACKAGES
        for line in setup_arguments(package).get('entry_points', {}).get('console_scripts', [])
        for command, _, target in [line.partition('=')]
    ]


def test_console_scripts_have_names_of_their_own() -> None:
    commands = [command for command, _ in console_scripts()]
    assert len(commands) == len(set(commands))
    assert 'rotor-rig' in commands


@pytest.mark.parametrize(('command', 'target'), console_scripts())
def test_console_script_leads_somewhere(command: str, target: str) -> None:
    module, _, function = target.partition(':')
    spec = importlib.util.find_spec(module)
    assert spec is not None, command
    assert spec.origin is not None
    defined = ast.parse(Path(spec.origin).read_text()).body
    assert function in [node.name for node in defined if isinstance(node, ast.FunctionDef)]


def locked() -> dict[str, list[Requirement]]:
    """Return the requirements of the lock by canonical name."""
    found: dict[str, list[Requirement]] = {}
    for line in (ROOT / 'requirements.lock').read_text().splitlines():
        if line and not line.startswith((' ', '#')):
            requirement = Requirement(line.removesuffix('\\'))
            found.setdefault(canonicalize_name(requirement.name), []).append(requirement)
    return found


@pytest.mark.parametrize('package', PACKAGES)
@pytest.mark.parametrize('python', ['3.11', '3.12', '3.13'])
def test_lock_satisfies_what_setup_declares(package: str, python: str) -> None:
    arguments = setup_arguments(package)
    extras = arguments.get('extras_require', {})
    declared = sum(extras.values(), arguments['install_requires'])
    environment = {'python_version': python, 'python_full_version': f'{python}.0'}
    lock = locked()
    for requirement in map(Requirement, declared):
        if requirement.name in PACKAGES:
            continue
        pins = [
            pin
            for pin in lock[canonicalize_name(requirement.name)]
            if pin.marker is None or pin.marker.evaluate(environment)
        ]
        assert len(pins) == 1, requirement
        version = str(pins[0].specifier).removeprefix('==')
        assert requirement.specifier.contains(version, prereleases=True), requirement


def test_lock_is_hashed_and_names_no_place() -> None:
    text = (ROOT / 'requirements.lock').read_text()
    entries = re.split(r'\n(?=\S)', text.partition('\n')[2].strip())
    assert len(entries) > 50
    for entry in entries:
        lines = entry.split(' \\\n')
        assert re.fullmatch(
            r'[\w.-]+(\[\w+\])?==[\w.]+( ; python_full_version [<>=]+ .+)?', lines[0]
        )
        assert len(lines) > 1, f'{lines[0]} has no hash'
        assert all(re.fullmatch(r'    --hash=sha256:[0-9a-f]{64}', line) for line in lines[1:])


def test_lock_brings_nothing_of_great_weight_by_accident() -> None:
    assert not {'torch', 'jax', 'tensorflow', *PACKAGES} & set(locked())


def test_every_source_file_says_whose_it_is() -> None:
    header = ('# Copyright 2026 The cracked rotor rig authors',
              '# SPDX-License-Identifier: Apache-2.0')  # fmt: skip
    folders = [SOURCES, *(ROOT / name for name in ('tests', 'docs', 'benchmarks', 'scripts'))]
    paths = [path for folder in folders for path in folder.rglob('*.py')]
    paths += [*(ROOT / 'scripts').iterdir(), ROOT / '.ci' / 'run']
    assert len(paths) > 50
    for path in paths:
        if 'build' in path.parts or 'install' in path.parts:
            continue
        lines = path.read_text().splitlines()
        if lines and lines[0].startswith('#!'):
            del lines[0]
        assert tuple(lines[:2]) == header, path


def test_test_files_have_names_of_their_own() -> None:
    """Without __init__.py two test modules of one name would shadow each other."""
    folders = [ROOT / 'tests', *(SOURCES / package / 'test' for package in PACKAGES)]
    names = [path.name for folder in folders for path in folder.rglob('*.py')]
    twins = {name for name in names if names.count(name) > 1} - {'conftest.py'}
    assert twins == set()


def test_one_name_means_one_class() -> None:
    """Maneuvers and families of indicators have the plain names of what they are."""
    places: dict[str, list[str]] = {}
    for package in PACKAGES:
        for module, tree in modules(package):
            if module.startswith(('maneuver_gen.maneuvers.', 'vibration_monitor.indicators.')):
                continue
            for node in tree.body:
                if isinstance(node, ast.ClassDef) and not node.name.startswith('_'):
                    places.setdefault(node.name, []).append(module)
    assert {name: found for name, found in places.items() if len(found) > 1} == {}
