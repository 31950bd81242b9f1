# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Figures 5 to 19 of Hou et al. 2016, reproduced, and how far they agree."""
