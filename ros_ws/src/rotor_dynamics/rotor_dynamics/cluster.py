# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Where the points of an analysis are computed: in this process, or on somebody's dask cluster."""

import concurrent.futures
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from rotor_common.errors import ProcessError
from rotor_dynamics.cache import code_version
from rotor_dynamics.errors import AnalysisError

if TYPE_CHECKING:
    from distributed import Client

LOOPBACK = '127.0.0.1:0'
CONNECT_S = 10.0


@contextmanager
def executor(scheduler: str | None, jobs: int | None) -> Iterator[concurrent.futures.Executor]:
    """Give an executor for pure, picklable tasks; leaving the block drops what is not done.

    `scheduler` None starts a cluster of `jobs` threads (default: all cores) in this process: the
    kernels release the GIL, so threads are enough, and no task leaves the process. Otherwise
    `scheduler` is the address of a dask scheduler (tcp://host:port) whose workers have the same
    version of rotor_sim; a worker that dies loses nothing, its tasks are given to another.

    Raises AnalysisError for arguments that do not serve and a scheduler that cannot be used,
    ProcessError when the cluster is lost on the way.
    """
    from distributed import KilledWorker  # noqa: PLC0415 - slow

    check_executor(scheduler, jobs)
    with _client(scheduler, jobs) as client:
        try:
            # a pure call would be looked up by its name among those of other people's code
            yield client.get_executor(pure=False)
        except KilledWorker as error:
            raise ProcessError(
                f'the workers of {scheduler} died again and again over the same points ({error})'
            ) from None
        except concurrent.futures.CancelledError:
            raise ProcessError(
                f'the scheduler {scheduler} was lost; give --cache, and the same command goes on '
                'where it stopped'
            ) from None


def check_executor(scheduler: str | None, jobs: int | None) -> None:
    """Raise AnalysisError for arguments of `executor` that do not serve, without starting it."""
    if jobs is not None and scheduler is not None:
        raise AnalysisError('--jobs is for this machine; --scheduler has workers of its own')
    if jobs is not None and jobs < 1:
        raise AnalysisError(f'--jobs {jobs} is out of range; allowed: 1 or more')


@contextmanager
def _client(scheduler: str | None, jobs: int | None) -> Iterator['Client']:
    from distributed import Client  # noqa: PLC0415 - slow

    if scheduler is None:
        with _local_cluster(jobs or os.cpu_count() or 1) as cluster, Client(cluster) as client:
            yield client
        return
    client = _connect(scheduler)
    with client:
        _check_workers(client, scheduler)
        yield client


def _local_cluster(threads: int) -> Any:
    """Return a cluster in this process; it talks through memory and listens on loopback only."""
    from distributed import LocalCluster  # noqa: PLC0415 - slow
    from distributed.threadpoolexecutor import ThreadPoolExecutor  # noqa: PLC0415

    class Releasing(ThreadPoolExecutor):  # type: ignore[misc]
        """Threads that a closing cluster does not wait for: Ctrl-C must not take a chunk's time."""

        def shutdown(self, wait: bool = True, timeout: float | None = None) -> None:  # noqa: ARG002
            super().shutdown(wait=False)

    return LocalCluster(
        processes=False,
        n_workers=1,
        threads_per_worker=threads,
        executor=Releasing(threads, thread_name_prefix='analysis'),
        dashboard_address=LOOPBACK,  # dask serves its status pages in any case
        worker_dashboard_address=LOOPBACK,
        memory_limit=0,  # it would count all of this process
        silence_logs=logging.ERROR,
    )


def _connect(scheduler: str) -> 'Client':
    from distributed import Client  # noqa: PLC0415 - slow

    try:
        return Client(scheduler, timeout=CONNECT_S, set_as_default=False)
    except ValueError as error:
        reason = f'is not an address like tcp://host:8786 ({error})'
    except OSError:
        reason = f'does not answer within {CONNECT_S:g} s; start one by `dask scheduler`'
    raise AnalysisError(f'the scheduler {scheduler!r} {reason}')


def _check_workers(client: 'Client', scheduler: str) -> None:
    """Raise AnalysisError unless there are workers and all compute as this process would."""
    try:
        versions = client.run(code_version)
    except ImportError as error:
        raise AnalysisError(
            f'a worker of {scheduler} cannot load this rig ({error}); install it there'
        ) from None
    if not versions:
        raise AnalysisError(
            f'the scheduler {scheduler} has no workers; start one by `dask worker {scheduler}`'
        )
    other = [worker for worker, version in versions.items() if version != code_version()]
    if other:
        raise AnalysisError(
            f'the worker {other[0]} has another version of rotor_sim; install this one there'
        )
