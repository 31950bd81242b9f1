# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Entry point of `rotor-rig`: listens to Ctrl-C before the slow imports begin."""

import signal
import sys

from rotor_interfaces.exit_code import ExitCode


def main() -> None:
    """Run the command line; Ctrl-C ends it without a traceback."""
    signal.signal(signal.SIGINT, lambda *_: sys.exit(ExitCode.INTERRUPTED))
    from rotor_bringup.cli import app  # noqa: PLC0415 - after the signal

    app(prog_name='rotor-rig')


if __name__ == '__main__':
    main()
