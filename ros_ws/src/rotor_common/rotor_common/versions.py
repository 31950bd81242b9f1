# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Versions of the software that made a run, as stored in recordings and data sets."""

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
