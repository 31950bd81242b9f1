# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A small made-up run as wire bytes, and processes and peers to record and replay it."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self

import numpy as np

from rotor_interfaces import messages, topics
from rotor_interfaces.channels import CHANNEL_COLUMNS
from rotor_interfaces.messages import OFFLINE, sample_stamp_ns, to_cdr
from rotor_interfaces.topics import Topic
from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock, encode
from rotor_recording.recording import RecordingWriter

EPOCH_NS = 1_800_000_000_000_000_000
RATE_HZ = 10240
BLOCK = 256
BLOCK_NS = 25_000_000
CONFIG_TEXT = '{"scenario": {"name": "made up"}}'


class Wire(NamedTuple):
    """One message as it goes over the wire."""

    topic: Topic
    stamp_ns: int
    data: bytes


def block_bytes(number: int, *, first_sample: int | None = None, seed: int = 0) -> bytes:
    """Return the waveform block `number`, full of noise, which no compression shrinks."""
    first = number * BLOCK if first_sample is None else first_sample
    rows = np.zeros(BLOCK, WAVEFORM_DTYPE)
    rows['sample'] = first + np.arange(BLOCK)
    rows['time'] = np.arange(BLOCK) / RATE_HZ
    noise = np.random.default_rng([seed, number])
    for name in CHANNEL_COLUMNS:
        rows[name] = noise.standard_normal(BLOCK)
    return to_cdr(encode(WaveformBlock(stamp_of(number), rows), OFFLINE))


def stamp_of(block: int, epoch_ns: int = EPOCH_NS) -> int:
    """Return the stamp of a block in ns."""
    return sample_stamp_ns(epoch_ns, block * BLOCK, RATE_HZ)


def made_up_run(blocks: int) -> Iterator[Wire]:
    """Yield config, then for each block waveform, truth, load, IMU, clock and alarm."""
    yield Wire(topics.CONFIG, EPOCH_NS, to_cdr(messages.string(OFFLINE, CONFIG_TEXT)))
    for number in range(blocks):
        stamp = stamp_of(number)
        yield Wire(topics.WAVEFORM, stamp, block_bytes(number))
        truth = messages.joint_state(
            OFFLINE, stamp, 'rotor', ['crack_stiffness_ratio'], np.array([0.1 + number])
        )
        yield Wire(topics.TRUTH, stamp, to_cdr(truth))
        load = messages.load(OFFLINE, stamp, 9.81, float(number))
        yield Wire(topics.MANEUVER_LOAD, stamp, to_cdr(load))
        imu = messages.imu(OFFLINE, stamp, 'bearing_1', (0.0, 1.0, 2.0), 0.1)
        yield Wire(topics.BEARING_1_IMU, stamp, to_cdr(imu))
        yield Wire(topics.CLOCK, stamp, to_cdr(messages.clock(OFFLINE, stamp)))
        alarm = messages.diagnostics(
            OFFLINE, stamp, 'monitor: crack', level=1, text='odd', values={'ratio [1]': 2}
        )
        yield Wire(topics.ALARM, stamp, to_cdr(alarm))
        spectrum = np.zeros(4, [('order', '<f4'), ('frequency', '<f4')])
        table = encode(WaveformBlock(stamp, spectrum), OFFLINE)
        yield Wire(topics.SPECTRUM, stamp, to_cdr(table))


def write_all(writer: RecordingWriter, wires: Sequence[Wire] | Iterator[Wire]) -> None:
    """Write messages with log time = publish time = stamp."""
    for wire in wires:
        writer.write(wire.topic, wire.data, wire.stamp_ns, wire.stamp_ns)


def bag(folder: Path, blocks: int = 40) -> Path:
    """Write the made-up run as a bag and return its folder."""
    with RecordingWriter(folder, config={'scenario': {'name': 'made up'}}) as writer:
        write_all(writer, made_up_run(blocks))
    return folder


def single(path: Path, blocks: int = 40) -> Path:
    """Write the made-up run as one file and return its path."""
    with RecordingWriter.single_file(path) as writer:
        write_all(writer, made_up_run(blocks))
    return path


def private_ros(log_folder: Path) -> dict[str, str]:
    """Return the environment of a ROS domain of its own for each test."""
    from live_flight import private_domain

    return {
        'ROS_DOMAIN_ID': private_domain(),
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
        'ROS_LOG_DIR': str(log_folder),
    }


@contextmanager
def process(
    arguments: Sequence[str], environment: dict[str, str], **options: Any
) -> Iterator[subprocess.Popen[str]]:
    """Run `python ARGUMENTS` and see to it that it has ended afterwards."""
    with subprocess.Popen(
        [sys.executable, *arguments],
        env={**os.environ, **environment},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **options,
    ) as child:
        try:
            yield child
        finally:
            with suppress(ProcessLookupError):
                child.send_signal(signal.SIGKILL)
            child.communicate()


class Peer:
    """An independent ROS node in a context of its own, for the test's side of the wire."""

    def __init__(self, domain_id: int) -> None:
        import rclpy
        from rclpy.experimental.events_executor import EventsExecutor

        self._context = rclpy.Context()
        rclpy.init(context=self._context, domain_id=domain_id)
        self.node = rclpy.create_node('peer', context=self._context)
        self._executor = EventsExecutor(context=self._context)
        self._executor.add_node(self.node)

    def spin_until(self, condition: Callable[[], bool], timeout_s: float = 300.0) -> bool:
        """Handle what comes until the condition holds; say whether it did in time."""
        deadline = time.monotonic() + timeout_s
        while not condition():
            left_s = deadline - time.monotonic()
            if left_s < 0.0:
                return False
            self._executor.spin_once(min(0.02, max(left_s, 1e-3)))  # of less, DDS makes no end
        return True

    def spin_for(self, seconds: float) -> None:
        """Handle what comes for a while."""
        self.spin_until(lambda: False, seconds)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()
