# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The maneuvers that come with the rig, one file each, named like their `profile`."""
