# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Exit codes of the nodes and of `rotor-rig`; imported before anything slow."""

import enum


class ExitCode(enum.IntEnum):
    """What the exit code of every command means."""

    DONE = 0
    CHECK_FAILED = 1
    BAD_INPUT = 2
    PROCESS_FAILED = 3
    INTERRUPTED = 130
