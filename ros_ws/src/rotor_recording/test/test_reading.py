# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The reader: order, memory, choice of files, and what it makes of waveforms."""

import re
import shutil
import tracemalloc
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer

from recording_support import EPOCH_NS, bag, block_bytes, made_up_run, single, write_all
from rotor_interfaces import topics
from rotor_interfaces.messages import typestore
from rotor_interfaces.topics import Topic
from rotor_recording.errors import RecordingError
from rotor_recording.reading import Recording, waveform_blocks
from rotor_recording.recording import RecordingWriter

LOG_TIMES = st.lists(st.tuples(st.integers(0, 50), st.booleans()), max_size=60)


@given(log_times=LOG_TIMES)
@settings(deadline=None, max_examples=50)
def test_messages_come_by_log_time_and_equal_ones_in_file_order(
    tmp_path_factory: pytest.TempPathFactory, log_times: list[tuple[int, bool]]
) -> None:
    path = tmp_path_factory.mktemp('order') / 'run.mcap'
    with RecordingWriter.single_file(path) as writer:
        for number, (log_time, ends_chunk) in enumerate(log_times):
            writer.write(topics.CLOCK, number.to_bytes(12, 'little'), log_time, number)
            if ends_chunk:
                writer.flush()
    read = [(m.log_time_ns, m.publish_time_ns) for m in Recording(path).messages()]
    assert read == sorted((log_time, number) for number, (log_time, _) in enumerate(log_times))


@given(log_times=LOG_TIMES, start=st.integers(0, 60))
@settings(deadline=None, max_examples=50)
def test_a_start_time_leaves_out_what_is_before(
    tmp_path_factory: pytest.TempPathFactory, log_times: list[tuple[int, bool]], start: int
) -> None:
    path = tmp_path_factory.mktemp('start') / 'run.mcap'
    with RecordingWriter.single_file(path) as writer:
        for log_time, ends_chunk in log_times:
            writer.write(topics.CLOCK, bytes(12), log_time, log_time)
            if ends_chunk:
                writer.flush()
    recording = Recording(path)
    everything = [m.log_time_ns for m in recording.messages()]
    assert [m.log_time_ns for m in recording.messages(start_ns=start)] == [
        log_time for log_time in everything if log_time >= start
    ]


def test_topics_can_be_chosen(tmp_path: Path) -> None:
    recording = Recording(bag(tmp_path / 'bag', 5))
    assert {m.topic for m in recording.messages(['/rotor/truth'])} == {'/rotor/truth'}
    assert list(recording.messages([])) == []


def test_a_long_recording_is_streamed(tmp_path: Path) -> None:
    path = tmp_path / 'long.mcap'
    with RecordingWriter.single_file(path) as writer:
        for number in range(1500):
            writer.write(topics.WAVEFORM, block_bytes(number % 50), EPOCH_NS + number, 0)
    size = path.stat().st_size
    assert size > 15 * 2**20
    tracemalloc.start()
    count = sum(1 for _ in Recording(path).messages())
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert count == 1500
    # packed, unpacked and as messages, two chunks of 1 MiB at a time
    assert peak < 8 * 2**20


# Files of a bag


def test_all_files_of_a_split_bag_are_read(tmp_path: Path) -> None:
    folder = tmp_path / 'bag'
    folder.mkdir()
    for number in (10, 9):
        with RecordingWriter.single_file(folder / f'run_{number}.mcap') as writer:
            writer.write(topics.CLOCK, bytes(12), number, number)
    recording = Recording(folder)
    assert [m.log_time_ns for m in recording.messages()] == [9, 10]
    assert recording.message_counts == {'/clock': 2}
    assert (recording.start_ns, recording.end_ns) == (9, 10)
    # equal log times: run_9 stands before run_10
    shutil.copy(folder / 'run_9.mcap', folder / 'run_11.mcap')
    assert [file.path.name for file in Recording(folder)._files] == [
        'run_9.mcap', 'run_10.mcap', 'run_11.mcap',
    ]  # fmt: skip


def test_a_missing_file_of_a_bag_is_told(tmp_path: Path) -> None:
    folder = bag(tmp_path / 'bag', 3)
    metadata = folder / 'metadata.yaml'
    text = metadata.read_text().replace('  - bag_0.mcap\n', '  - bag_0.mcap\n  - bag_1.mcap\n')
    metadata.write_text(text)
    recording = Recording(folder)
    assert recording.damage == [
        'bag: bag_1.mcap of metadata.yaml is missing, so its messages are left out'
    ]
    assert recording.message_counts['/rotor/waveform'] == 3


@pytest.mark.parametrize('text', ['', 'a: [', '- 1', 'rosbag2_bagfile_information: 3', '\0'])
def test_a_damaged_metadata_yaml_is_told_and_done_without(tmp_path: Path, text: str) -> None:
    folder = bag(tmp_path / 'bag', 3)
    (folder / 'metadata.yaml').write_text(text)
    recording = Recording(folder)
    (sentence,) = recording.damage
    assert sentence.startswith('bag: metadata.yaml is damaged')
    assert recording.message_counts['/rotor/waveform'] == 3


def test_metadata_yaml_cannot_lead_out_of_the_folder(tmp_path: Path) -> None:
    single(tmp_path / 'other.mcap', 3)
    folder = bag(tmp_path / 'bag', 3)
    metadata = folder / 'metadata.yaml'
    metadata.write_text(metadata.read_text().replace('- bag_0.mcap', '- ../other.mcap'))
    recording = Recording(folder)
    assert [file.path for file in recording._files] == [folder / 'bag_0.mcap']
    assert recording.damage == [
        'bag: metadata.yaml names other.mcap, which is not there; read instead: bag_0.mcap'
    ]


def test_one_broken_file_does_not_hide_the_others(tmp_path: Path) -> None:
    folder = tmp_path / 'bag'
    folder.mkdir()
    single(folder / 'run_0.mcap', 3)
    (folder / 'run_1.mcap').write_bytes(b'not MCAP at all')
    recording = Recording(folder)
    assert recording.message_counts['/rotor/waveform'] == 3
    (sentence,) = recording.damage
    assert 'run_1.mcap is not an MCAP file' in sentence


@pytest.mark.parametrize(
    ('make', 'sentence'),
    [
        (
            lambda path: path.with_name('other').touch(),
            r'cannot be read \(No such file or directory\)',
        ),
        (lambda path: path.mkdir(), r'holds no \.mcap file'),
        (lambda path: path.write_bytes(b''), 'is empty; give a .mcap file or the folder of a bag'),
        (lambda path: path.write_text('speed: 352'), 'is not an MCAP file'),
        (lambda path: path.write_bytes(b'\x89MCAP0\r\n'), 'holds no whole message'),
    ],
)
def test_what_is_no_recording_ends_in_one_sentence(
    tmp_path: Path, make: object, sentence: str
) -> None:
    path = tmp_path / 'run.mcap'
    make(path)  # type: ignore[operator]
    with pytest.raises(RecordingError, match=sentence) as refused:
        Recording(path)
    assert str(path) in str(refused.value)
    assert '\n' not in str(refused.value)


# The waveform


def test_the_waveform_is_found_in_a_namespace(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / 'bag') as writer:
        topic = replace(topics.WAVEFORM, name='/rig_1/rotor/waveform')
        writer.write(topic, block_bytes(0), EPOCH_NS, EPOCH_NS)
    assert [b.first_sample for b in waveform_blocks(Recording(tmp_path / 'bag'))] == [0]


def test_two_rigs_in_one_recording_are_refused(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / 'bag') as writer:
        for name in ('/rig_1/rotor/waveform', '/rig_2/rotor/waveform'):
            writer.write(replace(topics.WAVEFORM, name=name), block_bytes(0), EPOCH_NS, EPOCH_NS)
    with pytest.raises(RecordingError, match='more than once'):
        list(waveform_blocks(Recording(tmp_path / 'bag')))


def test_a_recording_without_waveform_names_its_topics(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / 'bag') as writer:
        writer.write(topics.CLOCK, bytes(12), EPOCH_NS, EPOCH_NS)
    with pytest.raises(RecordingError, match='holds no rotor/waveform; its topics are: /clock'):
        list(waveform_blocks(Recording(tmp_path / 'bag')))


def test_a_waveform_of_another_type_is_refused(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / 'bag') as writer:
        topic = Topic('rotor/waveform', 'std_msgs/msg/String', 1)
        writer.write(topic, bytes(8), EPOCH_NS, EPOCH_NS)
    with pytest.raises(RecordingError, match="has type 'std_msgs/msg/String'"):
        list(waveform_blocks(Recording(tmp_path / 'bag')))


def test_a_waveform_that_is_not_cdr_is_refused(tmp_path: Path) -> None:
    path = tmp_path / 'run.mcap'
    with path.open('wb') as file:
        writer = Writer(file, compression=CompressionType.NONE)
        writer.start()
        text, _ = typestore().generate_msgdef(topics.WAVEFORM.type, ros_version=2)
        schema = writer.register_schema(topics.WAVEFORM.type, 'ros2msg', text.encode())
        channel = writer.register_channel('/rotor/waveform', 'json', schema)
        writer.add_message(channel, 1, b'{}', 1)
        writer.finish()  # type: ignore[no-untyped-call]
    recording = Recording(path)
    assert recording.message_counts == {'/rotor/waveform': 1}
    with pytest.raises(RecordingError, match="encoded as 'json'"):
        list(waveform_blocks(recording))


@given(garbage=st.binary(max_size=200), cut=st.integers(0, 18000))
@settings(deadline=None, max_examples=50)
def test_a_block_that_cannot_be_decoded_is_told(
    tmp_path_factory: pytest.TempPathFactory, garbage: bytes, cut: int
) -> None:
    path = tmp_path_factory.mktemp('garbage') / 'run.mcap'
    with RecordingWriter.single_file(path) as writer:
        writer.write(topics.WAVEFORM, block_bytes(0), EPOCH_NS, 0)
        writer.write(topics.WAVEFORM, garbage, EPOCH_NS + 1, 0)
        writer.write(topics.WAVEFORM, block_bytes(1)[:cut], EPOCH_NS + 2, 0)
        writer.write(topics.WAVEFORM, block_bytes(2), EPOCH_NS + 3, 0)
    recording = Recording(path)
    assert [b.first_sample for b in waveform_blocks(recording)] == [0, 512]
    said = ' '.join(recording.damage)
    assert f'log time {EPOCH_NS + 1} ns' in said
    # one sentence with a count, or two where one of them looks like compressed data
    assert sum(map(int, re.findall(r'left out: (\d+) ', said))) == 2


def test_reading_twice_gives_the_same(tmp_path: Path) -> None:
    recording = Recording(bag(tmp_path / 'bag', 5))
    assert list(recording.messages()) == list(recording.messages())
    assert len(list(recording.messages())) == len(list(made_up_run(5)))


def test_write_all_is_what_the_tests_think(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / 'bag') as writer:
        write_all(writer, made_up_run(2))
        assert writer.messages == len(list(made_up_run(2)))
        assert writer.message_bytes == sum(len(w.data) for w in made_up_run(2))
