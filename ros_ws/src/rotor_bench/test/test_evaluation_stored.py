# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Stored flights are whole, or said not to be: none ends early with another."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from rotor_bench.dataset.suite import Flight
from rotor_bench.errors import DatasetError
from rotor_bench.evaluation.sources import Stored
from rotor_interfaces import messages, topics
from rotor_interfaces.messages import OFFLINE, sample_stamp_ns
from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock, decode, encode
from rotor_recording.reading import Recording
from rotor_recording.recording import RecordingWriter

RATE_HZ = 1024
BLOCK = 256
WHOLE = ((0, 256), (256, 256), (512, 256), (768, 256))
"""(first sample, samples) of the blocks of a flight of 1 s."""


def stored(folder: Path, name: str, blocks: tuple[tuple[int, int], ...]) -> Flight:
    """Write a recording of such blocks; return its flight of 1 s."""
    (folder / 'flights').mkdir(exist_ok=True)
    with RecordingWriter.single_file(folder / 'flights' / f'{name}.mcap') as writer:
        for first, count in blocks:
            rows = np.zeros(count, WAVEFORM_DTYPE)
            rows['sample'] = first + np.arange(count)
            stamp_ns = sample_stamp_ns(0, first, RATE_HZ)
            data = messages.to_cdr(encode(WaveformBlock(stamp_ns, rows), OFFLINE))
            writer.write(topics.WAVEFORM, data, stamp_ns, stamp_ns)
    scenario: Any = SimpleNamespace(rate_hz=RATE_HZ)
    return cast('Flight', SimpleNamespace(name=name, duration_s=1.0, scenario=scenario))


def flown(folder: Path, flights: list[Flight]) -> list[list[int]]:
    return [[block.first_sample for block in row] for row in Stored(folder).fly(flights)]


def test_a_block_whose_samples_do_not_follow_is_damage_of_its_file(tmp_path: Path) -> None:
    flight = stored(tmp_path, 'bad', ((0, 256), (256, 1)))
    file = tmp_path / 'flights' / 'bad.mcap'
    with RecordingWriter.single_file(tmp_path / 'new.mcap') as writer:
        for message in Recording(file).messages():
            block = messages.from_cdr(message.data, message.type)
            rows = np.zeros(256, WAVEFORM_DTYPE)
            rows['sample'] = decode(block).first_sample
            data = messages.to_cdr(encode(WaveformBlock(0, rows), OFFLINE))
            writer.write(topics.WAVEFORM, data, message.log_time_ns, message.log_time_ns)
    (tmp_path / 'new.mcap').replace(file)
    with pytest.raises(DatasetError, match=r'bad\.mcap is damaged after sample 0: the samples of'):
        flown(tmp_path, [flight])


def test_whole_flights_come_in_lock_step(tmp_path: Path) -> None:
    flights = [stored(tmp_path, name, WHOLE) for name in 'ab']
    assert flown(tmp_path, flights) == [[0, 0], [256, 256], [512, 512], [768, 768]]


@pytest.mark.parametrize('order', [('a', 'short'), ('short', 'a'), ('short',)])
@pytest.mark.parametrize('blocks', [WHOLE[:3], WHOLE[:2] + WHOLE[3:], WHOLE[1:], ((0, 512),) * 2])
def test_a_flight_that_is_not_whole_is_named(
    tmp_path: Path, order: tuple[str, ...], blocks: tuple[tuple[int, int], ...]
) -> None:
    made = {'a': stored(tmp_path, 'a', WHOLE), 'short': stored(tmp_path, 'short', blocks)}
    with pytest.raises(DatasetError, match=r'short\.mcap should hold 1024 samples'):
        flown(tmp_path, [made[name] for name in order])


@pytest.mark.parametrize('order', [('a', 'long'), ('long', 'a'), ('long',)])
def test_a_flight_that_is_too_long_is_named(tmp_path: Path, order: tuple[str, ...]) -> None:
    made = {'a': stored(tmp_path, 'a', WHOLE)}
    made['long'] = stored(tmp_path, 'long', (*WHOLE, (1024, 256)))
    with pytest.raises(DatasetError, match=r'long\.mcap .* for the first 1024 only'):
        flown(tmp_path, [made[name] for name in order])


def test_blocks_of_other_lengths_are_said(tmp_path: Path) -> None:
    flights = [stored(tmp_path, 'a', WHOLE), stored(tmp_path, 'b', ((0, 512), (512, 512)))]
    with pytest.raises(DatasetError, match=r'flights a to b in .* differ in the length'):
        flown(tmp_path, flights)
