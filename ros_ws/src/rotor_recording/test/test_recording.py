# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The writer: what it leaves behind, and where it refuses to write."""

import json
from pathlib import Path

import pytest
import yaml
from mcap.reader import make_reader

from recording_support import (
    CONFIG_TEXT,
    EPOCH_NS,
    bag,
    block_bytes,
    made_up_run,
    single,
    stamp_of,
    write_all,
)
from rotor_interfaces import topics
from rotor_recording.errors import RecordingError
from rotor_recording.reading import Recording, waveform_blocks
from rotor_recording.recording import RecordingWriter


@pytest.mark.parametrize('write', [bag, single])
def test_what_is_written_is_read(tmp_path: Path, write: object) -> None:
    path = write(tmp_path / 'run.mcap')  # type: ignore[operator]
    recording = Recording(path)
    read = [(m.topic, m.type, m.log_time_ns, m.data) for m in recording.messages()]
    sent = [('/' + w.topic.name.lstrip('/'), w.topic.type, w.stamp_ns, w.data)
            for w in made_up_run(40)]  # fmt: skip
    assert read == sent
    assert recording.damage == []
    assert recording.start_ns == EPOCH_NS
    assert recording.end_ns == stamp_of(39)
    counts = recording.message_counts
    assert counts['/rotor/waveform'] == 40
    assert counts['/rotor/config'] == 1
    assert sum(counts.values()) == len(sent)


def test_an_uncompressed_file_says_the_same(tmp_path: Path) -> None:
    compressed = single(tmp_path / 'small.mcap')
    with RecordingWriter.single_file(tmp_path / 'plain.mcap', compress=False) as writer:
        for sent in made_up_run(40):
            writer.write(sent.topic, sent.data, sent.stamp_ns, sent.stamp_ns)
    plain, small = Recording(tmp_path / 'plain.mcap'), Recording(compressed)
    assert list(plain.messages()) == list(small.messages())
    for path, compression in ((compressed, 'lz4'), (tmp_path / 'plain.mcap', '')):
        with path.open('rb') as file:
            summary = make_reader(file).get_summary()
        assert summary is not None
        assert {index.compression for index in summary.chunk_indexes} == {compression}


def test_publish_time_is_kept_apart(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / 'bag') as writer:
        writer.write(topics.WAVEFORM, block_bytes(0), 5, 7)
    (message,) = Recording(tmp_path / 'bag').messages()
    assert (message.log_time_ns, message.publish_time_ns) == (5, 7)


def test_waveform_comes_back_as_blocks(tmp_path: Path) -> None:
    blocks = list(waveform_blocks(Recording(bag(tmp_path / 'bag'))))
    assert [block.first_sample for block in blocks] == [256 * k for k in range(40)]
    assert [block.stamp_ns for block in blocks] == [stamp_of(k) for k in range(40)]


def test_the_same_run_gives_the_same_bytes(tmp_path: Path) -> None:
    first, second = single(tmp_path / 'a.mcap'), single(tmp_path / 'b.mcap')
    assert first.read_bytes() == second.read_bytes()


def test_the_name_says_active_until_the_end(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / 'bag', name='flight')
    write_all(writer, made_up_run(4))
    assert [p.name for p in (tmp_path / 'bag').iterdir()] == ['flight_0.mcap.active']
    writer.close()
    writer.close()  # twice does no harm
    assert {p.name for p in (tmp_path / 'bag').iterdir()} == {'flight_0.mcap', 'metadata.yaml'}


def test_what_is_flushed_can_be_read_from_the_active_file(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / 'bag')
    write_all(writer, made_up_run(4))
    writer.flush()
    recording = Recording(tmp_path / 'bag')
    assert len(list(recording.messages())) == len(list(made_up_run(4)))
    (sentence,) = recording.damage
    assert 'not finalised' in sentence
    writer.close()
    assert Recording(tmp_path / 'bag').damage == []


def test_flush_is_due_after_its_period(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    writer = RecordingWriter(tmp_path / 'bag')
    write_all(writer, made_up_run(4))
    writer.flush_if_due()
    with pytest.raises(RecordingError, match='is empty'):
        Recording(tmp_path / 'bag')
    monkeypatch.setattr('rotor_recording.recording.FLUSH_PERIOD_S', 0.0)
    writer.flush_if_due()
    assert Recording(tmp_path / 'bag').message_counts['/rotor/waveform'] == 4
    writer.close()


def test_an_empty_recording_is_whole(tmp_path: Path) -> None:
    RecordingWriter(tmp_path / 'bag').close()
    recording = Recording(tmp_path / 'bag')
    assert list(recording.messages()) == []
    assert recording.damage == []
    assert recording.start_ns is None


def test_an_error_of_the_caller_still_finalises(tmp_path: Path) -> None:
    wires = [*made_up_run(3), None]
    with pytest.raises(AttributeError), RecordingWriter(tmp_path / 'bag') as writer:
        write_all(writer, wires)  # type: ignore[arg-type]
    assert Recording(tmp_path / 'bag').message_counts['/rotor/waveform'] == 3
    assert Recording(tmp_path / 'bag').damage == []


def test_the_last_configuration_counts(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / 'bag', config={'k': 1}) as writer:
        write_all(writer, made_up_run(3))
        writer.add_config(json.dumps({'k': 2, 'unit': 'µm'}))
    assert Recording(tmp_path / 'bag').config() == {'k': 2, 'unit': 'µm'}


def test_a_foreign_recorder_keeps_the_configuration_as_a_message(tmp_path: Path) -> None:
    assert Recording(single(tmp_path / 'run.mcap')).config() == json.loads(CONFIG_TEXT)


def test_both_quality_of_service_texts_agree(tmp_path: Path) -> None:
    folder = bag(tmp_path / 'bag')
    document = yaml.safe_load((folder / 'metadata.yaml').read_text())
    information = document['rosbag2_bagfile_information']
    listed = {
        entry['topic_metadata']['name']: entry['topic_metadata']['offered_qos_profiles']
        for entry in information['topics_with_message_count']
    }
    stored = {
        name: yaml.safe_load(known.qos_profiles)
        for name, known in Recording(folder).topics().items()
    }
    assert listed == stored
    assert stored['/rotor/waveform'][0]['durability'] == 'volatile'
    assert stored['/rotor/truth'][0]['durability'] == 'transient_local'
    assert stored['/maneuver/load'][0]['depth'] == topics.MANEUVER_LOAD.depth


def test_metadata_yaml_counts_what_is_there(tmp_path: Path) -> None:
    folder = bag(tmp_path / 'bag')
    document = yaml.safe_load((folder / 'metadata.yaml').read_text())
    information = document['rosbag2_bagfile_information']
    sent = list(made_up_run(40))
    assert information['version'] == 9
    assert information['message_count'] == len(sent)
    assert information['starting_time']['nanoseconds_since_epoch'] == EPOCH_NS
    assert information['duration']['nanoseconds'] == stamp_of(39) - EPOCH_NS
    assert information['relative_file_paths'] == ['bag_0.mcap']


def test_the_file_describes_itself(tmp_path: Path) -> None:
    path = single(tmp_path / 'run.mcap')
    with path.open('rb') as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert reader.get_header().profile == 'ros2'
        assert reader.get_header().library.startswith('rotor-rig ')
        for channel in summary.channels.values():
            assert channel.metadata['topic_type_hash'].startswith('RIHS01_')
        for schema in summary.schemas.values():
            assert schema.encoding == 'ros2msg'
        text = next(s.data for s in summary.schemas.values() if s.name.endswith('PointCloud2'))
        # complete: the types it uses follow, each under its own head
        assert b'MSG: sensor_msgs/PointField' in text
        assert b'MSG: builtin_interfaces/Time' in text


# Where it refuses


def test_a_folder_with_something_in_it_is_refused(tmp_path: Path) -> None:
    (tmp_path / 'notes.txt').write_text('mine')
    with pytest.raises(RecordingError, match='is not empty, and a recording never overwrites'):
        RecordingWriter(tmp_path)
    assert (tmp_path / 'notes.txt').read_text() == 'mine'


@pytest.mark.parametrize('taken', ['run.mcap', 'run.mcap.active'])
def test_a_file_is_never_overwritten(tmp_path: Path, taken: str) -> None:
    (tmp_path / taken).write_text('mine')
    with pytest.raises(RecordingError, match=rf'{taken} exists, and a recording never overwrites'):
        RecordingWriter.single_file(tmp_path / 'run.mcap')
    assert (tmp_path / taken).read_text() == 'mine'


def test_a_place_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / 'file').write_text('')
    with pytest.raises(RecordingError, match='cannot be written') as refused:
        RecordingWriter(tmp_path / 'file' / 'bag')
    assert str(tmp_path) in str(refused.value)
    with pytest.raises(RecordingError, match=r'cannot be written \(No such file or directory\)'):
        RecordingWriter.single_file(tmp_path / 'nowhere' / 'run.mcap')


def test_a_full_disk_ends_in_one_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    writer = RecordingWriter(tmp_path / 'bag')
    write_all(writer, made_up_run(4))
    writer.flush()
    write_all(writer, list(made_up_run(6))[30:])

    def full(descriptor: int) -> None:  # noqa: ARG001
        raise OSError(28, 'No space left on device')

    monkeypatch.setattr('os.fsync', full)
    with pytest.raises(RecordingError, match=r'No space left on device.*can be read'):
        writer.close()
    writer.close()  # the second says nothing: the error was told
    monkeypatch.undo()
    assert Recording(tmp_path / 'bag').message_counts['/rotor/waveform'] >= 4
