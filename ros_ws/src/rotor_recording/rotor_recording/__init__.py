# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings: write, read, recover, verify and replay MCAP; import foreign files."""
