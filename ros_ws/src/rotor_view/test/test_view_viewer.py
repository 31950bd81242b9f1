# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The viewer process: sentences instead of hangs, loopback only, nothing left behind."""

import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import psutil  # type: ignore[import-untyped]
import pytest

import view_flight
from rotor_interfaces import messages, topics
from rotor_recording.recording import RecordingWriter
from rotor_view import ViewError, style, view_recording, viewer
from view_rows import curve, lines, logged


@pytest.fixture
def no_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv('DISPLAY', raising=False)
    monkeypatch.delenv('WAYLAND_DISPLAY', raising=False)


@pytest.fixture
def own_temp(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / 'temp'
    folder.mkdir()
    monkeypatch.setattr(tempfile, 'tempdir', str(folder))
    return folder


def record(path: Path, outgoing: list[view_flight.Outgoing]) -> Path:
    with RecordingWriter.single_file(path) as writer:
        for topic, stamp_ns, message in outgoing:
            time_ns = stamp_ns or view_flight.EPOCH_NS
            writer.write(topic, messages.to_cdr(message), time_ns, time_ns)
    return path


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    return record(tmp_path / 'flight.mcap', list(view_flight.flight(1.0)))


@pytest.mark.usefixtures('no_screen')
def test_no_screen_is_one_sentence(recording: Path) -> None:
    with pytest.raises(ViewError, match=r'there is no screen .* --screenshot FILE\.png'):
        view_recording(recording)


@pytest.mark.parametrize(
    ('option', 'name', 'reason'),
    [
        ('save', 'view.txt', 'must end in .rrd'),
        ('screenshot', 'view.jpg', 'must end in .png'),
        ('save', 'nowhere/view.rrd', 'does not exist'),
        ('screenshot', 'folder.png', 'is a folder'),
    ],
)
def test_a_bad_target_is_refused_before_any_work(
    tmp_path: Path, option: str, name: str, reason: str
) -> None:
    (tmp_path / 'folder.png').mkdir()
    target: dict[str, Any] = {option: tmp_path / name}
    with pytest.raises(ViewError, match=reason):
        view_recording(tmp_path / 'not looked at.mcap', **target)


def test_without_the_software_renderer_the_script_is_named(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(viewer, 'LAVAPIPE', tmp_path)
    with pytest.raises(ViewError, match='scripts/install_viewer_packages'):
        view_recording(recording, screenshot=tmp_path / 'view.png')


@pytest.mark.slow
@pytest.mark.parametrize(('script', 'reason'), [
    ('echo no graphics >&2; exit 3', r'did not start: it ended with code 3 \(no graphics\)'),
    ('kill -SEGV $$', r'did not start: it ended by SIGSEGV \(it said nothing\)'),
    ('kill -63 $$', r'did not start: it ended by signal 63'),
    ('sleep 60', r'did not start \(it said nothing\)'),
])  # fmt: skip
def test_a_viewer_that_does_not_start_is_one_sentence_and_leaves_nothing(
    own_temp: Path, monkeypatch: pytest.MonkeyPatch, script: str, reason: str
) -> None:
    program = own_temp.parent / 'viewer'
    program.write_text(f'#!/bin/sh\n{script}\n')
    program.chmod(0o700)
    monkeypatch.setattr(viewer, '_executable', lambda: str(program))
    monkeypatch.setattr(viewer, 'START_S', 1.0)
    # this process may have others, such as the resource tracker of multiprocessing
    before = set(psutil.Process().children(recursive=True))
    with pytest.raises(ViewError, match=reason):
        viewer.Viewer([], {})
    assert list(own_temp.iterdir()) == []
    assert set(psutil.Process().children(recursive=True)) <= before


def test_saved_views_hold_what_was_recorded(recording: Path, tmp_path: Path) -> None:
    file = tmp_path / 'view.rrd'
    file.write_text('an older view')
    assert view_recording(recording, save=file) == []
    assert len(curve(logged(file), style.DISPLACEMENT)[0]) == view_flight.RATE_HZ
    assert [p.name for p in sorted(tmp_path.iterdir())] == ['flight.mcap', 'view.rrd']


def test_what_a_recording_lacks_is_told_in_the_view(tmp_path: Path) -> None:
    some = [m for m in view_flight.flight(0.5) if m[0] in (topics.WAVEFORM, topics.SHAFT)]
    file = tmp_path / 'view.rrd'
    view_recording(record(tmp_path / 'few.mcap', some), save=file)
    assert {
        'not in this recording: maneuver/load, rotor/truth',
        (
            'not in this recording but computed from its waveform: '
            'monitor/spectrum, monitor/indicators, monitor/alarm'
        ),
    } <= set(lines(logged(file)))


def test_a_recording_without_a_waveform_is_one_sentence(tmp_path: Path) -> None:
    some = [m for m in view_flight.flight(0.5) if m[0] == topics.SHAFT]
    with pytest.raises(ViewError, match='holds no rotor/waveform'):
        view_recording(record(tmp_path / 'few.mcap', some), save=tmp_path / 'view.rrd')


def test_a_second_run_in_a_recording_is_told(tmp_path: Path) -> None:
    blocks = [view_flight.block_message(k) for k in range(0, 2560, 256)]
    later = [(topic, stamp + 10**10, message) for topic, stamp, message in blocks]
    path = record(tmp_path / 'two.mcap', [*blocks, *later])
    damage = view_recording(path, save=tmp_path / 'view.rrd')
    assert damage == ['two.mcap: a second run begins in this recording; only the first is shown']


def test_damaged_messages_are_told(tmp_path: Path) -> None:
    path = tmp_path / 'bad.mcap'
    with RecordingWriter.single_file(path) as writer:
        topic, stamp, message = view_flight.block_message(0)
        writer.write(topic, messages.to_cdr(message), stamp, stamp)
        writer.write(topic, b'\0\1\0\0nonsense', stamp + 1, stamp + 1)
    damage = view_recording(path, save=tmp_path / 'view.rrd')
    (sentence,) = damage
    assert sentence.startswith(
        'bad.mcap: messages of /rotor/waveform that cannot be decoded left out: 1 (the first at'
    )


@pytest.mark.slow
def test_the_viewer_listens_on_this_machine_only_and_goes(
    own_temp: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('HOME', str(own_temp.parent))
    monkeypatch.delenv('XDG_DATA_HOME', raising=False)
    with viewer.headless([], (200, 100)) as running:
        process = psutil.Process(running._process.pid)
        assert process.cmdline()[0].endswith('rerun')
        assert sys.executable not in process.cmdline()
        listening = [c.laddr.ip for c in process.net_connections() if c.status == 'LISTEN']
        assert listening == ['127.0.0.1']
    assert not psutil.pid_exists(process.pid)
    assert list(own_temp.iterdir()) == []
    # no usage reports: neither consent nor collected events anywhere in the home folder
    assert not [p for p in own_temp.parent.rglob('*') if 'analytics' in p.name]
    assert os.environ.get('XDG_CONFIG_HOME') != str(own_temp)
