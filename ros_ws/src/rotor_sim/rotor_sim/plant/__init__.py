# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The physics: parameters, equations of motion, static equilibrium, integrator."""
