# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The command `rotor-rig evaluate`."""

import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from rotor_common.console import print_json, say
from rotor_common.errors import ConfigError
from rotor_common.exit_code import ExitCode
from rotor_common.interrupt import Interrupted, interruptible
from rotor_common.out_path import make_folder
from rotor_common.progress import progress_bar

if TYPE_CHECKING:
    from rotor_bench.evaluation.checkpoint import Parts
    from rotor_bench.evaluation.outcome import Evaluated
    from rotor_bench.evaluation.suites import Chosen
    from rotor_bench.evaluation.topic import TestedNode

TOPIC = 'topic:'
PARTS = 'parts'
"""Folder of the finished flights, in that of the report."""


def evaluate(
    detectors: Annotated[
        list[str],
        typer.Argument(
            help='Names of installed detectors, module:Class, or topic:NAME of a ROS 2 node.',
            metavar='DETECTOR...',
        ),
    ],
    *,
    suite: Annotated[
        str, typer.Option(help='Name or YAML file of a suite, or the folder of a stored one.')
    ],
    out: Annotated[Path, typer.Option(help='Folder for evaluation.json and the pictures.')] = Path(
        'evaluation'
    ),
    split: Annotated[Literal['test', 'train'], typer.Option(help='Split of the suite.')] = 'test',
    seed: Annotated[int, typer.Option(help='Seed of the suite, unless it is stored.')] = 0,
    limit: Annotated[
        int | None, typer.Option(help='Only this many machines, spread over the suite.')
    ] = None,
    jobs: Annotated[
        int | None, typer.Option(help='Processes that simulate; default: all cores.')
    ] = None,
    node_command: Annotated[
        str, typer.Option(help='Command that starts the node of topic:NAME for every flight.')
    ] = '',
    rate: Annotated[
        float, typer.Option(help='Multiple of real time of the replay to a node.')
    ] = 20.0,
    as_json: Annotated[bool, typer.Option('--json', help='Print the statistics as JSON.')] = False,
) -> None:
    """Test detectors blind on the flights of a suite.

    Example: rotor-rig evaluate ratios zones --suite smoke
    """
    _check(detectors, jobs=jobs, limit=limit)
    make_folder(out)
    with _interruptible(out / PARTS):
        from rotor_bench.evaluation import (
            checkpoint,
            pictures,
            report,
            suites,
        )
        from rotor_bench.evaluation.topic import TestedNode

        chosen = suites.load(suite, seed=seed, split=split, limit=limit)
        nodes = [
            TestedNode(name.removeprefix(TOPIC), node_command, rate)
            for name in detectors
            if name.startswith(TOPIC)
        ]
        modules = [name for name in detectors if not name.startswith(TOPIC)]
        place = checkpoint.Parts(out / PARTS, checkpoint.key_of(chosen, modules))
        kept = _kept(place)
        began = time.perf_counter()
        done = _evaluated(chosen, modules, nodes, jobs or os.cpu_count() or 1, place, quiet=as_json)
        content = report.report(
            done,
            suite=chosen.config.name,
            seed=chosen.seed,
            split=split,
            stored=chosen.folder is not None,
            wall_s=time.perf_counter() - began,
            kept=kept,
        )
        report.save(content, out)
        place.remove()
        pictures.save_pictures(content, out)
    if as_json:
        head = {key: value for key, value in content.items() if key != 'flights'}
        print_json(head)
    else:
        _say(content, out / report.FILE)


def _check(detectors: list[str], *, jobs: int | None, limit: int | None) -> None:
    for name, value in (('jobs', jobs), ('limit', limit)):
        if value is not None and value < 1:
            raise ConfigError(f'--{name} {value} is out of range; allowed: 1 or more')
    repeated = sorted({name for name in detectors if detectors.count(name) > 1})
    if repeated:
        raise ConfigError(f'detector {repeated[0]!r} is given twice')


@contextmanager
def _interruptible(folder: Path) -> Iterator[None]:
    """Turn Ctrl-C into a sentence about what `folder` holds, once all processes have ended."""
    try:
        with interruptible(signal.SIGINT):
            yield
    except Interrupted:
        so_far = 'there are no finished flights to keep'
        if any(folder.glob('*.json')):
            so_far = f'finished flights are kept in {folder}, and the same command goes on there'
        say(f'stopped: {so_far}')
        raise typer.Exit(ExitCode.INTERRUPTED) from None


def _kept(place: 'Parts') -> int:
    """Say which parts of an earlier run are kept or removed; return the number of flights kept."""
    kept, gone = place.clean()
    if gone:
        _warn(
            f'{gone} parts in {place.folder} are thrown away: they are of another suite, seed, '
            'choice of machines, detector or version of the rig and its packages'
        )
    if kept:
        say(f'going on: {kept} flights are finished in {place.folder}')
    return kept


def _evaluated(
    chosen: 'Chosen',
    modules: list[str],
    nodes: list['TestedNode'],
    jobs: int,
    place: 'Parts',
    *,
    quiet: bool,
) -> 'Evaluated':
    """Evaluate the detectors in modules on all machines, then each node."""
    from rotor_bench.evaluation import runner, topic

    seconds = sum(flight.duration_s for machine in chosen.machines for flight in machine.flights)
    passes = len(nodes) + bool(modules)
    with _progress(seconds * passes, quiet=quiet) as bar:

        def on_flights(_flights: int, seconds: float) -> None:
            bar.advance(bar.task_ids[0], seconds / 3600)

        flown = []
        if modules:
            flown = [
                runner.evaluate(
                    chosen.machines,
                    modules,
                    chosen.source,
                    jobs=jobs,
                    secret=chosen.folder,
                    parts=place,
                    on_flights=on_flights,
                )
            ]
        flown += [topic.follow(chosen.machines, n, chosen.source, on_flights) for n in nodes]
    return runner.joined(flown)


def _say(content: dict[str, Any], file: Path) -> None:
    from rotor_bench.evaluation import report, walls

    for table in report.tables(content):
        Console().print(table)
    for name, numbers in content['detectors'].items():
        for failure, count in numbers['failures'].items():
            _warn(f'{name} failed on {count} of {numbers["flights"]} flights: {failure}')
    if walls.is_weak(content['isolation']):
        _warn(f'isolation: {content["isolation"]}')
    say(f'report: {file}')


def _progress(seconds: float, *, quiet: bool) -> Progress:
    text = TextColumn('{task.completed:.1f} of {task.total:.1f} flight hours')
    bar = progress_bar(text, BarColumn(), TimeRemainingColumn(), quiet=quiet)
    bar.add_task('evaluate', total=seconds / 3600)
    return bar


def _warn(sentence: str) -> None:
    say(f'warning: {sentence}', style='yellow')
