# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Crack detectors behind one protocol; docs/evaluation.md compares them."""
