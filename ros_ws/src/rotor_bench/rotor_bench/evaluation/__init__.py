# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Detectors tested blind on virtual machines: isolation, running, statistics, report."""
