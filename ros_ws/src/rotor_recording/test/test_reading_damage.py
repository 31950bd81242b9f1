# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Damaged files: what is whole is read, what is lost is said, nothing is altered."""

import struct
import subprocess
import sys
from collections import Counter
from pathlib import Path

import lz4.frame
import pytest
import zstandard
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, DataEnd, Footer, Header, MetadataIndex, Schema
from mcap.writer import MCAP0_MAGIC, Writer

from recording_support import EPOCH_NS, made_up_run, stamp_of, write_all
from rotor_interfaces import topics
from rotor_recording.errors import RecordingError
from rotor_recording.mcap_file import McapFile
from rotor_recording.reading import RecordedMessage, Recording
from rotor_recording.recording import RecordingWriter

CONFIG = {'scenario': {'crack_stiffness_ratio': 0.1}}


@pytest.fixture(scope='module')
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of small chunks, so that much of it is structure."""
    return small_chunks(tmp_path_factory.mktemp('whole') / 'run.mcap', blocks=12)


def small_chunks(path: Path, blocks: int) -> Path:
    wires = [wire for wire in made_up_run(blocks) if wire.topic is not topics.WAVEFORM]
    with RecordingWriter.single_file(path, config=CONFIG) as writer:
        for number, wire in enumerate(wires):
            write_all(writer, [wire])
            if number % 6 == 5:
                writer.flush()
    return path


def read_all(path: Path) -> tuple[list[RecordedMessage], list[str]]:
    """Return the messages and the sentences; none and the error's for an unreadable file."""
    try:
        recording = Recording(path)
        messages = list(recording.messages())
    except RecordingError as error:
        return [], [str(error)]
    return messages, recording.damage


@given(cut=st.floats(0.0, 1.0))
@settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=100, deadline=None
)
def test_a_cut_file_gives_a_beginning_of_the_run(whole: Path, tmp_path: Path, cut: float) -> None:
    content = whole.read_bytes()
    kept = int(cut * len(content))
    path = tmp_path / 'cut.mcap'
    path.write_bytes(content[:kept])
    messages, damage = read_all(path)
    sent, _ = read_all(whole)
    assert messages == sent[: len(messages)]
    assert bool(damage) == (kept < len(content))
    assert all('\n' not in sentence for sentence in damage)


@given(place=st.floats(0.0, 1.0, exclude_max=True), flip=st.integers(1, 255))
@settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=150, deadline=None
)
def test_a_flipped_byte_never_alters_and_never_hides(
    whole: Path, tmp_path: Path, place: float, flip: int
) -> None:
    content = bytearray(whole.read_bytes())
    content[int(place * len(content))] ^= flip
    check_against(read_all(whole)[0], tmp_path / 'flipped.mcap', content)


@pytest.mark.slow
def test_no_flip_of_an_opcode_or_length_alters_or_hides(tmp_path: Path) -> None:
    # these decide what a record is taken for, and no checksum covers them
    whole = small_chunks(tmp_path / 'run.mcap', blocks=2)
    sent, _ = read_all(whole)
    content = whole.read_bytes()
    place = len(MCAP0_MAGIC)
    while place < len(content) - len(MCAP0_MAGIC):
        for byte in (place, place + 1):
            for bit in range(8):
                flipped = bytearray(content)
                flipped[byte] ^= 1 << bit
                check_against(sent, tmp_path / 'flipped.mcap', flipped)
        (length,) = struct.unpack_from('<Q', content, place + 1)
        place += 9 + length


def check_against(sent: list[RecordedMessage], path: Path, content: bytearray) -> None:
    """Read a damaged copy: nothing altered, nothing lost without a word, in order."""
    path.write_bytes(content)
    messages, damage = read_all(path)
    left_out = Counter(sent)
    left_out.subtract(messages)
    assert min(left_out.values()) >= 0, 'a message that was never sent'
    assert messages == sorted(messages, key=lambda message: message.log_time_ns)
    if len(messages) < len(sent):
        assert damage
    if messages:
        assert Recording(path).config() in (CONFIG, None, {'scenario': {'name': 'made up'}})


def test_a_start_time_does_not_trust_the_head_of_a_chunk(whole: Path, tmp_path: Path) -> None:
    # the head of a chunk has no checksum: its times are 16 bytes after the opcode and length
    content = bytearray(whole.read_bytes())
    place = content.index(struct.pack('<Q', stamp_of(11)), 100)
    content[place : place + 8] = struct.pack('<Q', 5)
    path = tmp_path / 'flipped.mcap'
    path.write_bytes(content)
    recording = Recording(path)
    begin = stamp_of(6)
    assert list(recording.messages(start_ns=begin)) == list(
        Recording(whole).messages(start_ns=begin)
    )
    assert any('disagree about its times' in sentence for sentence in recording.damage)


def test_a_bad_chunk_costs_only_itself_and_is_counted(whole: Path, tmp_path: Path) -> None:
    recording = Recording(whole)
    segments = recording._files[0].segments
    bad = segments[5]
    content = bytearray(whole.read_bytes())
    content[bad.offset + bad.length // 2] ^= 1
    path = tmp_path / 'bad.mcap'
    path.write_bytes(content)
    lost = len(McapFile(whole).read(bad))
    messages, damage = read_all(path)
    assert len(messages) == len(list(recording.messages())) - lost
    assert len(damage) == 1
    assert f'so its {lost} messages are left out' in damage[0]


def test_a_broken_length_is_passed_over_with_the_index(whole: Path, tmp_path: Path) -> None:
    recording = Recording(whole)
    bad = recording._files[0].segments[5]
    content = bytearray(whole.read_bytes())
    content[bad.offset - 8 : bad.offset] = struct.pack('<Q', 2**63)
    path = tmp_path / 'bad.mcap'
    path.write_bytes(content)
    messages, damage = read_all(path)
    lost = len(McapFile(whole).read(bad))
    assert len(messages) == len(list(recording.messages())) - lost
    assert f'{len(messages)} of the {len(messages) + lost} messages' in ' '.join(damage)


def test_a_first_chunk_lost_still_leaves_its_definitions(whole: Path, tmp_path: Path) -> None:
    # they stand again in the summary of a finalised file
    recording = Recording(whole)
    first = recording._files[0].segments[0]
    content = bytearray(whole.read_bytes())
    content[first.offset + first.length - 1] ^= 1
    path = tmp_path / 'bad.mcap'
    path.write_bytes(content)
    messages, _ = read_all(path)
    assert len(messages) == len(list(recording.messages())) - len(McapFile(whole).read(first))
    assert {m.topic for m in messages} >= {'/rotor/truth', '/clock'}


def test_a_killed_recording_whose_definitions_are_lost_says_so(whole: Path, tmp_path: Path) -> None:
    recording = Recording(whole)
    first, *_, last = recording._files[0].segments
    content = bytearray(whole.read_bytes()[: last.offset + last.length])
    content[first.offset + first.length - 1] ^= 1
    path = tmp_path / 'bad.mcap.active'
    path.write_bytes(content)
    messages, damage = read_all(path)
    assert '/rotor/truth' not in {m.topic for m in messages}
    assert any('the definition of the channel is missing or damaged' in text for text in damage)


def test_a_flipped_configuration_is_not_believed(whole: Path, tmp_path: Path) -> None:
    content = whole.read_bytes().replace(
        b'"crack_stiffness_ratio": 0.1', b'"crack_stiffness_ratio": 0.4'
    )
    path = tmp_path / 'flipped.mcap'
    path.write_bytes(content)
    recording = Recording(path)
    # the message on rotor/config, which lies in a chunk with a checksum, is taken instead
    assert recording.config() == {'scenario': {'name': 'made up'}}
    assert 'checksum of its run configuration' in ' '.join(recording.damage)


def test_a_record_of_the_summary_is_never_taken_for_a_message(tmp_path: Path) -> None:
    # in a file without chunks, where messages may stand anywhere before the summary
    path = tmp_path / 'run.mcap'
    with path.open('wb') as file:
        writer = Writer(file, use_chunking=False)
        writer.start('ros2')
        schema = writer.register_schema('std_msgs/msg/String', 'ros2msg', b'string data')
        channel = writer.register_channel('/a', 'cdr', schema)
        writer.add_message(channel, EPOCH_NS, b'one', EPOCH_NS)
        writer.finish()  # type: ignore[no-untyped-call]
    content = bytearray(path.read_bytes())
    repeated = content.rindex(bytes([Opcode.CHANNEL]), 0, content.rindex(b'/a'))
    assert content[repeated : repeated + 9] == struct.pack('<BQ', Opcode.CHANNEL, 21)
    content[repeated] = Opcode.MESSAGE
    path.write_bytes(content)
    messages, damage = read_all(path)
    assert [m.data for m in messages] == [b'one']
    assert 'does not belong there' in ' '.join(damage)


def test_metadata_beyond_every_file_are_no_foreign_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # the checksum of the summary fits: its writer is hostile
    path = tmp_path / 'run.mcap'
    write = MetadataIndex.write

    def far_away(index: MetadataIndex, builder: RecordBuilder) -> None:
        index.offset = 2**64 - 1
        write(index, builder)

    monkeypatch.setattr(MetadataIndex, 'write', far_away)
    with path.open('wb') as file:
        writer = Writer(file)
        writer.start('ros2')
        schema = writer.register_schema('std_msgs/msg/String', 'ros2msg', b'string data')
        writer.add_message(writer.register_channel('/a', 'cdr', schema), EPOCH_NS, b'a', EPOCH_NS)
        writer.add_metadata('name', {'key': 'value'})
        writer.finish()  # type: ignore[no-untyped-call]
    opened = McapFile(path)
    assert not opened.is_indexed
    assert opened.metadata == {'name': {'key': 'value'}}


# Files that want memory


def hostile(path: Path, compression: str, packed: bytes, claimed: int) -> Path:
    """Write a file with one good message and one chunk that unpacks to too much."""
    builder = RecordBuilder()
    Header('ros2', 'test').write(builder)
    Schema(1, b'', 'ros2msg', 'std_msgs/msg/String').write(builder)
    Channel(1, '/a', 'cdr', {}, 1).write(builder)
    message = struct.pack('<BQHIQQ', 5, 22, 1, 0, EPOCH_NS, EPOCH_NS)
    Chunk('', message, EPOCH_NS, EPOCH_NS, 0, len(message)).write(builder)
    Chunk(compression, packed, EPOCH_NS, EPOCH_NS, 0, claimed).write(builder)
    DataEnd(0).write(builder)
    Footer(0, 0, 0).write(builder)
    content: bytes = builder.end()  # type: ignore[no-untyped-call]
    path.write_bytes(MCAP0_MAGIC + content + MCAP0_MAGIC)
    return path


@pytest.mark.slow
@pytest.mark.parametrize(
    ('compression', 'claimed'),
    [
        ('lz4', 10),
        ('lz4', 2**64 - 1),
        ('zstd', 10),
        ('zstd', 2**28),
        ('zstd without size', 2**64 - 1),
    ],
)
def test_a_small_chunk_that_unpacks_to_much_is_left_out(
    tmp_path: Path, compression: str, claimed: int
) -> None:
    piece = bytes(2**20)
    if compression == 'lz4':
        packer = lz4.frame.LZ4FrameCompressor()
        packed = packer.begin() + b''.join(packer.compress(piece) for _ in range(256))
        packed += packer.flush()
    else:
        size = 2**28 if compression == 'zstd' else -1
        stream = zstandard.ZstdCompressor().compressobj(size=size)
        packed = b''.join(stream.compress(piece) for _ in range(256)) + stream.flush()
    path = hostile(tmp_path / 'bomb.mcap', compression.split(maxsplit=1)[0], packed, claimed)
    reader = (
        'import resource, sys\n'
        'from rotor_recording.reading import Recording\n'
        'before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n'
        'recording = Recording(sys.argv[1])\n'
        'print(len(list(recording.messages())), len(recording.damage),\n'
        '      resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)\n'
    )
    done = subprocess.run(
        [sys.executable, '-c', reader, str(path)],
        capture_output=True, text=True, timeout=300, check=True,
    )  # fmt: skip
    messages, sentences, grown_kib = map(int, done.stdout.split())
    assert (messages, sentences) == (1, 1)
    # at most the limit of 128 MiB for a chunk, and never the 256 MiB that it holds; 16 MiB are
    # for the interpreter
    assert grown_kib < (128 + 16) * 1024


def test_a_record_that_claims_more_than_the_file_is_not_allocated(tmp_path: Path) -> None:
    for opcode in (1, 3, 4, 5, 6, 7, 8, 9, 12, 0x99):
        path = tmp_path / f'{opcode}.mcap'
        path.write_bytes(MCAP0_MAGIC + struct.pack('<BQ', opcode, 2**62) + bytes(100))
        with pytest.raises(RecordingError, match='no whole message'):
            Recording(path)


@given(noise=st.binary(max_size=600))
@settings(deadline=None)
def test_noise_after_the_magic_never_ends_in_a_traceback(
    tmp_path_factory: pytest.TempPathFactory, noise: bytes
) -> None:
    path = tmp_path_factory.mktemp('noise') / 'run.mcap'
    path.write_bytes(MCAP0_MAGIC + noise)
    read_all(path)


def test_a_config_topic_that_is_no_text_is_told(tmp_path: Path) -> None:
    with RecordingWriter.single_file(tmp_path / 'run.mcap') as writer:
        writer.write(topics.CONFIG, b'\0\1\0\0\xff\xff\xff\xff', EPOCH_NS, EPOCH_NS)
    recording = Recording(tmp_path / 'run.mcap')
    assert recording.config() is None
    assert recording.damage == [
        'run.mcap: its run configuration is not a JSON mapping and is ignored'
    ]
