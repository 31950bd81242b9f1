# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Scenarios and the offline run: the same objects as in the ROS graph, without ROS."""

from rotor_rig.scenario import Scenario, load_scenario

__all__ = ['Scenario', 'load_scenario']
