# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A copy of the scripts with stand-ins for Python, pip and uv, which install nothing."""

import shutil
import subprocess
import textwrap
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

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
        out, err = process.communicate(timeout=300)
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


def make_workplace(folder: Path) -> Workplace:
    """Return a workplace whose path has a space in it, with Python 3.12 and nothing set up."""
    root = folder / 'the rig'
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
