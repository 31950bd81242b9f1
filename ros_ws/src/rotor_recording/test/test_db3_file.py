# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: S608 - the statements are made here
"""SQLite bags: no cell is trusted, and a replay finds its way by the index of times."""

import contextlib
import sqlite3
import time
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rosbags.rosbag2 import StoragePlugin, Writer

from recording_support import EPOCH_NS, made_up_run
from rotor_interfaces.messages import typestore
from rotor_recording.db3_file import Db3File
from rotor_recording.errors import RecordingInputError
from rotor_recording.reading import Recording, waveform_blocks
from rotor_recording.replay import begin_ns, latched_before, selected
from rotor_recording.seeking import _runs

BLOCKS = 8


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """A bag of 8 blocks."""
    known = {}
    with Writer(tmp_path / 'bag', version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        for topic, stamp_ns, data in made_up_run(BLOCKS):
            if topic not in known:
                name = f'/{topic.name.lstrip("/")}'
                known[topic] = writer.add_connection(name, topic.type, typestore=typestore())
            writer.write(known[topic], stamp_ns, data)
    return tmp_path / 'bag' / 'bag.db3'


def change(bag: Path, *queries: str) -> None:
    with contextlib.closing(sqlite3.connect(bag)) as database:
        for query in queries:
            database.execute(query)
        database.commit()


ONE = 'WHERE rowid = (SELECT min(rowid) FROM messages WHERE topic_id = 2)'
ROW = 'rows are left out, since their time is no whole number from 0 on or their data are no bytes'
BROKEN = {
    'data is 2 GiB of a number': f'UPDATE messages SET data = 2147483647 {ONE}',
    'data is a text': f"UPDATE messages SET data = 'x' {ONE}",
    'time is a text': f"UPDATE messages SET timestamp = 'x' {ONE}",
    'time is a float': f'UPDATE messages SET timestamp = 0.5 {ONE}',
    'time is before 1970': f'UPDATE messages SET timestamp = -1 {ONE}',
}


@pytest.mark.parametrize('what', BROKEN)
def test_a_row_that_is_no_message_is_left_out_and_counted(bag: Path, what: str) -> None:
    change(bag, BROKEN[what])
    begun_s = time.process_time()
    recording = Recording(bag)
    assert len(list(waveform_blocks(recording))) == BLOCKS - 1
    assert time.process_time() - begun_s < 2.0
    assert recording.message_counts['/rotor/waveform'] == BLOCKS - 1
    assert recording.damage == [f'bag.db3: 1 {ROW}']
    assert recording.files[0].lost_messages == 1


def test_topics_that_are_none_are_counted_with_their_messages(bag: Path) -> None:
    change(bag, "UPDATE topics SET name = x'00ff' WHERE id = 3", 'DELETE FROM topics WHERE id = 4')
    recording = Recording(bag)
    assert len(list(waveform_blocks(recording))) == BLOCKS
    assert recording.damage == [
        'bag.db3: 1 topics have no number or no name and are left out',
        f'bag.db3: {2 * BLOCKS} messages of topics that it does not name are left out',
    ]


def test_foreign_words_about_a_topic_end_nothing(bag: Path) -> None:
    bomb = 'a: &a [x, x]\n' + ''.join(
        f'{chr(98 + n)}: &{chr(98 + n)} [*{chr(97 + n)}, *{chr(97 + n)}]\n' for n in range(24)
    )
    with contextlib.closing(sqlite3.connect(bag)) as database:
        database.execute('UPDATE topics SET offered_qos_profiles = ?', (bomb,))
        database.execute("UPDATE topics SET type = x'00' WHERE id = 3")
        database.execute('UPDATE message_definitions SET encoding = 5')
        database.commit()
    begun_s = time.process_time()
    recording = Recording(bag)
    assert len(selected(recording, ())) == len(recording.topics()) - 1  # but /clock
    assert latched_before(recording, selected(recording, ()), EPOCH_NS + 1) == []
    assert time.process_time() - begun_s < 2.0
    assert len(list(recording.messages())) == 7 * BLOCKS + 1


ENDLESS = (
    'CREATE VIEW messages AS WITH RECURSIVE a(id, topic_id, timestamp, data) AS '
    '(SELECT 1, 2, 3, 4 UNION ALL SELECT id + 1, 2, 3, 4 FROM a) SELECT * FROM a'
)


@pytest.mark.parametrize(
    'queries',
    [
        ('DROP TABLE messages',),
        ('DROP TABLE messages', ENDLESS),
        ('ALTER TABLE messages DROP COLUMN data',),
        ('DROP INDEX timestamp_idx', 'ALTER TABLE messages DROP COLUMN timestamp'),
        ('ALTER TABLE topics DROP COLUMN type',),
    ],
)  # fmt: skip
def test_what_is_no_bag_ends_in_a_sentence(bag: Path, queries: tuple[str, ...]) -> None:
    change(bag, *queries)
    with pytest.raises(RecordingInputError, match=r'bag\.db3 cannot be read as a SQLite bag'):
        Recording(bag)


def test_a_list_of_tables_that_is_no_text_ends_in_a_sentence(bag: Path) -> None:
    data = bag.read_bytes()
    spoilt = data.replace(b'CREATE TABLE', b'CREATE \x99ABLE')
    assert spoilt != data
    bag.write_bytes(spoilt)
    with pytest.raises(RecordingInputError, match='its list of tables is damaged'):
        Db3File(bag)


def test_a_column_that_makes_up_gigabytes_ends_in_a_sentence(bag: Path) -> None:
    change(
        bag,
        'DROP TABLE messages',
        'CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, '
        'data BLOB GENERATED ALWAYS AS (zeroblob(900000000)) VIRTUAL)',
        'INSERT INTO messages(topic_id, timestamp) VALUES (2, 5)',
    )
    with pytest.raises(RecordingInputError, match='string or blob too big'):
        list(Recording(bag).messages())


@settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=60
)
@given(
    rows=st.lists(st.tuples(st.integers(1, 4), st.integers(0, 60)), min_size=1, max_size=40),
    wanted=st.sets(st.integers(1, 4), min_size=1),
    hole=st.integers(1, 15),
    begin=st.integers(0, 61),
    is_indexed=st.booleans(),
)
def test_the_index_of_times_says_what_all_rows_say(
    tmp_path: Path,
    rows: list[tuple[int, int]],
    wanted: set[int],
    hole: int,
    *,
    begin: int,
    is_indexed: bool,
) -> None:
    path = tmp_path / 'x.db3'
    path.unlink(missing_ok=True)
    change(
        path,
        'CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format)',
        'CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data)',
        *(['CREATE INDEX timestamp_idx ON messages(timestamp)'] if is_indexed else []),
        *(f"INSERT INTO topics VALUES ({n}, '/t{n}', 'x/msg/X', 'cdr')" for n in range(1, 5)),
        *(f"INSERT INTO messages VALUES (NULL, {n}, {t}, x'{i:02x}')"
          for i, (n, t) in enumerate(rows)),
    )  # fmt: skip
    file = Db3File(path)
    (segment,) = file.segments
    times = sorted(t for n, t in rows if n in wanted)
    assert [*_runs(file.times(segment, wanted, hole), hole)] == [*_runs(times, hole)]
    order = sorted(range(len(rows)), key=lambda i: (rows[i][1], i))
    found = [(m.channel_id, m.log_time_ns, m.data) for m in file.ordered(segment, begin)]
    assert found == [(*rows[i], bytes([i])) for i in order if rows[i][1] >= begin]
    last = {rows[i][0]: i for i in order if rows[i][1] < begin and rows[i][0] in wanted}
    said = {m.channel_id: m.data for m in file.last_before(segment, wanted, begin)}
    assert said == {n: bytes([i]) for n, i in last.items()}


def test_a_replay_from_the_end_reads_hardly_more_than_the_end(bag: Path) -> None:
    steps = 100_000
    with contextlib.closing(sqlite3.connect(bag)) as database:
        database.executemany(
            'INSERT INTO messages(topic_id, timestamp, data) VALUES (2, ?, ?)',
            ((EPOCH_NS + n * 10_000_000, b'\0\1\0\0') for n in range(1, steps)),
        )
        database.commit()
    recording = Recording(bag)
    chosen = selected(recording, ())
    begun_s = time.process_time()
    begin = begin_ns(recording, steps * 0.01 - 1.0, chosen.keys())
    first = next(recording.messages(chosen.keys(), begin))
    taken_s = time.process_time() - begun_s
    assert first.log_time_ns == begin == EPOCH_NS + (steps - 100) * 10_000_000
    begun_s = time.process_time()
    assert sum(1 for _ in recording.messages()) > steps
    assert taken_s < (time.process_time() - begun_s) / 10
