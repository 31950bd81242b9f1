# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of data sets."""

from rotor_common.errors import RigError


class DatasetError(RigError, ValueError):
    """A suite or a folder of a data set that cannot be used."""
