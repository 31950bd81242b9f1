# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The rotor in time: load grid, schedules of parameters, simulator of one rotor and of many."""
