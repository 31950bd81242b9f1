# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A made-up flight as messages: every topic that the view shows, with known numbers."""

import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from rotor_common.constants import NANOSECONDS
from rotor_interfaces import messages, topics
from rotor_interfaces.messages import OFFLINE, sample_stamp_ns
from rotor_interfaces.topics import Topic
from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock, encode

EPOCH_NS = 1_800_000_000 * NANOSECONDS
RATE_HZ = 10240
BLOCK = 256
SPEED_RAD_S = 352.0
WINDOW_S = 0.25

Outgoing = tuple[Topic, int, Any]


def stamp_of(time_s: float) -> int:
    return EPOCH_NS + round(time_s * NANOSECONDS)


def load_factor(time_s: Any) -> Any:
    return 1.0 + 2.0 * np.sin(np.asarray(time_s) * 0.8) ** 2


def rows_of(first: int, count: int) -> Any:
    """Return known signals: disk z is 10 um at 1x and 20 um at 3x, disk y sits at the load."""
    rows = np.zeros(count, WAVEFORM_DTYPE)
    sample = first + np.arange(count)
    time = sample / RATE_HZ
    angle = SPEED_RAD_S * time
    rows['time'] = np.arange(count) / RATE_HZ
    rows['sample'] = sample
    rows['angle'] = angle
    rows['disk_y'] = 1e-6 * (9.0 * load_factor(time) + 3.0 * np.cos(angle))
    rows['disk_z'] = 1e-6 * (10.0 * np.sin(angle) + 20.0 * np.sin(3.0 * angle))
    for bearing in ('brg1', 'brg2'):
        rows[f'{bearing}_y'] = 0.3 * rows['disk_y']
        rows[f'{bearing}_z'] = 0.3 * rows['disk_z']
        rows[f'{bearing}_ay'] = 2.0 * np.cos(angle)
        rows[f'{bearing}_az'] = 5.0 * np.sin(3.0 * angle)
    rows['load_y'] = 9.81 * load_factor(time)
    return rows


def block_message(first: int, count: int = BLOCK) -> Outgoing:
    stamp = sample_stamp_ns(EPOCH_NS, first, RATE_HZ)
    block = WaveformBlock(stamp, rows_of(first, count))
    return topics.WAVEFORM, stamp, encode(block, OFFLINE)


def named(topic: Topic, time_s: float, numbers: dict[str, float]) -> Outgoing:
    values = np.array([*numbers.values()])
    stamp = stamp_of(time_s)
    return topic, stamp, messages.joint_state(OFFLINE, stamp, 'rotor', [*numbers], values)


def status(topic: Topic, time_s: float, level: int, text: str) -> Outgoing:
    stamp = stamp_of(time_s)
    message = messages.diagnostics(
        OFFLINE, stamp, 'monitor: crack', level=level, text=text, values={}
    )
    return topic, stamp, message


def spectrum(time_s: float) -> Outgoing:
    orders = np.arange(641) / 64
    rows = np.zeros(641, [('order', '<f4'), ('frequency', '<f4'), ('disk_z', '<f4')])
    rows['order'] = orders
    for order, amplitude in ((1.0, 10e-6), (3.0, 20e-6)):
        rows['disk_z'] += amplitude * np.exp(-0.5 * ((orders - order) * 64 / 1.5) ** 2)
    stamp = stamp_of(time_s)
    return topics.SPECTRUM, stamp, encode(WaveformBlock(stamp, rows), OFFLINE)


def flight(duration_s: float = 3.0, without: tuple[Topic, ...] = ()) -> Iterator[Outgoing]:
    """Yield a whole flight in the order of a live run: the load ahead, alarms behind."""
    config = json.dumps({'scenario': {'rotor': {'crack_angle_rad': 1.0}, 'monitor': {}}})
    everything: list[tuple[float, Outgoing]] = [
        (-1.0, (topics.CONFIG, 0, messages.string(OFFLINE, config)))
    ]
    for k in range(round(duration_s * 100) + 1):
        stamp = stamp_of(k / 100)
        load = messages.load(OFFLINE, stamp, 9.81 * float(load_factor(k / 100)), 0.0)
        everything.append((k / 100 - 0.5, (topics.MANEUVER_LOAD, stamp, load)))
    for first in range(0, round(duration_s * RATE_HZ), BLOCK):
        time_s = first / RATE_HZ
        everything.append((time_s, block_message(first)))
        everything.append((time_s, named(topics.TRUTH, time_s, {'crack_stiffness_ratio': 0.1})))
        stamp = stamp_of(time_s)
        shaft = messages.joint_state(
            OFFLINE, stamp, 'rotor', ['shaft'], np.zeros(1), velocity=np.array([SPEED_RAD_S])
        )
        everything.append((time_s, (topics.SHAFT, stamp, shaft)))
    for k in range(1, int(duration_s / WINDOW_S)):
        time_s = k * WINDOW_S
        ratios = {'ratio_2_1': 0.1, 'ratio_3_1': 2.0, 'ratio_4_1': 0.05, 'ratio_2.5_1': 0.02}
        numbers = {f'disk_z/{name}': value * time_s for name, value in ratios.items()}
        numbers['crack_ratio_low'] = 0.01 * time_s
        everything.append((time_s + 0.05, named(topics.INDICATORS, time_s, numbers)))
        everything.append((time_s + 0.05, spectrum(time_s)))
    for time_s, level, text in (
        (0.0, 3, 'no window yet'),
        (0.5, 0, 'all rules are below their limits'),
        (1.5, 1, 'crack_ratio_low = 0.015: above the WARN limit'),
        (2.0, 2, 'crack_ratio_low = 0.02: above the ERROR limit'),
    ):
        if time_s <= duration_s:
            everything.append((time_s, status(topics.ALARM, time_s, level, text)))
    everything.sort(key=lambda item: item[0])
    yield from (outgoing for _, outgoing in everything if outgoing[0] not in without)
