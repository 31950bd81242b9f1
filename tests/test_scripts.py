# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""scripts/run and scripts/test set themselves up once and repair what is broken.

The real scripts run with stand-ins that note what they were asked to do.
"""

import os
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from script_support import EVERYTHING, ROOT, Workplace, make_workplace

SCRIPTS = ('run', 'test', 'lock', 'env', 'install_viewer_packages')


@pytest.fixture
def workplace(tmp_path: Path) -> Workplace:
    """A workplace with Python 3.12 and nothing set up."""
    return make_workplace(tmp_path)


@pytest.mark.parametrize('script', [*(f'scripts/{name}' for name in SCRIPTS), '.ci/run'])
def test_script_is_well_formed(script: str) -> None:
    path = ROOT / script
    subprocess.run(['bash', '-n', path], check=True)
    assert max(len(line) for line in path.read_text().splitlines()) <= 100
    assert os.access(path, os.X_OK) == (script != 'scripts/env')


def test_no_script_calls_sudo() -> None:
    for name in SCRIPTS:
        lines = (ROOT / 'scripts' / name).read_text().splitlines()
        assert not [
            line for line in lines if 'sudo' in line and not line.lstrip().startswith('echo')
        ]


def test_first_start_sets_everything_up_and_the_second_nothing(workplace: Workplace) -> None:
    first = workplace.run('--duration', '3 s')
    assert first.returncode == 0, first.stderr
    assert first.stdout.splitlines()[-1] == '<run><--duration><3 s>'
    assert workplace.done_so_far() == EVERYTHING

    second = workplace.run()
    assert second.returncode == 0
    assert second.stderr == ''
    assert workplace.done_so_far() == []


def test_test_script_runs_what_may_share_the_machine_and_then_the_rest(
    workplace: Workplace,
) -> None:
    shared = '-n logical --dist worksteal --durations 10'
    for arguments, expected in {
        (): [f'-m not real_time {shared}', '-m real_time --durations 10'],
        ('--quick',): [f'-m not slow and not real_time {shared}'],
        ('--quick', '-k', 'a b'): [f'-m not slow and not real_time {shared} -k a b'],
        ('-m', 'not slow'): ['-m not slow'],
    }.items():
        done = workplace.run(*arguments, script='test')
        assert done.stdout.splitlines() == [f'python -m pytest {each}' for each in expected]
    assert workplace.done_so_far() == EVERYTHING


def test_exit_code_is_that_of_the_command(workplace: Workplace) -> None:
    workplace.run()
    (workplace.venv / 'bin' / 'rotor-rig').write_text('#!/bin/sh\nexit 3\n')
    assert workplace.run().returncode == 3


def test_ros_finds_its_own_environment_and_no_other(workplace: Workplace) -> None:
    done = workplace.run(
        PYTHONPATH='/opt/ros/jazzy/lib/python3.12/site-packages',
        LD_LIBRARY_PATH='/opt/ros/jazzy/lib',
        AMENT_PREFIX_PATH='/opt/ros/jazzy',
        RMW_IMPLEMENTATION='rmw_cyclonedds_cpp',
        _ROS_WHEELS_BOOTSTRAP_COMPLETE='1',
    )
    seen = dict(line.split('=', 1) for line in done.stdout.splitlines() if '=' in line)
    assert not {'PYTHONPATH', 'LD_LIBRARY_PATH', '_ROS_WHEELS_BOOTSTRAP_COMPLETE'} & set(seen)
    assert seen['AMENT_PREFIX_PATH'] == seen['VIRTUAL_ENV'] == str(workplace.venv)
    assert seen['PATH'].startswith(f'{workplace.venv}/bin:')
    assert seen['RMW_IMPLEMENTATION'] == 'rmw_fastrtps_cpp'
    assert seen['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'LOCALHOST'
    assert Path(seen['ROS_LOG_DIR']).is_dir()


def test_what_the_user_set_for_ros_stays(workplace: Workplace, tmp_path: Path) -> None:
    done = workplace.run(
        ROS_AUTOMATIC_DISCOVERY_RANGE='SUBNET', ROS_LOG_DIR=str(tmp_path), ROS_DOMAIN_ID='7'
    )
    lines = done.stdout.splitlines()
    assert 'ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET' in lines
    assert f'ROS_LOG_DIR={tmp_path}' in lines
    assert 'ROS_DOMAIN_ID=7' in lines


def test_it_works_without_a_home(workplace: Workplace) -> None:
    environment = workplace.full_environment()
    del environment['HOME']
    done = subprocess.run([workplace.root / 'scripts' / 'run'], env=environment, check=False)
    assert done.returncode == 0


def change_lock(place: Workplace) -> None:
    with (place.root / 'requirements.lock').open('a') as lock:
        lock.write('# changed\n')


def remove_a_dependency(place: Workplace) -> None:
    (place.venv / 'lib/python3.12/site-packages/numpy-1.dist-info').rmdir()


def remove_the_interpreter(place: Workplace) -> None:
    (place.venv / 'bin/python').unlink()
    (place.venv / 'bin/python').symlink_to('/nonexistent/python3.12')


def lose_the_stamp(place: Workplace) -> None:
    (place.venv / 'rig-dependencies').unlink()


def remove_everything(place: Workplace) -> None:
    shutil.rmtree(place.venv)


def leave_an_empty_folder(place: Workplace) -> None:
    shutil.rmtree(place.venv)
    place.venv.mkdir()


@pytest.mark.parametrize(
    'damage',
    [
        change_lock,
        remove_a_dependency,
        remove_the_interpreter,
        lose_the_stamp,
        remove_everything,
        leave_an_empty_folder,
    ],
)
def test_a_changed_or_broken_environment_is_made_anew(
    workplace: Workplace, damage: Callable[[Workplace], None]
) -> None:
    workplace.run()
    workplace.done_so_far()
    damage(workplace)
    assert workplace.run().returncode == 0
    assert workplace.done_so_far() == EVERYTHING


def change_setup(place: Workplace) -> None:
    with (place.root / 'ros_ws/src/rotor_sim/setup.py').open('a') as setup:
        setup.write('# changed\n')


def remove_the_command(place: Workplace) -> None:
    (place.venv / 'bin/rotor-rig').unlink()


@pytest.mark.parametrize('damage', [change_setup, remove_the_command])
def test_only_the_own_packages_are_installed_again(
    workplace: Workplace, damage: Callable[[Workplace], None]
) -> None:
    workplace.run()
    workplace.done_so_far()
    damage(workplace)
    assert workplace.run().returncode == 0
    assert workplace.done_so_far() == ['install packages with uv']


def test_a_moved_clone_is_set_up_anew(workplace: Workplace) -> None:
    workplace.run()
    workplace.done_so_far()
    moved = workplace.root.with_name('moved')
    workplace.root.rename(moved)
    place = Workplace(moved, moved / 'commands')
    assert place.run().returncode == 0
    assert place.done_so_far() == EVERYTHING


def test_extra_packages_of_the_user_are_left_alone(workplace: Workplace) -> None:
    workplace.run()
    workplace.done_so_far()
    (workplace.venv / 'lib/python3.12/site-packages/ipython-9.dist-info').mkdir()
    workplace.run()
    assert workplace.done_so_far() == []


def test_pip_steps_in_where_uv_does_not_get_through(workplace: Workplace) -> None:
    assert workplace.run(STAND_IN_FAILURE='uv').returncode == 0
    assert workplace.done_so_far() == [
        'venv 3.12',
        'pip 1 requirement',
        'install dependencies with uv',
        'install dependencies with python',
        'install packages with uv',
    ]


def test_a_failed_installation_says_why_and_is_repaired(workplace: Workplace) -> None:
    failed = workplace.run(STAND_IN_FAILURE='uv python')
    assert failed.returncode == 1
    assert 'no network' in failed.stderr
    assert failed.stderr.splitlines()[-1].startswith('Setting up failed')
    assert 'the next start tries again' in failed.stderr
    workplace.done_so_far()
    assert workplace.run().returncode == 0
    assert workplace.done_so_far() == EVERYTHING


def wait_until_busy(place: Workplace) -> None:
    deadline = time.monotonic() + 300.0
    while not place.log_file.with_name('stand-in.log.busy').exists():
        assert time.monotonic() < deadline, 'the installation did not begin'
        time.sleep(0.02)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGKILL])
def test_an_interrupted_set_up_is_repaired(workplace: Workplace, number: signal.Signals) -> None:
    process = workplace.start(STAND_IN_SLEEP='30')
    wait_until_busy(workplace)
    os.killpg(process.pid, number)  # as Ctrl-C does: the whole foreground group
    _, err = process.communicate(timeout=300)
    if number == signal.SIGINT:
        assert process.returncode == 130
        assert 'the next start repairs it' in err
    workplace.done_so_far()
    assert workplace.run().returncode == 0
    assert workplace.done_so_far() == EVERYTHING


@pytest.mark.slow
def test_two_starts_at_once_set_up_once(workplace: Workplace) -> None:
    first = workplace.start(STAND_IN_SLEEP='1')
    wait_until_busy(workplace)
    second = workplace.start()
    outputs = [process.communicate(timeout=300) for process in (first, second)]
    assert [first.returncode, second.returncode] == [0, 0]
    assert workplace.done_so_far() == EVERYTHING
    assert 'waiting for it' in outputs[1][1]
    assert all(out.endswith('<run>') for out, _ in outputs)


def test_a_foreign_folder_is_not_touched(workplace: Workplace) -> None:
    precious = workplace.root / 'precious'
    precious.mkdir()
    (precious / 'thesis.tex').write_text('years of work')
    done = workplace.run(ROTOR_RIG_VENV=str(precious))
    assert done.returncode == 1
    assert 'did not make it' in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert (precious / 'thesis.tex').exists()


def test_the_environment_may_be_elsewhere(workplace: Workplace) -> None:
    elsewhere = workplace.root / 'not yet' / 'there'
    assert workplace.run(ROTOR_RIG_VENV=str(elsewhere)).returncode == 0
    assert (elsewhere / 'bin' / 'rotor-rig').exists()
    assert not workplace.venv.exists()


def add_apt(place: Workplace, *, user: int, installed: bool) -> None:
    status = 'installed' if installed else 'not-installed'
    place.add_command('dpkg-query', f'#!/bin/sh\necho {status}\n')
    place.add_command('id', f'#!/bin/sh\necho {user}\n')
    for command in ('apt-get', 'sudo'):
        place.add_command(command, f'#!/bin/sh\necho {command} "$@" >>"$STAND_IN_LOG"\n')


def test_viewer_packages_as_root(workplace: Workplace) -> None:
    add_apt(workplace, user=0, installed=False)
    assert workplace.run(script='install_viewer_packages').returncode == 0
    update, install = workplace.done_so_far()
    assert update.startswith('apt-get update')
    assert re.match(r'apt-get install .* --no-install-recommends .*\bxvfb\b', install)


def test_viewer_packages_as_somebody_else(workplace: Workplace) -> None:
    add_apt(workplace, user=1000, installed=False)
    done = workplace.run(script='install_viewer_packages')
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith('sudo apt-get install')
    assert workplace.done_so_far() == []


def test_viewer_packages_already_there(workplace: Workplace) -> None:
    add_apt(workplace, user=1000, installed=True)
    assert workplace.run(script='install_viewer_packages').returncode == 0
    assert workplace.done_so_far() == []
