# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Scenarios, the offline pipeline, process supervision and the `rotor-rig` command line."""
