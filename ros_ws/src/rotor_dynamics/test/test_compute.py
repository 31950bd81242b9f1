# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The local executor: threads of this process, no port, quick to let go.

What needs a scheduler and worker processes is in tests/test_distributed.py.
"""

import concurrent.futures
import os
import random
import subprocess
import sys
import threading
import time

import psutil  # type: ignore[import-untyped]
import pytest

from rotor_dynamics import cluster
from rotor_dynamics.cluster import executor
from rotor_dynamics.errors import AnalysisError

BARRIER = threading.Barrier(3, timeout=20.0)
RUNNING: list[int] = []
MOST: list[int] = []
STARTED, RELEASE = threading.Event(), threading.Event()


def meet(number: int) -> tuple[int, int]:
    """Return only if three run at once."""
    BARRIER.wait()
    return number, os.getpid()


def count(number: int) -> None:
    RUNNING.append(number)
    MOST.append(len(RUNNING))
    time.sleep(0.01)
    RUNNING.remove(number)


def draw() -> float:
    return random.random()


def fail() -> None:
    raise AnalysisError('no such point')


def hold() -> None:
    STARTED.set()
    RELEASE.wait(60.0)


def listening() -> set[str]:
    connections = psutil.Process().net_connections()
    return {link.laddr.ip for link in connections if link.status == psutil.CONN_LISTEN}


def test_tasks_run_in_threads_of_this_process_without_a_port() -> None:
    before = listening()
    with executor(None, 3) as pool:
        futures = [pool.submit(meet, number) for number in range(3)]
        done = {future.result() for future in concurrent.futures.as_completed(futures)}
        opened = listening() - before
    assert done == {(number, os.getpid()) for number in range(3)}
    assert opened == set()


def test_threads_need_no_dask() -> None:
    code = (
        'import sys; from rotor_dynamics.cluster import executor\n'
        'with executor(None, 1) as pool: print(pool.submit(abs, -1).result())\n'
        'print([name for name in ("dask", "distributed") if name in sys.modules])'
    )
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=True)
    assert done.stdout.split('\n')[:2] == ['1', '[]']


def test_one_job_means_one_task_at_a_time() -> None:
    with executor(None, 1) as pool:
        for future in [pool.submit(count, number) for number in range(8)]:
            future.result()
    assert MOST == [1] * 8


def test_the_same_call_is_computed_each_time() -> None:
    with executor(None, 2) as pool:
        assert len({pool.submit(draw).result() for _ in range(3)}) == 3


def test_an_error_of_a_task_is_that_of_the_result() -> None:
    with executor(None, 1) as pool, pytest.raises(AnalysisError, match='no such point'):
        pool.submit(fail).result()


def test_leaving_does_not_wait_for_what_is_running() -> None:
    def interrupted() -> None:
        with executor(None, 1) as pool:
            pool.submit(hold)
            pool.submit(hold)
            assert STARTED.wait(20.0)
            raise KeyboardInterrupt

    start = time.monotonic()
    try:
        with pytest.raises(KeyboardInterrupt):
            interrupted()
        assert time.monotonic() - start < 20.0, 'it waited for the tasks of 60 s'
    finally:
        RELEASE.set()


@pytest.mark.parametrize('jobs', [0, -1])
def test_jobs_below_one_are_refused(jobs: int) -> None:
    with pytest.raises(AnalysisError, match=rf'--jobs {jobs} .*1 or more'), executor(None, jobs):
        pass


def test_jobs_beside_a_scheduler_are_refused() -> None:
    with (
        pytest.raises(AnalysisError, match='--scheduler has workers of its own'),
        executor('tcp://127.0.0.1:1', 2),
    ):
        pass


@pytest.mark.parametrize('address', ['nowhere', 'http://127.0.0.1:80', 'tcp://127.0.0.1'])
def test_what_is_no_address_is_refused(address: str) -> None:
    with (
        pytest.raises(AnalysisError, match=r'is not an address like tcp://'),
        executor(address, None),
    ):
        pass


def test_a_scheduler_that_does_not_answer_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, 'CONNECT_S', 0.5)
    with (
        pytest.raises(AnalysisError, match=r"'tcp://127.0.0.1:1' does not answer within 0.5 s"),
        executor('tcp://127.0.0.1:1', None),
    ):
        pass
