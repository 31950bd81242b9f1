# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The wire contract of the rig: topics, QoS, the waveform block and message builders."""
