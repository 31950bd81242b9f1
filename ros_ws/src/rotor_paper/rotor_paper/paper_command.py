# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The command `rotor-rig paper`; checks its arguments before any slow import."""

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from rotor_common.console import print_json
from rotor_common.errors import ConfigError
from rotor_common.options import JsonOption
from rotor_common.out_path import make_folder
from rotor_common.progress import interruptible

FIRST, LAST = 5, 19
VARIANTS = ('natural', 'derived', 'figure', 'figure_chaos')
LIMITS = {'values': (2, 2000), 'transient': (0, 200_000), 'revolutions': (100, 4000)}
"""Allowed range of the counts: a diagram is held in memory with all its spectra, Figs 7 to 10 leave
out four times as many revolutions as `transient`, and a section of fewer than 100 revolutions gets
no label but periodic (rotor_dynamics.motion.SHORTEST)."""


def paper(
    figures: Annotated[
        list[int] | None, typer.Argument(help='Figures, 5 to 19; default: all.')
    ] = None,
    *,
    variant: Annotated[
        list[str] | None,
        typer.Option(
            help='natural, derived, figure or figure_chaos; may be given several times. The last '
            "two are empirical reconstructions, not the authors' code. Default: all four."
        ),
    ] = None,
    out: Annotated[Path, typer.Option(help='Folder for pictures, data and report.')],
    values: Annotated[int, typer.Option(help='Values of the parameter in each diagram.')] = 400,
    transient: Annotated[int, typer.Option(help='Revolutions left out at each point.')] = 1000,
    revolutions: Annotated[int, typer.Option(help='Revolutions recorded at each point.')] = 300,
    check: Annotated[
        bool, typer.Option('--check/--no-check', help='Compute every point at 2N steps as well.')
    ] = True,
    scheduler: Annotated[
        str | None, typer.Option(help='Address of a dask scheduler, tcp://host:port.')
    ] = None,
    jobs: Annotated[int | None, typer.Option(help='Threads on this machine.')] = None,
    cache: Annotated[
        Path | None, typer.Option(help='Folder of finished results; default: OUT/cache.')
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Draw figures 5 to 19 of the paper again and say what agrees with them.

    Example: rotor-rig paper 14 15 --values 40 --out paper
    """
    numbers = _figures(figures)
    names = _variants(variant)
    counts = {'values': values, 'transient': transient, 'revolutions': revolutions}
    for name, number in counts.items():
        _check_count(name, number)
    make_folder(out)

    from rotor_dynamics import cluster
    from rotor_dynamics.cache import ResultCache
    from rotor_paper import report, run
    from rotor_paper.figures import Settings

    settings = Settings(values, transient, revolutions, check_steps=check)
    store = ResultCache(cache or out / 'cache')
    cached = any(store.folder.glob('*.npz'))
    began = time.perf_counter()
    with (
        interruptible('paper', store.folder, quiet=as_json) as on_progress,
        cluster.executor(scheduler, jobs) as executor,
    ):
        outcome = run.make(
            numbers,
            names,
            settings,
            out=out,
            executor=executor,
            cache=store,
            on_progress=on_progress,
        )
    wall_s = time.perf_counter() - began
    content = report.report(outcome, settings, names, wall_s=wall_s, cached=cached)
    report.save(content, out)
    if as_json:
        print_json(content)
    else:
        _say(content, out)


def _figures(figures: list[int] | None) -> list[int]:
    wrong = [number for number in figures or [] if not FIRST <= number <= LAST]
    if wrong:
        raise ConfigError(f'figure {wrong[0]} is not one of the paper that can be drawn: 5 to 19')
    return sorted(set(figures or range(FIRST, LAST + 1)))


def _variants(variants: list[str] | None) -> list[str]:
    for name in variants or ():
        if name not in VARIANTS:
            raise ConfigError(
                f'--variant {name!r} is not known; it is one of {", ".join(VARIANTS)}'
            )
    return [name for name in VARIANTS if name in (variants or VARIANTS)]


def _check_count(name: str, number: int) -> None:
    least, most = LIMITS[name]
    if not least <= number <= most:
        raise ConfigError(f'--{name} {number} is out of range; allowed: {least} to {most}')


def _say(content: dict[str, Any], out: Path) -> None:
    for variant, counts in content['summary'].items():
        each = ', '.join(f'{count} {verdict}' for verdict, count in counts.items())
        typer.echo(f'{variant} ({content["variants"][variant]}): {each}')
    typer.echo(f'report: {out / "report.html"}')
