# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A recovered recording opens everywhere and says what was lost; a verified one is as it says."""

import signal
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader, StoragePlugin, Writer

from recording_support import BLOCK, bag, block_bytes, made_up_run, single, stamp_of, write_all
from rotor_interfaces import topics
from rotor_interfaces.messages import typestore
from rotor_recording.errors import RecordingError
from rotor_recording.reading import Recording
from rotor_recording.recording import RecordingWriter
from rotor_recording.recovery import Recovery, recover
from rotor_recording.verification import verify

WAVEFORM = '/rotor/waveform'

KILLED = """
import sys, time
from recording_support import made_up_run, write_all
from rotor_recording.recording import RecordingWriter

writer = RecordingWriter(sys.argv[1], config={'scenario': {'name': 'made up'}})
for number, wire in enumerate(made_up_run(200)):
    write_all(writer, [wire])
    if number % 70 == 69:
        writer.flush()
writer.flush()
print('flushed', flush=True)
write_all(writer, made_up_run(1))
time.sleep(60)
"""


@pytest.fixture(scope='module')
def killed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a recorder that was killed."""
    folder = tmp_path_factory.mktemp('killed') / 'flight'
    with subprocess.Popen(
        [sys.executable, '-c', KILLED, str(folder)],
        stdout=subprocess.PIPE, text=True, cwd=Path(__file__).parent,
    ) as child:  # fmt: skip
        assert child.stdout is not None
        assert child.stdout.readline() == 'flushed\n'
        child.send_signal(signal.SIGKILL)
    return folder


SENT = Counter(f'/{wire.topic.name.lstrip("/")}' for wire in made_up_run(200))


@pytest.mark.slow
@pytest.mark.parametrize('what', ['file', 'folder'])
def test_a_killed_recording_opens_in_foreign_readers(
    killed: Path, tmp_path: Path, what: str
) -> None:
    path = killed if what == 'folder' else next(killed.iterdir())
    assert path.is_dir() or path.name == 'flight_0.mcap.active'
    found = recover(path, tmp_path / 'whole')
    assert found.messages == SENT
    assert 'not finalised' in found.lost[0]
    # mcap and its ROS 2 decoder
    with (found.bag / 'whole_0.mcap').open('rb') as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == SENT.total()
        decoded = Counter(channel.topic for _, channel, _, _ in reader.iter_decoded_messages())
    assert decoded == SENT
    # rosbags
    with Reader(found.bag) as foreign:
        assert {known.topic: known.msgcount for known in foreign.connections} == SENT
        assert Counter(known.topic for known, _, _ in foreign.messages()) == SENT
    with AnyReader([found.bag]) as foreign:
        for known, _, data in foreign.messages():
            foreign.deserialize(data, known.msgtype)
    # ours: the same messages, and nothing wrong with them
    assert list(Recording(found.bag).messages()) == list(Recording(path).messages())
    assert Recording(found.bag).config() == {'scenario': {'name': 'made up'}}
    assert {check.state for check in verify(found.bag)} == {'good'}


@pytest.mark.slow
def test_a_killed_recording_opens_in_rerun(killed: Path, tmp_path: Path) -> None:
    file = recover(killed, tmp_path / 'whole').bag / 'whole_0.mcap'
    done = subprocess.run(
        [sys.executable, '-m', 'rerun', 'mcap', 'check', '--full', str(file)],
        check=False, capture_output=True, text=True, timeout=120, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


def test_what_is_lost_is_counted(tmp_path: Path) -> None:
    path = single(tmp_path / 'run.mcap', 200)
    first, second, *_ = Recording(path)._files[0].segments
    content = bytearray(path.read_bytes())
    content[second.offset + second.length // 2] ^= 1
    path.write_bytes(content)
    blocks = [m for m in Recording(path).messages() if m.topic == WAVEFORM]
    missing = 200 - len(blocks)
    assert missing > 10
    found = recover(path)
    assert found.bag == tmp_path / 'run_recovered'
    assert found.lost_chunks == 1
    assert found.lost_bytes == second.length
    assert found.lost_messages == 1 + 7 * 200 - sum(found.messages.values())
    assert found.samples[WAVEFORM].continuity.lost_samples == missing * BLOCK
    assert f'{missing * BLOCK} samples are missing' in found.lost[-1]
    state = {check.what: check.state for check in verify(found.bag)}
    assert state[f'sample index of {WAVEFORM}'] == 'wrong'
    assert state['structure'] == 'good'
    assert first.length


def test_a_whole_recording_loses_nothing(tmp_path: Path) -> None:
    found = recover(bag(tmp_path / 'flight'))
    assert (found.lost, found.lost_bytes, found.lost_chunks) == ([], 0, 0)
    assert found.lost_messages == 0


def test_nothing_is_overwritten_and_nothing_half_done_is_left(tmp_path: Path) -> None:
    folder = bag(tmp_path / 'flight')
    (tmp_path / 'flight_recovered').mkdir()
    with pytest.raises(RecordingError, match='never overwrites'):
        recover(folder)
    empty = tmp_path / 'empty.mcap'
    empty.write_bytes(b'')
    with pytest.raises(RecordingError, match='is empty'):
        recover(empty, tmp_path / 'out')
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        'empty.mcap', 'flight', 'flight_recovered',
    ]  # fmt: skip


def test_a_sqlite_bag_is_recovered_as_far_as_it_goes(tmp_path: Path) -> None:
    with Writer(tmp_path / 'a', version=9, storage_plugin=StoragePlugin.SQLITE3) as foreign:
        known = foreign.add_connection(WAVEFORM, topics.WAVEFORM.type, typestore=typestore())
        for number in range(40):
            foreign.write(known, stamp_of(number), block_bytes(number))
    found = recover(tmp_path / 'a')
    assert found.messages == {WAVEFORM: 40}
    assert list(Recording(found.bag).messages()) == list(Recording(tmp_path / 'a').messages())
    assert 'wrong' not in states(found)
    state = {check.what: check.state for check in verify(tmp_path / 'a')}
    assert state.pop('checksums of a.db3') == 'not checked'
    assert set(state.values()) == {'good'}


def states(found: Recovery) -> set[str]:
    return {check.state for check in verify(found.bag)}


# Verifying


def wrong(path: Path) -> dict[str, str]:
    """Return what is wrong with a recording, and why."""
    return {check.what: check.text for check in verify(path) if check.state == 'wrong'}


def test_a_good_recording_is_good(tmp_path: Path) -> None:
    checks = verify(bag(tmp_path / 'flight'))
    assert {check.state for check in checks} == {'good'}
    assert {check.what.split(' of ')[0] for check in checks} == {
        'structure', 'checksums', 'summary', 'messages', 'sample index', 'stamps', 'types',
        'metadata.yaml',
    }  # fmt: skip


def test_a_lost_block_a_second_run_and_a_late_stamp_are_seen(tmp_path: Path) -> None:
    wires = list(made_up_run(30))
    blocks = [wire for wire in wires if wire.topic is topics.WAVEFORM]
    for name, sent, words in (
        ('lost', [*blocks[:10], *blocks[12:]], f'1 gaps, {2 * BLOCK} lost samples'),
        ('again', [*blocks, *blocks], '1 restarts'),
    ):
        with RecordingWriter(tmp_path / name) as writer:
            write_all(writer, [wire._replace(stamp_ns=stamp_of(k)) for k, wire in enumerate(sent)])
        assert wrong(tmp_path / name) == {f'sample index of {WAVEFORM}': words}
    stopped = [
        wire._replace(data=block_bytes(9, first_sample=BLOCK * k)) if k > 9 else wire
        for k, wire in enumerate(blocks)
    ]
    with RecordingWriter(tmp_path / 'stopped') as writer:
        write_all(writer, stopped)
    assert wrong(tmp_path / 'stopped') == {
        f'stamps of {WAVEFORM}': '20 messages are not stamped later than the one before'
    }


def test_metadata_of_another_recording_is_seen(tmp_path: Path) -> None:
    folder = bag(tmp_path / 'flight', 1)
    metadata = folder / 'metadata.yaml'
    metadata.write_text(metadata.read_text().replace('message_count: 1\n', 'message_count: 2\n'))
    assert set(wrong(folder)) == {'metadata.yaml'}
    assert f'{WAVEFORM}: 1 of 2' in wrong(folder)['metadata.yaml']


def test_a_wrong_hash_of_a_type_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from rotor_recording import recording as module

    store = typestore()
    text, definitions = store.generate_msgdef(topics.WAVEFORM.type, ros_version=2)

    class Other:
        """Says of every type what a program of another release would."""

        def generate_msgdef(self, kind: str, ros_version: int) -> tuple[str, object]:
            known, more = store.generate_msgdef(kind, ros_version=ros_version)
            return known.replace('uint32 width', 'uint64 width'), more

        def hash_rihs01(self, kind: str) -> str:
            return str(store.hash_rihs01(kind))

    assert 'uint32 width' in text
    assert definitions is not None
    monkeypatch.setattr(module, 'typestore', Other)
    folder = bag(tmp_path / 'flight', 2)
    assert list(wrong(folder)) == ['types']
    assert f'the text of {topics.WAVEFORM.type} on {WAVEFORM}' in wrong(folder)['types']


@pytest.mark.parametrize('share', [0.1, 0.3, 0.5, 0.7, 0.9, 0.97])
def test_a_flipped_byte_makes_a_recording_wrong(tmp_path: Path, share: float) -> None:
    path = single(tmp_path / 'run.mcap', 400)
    content = bytearray(path.read_bytes())
    content[int(share * len(content))] ^= 4
    path.write_bytes(content)
    assert wrong(path)
