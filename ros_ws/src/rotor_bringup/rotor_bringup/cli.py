# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The `rotor-rig` command line. Results also as --json; exit codes in `ExitCode`.

A verb is an entry point of the group `rotor_rig.commands`, imported when it is called: a function
with typer's annotations, a dataclass whose fields are the options and that has a method `run`, or
a Typer app with verbs of its own. Its docstring is its help.
"""

import ast
import functools
import importlib.util
import inspect
from collections.abc import Callable
from importlib.metadata import EntryPoint, entry_points, version
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer
from typer.core import TyperCommand, TyperGroup

from rotor_common.console import printable, say
from rotor_common.errors import ProcessError, RigError, refusal
from rotor_common.exit_code import ExitCode

GROUP = 'rotor_rig.commands'
ORDER = (
    'run', 'simulate', 'replay', 'analyze', 'view', 'import', 'recover', 'verify', 'scenario',
    'plant', 'orbit-diagram', 'waterfall', 'lyapunov', 'poincare', 'map', 'paper', 'dataset',
    'evaluate', 'baseline',
)  # fmt: skip
"""Order of the help page; verbs that others add follow."""


class VerbGroup(TyperGroup):
    """Loads a verb when it is called; turns the rig's errors into a sentence and an exit code."""

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ARG002 - typer's signature
        """Return the names of all verbs."""
        return list(_verbs())

    def get_command(self, ctx: Any, cmd_name: str) -> Any:  # noqa: ARG002
        """Return a verb with its help text alone, None for an unknown one."""
        point = _verbs().get(cmd_name)
        return None if point is None else TyperCommand(cmd_name, help=_help(point))

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the name, the loaded verb and its arguments."""
        name, _, rest = super().resolve_command(ctx, args)
        return name, _loaded(_verbs()[str(name)]), rest

    def invoke(self, ctx: Any) -> Any:
        """Run a verb."""
        try:
            return super().invoke(ctx)
        except ProcessError as error:
            _fail(str(error), ExitCode.PROCESS_FAILED)
        except RigError as error:
            _fail(str(error), ExitCode.BAD_INPUT)
        except OSError as error:
            if isinstance(error, BrokenPipeError):
                raise
            _fail(refusal(error), ExitCode.BAD_INPUT)
        except ValueError as error:
            if not (isinstance(error, UnicodeEncodeError) or 'embedded null' in str(error)):
                raise
            _fail(f'no file can have such a name ({error})', ExitCode.BAD_INPUT)


@functools.cache
def _verbs() -> dict[str, EntryPoint]:
    found = {point.name: point for point in entry_points(group=GROUP)}
    return {name: found[name] for name in sorted(found, key=_place)}


def _place(name: str) -> tuple[int, str]:
    return (ORDER.index(name) if name in ORDER else len(ORDER), name)


def _help(point: EntryPoint) -> str:
    """Return the docstring of a verb without importing it; that of the module for a Typer app."""
    top, _, inner = point.module.partition('.')
    spec = importlib.util.find_spec(top)
    places = [] if spec is None else spec.submodule_search_locations or [spec.origin or '']
    for place in places:
        file = Path(place, *inner.split('.')).with_suffix('.py')
        if file.is_file():
            module = ast.parse(file.read_text('utf-8'))
            named = (node for node in module.body if getattr(node, 'name', '') == point.attr)
            node = next(named, module)
            assert isinstance(node, ast.Module | ast.FunctionDef | ast.ClassDef)  # noqa: S101
            return ast.get_docstring(node) or ''
    return ''


def _loaded(point: EntryPoint) -> Any:
    target = point.load()
    if not isinstance(target, typer.Typer):
        verb = _of_class(target) if inspect.isclass(target) else target
        target = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
        target.command(point.name)(verb)
    return typer.main.get_command(target)


def _of_class(target: type[Any]) -> Callable[..., None]:
    """Return a function with the fields of a dataclass as its parameters."""

    def command(**options: Any) -> None:
        target(**options).run()

    command.__doc__ = target.__doc__
    command.__annotations__ = get_type_hints(target, include_extras=True)
    command.__signature__ = inspect.signature(target)  # type: ignore[attr-defined]
    return command


def _fail(sentence: str, code: ExitCode) -> None:
    say(f'error: {printable(sentence)}', 'red')
    raise typer.Exit(code)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f'rotor-rig {version("rotor_bringup")}')
        raise typer.Exit


app = typer.Typer(cls=VerbGroup, no_args_is_help=True, pretty_exceptions_enable=False)


@app.callback(help='A virtual rig of a cracked rotor in flight maneuvers, on ROS 2 Jazzy.')
def main(
    show_version: Annotated[
        bool,
        typer.Option(
            '--version', help='Show the version and exit.', callback=_show_version, is_eager=True
        ),
    ] = False,
) -> None:
    """Take the options before the verb."""
