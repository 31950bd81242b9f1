# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Where the points of an analysis are computed: threads of this process, or a dask cluster."""

import concurrent.futures
import gc
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.pool import ThreadPool
from typing import TYPE_CHECKING, Any

from rotor_common.errors import ProcessError
from rotor_dynamics.cache import code_version
from rotor_dynamics.errors import AnalysisError

if TYPE_CHECKING:
    from distributed import Client

CONNECT_S = 10.0


@contextmanager
def executor(scheduler: str | None, jobs: int | None) -> Iterator[concurrent.futures.Executor]:
    """Yield an executor for pure, picklable tasks; leaving the block drops unfinished ones.

    `scheduler` None starts `jobs` threads (default: one for each core) in this process: the kernels
    release the GIL, so threads are enough. Otherwise `scheduler` is the address of a dask scheduler
    (tcp://host:port) whose workers have the same version of the rig; the tasks of a worker that
    dies are given to another.

    Raises AnalysisError for arguments that are not allowed and a scheduler that cannot be used,
    ProcessError if the cluster is lost while it computes.
    """
    check_executor(scheduler, jobs)
    if scheduler is None:
        with ThreadPool(jobs or os.cpu_count()) as threads:
            yield _Threads(threads)
        return
    from distributed import KilledWorker  # noqa: PLC0415 - slow

    with _connect(scheduler) as client:
        _check_workers(client, scheduler)
        try:
            # dask would look up a pure call by its name, among results of other code
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
    """Raise AnalysisError for arguments that `executor` does not allow, without starting it."""
    if jobs is not None and scheduler is not None:
        raise AnalysisError('--jobs is for this machine; --scheduler has workers of its own')
    if jobs is not None and jobs < 1:
        raise AnalysisError(f'--jobs {jobs} is out of range; allowed: 1 or more')


class _Threads(concurrent.futures.Executor):
    """Daemon threads, which nothing waits for: Ctrl-C must not last as long as a chunk."""

    def __init__(self, threads: ThreadPool) -> None:
        self._threads = threads

    def submit(
        self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any
    ) -> concurrent.futures.Future[Any]:
        future: concurrent.futures.Future[Any] = concurrent.futures.Future()
        future.set_running_or_notify_cancel()  # only leaving the pool cancels it
        self._threads.apply_async(fn, args, kwargs, future.set_result, future.set_exception)
        return future


def _connect(scheduler: str) -> 'Client':
    from distributed import Client  # noqa: PLC0415 - slow
    from distributed.comm import get_address_host_port  # noqa: PLC0415 - slow

    try:
        get_address_host_port(scheduler)  # before a client exists that would have to be closed
        return Client(scheduler, timeout=CONNECT_S, set_as_default=False)
    except ValueError as error:
        reason = f'is not an address like tcp://host:8786 ({error})'
    except OSError:
        reason = f'does not answer within {CONNECT_S:g} s; start one by `dask scheduler`'
    # The failed client closes itself when it is garbage-collected. If that happened while another
    # client starts, it would wait for a lock which that client holds.
    gc.collect()
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
