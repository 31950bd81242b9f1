# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Shared base of all packages: constants, configuration, errors, exit codes, file access."""
