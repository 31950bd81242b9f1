# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings opened with three readers that are not ours: mcap-ros2-support, rosbags, rerun.

What each of them counts and decodes is held against what was written.
"""

import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader

from rig_support import LiveRuns
from rotor_common.constants import NANOSECONDS
from rotor_interfaces import messages, topics
from rotor_interfaces.messages import OFFLINE, sample_stamp_ns, to_cdr
from rotor_interfaces.topics import Topic
from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock, encode
from rotor_recording.reading import Recording
from rotor_recording.recording import RecordingWriter

EPOCH_NS = 1_800_000_000 * NANOSECONDS
BLOCKS = 30


def sent() -> Iterator[tuple[Topic, int, Any]]:
    """Yield every topic of the contract, in a run of 0.75 s."""
    yield topics.CONFIG, EPOCH_NS, messages.string(OFFLINE, '{"scenario": {}}')
    for number in range(BLOCKS):
        stamp = sample_stamp_ns(EPOCH_NS, 256 * number, 10240)
        rows = np.zeros(256, WAVEFORM_DTYPE)
        rows['sample'] = 256 * number + np.arange(256)
        rows['disk_z'] = 1e-6 * np.sin(rows['sample'])
        block = encode(WaveformBlock(stamp, rows), OFFLINE)
        numbers = messages.joint_state(OFFLINE, stamp, 'rotor', ['a', 'b'], np.array([1.0, number]))
        status = messages.diagnostics(OFFLINE, stamp, 'a: b', level=1, text='odd', values={'k': 1})
        imu = messages.imu(OFFLINE, stamp, 'bearing_1', (0.0, 1.0, 2.0), 0.1)
        yield topics.MANEUVER_LOAD, stamp, messages.load(OFFLINE, stamp, 9.81, 0.5)
        for topic in (topics.WAVEFORM, topics.TRUTH_WAVEFORM, topics.SPECTRUM):
            yield topic, stamp, block
        for topic in (topics.SHAFT, topics.TRUTH, topics.INDICATORS):
            yield topic, stamp, numbers
        for topic in (topics.BEARING_1_IMU, topics.BEARING_2_IMU):
            yield topic, stamp, imu
        for topic in (topics.ALARM, topics.DIAGNOSTICS):
            yield topic, stamp, status
        yield topics.PROGRESS, stamp, messages.header(OFFLINE, stamp, 'recorder')
        yield topics.CLOCK, stamp, messages.clock(OFFLINE, stamp)


def full_name(topic: Topic) -> str:
    return '/' + topic.name.lstrip('/')


COUNTS = Counter(full_name(topic) for topic, _, _ in sent())


@pytest.fixture(scope='module')
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp('bags') / 'flight'
    with RecordingWriter(path, config={'scenario': {}}) as writer:
        for topic, stamp, message in sent():
            writer.write(topic, to_cdr(message), stamp, stamp)
    return path


@pytest.fixture(scope='module')
def file(folder: Path) -> Path:
    return folder / 'flight_0.mcap'


def test_all_topics_of_the_contract_are_in_the_example() -> None:
    assert COUNTS.keys() == {full_name(topic) for topic in topics.TOPICS}


def test_mcap_and_its_ros2_decoder(file: Path) -> None:
    decoded: Counter[str] = Counter()
    with file.open('rb') as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == COUNTS.total()
        for _, channel, _, message in reader.iter_decoded_messages():
            if channel.topic == '/rotor/waveform':
                first = decoded['/rotor/waveform'] * 256
                rows = np.frombuffer(bytes(message.data), WAVEFORM_DTYPE)
                assert rows['sample'].tolist() == list(range(first, first + 256))
                assert [f.name for f in message.fields] == list(WAVEFORM_DTYPE.names or ())
            if channel.topic == '/maneuver/load':
                assert message.accel.linear.y == 9.81
            decoded[channel.topic] += 1
    assert decoded == COUNTS


def test_rosbags_reads_the_folder_and_the_file(folder: Path, file: Path) -> None:
    for path in (folder, file):
        with Reader(path) as bag:
            announced = {known.topic: known.msgcount for known in bag.connections}
            read = Counter(connection.topic for connection, _, _ in bag.messages())
            assert announced == COUNTS
            assert read == COUNTS
            assert bag.start_time == EPOCH_NS
    with AnyReader([folder]) as bag:
        wanted = [known for known in bag.connections if known.topic == '/monitor/indicators']
        decoded: list[Any] = [
            bag.deserialize(data, known.msgtype) for known, _, data in bag.messages(wanted)
        ]
    values = [message.position[1] for message in decoded]
    assert values == list(range(BLOCKS))


def rerun(*arguments: object) -> str:
    done = subprocess.run(
        [sys.executable, '-m', 'rerun', *(str(argument) for argument in arguments)],
        check=False,
        capture_output=True,
        text=True,
        timeout=120,
        stdin=subprocess.DEVNULL,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
def test_reruns_importer(file: Path, tmp_path: Path) -> None:
    rerun('mcap', 'check', '--full', file)
    rerun('mcap', 'convert', file, '-o', tmp_path / 'flight.rrd')
    rows: Counter[tuple[str, str]] = Counter()
    pattern = r'Chunk\(\w+\) with (\d+) rows .* - (/\S+) - data columns: \[(.*)\]'
    listed = rerun('rrd', 'print', tmp_path / 'flight.rrd')
    for count, entity, columns in re.findall(pattern, listed):
        # what describes a channel or the look of its curve is no message
        if not re.search('McapChannel|SeriesLines', columns) and not entity.startswith('/__'):
            rows[entity, columns] += int(count)
    assert {entity for entity, _ in rows} >= COUNTS.keys()
    for (entity, columns), count in rows.items():
        # /position and the like: parts of a message stand below the topic's entity
        topic = max((name for name in COUNTS if f'{entity}/'.startswith(f'{name}/')), key=len)
        assert count == COUNTS[topic], (entity, columns)


@pytest.mark.slow
def test_a_live_recording_reads_alike_everywhere(live: LiveRuns) -> None:
    """Bytes as DDS delivered them, not as our offline writer lays them out."""
    bag = live('climb_dive', '--duration', '6', '--rate', 0).folder
    ours = Counter(Recording(bag).message_counts)
    assert ours['/rotor/waveform'] == 240
    decoded: Counter[str] = Counter()
    with (bag / f'{bag.name}_0.mcap').open('rb') as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, _, _ in reader.iter_decoded_messages():
            decoded[channel.topic] += 1
    assert decoded == ours
    read: Counter[str] = Counter()
    with AnyReader([bag]) as rosbag:
        for connection, _, data in rosbag.messages():
            rosbag.deserialize(data, connection.msgtype)
            read[connection.topic] += 1
    assert read == ours
