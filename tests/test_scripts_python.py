# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The scripts find a Python that fits and refuse a machine that does not.

Most tests run the real scripts with stand-ins; the slow ones make real environments.
"""

import os
import re
import shutil
import subprocess
import textwrap
from pathlib import Path

import pytest

from script_support import ROOT, Workplace, make_workplace


@pytest.fixture
def workplace(tmp_path: Path) -> Workplace:
    """A workplace with Python 3.12 and nothing set up."""
    return make_workplace(tmp_path)


@pytest.mark.parametrize(
    ('system', 'machine', 'libc', 'accepted'),
    [
        ('Linux', 'x86_64', 'glibc 2.28', True),
        ('Linux', 'x86_64', 'glibc 2.100', True),
        ('Linux', 'x86_64', 'glibc 2.27', False),
        ('Linux', 'x86_64', '', False),  # musl
        ('Linux', 'aarch64', 'glibc 2.39', False),
        ('Darwin', 'x86_64', '', False),
    ],
)
def test_platform(
    workplace: Workplace, system: str, machine: str, libc: str, accepted: bool
) -> None:
    workplace.add_command(
        'uname',
        f'#!/bin/sh\n[ "$1" = -s ] && echo {system}\n[ "$1" = -m ] && echo {machine}\ntrue\n',
    )
    workplace.add_command('getconf', f'#!/bin/sh\n[ -n "{libc}" ] && echo {libc}\n')
    done = workplace.run()
    assert (done.returncode == 0) == accepted
    if not accepted:
        assert done.returncode == 1
        assert re.fullmatch(r'This rig runs on Linux x86-64 with glibc 2\.28 .*\.\n', done.stderr)
        assert workplace.done_so_far() == []


def first_step(place: Workplace, **changes: str) -> str:
    done = place.run(**changes)
    assert done.returncode == 0, done.stderr
    return place.done_so_far()[0]


def test_python_3_12_is_preferred_then_3_13_then_3_11(workplace: Workplace) -> None:
    workplace.add_python(11)
    workplace.add_python(13)
    assert first_step(workplace) == 'venv 3.12'
    shutil.rmtree(workplace.venv)
    (workplace.commands / 'python3.12').write_text('#!/bin/sh\nexit 127\n')  # as pyenv's shims
    assert first_step(workplace) == 'venv 3.13'
    shutil.rmtree(workplace.venv)
    (workplace.commands / 'python3.13').unlink()
    assert first_step(workplace) == 'venv 3.11'


def test_a_mere_python3_will_do(workplace: Workplace) -> None:
    (workplace.commands / 'python3.12').write_text('#!/bin/sh\nexit 127\n')
    workplace.add_python(13, name='python3')
    assert first_step(workplace) == 'venv 3.13'


def test_python_is_found_in_pyenv(workplace: Workplace) -> None:
    (workplace.commands / 'python3.12').write_text('#!/bin/sh\nexit 127\n')
    folder = workplace.root / 'home' / '.pyenv' / 'versions' / '3.12.1' / 'bin'
    workplace.add_python(12, folder, 'python3')
    assert first_step(workplace) == 'venv 3.12'


def test_the_user_may_name_a_python(workplace: Workplace, tmp_path: Path) -> None:
    python = workplace.add_python(11, tmp_path / 'own')
    assert first_step(workplace, ROTOR_RIG_PYTHON=str(python)) == 'venv 3.11'


def test_no_python_is_one_sentence(workplace: Workplace) -> None:
    (workplace.commands / 'python3.12').write_text('#!/bin/sh\nexit 127\n')
    done = workplace.run()
    assert done.returncode == 1
    assert re.fullmatch(r'No usable Python was found: install 3\.12 .*\n', done.stderr)


@pytest.mark.parametrize('minor', [10, 14])
def test_a_python_of_another_version_is_refused(workplace: Workplace, minor: int) -> None:
    python = workplace.add_python(minor)
    done = workplace.run(ROTOR_RIG_PYTHON=str(python))
    assert done.returncode == 1
    assert re.fullmatch(r'ROTOR_RIG_PYTHON = .* is not usable: .*\n', done.stderr)
    assert workplace.done_so_far() == []


def other_python(minor: int) -> str:
    """Return an interpreter of this machine, or skip the test."""
    interpreters = [f'python3.{minor}']
    interpreters += map(
        str, Path('~/.pyenv/versions').expanduser().glob(f'3.{minor}.*/bin/python3')
    )
    for interpreter in interpreters:
        search = f'. scripts/env; usable_python "{interpreter}" {minor}'
        done = subprocess.run(
            ['bash', '-c', search], cwd=ROOT, capture_output=True, text=True, check=False
        )
        if done.returncode == 0:
            return done.stdout.strip()
    pytest.skip(f'this machine has no Python 3.{minor}')


@pytest.mark.slow
@pytest.mark.parametrize('minor', [11, 13])
def test_the_lock_installs_on_other_pythons(minor: int, tmp_path: Path) -> None:
    """The real thing, in a new environment: the rig starts, ROS 2 works, nothing is missing."""
    environment = {
        **os.environ,
        'ROTOR_RIG_PYTHON': other_python(minor),
        'ROTOR_RIG_VENV': str(tmp_path / 'venv'),
    }
    check = """
        import sys, numba, rclpy, rerun, scipy
        from sensor_msgs.msg import PointCloud2
        rclpy.init()
        rclpy.create_node('probe').create_publisher(PointCloud2, 'probe', 1)
        rclpy.shutdown()
        print('Python 3.%d' % sys.version_info.minor)
    """
    commands = f"""
        . scripts/env
        set_up
        python - <<'PYTHON'\n{textwrap.dedent(check)}\nPYTHON
        rotor-rig scenario check climb_dive >&2
        uv pip check --quiet
        start=$SECONDS; scripts/run --help >/dev/null; echo $((SECONDS - start))
    """
    done = subprocess.run(
        ['bash', '-c', commands],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    version, second_start_s = done.stdout.splitlines()
    assert version == f'Python 3.{minor}'
    # "a second start takes seconds"; the environment itself takes some tenths, the rest is Python
    assert int(second_start_s) < 15
