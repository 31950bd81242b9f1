# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Entry point of `rotor-rig`: listens to Ctrl-C before the slow imports begin."""

import os
import signal
import sys

from rotor_common.exit_code import ExitCode


def main() -> None:
    """Run the command line; Ctrl-C ends it without a traceback."""
    signal.signal(signal.SIGINT, lambda *_: sys.exit(ExitCode.INTERRUPTED))
    from rotor_common import console  # noqa: PLC0415

    console.open_standard_streams()
    console.allow_any_width()
    try:
        os.getcwd()  # noqa: PTH109 - libraries need it when they are imported
    except FileNotFoundError:
        sys.stderr.write('error: the folder you are in has been removed; change to another one\n')
        sys.exit(ExitCode.BAD_INPUT)
    from rotor_bringup.cli import app  # noqa: PLC0415 - after the signal

    try:
        try:
            app(prog_name='rotor-rig')
        finally:
            sys.stdout.flush()
    except console.OutputError as error:  # as of --help
        sys.stderr.write(f'error: {error}\n')
        sys.exit(ExitCode.BAD_INPUT)


if __name__ == '__main__':
    main()
