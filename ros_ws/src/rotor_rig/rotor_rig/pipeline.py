# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Offline run without ROS: scenario -> load grid -> simulator -> monitor, block by block."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from maneuver_gen.load_grid import load_grid
from rotor_common.constants import LOAD_STEP_NS
from rotor_common.errors import WireError
from rotor_common.versions import versions
from rotor_interfaces import messages, topics
from rotor_interfaces.messages import OFFLINE, sample_stamp_ns
from rotor_interfaces.topics import Topic
from rotor_interfaces.waveform import WaveformBlock
from rotor_recording.reading import Recording, waveform_blocks, waveform_name
from rotor_recording.recording import RecordingWriter
from rotor_rig.scenario_model import Scenario
from rotor_sim.messages import block_messages, config_message
from rotor_sim.stream.load_grid import LoadGrid
from rotor_sim.stream.simulator import RotorSimulator, SimulatedBlock
from vibration_monitor.messages import MonitorMessages
from vibration_monitor.monitor import IndicatorRecord, VibrationMonitor

Outgoing = tuple[Topic, int, Any]


@dataclass(frozen=True)
class PipelineStep:
    """What one block added: the block itself, the monitor's new windows, all messages."""

    block: SimulatedBlock
    records: list[IndicatorRecord]
    messages: list[Outgoing]


def simulate(scenario: Scenario) -> Iterator[PipelineStep]:
    """Yield the run block by block, exactly as a live run would go.

    Raises:
        RigError: a run that cannot be computed.

    """
    config = scenario.rotor_sim()
    points = load_grid(scenario.maneuver, scenario.duration_s)
    grid = LoadGrid()
    for k, (load_y, load_z) in enumerate(points):
        grid.append(k, load_y, load_z)
    simulator = RotorSimulator(config)
    simulator.prepare(grid)
    monitor = VibrationMonitor(scenario.monitor)
    monitor_messages = MonitorMessages(OFFLINE)
    epoch_ns = scenario.epoch_ns
    next_point = 0
    end_sample = round(scenario.duration_s * config.rate_hz)
    told = config_message(OFFLINE, scenario.plain(), versions(), config.sensors.column_units)
    first: list[Outgoing] = [(topics.CONFIG, epoch_ns, told)]
    while simulator.next_sample < end_sample:
        count = min(config.block_samples, end_sample - simulator.next_sample)
        block = simulator.advance(count, grid)
        outgoing, first = first, []
        end_ns = sample_stamp_ns(epoch_ns, simulator.next_sample, config.rate_hz)
        while next_point < len(points) and epoch_ns + next_point * LOAD_STEP_NS <= end_ns:
            stamp_ns = epoch_ns + next_point * LOAD_STEP_NS
            load = messages.load(OFFLINE, stamp_ns, *points[next_point])
            outgoing.append((topics.MANEUVER_LOAD, stamp_ns, load))
            next_point += 1
        outgoing += block_messages(OFFLINE, config, epoch_ns, block)
        outgoing.append((topics.CLOCK, end_ns, messages.clock(OFFLINE, end_ns)))
        stamp_ns = sample_stamp_ns(epoch_ns, block.first_sample, config.rate_hz)
        records = monitor.push(WaveformBlock(stamp_ns, block.rows))
        outgoing += monitor_messages.after_block(monitor, records, stamp_ns)
        yield PipelineStep(block, records, outgoing)


def record(scenario: Scenario, path: Path) -> Iterator[PipelineStep]:
    """Yield the run as `simulate` does and write it to the MCAP file `path` as it goes."""
    config: dict[str, Any] = {'scenario': scenario.plain(), 'versions': versions()}
    if scenario.sensors.instruments:
        config['column_units'] = scenario.sensors.column_units
    with RecordingWriter.single_file(path, config=config) as writer:
        for step in simulate(scenario):
            for topic, stamp_ns, message in step.messages:
                writer.write(topic, messages.to_cdr(message), stamp_ns, stamp_ns)
            yield step


def analyze(recording: Recording, monitor: VibrationMonitor) -> Iterator[IndicatorRecord]:
    """Yield what the monitor says about the recorded waveform."""
    for _, windows in analyze_blocks(recording, monitor):
        yield from windows


def analyze_blocks(
    recording: Recording, monitor: VibrationMonitor
) -> Iterator[tuple[WaveformBlock, list[IndicatorRecord]]]:
    """Yield each block of the recorded waveform with the windows that it completes.

    A block that the monitor refuses is left out and counted in `recording.damage`, as the live
    monitor does; the sample index shows the gap.
    """
    refused = 0
    for block in waveform_blocks(recording):
        try:
            yield block, monitor.push(block)
        except WireError as error:
            refused += 1
            reason = f'the first is stamped {block.stamp_ns} ns: {error}'
            name = waveform_name(recording)
            recording.leave_out(f'blocks of {name} that the monitor refuses', refused, reason)
