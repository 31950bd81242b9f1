# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings of other machines turned into the rig's own kind; docs/real_data.md."""
