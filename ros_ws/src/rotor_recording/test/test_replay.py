# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""What a replay publishes and when, without ROS."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import Writer

from recording_support import BLOCK_NS, EPOCH_NS, bag, block_bytes, made_up_run, stamp_of
from rotor_common.errors import ConfigError
from rotor_interfaces import topics
from rotor_interfaces.topics import Topic
from rotor_recording.errors import RecordingError
from rotor_recording.mcap_walk import Connection
from rotor_recording.reading import Recording
from rotor_recording.recording import RecordingWriter, qos_profiles
from rotor_recording.replay import (
    DEFAULT_DEPTH,
    MAX_BACKLOG_S,
    Offer,
    ReplayOptions,
    ReplaySchedule,
    begin_ns,
    latched_before,
    offer_of,
    selected,
)

# When


@given(
    rate=st.floats(0.01, 100.0),
    now_s=st.floats(0.0, 1e6),
    after_ns=st.integers(0, 3600 * 10**9),
)
def test_the_schedule_is_absolute(rate: float, now_s: float, after_ns: int) -> None:
    schedule = ReplaySchedule(rate=rate, begin_ns=EPOCH_NS, now_s=now_s)
    due_s = now_s + after_ns * 1e-9 / rate
    # doubles near 1e6 s are 1.2e-10 apart, and three operations lie between
    assert schedule.late_s(EPOCH_NS + after_ns, due_s) == pytest.approx(0.0, abs=1e-9)
    assert schedule.late_s(EPOCH_NS + after_ns, due_s - 1.0) == pytest.approx(-1.0, abs=1e-9)


@pytest.mark.parametrize('rate', [0.5, 1.0, 4.0])
def test_a_stall_shifts_the_schedule_instead_of_a_burst(rate: float) -> None:
    schedule = ReplaySchedule(rate=rate, begin_ns=EPOCH_NS, now_s=0.0)
    just_in_time_s = MAX_BACKLOG_S / rate
    assert not schedule.shift_if_stalled(EPOCH_NS, just_in_time_s)
    assert schedule.late_s(EPOCH_NS, just_in_time_s) == just_in_time_s
    stalled_s = just_in_time_s + 10.0
    assert schedule.shift_if_stalled(EPOCH_NS, stalled_s)
    assert schedule.late_s(EPOCH_NS, stalled_s) == 0.0
    assert schedule.late_s(EPOCH_NS + BLOCK_NS, stalled_s) == pytest.approx(-0.025 / rate)


@pytest.mark.parametrize(
    ('options', 'words'),
    [
        ({'rate': 0.0}, 'rate = 0.0 is out of range; allowed: above 0 to 1000'),
        ({'rate': -1.0}, 'rate = -1.0 is out of range'),
        ({'rate': float('nan')}, 'rate = nan is out of range'),
        ({'rate': float('inf')}, 'rate = inf is out of range'),
        ({'start_s': -0.1}, 'start_s = -0.1 is out of range; allowed: 0 s or more'),
        ({'wait_for_subscribers_s': -1.0}, 'wait_for_subscribers_s = -1.0 is out of range'),
    ],
)
def test_options_out_of_range_are_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigError) as refused:
        ReplayOptions(**options)
    assert words in str(refused.value)


def test_the_start_lies_in_the_recording(tmp_path: Path) -> None:
    recording = Recording(bag(tmp_path / 'bag', 41))
    assert begin_ns(recording, 0.0) == EPOCH_NS
    assert begin_ns(recording, 0.5) == EPOCH_NS + 500_000_000
    assert begin_ns(recording, 1.0) == stamp_of(40)
    with pytest.raises(RecordingError, match=r'start_s = 1.1 is after the end .* 1.000 s long'):
        begin_ns(recording, 1.1)


def test_an_empty_recording_cannot_be_replayed(tmp_path: Path) -> None:
    RecordingWriter(tmp_path / 'bag').close()
    with pytest.raises(RecordingError, match='holds no message'):
        begin_ns(Recording(tmp_path / 'bag'), 0.0)


# What


@pytest.fixture
def full(tmp_path: Path) -> Recording:
    """A recording of every topic of the contract."""
    with RecordingWriter(tmp_path / 'bag') as writer:
        for topic in topics.TOPICS:
            writer.write(topic, bytes(12), EPOCH_NS, EPOCH_NS)
    return Recording(tmp_path / 'bag')


def test_all_but_clock_progress_and_diagnostics_are_published(full: Recording) -> None:
    expected = {'/' + topic.name.lstrip('/') for topic in topics.TOPICS}
    expected -= {'/clock', '/rig/progress', '/diagnostics'}
    assert selected(full, ()).keys() == expected


def test_topics_can_be_named_with_and_without_a_slash(full: Recording) -> None:
    names = ('rotor/waveform', '/diagnostics')
    assert list(selected(full, names)) == ['/rotor/waveform', '/diagnostics']


@pytest.mark.parametrize(
    ('name', 'words'),
    [
        ('rotor/waveforms', 'holds no /rotor/waveforms; its topics are: /maneuver/load'),
        ('/clock', '/clock is never replayed'),
        ('rig/progress', '/rig/progress is never replayed'),
    ],
)
def test_a_topic_that_cannot_be_replayed_is_refused(full: Recording, name: str, words: str) -> None:
    with pytest.raises(RecordingError, match=words):
        selected(full, (name,))


def test_an_encoding_that_ros_does_not_speak_is_refused(tmp_path: Path) -> None:
    with (tmp_path / 'run.mcap').open('wb') as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema('std_msgs/msg/String', 'ros2msg', b'string data')
        writer.add_message(writer.register_channel('/a', 'json', schema), 1, b'{}', 1)
        writer.finish()  # type: ignore[no-untyped-call]
    with pytest.raises(RecordingError, match=r"/a in .* is encoded as 'json'"):
        selected(Recording(tmp_path / 'run.mcap'), ())


def test_the_last_latched_message_before_the_start_goes_first(tmp_path: Path) -> None:
    recording = Recording(bag(tmp_path / 'bag', 20))
    chosen = selected(recording, ())
    first = latched_before(recording, chosen, stamp_of(10))
    wires = [w for w in made_up_run(20) if w.topic.latched and w.stamp_ns < stamp_of(10)]
    last = {w.topic: w for w in wires}
    expected = sorted(last.values(), key=lambda wire: wire.stamp_ns)
    assert [m.data for m in first] == [wire.data for wire in expected]
    assert [m.topic for m in first] == ['/rotor/config', '/rotor/truth', '/maneuver/load']
    assert latched_before(recording, chosen, EPOCH_NS) == []


# With which quality of service


@pytest.mark.parametrize('topic', topics.TOPICS, ids=lambda topic: topic.name)
def test_the_quality_of_service_is_the_recorded_one(topic: Topic) -> None:
    text = yaml.safe_dump(qos_profiles(topic))
    offer = offer_of(Connection('/a', topic.type, 'cdr', text))
    assert offer == Offer(topic.depth, is_reliable=True, is_latched=topic.latched)


ROSBAG2_V8 = '- history: 1\n  depth: 10\n  reliability: {}\n  durability: {}\n'


@pytest.mark.parametrize(
    ('text', 'offer'),
    [
        # rmw: reliability 1 reliable, 2 best effort; durability 1 transient local, 2 volatile
        (ROSBAG2_V8.format(1, 1), Offer(10, is_reliable=True, is_latched=True)),
        (ROSBAG2_V8.format(2, 2), Offer(10, is_reliable=False, is_latched=False)),
        # a recorder that saw the publisher only in the graph does not know its depth
        ('- depth: 0', Offer(DEFAULT_DEPTH, is_reliable=True, is_latched=False)),
        ('', Offer(DEFAULT_DEPTH, is_reliable=True, is_latched=False)),
        ('[', Offer(DEFAULT_DEPTH, is_reliable=True, is_latched=False)),
        ('- 3', Offer(DEFAULT_DEPTH, is_reliable=True, is_latched=False)),
        ('depth: -1', Offer(DEFAULT_DEPTH, is_reliable=True, is_latched=False)),
        ('- depth: 99999999999', Offer(DEFAULT_DEPTH, is_reliable=True, is_latched=False)),
    ],
)
def test_other_recorders_quality_of_service_is_understood(text: str, offer: Offer) -> None:
    assert offer_of(Connection('/a', 'std_msgs/msg/String', 'cdr', text)) == offer


def test_a_namespace_does_not_hide_what_is_never_replayed(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / 'bag') as writer:
        for topic in (topics.WAVEFORM, topics.PROGRESS):
            moved = replace(topic, name=f'/rig_1/{topic.name}')
            writer.write(moved, block_bytes(0), EPOCH_NS, EPOCH_NS)
    assert list(selected(Recording(tmp_path / 'bag'), ())) == ['/rig_1/rotor/waveform']
