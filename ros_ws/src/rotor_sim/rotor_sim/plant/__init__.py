# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The rotor's equations: elements, assembly, statics and the generated engine."""
