# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Signals raised as exceptions, also while numba compiles."""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

AGAIN_S = 0.05
"""A swallowed signal is sent again after this time."""


class Interrupted(KeyboardInterrupt):
    """A signal came within `interruptible`; its number is the argument.

    Python notes a plain KeyboardInterrupt that passes through exec() or eval(), caught later or
    not, and then ends a `python -m` process by SIGINT whatever exit code it asks for (CPython,
    `run_eval_code_obj`). numba, pydantic and dataclasses use exec() wherever they build a
    function. A subclass is not noted.
    """


class _Hold:
    """Nesting depth of `held` in the main thread, and the signals that came meanwhile."""

    def __init__(self) -> None:
        self.depth = 0
        self.waiting: list[int] = []

    def arrive(self, number: int) -> None:
        if not self.depth:
            raise Interrupted(number)
        self.waiting.append(number)


_hold = _Hold()


@contextmanager
def held() -> Iterator[None]:
    """Let a signal of `interruptible` wait for the end of this block, which must be short.

    For steps within `interruptible` that belong together, such as to store a result and to count
    it. A block that raises ends the wait too. In threads other than the main one, which get no
    signals, this does nothing.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    _hold.depth += 1
    try:
        yield
    finally:
        _hold.depth -= 1
        if _hold.waiting and not _hold.depth:
            raise Interrupted(_hold.waiting.pop())


@contextmanager
def interruptible(*numbers: signal.Signals) -> Iterator[None]:
    """Let the first of the signals raise Interrupted in the block; more of them do nothing.

    An exception in a callback from native code, as llvmlite has for its cache, is swallowed there
    or turned into another one. So a swallowed signal is sent again, and any exception of the block
    after a signal is raised as Interrupted. Main thread only.
    """
    has_come, is_owed = False, True
    timers: list[threading.Timer] = []

    def on_signal(number: int, _frame: object) -> None:
        nonlocal has_come, is_owed
        has_come = True
        if is_owed:
            is_owed = False
            _hold.arrive(number)

    def send_again(number: int) -> None:
        nonlocal is_owed
        is_owed = True
        signal.pthread_kill(threading.main_thread().ident or 0, number)

    def on_unraisable(unraisable: Any) -> None:
        if unraisable.exc_type is not Interrupted:
            hook_before(unraisable)
            return
        timers.append(threading.Timer(AGAIN_S, send_again, unraisable.exc_value.args))
        timers[-1].start()

    hook_before = sys.unraisablehook
    before = {number: signal.signal(number, on_signal) for number in numbers}
    sys.unraisablehook = on_unraisable
    try:
        yield
    except BaseException:
        if has_come:
            raise Interrupted from None
        raise
    finally:
        sys.unraisablehook = hook_before
        for timer in timers:
            timer.cancel()
        for number, handler in before.items():
            signal.signal(number, handler)
