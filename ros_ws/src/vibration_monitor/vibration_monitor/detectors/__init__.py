# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Crack detectors with one common protocol; compared in docs/evaluation.md."""
