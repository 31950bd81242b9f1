# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The command `rotor-rig dataset`."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Literal

import typer

from rotor_common.console import print_json, say
from rotor_common.options import JsonOption
from rotor_common.out_path import check_folder_name
from rotor_common.progress import interruptible


def dataset(  # noqa: PLR0917 - typer names them
    suite: Annotated[str, typer.Argument(help='smoke, standard, full, or a YAML file.')],
    out: Annotated[Path, typer.Option(help='Folder of the data set; a second run resumes.')],
    seed: Annotated[int, typer.Option(help='Seed of everything that is drawn.')] = 0,
    split: Annotated[Literal['train', 'test'] | None, typer.Option(help='Only this split.')] = None,
    machines: Annotated[
        int | None, typer.Option(help='Only this many machines, spread over the suite.')
    ] = None,
    jobs: Annotated[
        int | None, typer.Option(help='Processes on this machine; default: all cores.')
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(help='dask scheduler whose workers share the folder, tcp://host:port.'),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Write a labelled data set: flights of virtual machines, healthy and cracked.

    Example: rotor-rig dataset smoke --machines 2 --out flights
    """
    check_folder_name(out)
    from rotor_bench.dataset.run import make_dataset

    with interruptible(suite, out, quiet=as_json, what_is_done='flights') as progress:
        result = make_dataset(
            suite,
            out,
            seed=seed,
            split=split,
            machines=machines,
            jobs=jobs,
            scheduler=scheduler,
            on_progress=progress,
        )
    if as_json:
        rate = {'times_real_time': result.times_real_time}
        print_json({'folder': str(out), **asdict(result), **rate})
        return
    said = f'{result.flights} flights, {result.flight_hours:.2f} h, '
    said += f'{result.size_bytes / 1e9:.2f} GB in {out}'
    if result.times_real_time is not None:
        said += f'; {result.written} written in {result.wall_s:.0f} s, '
        said += f'{result.times_real_time:.0f} times real time'
    say(said)
