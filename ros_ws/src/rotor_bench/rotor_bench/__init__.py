# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The test bench of detectors: labelled data sets and blind evaluation."""
