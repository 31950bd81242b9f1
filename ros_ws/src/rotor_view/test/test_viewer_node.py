# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The real viewer process, live over DDS: what arrives is shown, and it ends as it should."""

import signal
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import view_flight
from recording_support import Peer, private_ros, process
from rotor_interfaces import messages, ros, topics
from rotor_view import style
from rotor_view.rig_view import SHOWN_TOPICS
from view_rows import curve, lines, logged

pytestmark = pytest.mark.slow


@pytest.fixture
def environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    environment = private_ros(tmp_path / 'log')
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    monkeypatch.delenv('DISPLAY', raising=False)
    monkeypatch.delenv('WAYLAND_DISPLAY', raising=False)
    return environment


def arguments(*parameters: str) -> list[str]:
    given = [text for parameter in parameters for text in ('-p', parameter)]
    return ['-m', 'rotor_view.viewer_node', '--ros-args', *given]


def publish(peer: Peer, run: list[view_flight.Outgoing], rate: float) -> None:
    """Publish a run at `rate` times real time, each message when the one before is out."""
    outputs: dict[Any, Any] = {topic: ros.publisher(peer.node, topic) for topic in SHOWN_TOPICS}
    assert peer.spin_until(
        lambda: all(output.get_subscription_count() for output in outputs.values())
    )
    peer.spin_for(0.5)
    start = time.monotonic()
    for topic, stamp_ns, message in run:
        if topic == topics.WAVEFORM:
            due_s = (stamp_ns - view_flight.EPOCH_NS) / 1e9 / rate
            peer.spin_for(max(0.0, start + due_s - time.monotonic()))
        outputs[topic].publish(messages.to_cdr(message))
    peer.spin_for(1.0)


@pytest.mark.real_time
def test_a_live_run_is_shown_whole(tmp_path: Path, environment: dict[str, str]) -> None:
    file = tmp_path / 'live.rrd'
    with (
        Peer(int(environment['ROS_DOMAIN_ID'])) as peer,
        process(arguments(f'save:={file}'), environment) as child,
    ):
        publish(peer, list(view_flight.flight(3.0)), rate=1.0)
        child.send_signal(signal.SIGINT)
        assert child.wait(300.0) == 0
    found = logged(file)
    times, values = curve(found, style.DISPLACEMENT)
    assert lines(found) == [
        'no window yet',
        'all rules are below their limits',
        'crack_ratio_low = 0.015: above the WARN limit',
        'crack_ratio_low = 0.02: above the ERROR limit',
    ]
    np.testing.assert_array_equal(times, np.rint(np.arange(30720) * 1e9 / 10240))
    assert not np.isnan(values).any()
    assert len(curve(found, style.LOAD)[0]) == 301
    assert len(curve(found, style.ratios('disk_z'))[0]) == 11
    assert np.asarray(found['/rig/disk/crack Mesh3D:vertex_positions'][0]).size == 1


@pytest.mark.real_time
def test_beyond_its_budget_the_view_has_gaps_and_says_so(
    tmp_path: Path, environment: dict[str, str]
) -> None:
    file = tmp_path / 'live.rrd'
    run = [message for message in view_flight.flight(4.0) if message[0] == topics.WAVEFORM]
    with (
        Peer(int(environment['ROS_DOMAIN_ID'])) as peer,
        process(arguments(f'save:={file}', 'blocks_per_s:=20'), environment) as child,
    ):
        publish(peer, run, rate=1.0)
        child.send_signal(signal.SIGTERM)
        assert child.wait(300.0) == 0
    found = logged(file)
    _, values = curve(found, style.DISPLACEMENT)
    whole = ~np.isnan(values).any(axis=1)
    assert 20 * 256 <= whole.sum() < len(run) * 256
    assert lines(found)
    assert all(line.startswith('samples are missing here') for line in lines(found))
    assert len(lines(found)) == (~whole).sum()


@pytest.mark.parametrize(
    ('parameters', 'reason'),
    [((), 'there is no screen'), (('save:={existing}',), 'exists already')],
)
def test_what_cannot_start_is_one_sentence(
    tmp_path: Path, environment: dict[str, str], parameters: tuple[str, ...], reason: str
) -> None:
    existing = tmp_path / 'live.rrd'
    existing.touch()
    given = [parameter.format(existing=existing) for parameter in parameters]
    with process(arguments(*given), environment) as child:
        assert child.wait(300.0) == 3
        errors = child.communicate()[1]
    assert errors.startswith('error: ')
    assert reason in errors
    assert len(errors.splitlines()) == 1
