# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Signals as exceptions that reach whoever waits for them, also out of compilers."""

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

AGAIN_S = 0.05
"""A swallowed interrupt is raised again after this time."""


class Interrupted(KeyboardInterrupt):
    """A signal came within `interruptible`.

    Python notes a plain KeyboardInterrupt that passes through exec() or eval(), caught later or
    not, and then ends a `python -m` process by SIGINT whatever exit code it asks for (CPython,
    `run_eval_code_obj`). numba, pydantic and dataclasses use exec() wherever they build a
    function. A subclass is not noted.
    """


@contextmanager
def interruptible(*numbers: signal.Signals) -> Iterator[None]:
    """Let the first of the signals raise Interrupted in the block; more of them do nothing.

    What is raised inside a callback of native code, as llvmlite has for its cache, is swallowed
    there or comes out as another exception. So it is raised again where it was swallowed, and
    whatever the block raises after a signal comes out as Interrupted. Main thread only.
    """
    has_come = False

    def on_signal(_number: int, _frame: object) -> None:
        nonlocal has_come
        if not has_come:
            has_come = True
            raise Interrupted

    def on_alarm(_number: int, _frame: object) -> None:
        raise Interrupted

    def on_unraisable(unraisable: Any) -> None:
        if unraisable.exc_type is Interrupted:
            signal.setitimer(signal.ITIMER_REAL, AGAIN_S)
        else:
            hook_before(unraisable)

    hook_before = sys.unraisablehook
    before = {number: signal.signal(number, on_signal) for number in numbers}
    before[signal.SIGALRM] = signal.signal(signal.SIGALRM, on_alarm)
    sys.unraisablehook = on_unraisable
    try:
        yield
    except BaseException:
        if has_come:
            raise Interrupted from None
        raise
    finally:
        sys.unraisablehook = hook_before
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        for number, handler in before.items():
            signal.signal(number, handler)
