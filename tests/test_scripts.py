# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""scripts/run and scripts/test set themselves up, repair what is broken and say what they refuse.

Most tests run the real scripts with a stand-in for Python, pip and uv that installs nothing but
notes what it was asked to do; the slow ones make real environments with other Pythons.
"""

import os
import re
import shutil
import signal
import subprocess
import textwrap
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
SCRIPTS = ('run', 'test', 'lock', 'env', 'install_viewer_packages')

# A Python of version 3.$minor. Asked by scripts/env whether it fits, it says so; `-m venv` makes a
# folder with itself as python; `-m pip` brings `uv`, which is itself too and "installs" by
# making the files that a real installation would make.
PYTHON = r"""#!/bin/bash
minor=${STAND_IN_MINOR:-MINOR}
case "$*" in
    "-I - "*)
        [[ " $3 " == *" $minor "* ]] || exit 1
        echo "$0" ;;
    "-m venv "*)
        echo "venv 3.$minor" >>"$STAND_IN_LOG"
        mkdir -p "$3/bin" "$3/lib/python3.$minor/site-packages/numpy-1.dist-info"
        cp "$0" "$3/bin/python" ;;
    "-m pip install --no-deps --require-hashes -r "*uv.lock)
        echo "pip $(grep -c ==  "${!#}") requirement" >>"$STAND_IN_LOG"
        cp "$0" "${0%/*}/uv" ;;
    *--require-hashes*)
        echo "install dependencies with ${0##*/}" >>"$STAND_IN_LOG"
        touch "$STAND_IN_LOG.busy"
        sleep "${STAND_IN_SLEEP:-0}"
        if [[ ${STAND_IN_FAILURE:-} == *"${0##*/}"* ]]; then echo 'no network'; exit 1; fi ;;
    *--editable*)
        echo "install packages with ${0##*/}" >>"$STAND_IN_LOG"
        printf '#!/bin/bash\nenv\nprintf "<%%s>" "$@"\n' >"${0%/*}/rotor-rig"
        chmod +x "${0%/*}/rotor-rig" ;;
    *)
        echo "python $*" ;;
esac
"""


@dataclass
class Workplace:
    """A copy of what the scripts read, and a PATH with stand-ins first."""

    root: Path
    commands: Path
    environment: dict[str, str] = field(default_factory=dict)

    @property
    def venv(self) -> Path:
        return self.root / '.venv'

    @property
    def log_file(self) -> Path:
        return self.root / 'stand-in.log'

    def add_command(self, name: str, text: str) -> None:
        path = self.commands / name
        path.write_text(textwrap.dedent(text))
        path.chmod(0o755)

    def add_python(self, minor: int, folder: Path | None = None, name: str = '') -> Path:
        folder = folder or self.commands
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / (name or f'python3.{minor}')
        path.write_text(PYTHON.replace('MINOR', str(minor)))
        path.chmod(0o755)
        return path

    def full_environment(self, **changes: str) -> dict[str, str]:
        return {
            'PATH': f'{self.commands}:/usr/bin:/bin',
            'HOME': str(self.root / 'home'),
            'STAND_IN_LOG': str(self.log_file),
            **self.environment,
            **changes,
        }

    def start(self, *arguments: str, script: str = 'run', **changes: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [self.root / 'scripts' / script, *arguments],
            env=self.full_environment(**changes),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def run(
        self, *arguments: str, script: str = 'run', **changes: str
    ) -> subprocess.CompletedProcess[str]:
        process = self.start(*arguments, script=script, **changes)
        out, err = process.communicate(timeout=60)
        return subprocess.CompletedProcess(process.args, process.returncode, out, err)

    def done_so_far(self) -> list[str]:
        """What the stand-ins were asked to do since the last call."""
        if not self.log_file.exists():
            return []
        lines = self.log_file.read_text().splitlines()
        self.log_file.unlink()
        return lines


EVERYTHING = [
    'venv 3.12',
    'pip 1 requirement',
    'install dependencies with uv',
    'install packages with uv',
]


@pytest.fixture
def workplace(tmp_path: Path) -> Workplace:
    """A workplace whose path has a space in it, with Python 3.12 and nothing set up."""
    root = tmp_path / 'the rig'
    shutil.copytree(ROOT / 'scripts', root / 'scripts')
    for path in (ROOT / 'ros_ws' / 'src').glob('*/setup.*'):
        target = root / path.relative_to(ROOT)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, target)
    (root / 'requirements.lock').write_text(
        '# made\nnumpy==1 \\\n    --hash=sha256:0\nuv==2 \\\n    --hash=sha256:1\nzict==3\n'
    )
    commands = root / 'commands'
    commands.mkdir()
    place = Workplace(root, commands)
    place.add_python(12)
    for name in ('python3', 'python3.11', 'python3.13'):  # hide those of this machine
        place.add_command(name, '#!/bin/sh\necho "$0: not found" >&2; exit 127\n')
    return place


@pytest.mark.parametrize('script', [*(f'scripts/{name}' for name in SCRIPTS), '.ci/run'])
def test_script_is_well_formed(script: str) -> None:
    path = ROOT / script
    subprocess.run(['bash', '-n', path], check=True)
    assert max(len(line) for line in path.read_text().splitlines()) <= 100
    assert os.access(path, os.X_OK) == (script != 'scripts/env')


def test_no_script_calls_sudo() -> None:
    for name in SCRIPTS:
        lines = (ROOT / 'scripts' / name).read_text().splitlines()
        assert not [line for line in lines if 'sudo' in line and not line.lstrip().startswith('echo')]


def test_first_start_sets_everything_up_and_the_second_nothing(workplace: Workplace) -> None:
    first = workplace.run('--duration', '3 s')
    assert first.returncode == 0, first.stderr
    assert first.stdout.splitlines()[-1] == '<run><--duration><3 s>'
    assert workplace.done_so_far() == EVERYTHING

    second = workplace.run()
    assert second.returncode == 0
    assert second.stderr == ''
    assert workplace.done_so_far() == []


def test_test_script_passes_arguments_to_pytest(workplace: Workplace) -> None:
    done = workplace.run('-m', 'not slow', script='test')
    assert done.stdout == 'python -m pytest -m not slow\n'
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
    deadline = time.monotonic() + 20.0
    while not place.log_file.with_name('stand-in.log.busy').exists():
        assert time.monotonic() < deadline, 'the installation did not begin'
        time.sleep(0.02)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGKILL])
def test_an_interrupted_set_up_is_repaired(workplace: Workplace, number: signal.Signals) -> None:
    process = workplace.start(STAND_IN_SLEEP='30')
    wait_until_busy(workplace)
    os.killpg(process.pid, number)  # as Ctrl-C does: the whole foreground group
    _, err = process.communicate(timeout=10)
    if number == signal.SIGINT:
        assert process.returncode == 130
        assert 'the next start repairs it' in err
    workplace.done_so_far()
    assert workplace.run().returncode == 0
    assert workplace.done_so_far() == EVERYTHING


def test_two_starts_at_once_set_up_once(workplace: Workplace) -> None:
    first = workplace.start(STAND_IN_SLEEP='1')
    wait_until_busy(workplace)
    second = workplace.start()
    outputs = [process.communicate(timeout=30) for process in (first, second)]
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
        'uname', f'#!/bin/sh\n[ "$1" = -s ] && echo {system}\n[ "$1" = -m ] && echo {machine}\ntrue\n'
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


def other_python(minor: int) -> str:
    """Return an interpreter of this machine, or skip the test."""
    interpreters = [f'python3.{minor}']
    interpreters += map(str, Path('~/.pyenv/versions').expanduser().glob(f'3.{minor}.*/bin/python3'))
    for interpreter in interpreters:
        search = f'. scripts/env; usable_python "{interpreter}" {minor}'
        done = subprocess.run(['bash', '-c', search], cwd=ROOT, capture_output=True, text=True)
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
        ['bash', '-c', commands], cwd=ROOT, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    version, second_start_s = done.stdout.splitlines()
    assert version == f'Python 3.{minor}'
    # "a second start takes seconds"; the environment itself takes some tenths, the rest is Python
    assert int(second_start_s) < 15
