# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Data sets: seeded grids of flights of virtual machines, flown in lock-step and written."""
