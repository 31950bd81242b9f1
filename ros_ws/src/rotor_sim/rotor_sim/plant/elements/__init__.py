# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The elements that come with the rig, one file each, named like their `kind`."""
