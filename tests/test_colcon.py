# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The workspace is an ordinary colcon workspace: built in a copy, used from its install folder."""

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from rig_support import shared_folder

SOURCES = Path(__file__).resolve().parent.parent / 'ros_ws' / 'src'
PACKAGES = tuple(tomllib.loads((SOURCES.parent / 'packages.toml').read_text())['packages'])
EXECUTABLES = (
    'maneuver_gen/maneuver_gen_node',
    'rotor_sim/rotor_sim_node',
    'vibration_monitor/vibration_monitor_node',
    'rotor_recording/recorder_node',
    'rotor_view/viewer_node',
    'rotor_bringup/rotor-rig',
)

pytestmark = pytest.mark.slow


def in_shell(
    commands: str, folder: Path, *, timeout_s: float = 300.0
) -> subprocess.CompletedProcess[str]:
    """Run bash commands in `folder` as somebody with this Python, but none of our settings."""
    environment = {
        'HOME': str(folder),
        'PATH': f'{Path(sys.executable).parent}:{os.environ["PATH"]}',
        'AMENT_PREFIX_PATH': sys.prefix,
    }
    return subprocess.run(
        ['bash', '-c', f'set -e; {commands}'],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=timeout_s,
    )


@pytest.fixture(scope='module')
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A built copy of ros_ws."""
    leftovers = shutil.ignore_patterns('__pycache__', '*.egg-info', 'build', 'install', 'log')
    with shared_folder(tmp_path_factory, 'ros_ws') as (folder, is_new):
        if is_new:
            shutil.copytree(SOURCES, folder / 'src', ignore=leftovers)
            built = in_shell('colcon build', folder)
            assert built.returncode == 0, built.stdout + built.stderr
    return folder


@pytest.mark.parametrize('package', PACKAGES)
def test_package_is_installed_whole(workspace: Path, package: str) -> None:
    prefix = workspace / 'install' / package
    share = prefix / 'share'
    assert (share / 'ament_index' / 'resource_index' / 'packages' / package).is_file()
    assert (share / package / 'package.xml').is_file()
    for kind in ('launch/*.launch.py', 'config/*.yaml'):
        source = {path.name for path in (SOURCES / package).glob(kind)}
        assert {path.name for path in (share / package).glob(kind)} == source

    (code,) = prefix.glob(f'lib/python3.*/site-packages/{package}')
    kept = [
        path.relative_to(SOURCES / package / package)
        for path in (SOURCES / package / package).rglob('*')
        if path.is_file() and path.suffix in {'.py', '.yaml', '.typed'}
    ]
    missing = [path for path in kept if not (code / path).is_file()]
    assert missing == []
    assert (code / 'py.typed').is_file()


@pytest.mark.parametrize('executable', EXECUTABLES)
def test_executable_is_where_ros2_run_looks(workspace: Path, executable: str) -> None:
    package, name = executable.split('/')
    path = workspace / 'install' / package / 'lib' / package / name
    assert os.access(path, os.X_OK)


def test_code_comes_from_the_workspace_and_not_from_the_virtual_environment(
    workspace: Path,
) -> None:
    show = f'import {", ".join(PACKAGES)}; print(*(eval(name).__file__ for name in {PACKAGES}))'
    done = in_shell(f'source install/setup.bash; python -c "{show}"', workspace)
    assert done.returncode == 0, done.stderr
    folders = done.stdout.split()
    assert len(folders) == len(PACKAGES)
    assert all(folder.startswith(f'{workspace}/install/') for folder in folders)


def test_command_line_works_from_the_workspace(workspace: Path) -> None:
    rotor_rig = 'install/rotor_bringup/lib/rotor_bringup/rotor-rig'
    done = in_shell(f'source install/setup.bash; {rotor_rig} scenario check climb_dive', workspace)
    assert done.returncode == 0, done.stderr


def test_node_starts_from_the_workspace_and_refuses_nonsense(workspace: Path) -> None:
    """An impossible parameter ends the node with its own sentence, so ROS and our code ran."""
    node = 'install/maneuver_gen/lib/maneuver_gen/maneuver_gen_node'
    commands = f'source install/setup.bash; {node} --ros-args -p lead_s:=99.0'
    done = in_shell(f'export ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST; {commands}', workspace)
    assert done.returncode == 2, done.stderr
    assert 'lead_s = 99 is out of range' in done.stderr
