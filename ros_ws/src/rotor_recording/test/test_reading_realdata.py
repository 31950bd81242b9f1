# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Files that we did not make: other recorders', the MCAP conformance vectors, damaged ones.

Truth here is what stands beside the files: the expected records of the conformance suite of
foxglove/mcap, and the number of whole messages in each damaged file.
"""

import json
import os
from pathlib import Path

import pytest

from rotor_recording.errors import RecordingError
from rotor_recording.reading import Recording

REALDATA = Path(
    os.environ.get(
        'ROTOR_RIG_REALDATA', Path(__file__).resolve().parents[5] / 'shared' / 'realdata'
    )
)

pytestmark = pytest.mark.skipif(
    not (REALDATA / 'mcap_bad').is_dir(),
    reason='no real data: set ROTOR_RIG_REALDATA to the folder that holds mcap/ and mcap_bad/',
)

# messages to salvage, and words of the sentence about the loss (None: the file is whole)
READABLE = {
    'chunk_index_wrong_offset_multi': (1324, 'the summary is damaged'),
    # attachments are no messages and are not read
    'crc_attachment_conformance': (0, None),
    'crc_data_end_conformance': (1, 'checksum of the data section does not fit'),
    'crc_summary_conformance': (1, 'the summary is damaged'),
    'footer_summary_beyond_eof_multi': (1324, 'the summary is damaged'),
    'footer_summary_zero_multi': (1324, None),
    # a reader that streams stops at 690; the index leads past the broken chunk of 88
    'huge_record_length_multi': (1236, '1236 of the 1324 messages'),
    'huge_uncompressed_size_multi': (1324, 'claims 1099511627776 bytes'),
    'ok_no_summary': (200, None),
    'ok_rechunked_multi': (1324, None),
    'one_bad_chunk_of_many_multi': (1236, 'its 88 messages are left out'),
    'trailing_garbage_imu': (2, '4096 bytes after the end'),
    'truncated_in_chunk_k_multi': (690, 'not finalised, or is cut'),
    'truncated_mid_message_ten': (6, 'not finalised, or is cut'),
    'truncated_no_dataend_imu': (2, 'not finalised, or is cut'),
    'truncated_no_dataend_ten': (10, 'not finalised, or is cut'),
    'truncated_no_end_magic_multi': (1324, 'the mark at the very end is missing'),
    'truncated_no_footer_multi': (1324, 'not finalised, or is cut'),
    'unknown_opcode_0x99': (1, 'checksum of the data section does not fit'),
    'wrong_message_encoding_rosbag2': (7, None),
}
UNREADABLE = {
    'chunk_not_closed': 'not finalised, or is cut',
    'crc_chunk_conformance': 'its checksum does not fit',
    'crc_chunk_talker_zstd': 'its checksum does not fit',
    'empty_0_bytes': 'is empty',
    'header_claims_1000_bytes': 'not finalised, or is cut',
    'header_only_talker': 'not finalised, or is cut',
    'magic_20_zero': 'is not an MCAP file',
    'magic_only': 'not finalised, or is cut',
    'magic_short_4_zero': 'is not an MCAP file',
    'magic_text': 'is not an MCAP file',
    'message_without_channel': 'the definition of the channel is missing',
    'nested_chunk': 'another chunk, which MCAP forbids',
    'truncated_mid_chunk_talker': 'not finalised, or is cut',
    'unknown_compression': "its compression is 'unknown'",
    'zstd_bitflip_talker': 'it cannot be unpacked',
}


def test_every_bad_file_has_an_expectation() -> None:
    there = {path.stem for path in (REALDATA / 'mcap_bad').glob('*.mcap')}
    assert there == READABLE.keys() | UNREADABLE.keys()


@pytest.mark.parametrize('name', READABLE)
def test_what_is_whole_is_salvaged(name: str) -> None:
    count, words = READABLE[name]
    recording = Recording(REALDATA / 'mcap_bad' / f'{name}.mcap')
    assert sum(1 for _ in recording.messages()) == count
    assert bool(recording.damage) == (words is not None)
    assert words is None or words in ' '.join(recording.damage)


@pytest.mark.parametrize('name', UNREADABLE)
def test_what_is_not_readable_ends_in_one_sentence(name: str) -> None:
    path = REALDATA / 'mcap_bad' / f'{name}.mcap'
    with pytest.raises(RecordingError) as refused:
        list(Recording(path).messages())
    sentence = str(refused.value)
    assert str(path) in sentence
    assert UNREADABLE[name] in sentence
    assert '\n' not in sentence


def test_the_conformance_vectors_are_read_as_they_say() -> None:
    paths = sorted((REALDATA / 'mcap' / 'conformance').rglob('*.mcap'))
    assert len(paths) == 416
    for path in paths:
        records = json.loads(path.with_suffix('.json').read_text())['records']
        expected = [dict(r['fields']) for r in records if r['type'] == 'Message']
        expected.sort(key=lambda fields: int(fields['log_time']))
        recording = Recording(path)
        read = list(recording.messages())
        assert [m.log_time_ns for m in read] == [int(f['log_time']) for f in expected], path
        assert [m.publish_time_ns for m in read] == [int(f['publish_time']) for f in expected]
        assert [list(m.data) for m in read] == [[int(b) for b in f['data']] for f in expected]
        assert recording.damage == [], path
        assert sum(recording.message_counts.values()) == len(expected), path


@pytest.mark.parametrize(
    ('tail', 'counts'),
    [
        ('only_topics', {'/parameter_events': 7}),
        ('topics_and_services', {'/parameter_events': 7, '/add_two_ints/_service_event': 6}),
        ('rewriter_a_0', {'a_empty': 100, 'b_basictypes': 50}),
        ('rewriter_b_0', {'a_empty': 25, 'c_strings': 50}),
        ('multiple_files_2', {'/chatter': 529}),
        ('talker__talker', {'/rosout': 10, '/topic': 10}),
        ('cdr_test_0', {'/test_topic': 3, '/array_topic': 4}),
        ('test_bag_for_seek_0', {'topic1': 5}),
    ],
)
def test_recordings_of_rosbag2_are_read(tail: str, counts: dict[str, int]) -> None:
    for path in (REALDATA / 'mcap' / 'ros2_rosbag2').glob(f'*{tail}.mcap'):
        recording = Recording(path)
        assert recording.message_counts == counts
        assert recording.damage == []
        assert sum(1 for _ in recording.messages()) == sum(counts.values())
