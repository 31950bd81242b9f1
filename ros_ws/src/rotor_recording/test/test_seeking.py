# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A replay finds its start by the indices of the file, and as if it had read everything."""

import itertools
import math
import random
from collections.abc import Collection
from pathlib import Path

import pytest
from rosbags.rosbag2 import StoragePlugin, Writer

from recording_support import EPOCH_NS, made_up_run, stamp_of, write_all
from rotor_common.constants import NANOSECONDS
from rotor_interfaces import topics
from rotor_interfaces.messages import typestore
from rotor_recording import replay
from rotor_recording.errors import RecordingInputError
from rotor_recording.mcap_file import McapFile
from rotor_recording.mcap_records import StoredMessage
from rotor_recording.mcap_walk import Segment
from rotor_recording.reading import RecordedMessage, Recording
from rotor_recording.recording import RecordingWriter

KINDS = ('whole', 'unfinished', 'sqlite')
CUT_AFTER_DATA = b'\x0f\x04\x00\x00\x00\x00\x00\x00\x00'
"""The head of the record that ends the data section."""


def long_run(path: Path, blocks: int, *, kind: str = 'whole') -> Path:
    """Write blocks with a chunk each 10 of them; the load is 2 s ahead, as it is live."""
    wires = list(made_up_run(blocks))
    with RecordingWriter.single_file(path, config={'scenario': {}}) as writer:
        for number, wire in enumerate(wires):
            ahead_ns = 2 * NANOSECONDS if wire.topic is topics.MANEUVER_LOAD else 0
            write_all(writer, [wire._replace(stamp_ns=wire.stamp_ns + ahead_ns)])
            if number % 70 == 69:
                writer.flush()
    return path if kind == 'whole' else unfinished(path)


def unfinished(path: Path) -> Path:
    """Return a copy as a killed recorder leaves it."""
    content = path.read_bytes()
    copy = path.with_name(f'{path.name}.active')
    copy.write_bytes(content[: content.rindex(CUT_AFTER_DATA)])
    return copy


class Reads:
    """Counts the chunks that are read."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.count = 0
        read = McapFile._read

        def counted(file: McapFile, segment: Segment) -> list[StoredMessage]:
            self.count += 1
            return read(file, segment)

        monkeypatch.setattr(McapFile, '_read', counted)


@pytest.mark.slow
@pytest.mark.parametrize('kind', ['whole', 'unfinished'])
def test_a_late_start_reads_a_few_chunks_whatever_the_length(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    counts = []
    for blocks in (800, 2400):
        path = long_run(tmp_path / f'{blocks}.mcap', blocks, kind=kind)
        reads = Reads(monkeypatch)
        opened = Recording(path)
        chunks = len(opened._files[0].segments)
        assert chunks >= blocks / 10
        chosen = replay.selected(opened, ())
        begin = replay.begin_ns(opened, blocks * 0.025 - 1.0, chosen)
        latched = replay.latched_before(opened, chosen, begin)
        first = next(opened.messages(chosen, begin))
        assert first.log_time_ns == begin == stamp_of(blocks - 40)
        assert {m.topic for m in latched} == {'/rotor/config', '/rotor/truth', '/maneuver/load'}
        assert opened.damage == [] or kind == 'unfinished'
        counts.append(reads.count)
        monkeypatch.undo()
    # the load lies 8 chunks before what it is for
    assert counts[0] == counts[1] <= 24, counts


def test_only_chunks_with_a_topic_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened = Recording(long_run(tmp_path / 'a.mcap', 400))
    reads = Reads(monkeypatch)
    assert len(list(opened.messages(['/rotor/config']))) == 1
    assert reads.count == 1


# The start, against a reading of everything


def everything(opened: Recording, start_s: float, names: Collection[str]) -> int | None:
    """Return where a replay begins by reading all messages; None if it is over before."""
    start_ns = math.floor(start_s * NANOSECONDS)
    for at_ns, message in replay.timed(opened.messages(names)):
        if at_ns >= start_ns:
            return message.log_time_ns - (at_ns - start_ns)
    return None


def latched(opened: Recording, names: Collection[str], time_ns: int) -> dict[str, RecordedMessage]:
    """Return the last message of each topic before a time by reading all messages."""
    return {m.topic: m for m in opened.messages(names) if m.log_time_ns < time_ns}


def patchy(path: Path, seed: int, kind: str) -> Path:
    """Write three topics at random times, with pauses on both sides of a hole, in small chunks."""
    chance = random.Random(seed)
    kept = [topics.TRUTH, topics.MANEUVER_LOAD, topics.CLOCK]
    wires = [wire for wire in made_up_run(3) if wire.topic in kept]
    times = list(
        itertools.accumulate(
            chance.choice([0.0, 0.1, 1.0, 6.0, 9.999, 10.0, 10.001, 40.0]) for _ in range(60)
        )
    )
    sent = [
        chance.choice(wires)._replace(stamp_ns=EPOCH_NS + round(time_s * NANOSECONDS))
        for time_s in times
    ]
    for _ in range(chance.choice([0, 5, 40])):
        one, other = chance.sample(range(len(sent)), 2)
        sent[one], sent[other] = sent[other], sent[one]
    if kind == 'sqlite':
        with Writer(path, version=9, storage_plugin=StoragePlugin.SQLITE3) as bag:
            store = typestore()
            known = {t: bag.add_connection(f'/{t.name}', t.type, typestore=store) for t in kept[:2]}
            known[topics.CLOCK] = bag.add_connection('/clock', topics.CLOCK.type, typestore=store)
            for wire in sent:
                bag.write(known[wire.topic], wire.stamp_ns, wire.data)
        return path
    with RecordingWriter.single_file(path) as writer:
        for wire in sent:
            write_all(writer, [wire])
            if chance.random() < 0.3:
                writer.flush()
    return path if kind == 'whole' else unfinished(path)


@pytest.mark.slow
@pytest.mark.parametrize('kind', KINDS)
def test_the_start_is_that_of_a_reading_of_everything(tmp_path: Path, kind: str) -> None:
    starts = found = 0
    for seed in range(25):
        path = patchy(tmp_path / f'{seed}', seed, kind)
        opened = Recording(path)
        for names in (['/rotor/truth'], ['/rotor/truth', '/maneuver/load'], list(opened.topics())):
            for start_s in (0.0, 0.05, 7.0, 10.0, 33.3, 61.0, 120.0, 1e4):
                starts += 1
                expected = everything(opened, start_s, names)
                if expected is None:
                    with pytest.raises(RecordingInputError, match='after the end'):
                        replay.begin_ns(opened, start_s, names)
                    continue
                assert replay.begin_ns(Recording(path), start_s, names) == expected, (seed, start_s)
                before = Recording(path).last_before(names, expected)
                assert [m.log_time_ns for m in before] == sorted(m.log_time_ns for m in before)
                last = {message.topic: message for message in before}
                assert last == latched(opened, names, expected), (seed, start_s)
                found += 1
    assert 0 < found < starts


def test_the_length_in_the_refusal_is_that_of_a_reading_of_everything(tmp_path: Path) -> None:
    opened = Recording(patchy(tmp_path / 'a', 3, 'whole'))
    *_, (at_ns, _) = replay.timed(opened.messages())
    with pytest.raises(RecordingInputError, match=f'{at_ns / NANOSECONDS:.3f} s long'):
        replay.begin_ns(opened, 1e6)


def test_a_flip_in_an_unfinished_file_is_seen_at_the_latest_when_it_is_read(tmp_path: Path) -> None:
    path = long_run(tmp_path / 'a.mcap', 100, kind='unfinished')
    sent = list(Recording(path).messages())
    content = path.read_bytes()
    # the head of the fourth chunk: its first and last log time, which have no checksum
    segment = Recording(path)._files[0].segments[3]
    for place in (segment.offset + 2, segment.offset + 10):
        flipped = bytearray(content)
        flipped[place] ^= 0x40
        path.write_bytes(flipped)
        assert list(Recording(path).messages()) == sent
        begin = stamp_of(50)
        late = [message for message in sent if message.log_time_ns >= begin]
        assert list(Recording(path).messages(start_ns=begin)) == late
