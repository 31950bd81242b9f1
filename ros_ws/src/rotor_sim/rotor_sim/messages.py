# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The messages of one simulated block, for ROS and for files."""

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from rotor_interfaces import messages, topics
from rotor_interfaces.channels import COLUMN_UNITS
from rotor_interfaces.messages import MessageFactory, sample_stamp_ns
from rotor_interfaces.topics import ROTOR_FRAME, Topic
from rotor_interfaces.waveform import WaveformBlock, encode
from rotor_sim.rotor_config import RotorSimConfig
from rotor_sim.stream.simulator import SimulatedBlock

Outgoing = tuple[Topic, int, Any]
"""Topic, stamp in ns, message."""


def block_messages(
    factory: MessageFactory, config: RotorSimConfig, epoch_ns: int, block: SimulatedBlock
) -> Iterator[Outgoing]:
    """Yield every message of one block, the waveform first; stamps are epoch + n/rate."""
    stamp = sample_stamp_ns(epoch_ns, block.first_sample, config.rate_hz)
    sensed = WaveformBlock(stamp, block.rows, ROTOR_FRAME)
    yield topics.WAVEFORM, stamp, encode(sensed, factory)
    if config.sensors.truth_waveform:
        truth = WaveformBlock(stamp, block.truth_rows, ROTOR_FRAME)
        yield topics.TRUTH_WAVEFORM, stamp, encode(truth, factory)
    yield (
        topics.SHAFT,
        stamp,
        messages.joint_state(
            factory,
            stamp,
            ROTOR_FRAME,
            ['shaft'],
            np.array([block.shaft_angle_rad]),
            velocity=np.array([block.shaft_speed_rad_s]),
        ),
    )
    yield (
        topics.TRUTH,
        stamp,
        messages.joint_state(
            factory, stamp, ROTOR_FRAME, list(block.truth), np.array([*block.truth.values()])
        ),
    )
    variance = _sample_variance(config, block)
    for index, bearing in enumerate((topics.BEARING_1_IMU, topics.BEARING_2_IMU)):
        for sample in block.imu[index]:
            imu_stamp = sample_stamp_ns(epoch_ns, sample.index, config.sensors.imu_rate_hz)
            yield (
                bearing,
                imu_stamp,
                messages.imu(
                    factory,
                    imu_stamp,
                    f'bearing_{index + 1}',
                    (0.0, sample.specific_force_y_m_s2, sample.specific_force_z_m_s2),
                    variance,
                ),
            )


def _sample_variance(config: RotorSimConfig, block: SimulatedBlock) -> float:
    """Return the variance of the white noise of one acceleration sample, (m/s^2)^2.

    The sum of the accelerometer's, over the band up to half the rate, and the recorder's.
    """
    density = config.sensors.accelerometers.noise_density
    recorder = block.truth['acceleration_noise_m_s2']
    return float(density**2 * 0.5 * config.rate_hz + recorder**2)


def config_message(
    factory: MessageFactory,
    scenario: Mapping[str, Any],
    versions: Mapping[str, str],
    column_units: Mapping[str, str] = COLUMN_UNITS,
) -> Any:
    """Return the message of `rotor/config`: everything needed to repeat the run, as JSON."""
    return messages.string(
        factory,
        json.dumps(
            {'scenario': scenario, 'versions': versions, 'column_units': column_units},
            sort_keys=True,
        ),
    )
