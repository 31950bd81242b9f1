# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The sensors of a machine: its preset, its own fixed errors, and the effect of a sensor fault."""

import math
from typing import Any

import numpy as np

from rotor_bench.dataset.suite_config import NoisePreset, SensorDraws
from rotor_interfaces.channels import ACCELERATION_COLUMNS
from rotor_sim.sensors.sensor_config import SensorConfig

PLANES = ('disk', 'brg1', 'brg2')
CLASS = 'realistic'
"""Preset of rotor_sim that every noisy machine starts from."""

Nested = dict[str, Any]


def sensors(
    noise: NoisePreset, table: SensorDraws, draw: np.random.Generator, *, encoder: bool, fault: str
) -> Nested:
    """Return the plain data of `sensors` of a scenario.

    `draw` gives the fixed errors: scale, cross-axis, bias and runout of this machine's sensors, the
    same on each of its flights. `fault` is '' or one of `table.faults`.
    """
    common = {'imu_rate_hz': 0, 'encoder': encoder}
    if noise == 'none':
        return {**common, **_faulty({}, table, fault)}
    factor = table.noise_factors[noise]
    preset = SensorConfig.from_mapping({'preset': CLASS})
    errors = _fixed_errors(table, draw)
    for kind, channel in preset.groups.items():
        errors[kind]['noise_density'] = factor * channel.noise_density
        errors[kind]['bias_walk'] = factor * channel.bias_walk
    return {'preset': CLASS, **common, **_faulty(errors, table, fault)}


def _fixed_errors(table: SensorDraws, draw: np.random.Generator) -> Nested:
    def within(limit: float) -> float:
        return float(draw.uniform(-limit, limit))

    probes: Nested = {}
    for plane in PLANES:
        surface = [
            (order, float(draw.uniform(*limits)), float(draw.uniform(-math.pi, math.pi)))
            for order, limits in enumerate(table.runout_m, start=1)
        ]
        for axis, late in (('y', 0.0), ('z', 0.5 * math.pi)):  # z sees the surface later
            probes[f'{plane}_{axis}'] = {
                'bias': within(table.probe_bias_m),
                'scale_error': within(table.probe_scale_error),
                'cross_axis': within(table.cross_axis),
                'runout': [
                    {'order': order, 'amplitude_m': size, 'phase_rad': phase - order * late}
                    for order, size, phase in surface
                ],
            }
    accelerometers = {
        name: {
            'scale_error': within(table.accelerometer_scale_error),
            'cross_axis': within(table.cross_axis),
        }
        for name in ACCELERATION_COLUMNS
    }
    load = {'bias': within(table.load_bias_m_s2), 'scale_error': within(table.load_scale_error)}
    return {
        'proximity': probes,
        'accelerometers': accelerometers,
        'load': {'load_y': load},
        'keyphasor': {},
    }


def _faulty(errors: Nested, table: SensorDraws, fault: str) -> Nested:
    """Return sensors with a fault of one or all probes, the key-phasor or the load sensor."""
    probes = errors.setdefault('proximity', {})
    disk_y = probes.setdefault('disk_y', {})
    match fault:
        case 'probe_gain':
            disk_y['scale_error'] = disk_y.get('scale_error', 0.0) + table.fault_gain
        case 'probe_scratch':  # a new mark on the track: one more of each order of runout
            for plane_axis in ('disk_y', 'disk_z'):
                late = 0.5 * math.pi if plane_axis == 'disk_z' else 0.0
                probe = probes.setdefault(plane_axis, {})
                probe['runout'] = probe.get('runout', []) + [
                    {'order': k, 'amplitude_m': table.fault_scratch_m, 'phase_rad': -k * late}
                    for k in (1, 2, 3)
                ]
        case 'probe_noise':
            base = probes.get('noise_density', 0.0)
            probes['noise_density'] = base + table.fault_noise_m_sqrt_hz
        case 'probe_dropouts':
            probes['dropout_rate'] = table.fault_dropouts_per_s
        case 'missed_pulses':
            errors.setdefault('keyphasor', {})['missed_probability'] = table.fault_pulses
        case 'double_pulses':
            errors.setdefault('keyphasor', {})['double_probability'] = table.fault_pulses
        case 'load_gain':
            load = errors.setdefault('load', {}).setdefault('load_y', {})
            load['scale_error'] = load.get('scale_error', 0.0) + table.fault_load_gain
    return errors
