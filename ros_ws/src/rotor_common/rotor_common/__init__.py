# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""What every package of the rig shares: constants, configuration, errors, exit codes, files."""
