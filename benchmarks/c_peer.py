# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The kernel in C, peer.c: compiled for this machine, with its struct."""

import ctypes
import functools
import subprocess
import tempfile
from pathlib import Path

BALLS_MAX = 64
FLAGS = ('-O3', '-march=native', '-ffast-math')


class Rotor(ctypes.Structure):
    """The struct of peer.c."""

    _fields_ = [
        *(
            (name, ctypes.c_double)
            for name in (
                *('m', 'm_b', 'k', 'damping_ratio', 'crack', 'beta', 'alpha', 'clearance', 'e'),
                *('contact', 'cage_ratio', 'speed', 'load'),
            )
        ),
        ('balls', ctypes.c_int),
        ('cos_ball', ctypes.c_double * BALLS_MAX),
        ('sin_ball', ctypes.c_double * BALLS_MAX),
    ]


@functools.cache
def c_library() -> ctypes.CDLL:
    """Compile peer.c and load it; nothing stays on the disk."""
    with tempfile.TemporaryDirectory(prefix='rotor-rig-benchmark-') as folder:
        source, made = Path(__file__).parent / 'peer.c', f'{folder}/peer'
        flags = (*FLAGS, '-fPIC')
        subprocess.run(['gcc', *flags, '-c', source, '-o', f'{made}.o'], check=True)
        # linked apart: with -ffast-math the link would flush subnormals in the whole process
        subprocess.run(['gcc', '-shared', f'{made}.o', '-lm', '-o', f'{made}.so'], check=True)
        return ctypes.CDLL(f'{made}.so')


def c_compiler() -> str:
    """Return the version of gcc."""
    done = subprocess.run(['gcc', '-dumpfullversion'], check=True, capture_output=True, text=True)
    return done.stdout.strip()
