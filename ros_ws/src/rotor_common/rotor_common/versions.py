# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The versions of what a run was made with, as a recording and a data set keep them."""

from importlib.metadata import PackageNotFoundError, version


def versions() -> dict[str, str]:
    """Return the versions that a repeated run should have."""
    names = ('rotor_bringup', 'rotor_sim', 'numpy', 'numba', 'scipy', 'mcap', 'rosbags')
    found = {}
    for name in names:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = 'not installed as a package'
    return found
