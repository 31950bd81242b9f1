# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""What the tests of docs/extending share: the code of a page, and its package installed."""

import os
import re
import subprocess
import sys
from pathlib import Path

DOCS = Path(__file__).parents[1] / 'docs' / 'extending'
RIG = sys.executable, '-P', '-m', 'rotor_bringup'  # -P: the command has no folder on its path


def page(part: str) -> str:
    return (DOCS / f'{part}.md').read_text('utf-8')


def blocks(part: str, language: str) -> list[str]:
    return re.findall(rf'```{language}\n(.*?)```', page(part), re.DOTALL)


def run(*words: str, path: Path | None = None, cwd: Path | None = None) -> str:
    """Return what a command prints; `path` is a folder of installed packages."""
    environment = os.environ | ({} if path is None else {'PYTHONPATH': str(path)})
    done = subprocess.run(
        words, env=environment, cwd=cwd, capture_output=True, text=True, timeout=500, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


def install(folder: Path, site: Path) -> Path:
    """Install the package in `folder` into `site`, for `run(path=site)`."""
    words = '--quiet', '--no-deps', '--no-build-isolation', '--target', str(site), str(folder)
    run(sys.executable, '-m', 'pip', 'install', *words)
    return site


def installed(part: str, module: str, folder: Path) -> Path:
    """Write the file and the pyproject.toml of a page, and install them."""
    source = folder / 'source'
    source.mkdir()
    (source / f'{module}.py').write_text(blocks(part, 'python')[0], 'utf-8')
    (source / 'pyproject.toml').write_text(blocks(part, 'toml')[0], 'utf-8')
    return install(source, folder / 'site')
