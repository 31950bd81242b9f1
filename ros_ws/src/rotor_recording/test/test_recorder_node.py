# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The real recorder process: ready, recording, ended, killed, and out of disk."""

import json
import resource
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from rosbags.rosbag2 import Reader

from recording_support import (
    CONFIG_TEXT,
    Peer,
    Wire,
    block_bytes,
    made_up_run,
    private_ros,
    process,
    stamp_of,
)
from rotor_common.exit_code import ExitCode
from rotor_interfaces import messages, ros, topics
from rotor_interfaces.messages import ros_class, typestore
from rotor_interfaces.topics import Topic
from rotor_recording.reading import Recording, waveform_blocks

pytestmark = pytest.mark.slow

SENT_TOPICS = tuple(dict.fromkeys(wire.topic for wire in made_up_run(1)))
BLOCK_S = 0.025


@dataclass
class Source:
    """The rig's side: publishes raw messages and hears the recorder's credits."""

    peer: Peer
    credits: list[int] = field(default_factory=list)
    statuses: list[dict[str, str]] = field(default_factory=list)
    outputs: dict[Topic, Any] = field(default_factory=dict)
    progress: Any = None

    def __post_init__(self) -> None:
        self.progress = ros.subscription(self.peer.node, topics.PROGRESS, self._on_progress)
        ros.subscription(self.peer.node, topics.DIAGNOSTICS, self._on_diagnostics)

    def open(self) -> None:
        self.outputs = {topic: ros.publisher(self.peer.node, topic) for topic in SENT_TOPICS}

    def _on_progress(self, message: Any) -> None:
        assert message.frame_id == 'recorder'
        self.credits.append(messages.stamp_ns(message))

    def _on_diagnostics(self, message: Any) -> None:
        (status,) = message.status
        assert status.name == 'recorder: stream'
        self.statuses.append({value.key: value.value for value in status.values})

    def hears_credits(self) -> bool:
        return bool(self.progress.get_publisher_count())

    def blocks_reported(self) -> int:
        return int(self.statuses[-1]['blocks [1]']) if self.statuses else 0

    def wait_until_recorded(self) -> None:
        assert self.peer.spin_until(lambda: bool(self.credits)), 'the recorder is not ready'
        assert self.peer.spin_until(
            lambda: all(output.get_subscription_count() for output in self.outputs.values())
        )

    def publish(self, wire: Wire) -> None:
        self.outputs[wire.topic].publish(wire.data)


@pytest.fixture
def ros_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    environment = private_ros(tmp_path / 'log')
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    return environment


@pytest.fixture
def source(ros_environment: dict[str, str]) -> Iterator[Source]:
    with Peer(int(ros_environment['ROS_DOMAIN_ID'])) as peer:
        yield Source(peer)


def recorder(
    folder: Path, environment: dict[str, str], *more: str, **options: Any
) -> AbstractContextManager[subprocess.Popen[str]]:
    arguments = ['-m', 'rotor_recording.recorder_node', '--ros-args']
    arguments += ['-p', f'path:={folder}', '-p', 'expect:=[rotor/waveform, rotor/truth]', *more]
    return process(arguments, environment, **options)


def filled(data: bytes) -> bytes:
    """Return the bytes as DDS delivers them: filled up to a multiple of 4."""
    return data + bytes(-len(data) % 4)


@pytest.mark.parametrize('number', [signal.SIGTERM, signal.SIGINT])
def test_everything_is_recorded_and_a_signal_finalises(
    tmp_path: Path, ros_environment: dict[str, str], source: Source, number: signal.Signals
) -> None:
    folder = tmp_path / 'bag'
    sent = [wire for wire in made_up_run(60) if wire.stamp_ns != stamp_of(7)]
    with recorder(folder, ros_environment) as child:
        assert source.peer.spin_until(lambda: source.hears_credits() and bool(source.statuses))
        source.peer.spin_for(0.3)
        assert source.credits == [], 'ready before the expected topics have a publisher'
        source.open()
        source.wait_until_recorded()
        for wire in sent:
            source.publish(wire)
            source.peer.spin_for(0.002)
        assert source.peer.spin_until(lambda: source.credits[-1] == stamp_of(59))
        assert source.peer.spin_until(lambda: source.blocks_reported() == 59)
        child.send_signal(number)
        assert child.wait(300.0) == 0
        assert child.communicate()[1] == ''
    assert source.credits[0] == 0
    assert source.credits[1:] == [w.stamp_ns for w in sent if w.topic is topics.WAVEFORM]
    assert source.statuses[-1]['lost samples [1]'] == '256'

    assert {p.name for p in folder.iterdir()} == {'bag_0.mcap', 'metadata.yaml'}
    recording = Recording(folder)
    assert recording.damage == []
    assert recording.config() == json.loads(CONFIG_TEXT)
    for topic in SENT_TOPICS:
        name = '/' + topic.name.lstrip('/')
        read = list(recording.messages([name]))
        wires = [wire for wire in sent if wire.topic is topic]
        if topic.best_effort:
            assert {m.data for m in read} <= {filled(wire.data) for wire in wires}
            continue
        assert [m.data for m in read] == [filled(wire.data) for wire in wires]
        assert [m.log_time_ns for m in read] == [wire.stamp_ns for wire in wires]
        assert all(abs(m.publish_time_ns - time.time_ns()) < 120e9 for m in read)
    with Reader(folder) as bag:
        assert bag.message_count == sum(recording.message_counts.values())
        assert len(list(bag.messages())) == bag.message_count


@pytest.mark.real_time
@pytest.mark.parametrize('alive_s', [1.07, 1.61, 2.23])
def test_a_killed_recorder_loses_at_most_a_quarter_of_a_second_and_a_block(
    tmp_path: Path, ros_environment: dict[str, str], source: Source, alive_s: float
) -> None:
    source.open()
    folder = tmp_path / 'bag'
    sent_at: list[float] = []
    latest = 0.0
    with recorder(folder, ros_environment) as child:
        source.wait_until_recorded()
        started = time.monotonic()
        while time.monotonic() < started + alive_s:
            due = started + len(sent_at) * BLOCK_S
            source.peer.spin_for(due - time.monotonic())
            data = block_bytes(len(sent_at))
            sent_at.append(time.monotonic())
            latest = max(latest, sent_at[-1] - due)
            source.outputs[topics.WAVEFORM].publish(data)
        killed = time.monotonic()
        child.kill()
        assert child.wait(300.0) == -signal.SIGKILL
    recording = Recording(folder)
    blocks = [block.first_sample // 256 for block in waveform_blocks(recording)]
    assert blocks == list(range(len(blocks)))
    assert [p.name for p in folder.iterdir()] == ['bag_0.mcap.active']
    assert 'not finalised' in ' '.join(recording.damage)
    lost_s = killed - sent_at[len(blocks)] if len(blocks) < len(sent_at) else 0.0
    # The machine's own part: as late as this process was, the recorder may have been.
    assert lost_s <= 0.25 + BLOCK_S + latest, f'lost {lost_s:.3f} s, late {latest:.3f} s'


def test_a_full_disk_ends_the_recorder_with_one_sentence(
    tmp_path: Path, ros_environment: dict[str, str], source: Source
) -> None:
    limit = 400_000

    def small_disk() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    folder = tmp_path / 'bag'
    source.open()
    with recorder(folder, ros_environment, preexec_fn=small_disk) as child:
        source.wait_until_recorded()
        for number in range(400):
            source.outputs[topics.WAVEFORM].publish(block_bytes(number))
            source.peer.spin_for(0.02)
            if child.poll() is not None:
                break
        assert child.wait(300.0) == ExitCode.PROCESS_FAILED
        said = child.communicate()[1].strip()
    assert said.startswith('error: ')
    assert 'cannot be written (File too large); the recording ends here' in said
    assert len(said.splitlines()) == 1
    recording = Recording(folder)
    blocks = [block.first_sample // 256 for block in waveform_blocks(recording)]
    assert blocks == list(range(len(blocks)))
    # a block is 18.8 kB at most: what fits is there but for the flush that failed, which held
    # what came in 0.2 s, here 10 to 15 blocks
    assert len(blocks) >= limit // 18_849 - 15
    assert recording.damage


@pytest.mark.parametrize(
    ('arguments', 'code', 'words'),
    [
        (['-p', 'path:=/proc/nowhere/bag'], 3, 'cannot be written'),
        ([], 2, 'path is empty'),
        (['-p', 'path:=bag', '-p', 'expect:=[rotor/wave]'], 2, "expect = 'rotor/wave' is no"),
    ],
)
def test_a_place_that_cannot_be_used_ends_in_one_sentence(
    ros_environment: dict[str, str], arguments: list[str], code: int, words: str
) -> None:
    command = ['-m', 'rotor_recording.recorder_node', '--ros-args', *arguments]
    with process(command, ros_environment) as child:
        assert child.wait(300.0) == code
        said = child.communicate()[1].strip()
    assert words in said
    assert len(said.splitlines()) == 1


def test_a_folder_in_use_is_not_touched(tmp_path: Path, ros_environment: dict[str, str]) -> None:
    (tmp_path / 'mine.txt').write_text('mine')
    with recorder(tmp_path, ros_environment) as child:
        assert child.wait(300.0) == ExitCode.PROCESS_FAILED
        said = child.communicate()[1].strip()
    assert said.startswith('error: the folder')
    assert 'is not empty' in said
    assert 'Traceback' not in said
    assert not list(tmp_path.glob('*.mcap*'))


def test_a_rig_in_a_namespace_is_recorded_there(
    tmp_path: Path, ros_environment: dict[str, str], source: Source
) -> None:
    folder = tmp_path / 'bag'
    output = source.peer.node.create_publisher(
        ros_class(topics.WAVEFORM.type), '/rig_1/rotor/waveform', ros.qos(topics.WAVEFORM)
    )
    with recorder(folder, ros_environment, '-r', '__ns:=/rig_1') as child:
        assert source.peer.spin_until(lambda: bool(output.get_subscription_count()))
        for number in range(5):
            output.publish(block_bytes(number))
        source.peer.spin_for(0.5)
        child.send_signal(signal.SIGTERM)
        assert child.wait(300.0) == 0
    assert [b.first_sample for b in waveform_blocks(Recording(folder))] == [0, 256, 512, 768, 1024]


def test_the_type_hashes_are_those_of_ros(source: Source) -> None:
    # truth: what the installed message packages announce in the ROS graph
    for topic in topics.TOPICS:
        output = ros.publisher(source.peer.node, topic)
        (info,) = source.peer.node.get_publishers_info_by_topic(output.topic_name)
        announced = info.topic_type_hash
        assert typestore().hash_rihs01(topic.type) == str(announced), topic.name
