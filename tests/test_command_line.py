# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The command line as a whole: its verbs are loaded when called, and every help is of use."""

import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from importlib.metadata import entry_points, version
from typing import Any

import pytest

from rotor_bringup import cli

CLI = [sys.executable, '-m', 'rotor_bringup']
HEAVY = ('distributed', 'matplotlib', 'numba', 'numpy', 'pyarrow', 'pydantic', 'rclpy', 'rerun',
         'scipy', 'xarray')  # fmt: skip


def verbs() -> Iterator[tuple[str, Any]]:
    """Yield the words and the loaded command of every verb."""
    for name, point in cli._verbs().items():
        command = cli._loaded(point)
        inner = getattr(command, 'commands', None)
        if inner is None:
            yield name, command
        else:
            yield from ((f'{name} {word}', verb) for word, verb in inner.items())


VERBS = dict(verbs())


@pytest.mark.parametrize('words', VERBS)
def test_help_has_an_example_that_parses(words: str) -> None:
    command = VERBS[words]
    found = re.search(r'^Example: rotor-rig (.*)$', command.help or '', re.MULTILINE)
    assert found, f'the help of {words} has no example'
    typed = shlex.split(found[1])
    own = words.split()
    assert typed[: len(own)] == own
    with command.make_context(words, typed[len(own) :]) as context:
        assert context.params


def test_the_help_page_tells_what_the_verbs_say_of_themselves() -> None:
    for name, point in cli._verbs().items():
        command = cli._loaded(point)
        stub = cli.VerbGroup.get_command(None, None, name)  # type: ignore[arg-type]
        assert stub.help.splitlines()[0] == command.help.splitlines()[0]


def test_every_verb_has_its_place_on_the_help_page() -> None:
    assert list(cli._verbs()) == list(cli.ORDER)
    assert set(cli.ORDER) == {point.name for point in entry_points(group=cli.GROUP)}


def test_help_and_version_import_nothing_of_weight() -> None:
    for arguments in (['--help'], ['--version']):
        code = (
            f'import sys; sys.argv[1:] = {arguments!r}\n'
            'import rotor_bringup.__main__ as program\n'
            'try: program.main()\n'
            f'except SystemExit: print([n for n in {HEAVY!r} if n in sys.modules])'
        )
        done = subprocess.run(
            [sys.executable, '-c', code], capture_output=True, text=True, check=True
        )
        assert done.stdout.strip().splitlines()[-1] == '[]', arguments


def test_version_is_that_of_the_package() -> None:
    done = subprocess.run([*CLI, '--version'], capture_output=True, text=True, check=True)
    assert done.stdout == f'rotor-rig {version("rotor_bringup")}\n'


@pytest.mark.parametrize(
    ('typed', 'word', 'offered'),
    [('rotor-rig ev', 1, 'evaluate'), ('rotor-rig scenario s', 2, 'show'),
     ('rotor-rig simulate --o', 2, '--out')],
)  # fmt: skip
def test_the_shell_completes(
    typed: str, word: int, offered: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('_ROTOR_RIG_COMPLETE', 'complete_bash')
    monkeypatch.setenv('COMP_WORDS', typed)
    monkeypatch.setenv('COMP_CWORD', str(word))
    done = subprocess.run(CLI, capture_output=True, text=True, check=False)
    assert done.stdout.split() == [offered]
