# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Log times, sample indices and counters from raw bytes, without ROS."""

import json
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from recording_support import EPOCH_NS, block_bytes, made_up_run, stamp_of
from rotor_common.constants import NANOSECONDS
from rotor_common.errors import WireError
from rotor_interfaces import messages, topics
from rotor_interfaces.messages import OFFLINE, to_cdr, typestore
from rotor_interfaces.topics import Topic
from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock, encode
from rotor_recording.reading import Recording
from rotor_recording.recording import RecordingWriter
from rotor_recording.recording_stream import RecordingStream, SampleIndexReader, raw_stamp_ns

WALL_NS = 1_900_000_000_000_000_000


@given(seconds=st.integers(0, 2**31 - 1), nanoseconds=st.integers(0, NANOSECONDS - 1))
def test_the_stamp_is_read_from_the_bytes_of_either_order(seconds: int, nanoseconds: int) -> None:
    stamp = seconds * NANOSECONDS + nanoseconds
    clock = messages.clock(OFFLINE, stamp)
    for little_endian in (True, False):
        data = typestore().serialize_cdr(clock, topics.CLOCK.type, little_endian=little_endian)
        assert raw_stamp_ns(topics.CLOCK, bytes(data)) == stamp


@pytest.mark.parametrize('wire', list(made_up_run(2)), ids=lambda wire: wire.topic.name)
def test_every_topic_of_the_contract_but_config_has_its_stamp(wire: object) -> None:
    expected = 0 if wire.topic is topics.CONFIG else wire.stamp_ns  # type: ignore[attr-defined]
    assert raw_stamp_ns(wire.topic, wire.data) == expected  # type: ignore[attr-defined]


def test_a_stamp_before_1970_or_a_cut_message_has_none() -> None:
    assert raw_stamp_ns(topics.CLOCK, b'\0\1\0\0' + b'\xff' * 4 + bytes(4)) == 0
    assert raw_stamp_ns(topics.CLOCK, b'\0\1\0\0') == 0
    assert raw_stamp_ns(topics.CLOCK, b'') == 0


# The sample index


@pytest.mark.parametrize('fill', [b'', bytes(3)], ids=['as built', 'filled by DDS'])
def test_the_index_is_read_without_decoding_again(
    fill: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    reader = SampleIndexReader()
    assert reader.read(block_bytes(0) + fill) == (0, 256)
    monkeypatch.setattr(messages, 'from_cdr', None)
    assert reader.read(block_bytes(3) + fill) == (768, 256)
    assert reader.read(block_bytes(1, first_sample=2**53) + fill) == (2**53, 256)


def test_another_layout_is_noticed() -> None:
    reader = SampleIndexReader()
    reader.read(block_bytes(0))
    other = np.zeros(10, [('sample', '<f8'), ('disk_y', '<f4')])
    other['sample'] = 512 + np.arange(10)
    assert reader.read(to_cdr(encode(WaveformBlock(1, other), OFFLINE))) == (512, 10)
    assert reader.read(block_bytes(9)) == (9 * 256, 256)
    integers = np.zeros(4, [('sample', '<u4')])
    integers['sample'] = 7
    data = to_cdr(encode(WaveformBlock(1, integers), OFFLINE))
    assert reader.read(data) == reader.read(data) == (7, 4)


def table(rows: np.ndarray) -> bytes:
    return to_cdr(encode(WaveformBlock(1, rows), OFFLINE))


def with_first_index(value: float) -> bytes:
    rows = np.zeros(256, WAVEFORM_DTYPE)
    rows['sample'][0] = value
    return table(rows)


@pytest.mark.parametrize('knows_layout', [False, True])
@pytest.mark.parametrize(
    'data',
    [
        b'',
        b'\0\1\0\0',
        block_bytes(0)[:-100],
        block_bytes(0)[:300],
        table(np.zeros(0, WAVEFORM_DTYPE)),
        table(np.zeros(3, [('disk_y', '<f4')])),
        with_first_index(np.nan),
        with_first_index(np.inf),
        with_first_index(0.5),
    ],
    ids=['empty', 'head', 'cut', 'cut fields', 'no rows', 'no sample', 'nan', 'inf', 'half'],
)
def test_a_block_without_an_index_is_refused(data: bytes, knows_layout: bool) -> None:
    reader = SampleIndexReader()
    if knows_layout:
        reader.read(block_bytes(4))
    with pytest.raises(WireError):
        reader.read(data)


def test_reading_the_index_costs_less_than_a_tenth_of_a_millisecond() -> None:
    reader = SampleIndexReader()
    data = block_bytes(0)
    reader.read(data)
    started = time.process_time()
    for _ in range(1000):
        reader.read(data)
    # measured: 1 us; the limit is what a recorder at 20 times real time can spare
    assert time.process_time() - started < 0.1


# The stream


@pytest.fixture
def stream(tmp_path: Path) -> Iterator[RecordingStream]:
    with RecordingWriter(tmp_path / 'bag') as writer:
        yield RecordingStream(writer)


def recorded(stream: RecordingStream, tmp_path: Path) -> list[tuple[str, int, int]]:
    stream.finish()
    stream._writer.close()
    recording = Recording(tmp_path / 'bag')
    return [(m.topic, m.log_time_ns, m.publish_time_ns) for m in recording.messages()]


def text(content: str) -> bytes:
    return to_cdr(messages.string(OFFLINE, content))


def header(stamp_ns: int) -> bytes:
    return to_cdr(messages.header(OFFLINE, stamp_ns, 'recorder'))


def load(stamp_ns: int) -> bytes:
    return to_cdr(messages.load(OFFLINE, stamp_ns, 9.81, 0.0))


def test_log_time_is_the_stamp_and_publish_time_the_wall(
    stream: RecordingStream, tmp_path: Path
) -> None:
    assert stream.take(topics.WAVEFORM, block_bytes(2), WALL_NS) == stamp_of(2)
    assert recorded(stream, tmp_path) == [('/rotor/waveform', stamp_of(2), WALL_NS)]


def test_what_has_no_stamp_waits_for_the_simulation_time(
    stream: RecordingStream, tmp_path: Path
) -> None:
    assert stream.take(topics.CONFIG, text('{}'), WALL_NS) == 0
    assert stream.take(topics.PROGRESS, header(0), WALL_NS + 1) == 0
    # published ahead: it does not say how late it is
    stream.take(topics.MANEUVER_LOAD, load(EPOCH_NS + 2 * NANOSECONDS), WALL_NS + 2)
    stream.take(topics.WAVEFORM, block_bytes(1), WALL_NS + 3)
    stream.take(topics.CONFIG, text('{"k": 1}'), WALL_NS + 4)
    assert recorded(stream, tmp_path) == [
        ('/rotor/config', stamp_of(1), WALL_NS),
        ('/rig/progress', stamp_of(1), WALL_NS + 1),
        ('/rotor/waveform', stamp_of(1), WALL_NS + 3),
        ('/rotor/config', stamp_of(1), WALL_NS + 4),
        ('/maneuver/load', EPOCH_NS + 2 * NANOSECONDS, WALL_NS + 2),
    ]


def test_what_never_got_a_simulation_time_is_kept_by_its_wall_time(
    stream: RecordingStream, tmp_path: Path
) -> None:
    stream.take(topics.CONFIG, text('{}'), WALL_NS)
    stream.take(topics.PROGRESS, header(0), WALL_NS + 1)
    assert recorded(stream, tmp_path) == [
        ('/rotor/config', WALL_NS, WALL_NS),
        ('/rig/progress', WALL_NS + 1, WALL_NS + 1),
    ]


def test_simulation_time_does_not_go_back(stream: RecordingStream) -> None:
    stream.take(topics.WAVEFORM, block_bytes(5), WALL_NS)
    stream.take(topics.PROGRESS, header(stamp_of(3)), WALL_NS)
    assert stream.time_ns == stamp_of(5)


def diagnostics(stamp_ns: int) -> bytes:
    return to_cdr(
        messages.diagnostics(OFFLINE, stamp_ns, 'battery', level=2, text='low', values={})
    )


STRANGERS: dict[Topic, Callable[[int], bytes]] = {
    topics.DIAGNOSTICS: diagnostics,
    topics.PROGRESS: header,
    topics.MANEUVER_LOAD: load,
    topics.CLOCK: lambda stamp_ns: to_cdr(messages.clock(OFFLINE, stamp_ns)),
    topics.CONFIG: lambda stamp_ns: text(f'{{"stamp": {stamp_ns}}}'),
}


@settings(deadline=None, max_examples=40)
@given(
    said=st.lists(
        st.tuples(
            st.sampled_from(sorted(STRANGERS, key=lambda topic: topic.name)),
            st.one_of(
                st.integers(0, 1_000_000 * NANOSECONDS),
                st.integers(2_000_000_000 * NANOSECONDS, (2**31 - 1) * NANOSECONDS),
            ),
            st.integers(0, 3),
        ),
        max_size=20,
    )
)
def test_no_stamp_of_a_stranger_sets_a_log_time(said: list[tuple[Topic, int, int]]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        with RecordingWriter(Path(folder) / 'bag') as writer:
            stream = RecordingStream(writer)
            for number in range(4):
                for topic, stamp_ns, before in said:
                    if before == number:
                        stream.take(topic, STRANGERS[topic](stamp_ns), WALL_NS)
                stream.take(topics.WAVEFORM, block_bytes(number), WALL_NS)
                assert stream.time_ns == stamp_of(number)
            stream.finish()
        recording = Recording(Path(folder) / 'bag')
        assert (recording.start_ns, recording.end_ns) == (stamp_of(0), stamp_of(3))
        assert sum(recording.message_counts.values()) == len(said) + 4


def test_a_status_is_filed_under_the_time_of_the_run_whatever_its_stamp(
    stream: RecordingStream, tmp_path: Path
) -> None:
    stream.take(topics.WAVEFORM, block_bytes(0), WALL_NS)
    for late_ns in (-NANOSECONDS, NANOSECONDS):
        stream.take(topics.DIAGNOSTICS, diagnostics(EPOCH_NS + late_ns), WALL_NS)
    assert {log for _, log, _ in recorded(stream, tmp_path)} == {EPOCH_NS}


def test_before_the_first_block_the_memory_is_bounded(stream: RecordingStream) -> None:
    for _ in range(5000):
        stream.take(topics.CLOCK, STRANGERS[topics.CLOCK](1), WALL_NS)
    assert stream.status()['messages left out [1]'] == 5000 - 4096
    stream.take(topics.WAVEFORM, block_bytes(0), WALL_NS)
    assert stream.status()['messages [1]'] == 4097
    assert stream.fault() == 'samples or blocks lost'


def test_of_two_sources_the_first_is_recorded(stream: RecordingStream, tmp_path: Path) -> None:
    stream.take(topics.CONFIG, text('{"k": 1}'), WALL_NS)
    for number in range(3):
        taken = stream.take(topics.WAVEFORM, block_bytes(number + 5), WALL_NS, is_alone=False)
        assert taken == stamp_of(number + 5)
        stream.take(topics.CONFIG, text('{"k": 2}'), WALL_NS, is_alone=False)
        assert not stream.take(topics.WAVEFORM, block_bytes(number), WALL_NS, is_alone=False)
    status = stream.status()
    assert status['blocks of another source [1]'] == 3
    assert status['lost samples [1]'] == 0
    assert stream.fault() == 'another source publishes rotor/waveform'
    assert len(recorded(stream, tmp_path)) == 4
    assert Recording(tmp_path / 'bag').config() == {'k': 1}


def test_missing_samples_and_refused_blocks_are_counted(stream: RecordingStream) -> None:
    for number in (0, 1, 4):
        stream.take(topics.WAVEFORM, block_bytes(number), WALL_NS)
    stream.take(topics.WAVEFORM, b'\0\1\0\0garbage!', WALL_NS)
    status = stream.status()
    assert status['blocks [1]'] == 3
    assert status['lost samples [1]'] == 2 * 256
    assert status['refused blocks [1]'] == 1
    assert status['messages [1]'] == 4  # recorded as it came


def test_the_configuration_becomes_metadata(stream: RecordingStream, tmp_path: Path) -> None:
    for content in ({'k': 1}, {'k': 2}, {'k': 2}):
        stream.take(topics.CONFIG, text(json.dumps(content)), WALL_NS)
    stream.take(topics.WAVEFORM, block_bytes(0), WALL_NS)
    assert len(recorded(stream, tmp_path)) == 4
    recording = Recording(tmp_path / 'bag')
    assert recording.config() == {'k': 2}
    assert recording.damage == []


def test_a_configuration_that_is_no_text_is_recorded_as_it_came(
    stream: RecordingStream, tmp_path: Path
) -> None:
    stream.take(topics.CONFIG, b'\0\1\0\0\xff\xff\xff\x7f', WALL_NS)
    stream.take(topics.WAVEFORM, block_bytes(0), WALL_NS)
    assert len(recorded(stream, tmp_path)) == 2


def test_names_are_those_that_the_node_resolves(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / 'bag') as writer:
        stream = RecordingStream(writer, lambda name: f'/rig_1/{name}')
        stream.take(topics.WAVEFORM, block_bytes(0), WALL_NS)
        assert replace(topics.WAVEFORM, name='/rig_1/rotor/waveform') in writer._channels
    assert list(Recording(tmp_path / 'bag').message_counts) == ['/rig_1/rotor/waveform']
