# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Sweeps on somebody's own dask cluster: scheduler and worker processes on loopback."""

import dataclasses
import importlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from distributed import Client

from rig_support import Rig
from rotor_common.errors import ProcessError
from rotor_dynamics import Plan, ResultCache, Survey, cluster, survey, sweep
from rotor_dynamics.cluster import executor
from rotor_dynamics.errors import AnalysisError
from rotor_sim.plant.parameters import RotorParameters

PLAN = Plan(transient_revolutions=100, revolutions=100, exponent_revolutions=50, highest_order=4.0)
POINTS = sweep(
    RotorParameters.hou2016('figure'),
    'K',
    np.linspace(0.0, 0.28, 384),  # six chunks
    speed_rad_s=352.0,
    load_factor=3.0,
)

Start = Callable[..., subprocess.Popen[bytes]]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Start `python -m MODULE ARGUMENTS`; what is still running at the end is killed, by its id."""
    running: list[subprocess.Popen[bytes]] = []

    def run(module: str, *arguments: str) -> subprocess.Popen[bytes]:
        with (tmp_path / f'{len(running)}.log').open('wb') as log:
            process = subprocess.Popen(
                [sys.executable, '-m', module, *arguments],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                cwd=tmp_path,
            )
        running.append(process)
        return process

    yield run
    for process in reversed(running):
        process.kill()
        process.wait(timeout=300.0)


@dataclasses.dataclass(frozen=True)
class Scheduler:
    """A scheduler process and its address."""

    process: subprocess.Popen[bytes]
    address: str


@pytest.fixture
def scheduler(start: Start, tmp_path: Path) -> Scheduler:
    """Start a scheduler that has no workers yet."""
    file = tmp_path / 'scheduler.json'
    process = start(
        'distributed.cli.dask_scheduler', '--host', '127.0.0.1', '--port', '0',
        '--dashboard-address', '127.0.0.1:0', '--scheduler-file', str(file),
    )  # fmt: skip
    deadline = time.monotonic() + 300.0
    while True:
        assert process.poll() is None, (tmp_path / '0.log').read_text()
        assert time.monotonic() < deadline
        if file.exists():
            try:
                return Scheduler(process, json.loads(file.read_text())['address'])
            except ValueError:  # half written
                pass
        time.sleep(0.05)


@pytest.fixture
def worker(start: Start, scheduler: Scheduler) -> Callable[[], subprocess.Popen[bytes]]:
    """Start a worker process with one thread."""

    def run() -> subprocess.Popen[bytes]:
        return start(
            'distributed.cli.dask_worker', scheduler.address, '--nthreads', '1', '--no-nanny',
            '--host', '127.0.0.1', '--dashboard-address', '127.0.0.1:0',
        )  # fmt: skip

    return run


def wait_for_workers(scheduler: Scheduler, count: int) -> None:
    with Client(scheduler.address, set_as_default=False) as client:
        client.wait_for_workers(count, timeout=300)


def assert_identical(found: Survey, wanted: Survey) -> None:
    for field in dataclasses.fields(Survey):
        if field.name in {'points', 'plan'}:
            assert getattr(found, field.name) == getattr(wanted, field.name)
        else:
            one, other = getattr(found, field.name), getattr(wanted, field.name)
            assert one.dtype == other.dtype, field.name
            assert one.tobytes() == other.tobytes(), field.name


@pytest.mark.slow
def test_a_worker_killed_in_the_middle_changes_nothing(
    scheduler: Scheduler, worker: Callable[[], subprocess.Popen[bytes]]
) -> None:
    workers = [worker(), worker()]
    wait_for_workers(scheduler, 2)
    progress: list[int] = []

    def kill_one(done: int, total: int) -> None:
        progress.append(done)
        assert total == len(POINTS)
        if len(progress) == 1:  # five chunks to go, one of them on this worker
            workers[0].kill()

    with executor(scheduler.address, None) as pool:
        assert {pool.submit(os.getpid).result() for _ in range(20)} <= {w.pid for w in workers}
        found = survey(POINTS, PLAN, executor=pool, on_progress=kill_one)
    assert workers[0].wait(timeout=300.0) == -9
    assert workers[1].poll() is None
    assert progress == [64, 128, 192, 256, 320, 384]
    assert_identical(found, survey(POINTS, PLAN))


@pytest.mark.slow
def test_a_lost_scheduler_is_one_sentence_and_what_is_done_is_kept(
    scheduler: Scheduler, worker: Callable[[], subprocess.Popen[bytes]], tmp_path: Path
) -> None:
    worker()
    wait_for_workers(scheduler, 1)
    cache = ResultCache(tmp_path / 'cache')

    def lose(*_: int) -> None:
        scheduler.process.kill()

    with (
        pytest.raises(ProcessError, match=r'the scheduler tcp://127.0.0.1:\d+ was lost'),
        executor(scheduler.address, None) as pool,
    ):
        survey(POINTS, PLAN, executor=pool, cache=cache, on_progress=lose)
    assert len(list(cache.folder.glob('*.npz'))) == 1


def test_a_scheduler_without_workers_is_one_sentence(scheduler: Scheduler) -> None:
    with (
        pytest.raises(AnalysisError, match='has no workers; start one by `dask worker tcp://'),
        executor(scheduler.address, None),
    ):
        pass


@pytest.mark.slow
def test_a_worker_that_would_compute_something_else_is_refused(
    scheduler: Scheduler,
    worker: Callable[[], subprocess.Popen[bytes]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    worker()
    wait_for_workers(scheduler, 1)
    for stand_in, sentence in (
        (os.getpid, 'has another version of rotor_sim; install this one there'),
        (lambda: importlib.import_module('no_such_rig'), 'cannot load this rig .*no_such_rig'),
    ):
        monkeypatch.setattr(cluster, 'code_version', stand_in)
        with (
            pytest.raises(AnalysisError, match=sentence),
            executor(scheduler.address, None),
        ):
            pass


@pytest.mark.slow
def test_the_command_computes_on_a_cluster_what_it_computes_here(
    scheduler: Scheduler, worker: Callable[[], subprocess.Popen[bytes]], rig: Rig, tmp_path: Path
) -> None:
    worker()
    wait_for_workers(scheduler, 1)
    files = [tmp_path / 'here.npz', tmp_path / 'there.npz']
    for file, where in zip(files, [(), ('--scheduler', scheduler.address)], strict=True):
        done = rig(
            'orbit-diagram', '--over', 'K', '0', '0.3', '70', '--transient', '50',
            '--revolutions', '20', '--out', file, *where,
        )  # fmt: skip
        assert done.code == 0, done.err
    with np.load(files[0]) as here, np.load(files[1]) as there:
        assert set(here) == set(there)
        for name in here:
            assert here[name].tobytes() == there[name].tobytes(), name
