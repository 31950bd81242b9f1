# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A signal waits for the end of what belongs together, and for nothing else."""

import os
import signal
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import pytest

from rotor_common.interrupt import Interrupted, held, interruptible


def interrupt_myself() -> None:
    os.kill(os.getpid(), signal.SIGINT)


def interrupted(work: Callable[[], None]) -> None:
    """Run `work` where SIGINT raises, and see that it does."""
    with pytest.raises(Interrupted), interruptible(signal.SIGINT):
        work()


def test_a_held_signal_comes_at_the_end_of_the_outermost_block() -> None:
    done = []

    def work() -> None:
        with held():
            with held():
                interrupt_myself()
                done.append('inner')
            done.append('outer')
        done.append('after')

    interrupted(work)
    assert done == ['inner', 'outer']


def test_a_signal_after_the_block_comes_at_once() -> None:
    done = []

    def work() -> None:
        with held():
            done.append('held')
        interrupt_myself()
        done.append('after')

    interrupted(work)
    assert done == ['held']


def test_an_error_in_the_block_ends_the_wait() -> None:
    def work() -> None:
        with held():
            interrupt_myself()
            raise ValueError

    done = []

    def more_work() -> None:
        interrupt_myself()
        done.append('after')

    interrupted(work)
    interrupted(more_work)
    assert not done, 'the next signal must not wait'


def test_another_thread_holds_nothing() -> None:
    done = []

    def work() -> None:
        block = held()
        with ThreadPoolExecutor(1) as pool:
            pool.submit(block.__enter__).result()
            interrupt_myself()
            done.append('after')

    interrupted(work)
    assert not done
