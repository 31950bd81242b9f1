# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The wire contract: topics, QoS, channels, the waveform block, message builders, node template."""
