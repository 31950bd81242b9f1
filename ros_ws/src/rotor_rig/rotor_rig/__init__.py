# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Scenarios and the offline run: the same objects as in the ROS graph, without ROS."""
