# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Makes a data set on several processes; a second run continues where the first one stopped."""

import concurrent.futures
import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

from rotor_bench.dataset.folder import Folder
from rotor_bench.dataset.suite import Flight, Machine, batches, plan_suite
from rotor_bench.dataset.suite_config import SuiteConfig, load_suite
from rotor_bench.dataset.write import Row, write_flights
from rotor_bench.errors import DatasetError
from rotor_common import interrupt
from rotor_common.errors import ProcessError
from rotor_common.versions import versions
from rotor_dynamics.cluster import check_executor, executor

OnProgress = Callable[[int, int], None]
"""Takes the flights done and the flights in total."""


@dataclass(frozen=True)
class Result:
    """What is in the folder now, and what this run has written of it."""

    flights: int
    flight_hours: float
    size_bytes: int
    written: int
    written_s: float
    wall_s: float

    @property
    def times_real_time(self) -> float | None:
        """Seconds of flight written per second of this run; None if nothing had to be written."""
        return self.written_s / self.wall_s if self.written else None


def choose(
    machines: Sequence[Machine], *, split: str | None = None, count: int | None = None
) -> list[Machine]:
    """Return the machines of a split, or `count` of them spread evenly over it.

    Raises DatasetError for a split without machines and a count out of range.
    """
    chosen = [machine for machine in machines if split in (None, machine.split)]
    if not chosen:
        raise DatasetError(f'the suite has no machine in the split {split!r}')
    if count is None:
        return chosen
    if not 1 <= count <= len(chosen):
        raise DatasetError(f'--machines {count} is out of range; allowed: 1 to {len(chosen)}')
    return [chosen[i * len(chosen) // count] for i in range(count)]


def make_dataset(
    source: str | SuiteConfig,
    folder: Path,
    *,
    seed: int = 0,
    split: str | None = None,
    machines: int | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    on_progress: OnProgress = lambda _done, _total: None,
) -> Result:
    """Write a data set into `folder`; flights that are there already are kept.

    The bytes of a file depend only on suite, seed and versions. `jobs` is the number of processes
    on this machine (default: one per core), `scheduler` a dask scheduler whose workers share the
    folder.

    Raises DatasetError, ConfigError or AnalysisError for what cannot be used, ProcessError when
    workers are lost; IntegrationError or RecordingError of a flight.
    """
    check_executor(scheduler, jobs)
    suite = source if isinstance(source, SuiteConfig) else load_suite(source)
    chosen = choose(plan_suite(suite, seed), split=split, count=machines)
    known = versions()
    place = Folder(folder.absolute(), suite, seed, known)
    flights = [flight for machine in chosen for flight in machine.flights]
    lanes = [row for batch in batches(chosen) for row in _rows(batch, place)]
    waiting = sum(map(len, lanes))
    done, started = len(flights) - waiting, time.monotonic()
    on_progress(done, len(flights))
    count = 0 if scheduler else min(jobs or os.cpu_count() or 1, len(lanes))
    with _workers(scheduler, count) as pool, closing(_written(pool, lanes, place, known)) as rows:
        for written in rows:
            with interrupt.held():  # an interrupt must not fall between noting and counting
                place.add(written)
                done += len(written)
                on_progress(done, len(flights))
    place.write_manifest()
    finished = place.finished.values()
    return Result(
        flights=len(finished),
        flight_hours=sum(row['duration_s'] for row in finished) / 3600.0,
        size_bytes=sum(row['size_bytes'] for row in finished),
        written=waiting,
        written_s=sum(flight.duration_s for row in lanes for flight in row),
        wall_s=time.monotonic() - started,
    )


def _rows(batch: Sequence[Machine], place: Folder) -> Iterator[list[Flight]]:
    """Yield the flights to write in lock-step: the first of each machine, then the second, ..."""
    for flights in zip(*(machine.flights for machine in batch), strict=True):
        row = [flight for flight in flights if not place.is_finished(flight)]
        if row:
            yield row


def _written(
    pool: concurrent.futures.Executor | None,
    lanes: Sequence[Sequence[Flight]],
    place: Folder,
    known: Mapping[str, str],
) -> Generator[list[Row]]:
    """Yield the manifest rows of written flights; without a pool, this process writes them."""
    if pool is None:
        yield from (write_flights(row, place.path, known) for row in lanes)
        return
    tasks = [pool.submit(write_flights, row, place.path, known) for row in lanes]
    yield from (task.result() for task in concurrent.futures.as_completed(tasks))


@contextmanager
def _workers(scheduler: str | None, count: int) -> Iterator[concurrent.futures.Executor | None]:
    """Yield the workers; an error or Ctrl-C in the block ends the running tasks."""
    if scheduler is not None:
        with executor(scheduler, None) as pool:
            yield pool
    elif count <= 1:
        yield None
    else:
        with _processes(count) as pool:
            yield pool


@contextmanager
def _processes(count: int) -> Iterator[concurrent.futures.Executor]:
    context = multiprocessing.get_context('spawn')
    pool = ProcessPoolExecutor(count, context, initializer=_ignore_interrupts)
    try:
        yield pool
    except BrokenProcessPool:
        raise ProcessError(
            'a process of the data set was ended from outside; the same command goes on where it '
            'stopped'
        ) from None
    except BaseException:
        for process in list((pool._processes or {}).values()):  # noqa: SLF001 - public from 3.14 on
            process.terminate()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _ignore_interrupts() -> None:
    """Leave Ctrl-C to the process that started this one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
