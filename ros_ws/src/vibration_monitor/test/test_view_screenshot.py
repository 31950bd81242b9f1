# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures made without a screen: every view has drawn something, and the check can fail."""

from pathlib import Path

import pytest
from PIL import Image

import view_flight
from rotor_interfaces import messages, topics
from rotor_interfaces.topics import Topic
from vibration_monitor.reading import Recording
from vibration_monitor.recording import RecordingWriter
from vibration_monitor.view import ViewError, blueprint, view_recording, viewer
from vibration_monitor.view.offline import convert
from vibration_monitor.view.screenshot import SIZE, VIEWERS, single_views
from view_pictures import EXPECTED, empty_views

pytestmark = [pytest.mark.slow, pytest.mark.real_time]


def record(folder: Path, without: tuple[Topic, ...] = ()) -> Path:
    path = folder / 'flight.mcap'
    with RecordingWriter.single_file(path) as writer:
        for topic, stamp_ns, message in view_flight.flight(3.0, without):
            time_ns = stamp_ns or view_flight.EPOCH_NS
            writer.write(topic, messages.to_cdr(message), time_ns, time_ns)
    return path


def pictures_of(folder: Path, without: tuple[Topic, ...] = ()) -> dict[str, bytes]:
    file = folder / 'view.rrd'
    convert(Recording(record(folder, without)), file)
    return single_views(file, print)


def test_every_view_has_drawn_something(tmp_path: Path) -> None:
    pictures = pictures_of(tmp_path)
    assert set(pictures) == set(EXPECTED)
    assert empty_views(pictures) == {}


def test_a_page_with_one_empty_view_fails_the_check(tmp_path: Path) -> None:
    lacking = empty_views(pictures_of(tmp_path, without=(topics.INDICATORS,)))
    assert lacking == {blueprint.RATIO_VIEW: list(EXPECTED[blueprint.RATIO_VIEW])}


def test_each_empty_view_fails_the_check(tmp_path: Path) -> None:
    """With the waveform alone, all views that show something else are found to be empty."""
    others = tuple(topic for topic in topics.TOPICS if topic != topics.WAVEFORM)
    lacking = empty_views(pictures_of(tmp_path, without=others))
    fed_by_the_waveform = {
        blueprint.DISPLACEMENT_VIEW,
        blueprint.ACCELERATION_VIEW,
        blueprint.ORBIT_VIEW,
    }
    assert set(lacking) == set(EXPECTED) - fed_by_the_waveform


def crash_at_first(folder: Path, monkeypatch: pytest.MonkeyPatch, crashes: int) -> None:
    """Let the viewer's binary be a script whose first starts crash in the middle of drawing."""
    program, count = folder / 'viewer', folder / 'starts'
    program.write_text(
        f'#!/bin/sh\n'
        f'echo start >>{count}\n'
        f'[ $(wc -l <{count}) -gt {crashes} ] && exec {viewer._executable()} "$@"\n'
        f'{viewer._executable()} "$@" & sleep 1; kill -SEGV $!; wait $!\n'
    )
    program.chmod(0o700)
    monkeypatch.setattr(viewer, '_executable', lambda: str(program))


def test_a_viewer_that_crashes_is_started_again_and_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, picture = record(tmp_path), tmp_path / 'view.png'
    crash_at_first(tmp_path, monkeypatch, VIEWERS - 1)
    said = view_recording(path, screenshot=picture)
    assert len(said) == VIEWERS - 1
    for sentence in said:
        assert 'ended with code 139 (Rerun caught a signal: SIGSEGV)' in sentence
        assert sentence.endswith('it was started again')
    with Image.open(picture) as image:
        assert image.size == SIZE


def test_a_viewer_that_always_crashes_is_given_up_with_its_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = record(tmp_path)
    crash_at_first(tmp_path, monkeypatch, VIEWERS)
    with pytest.raises(ViewError, match='SIGSEGV') as caught:
        view_recording(path, screenshot=tmp_path / 'view.png')
    assert any('install_signal_handler' in note for note in caught.value.__notes__)
    assert not (tmp_path / 'view.png').exists()


def test_the_command_makes_a_picture_and_a_file(tmp_path: Path) -> None:
    path = record(tmp_path)
    picture, file = tmp_path / 'view.png', tmp_path / 'view.rrd'
    assert view_recording(path, save=file, screenshot=picture) == []
    with Image.open(picture) as image:
        assert image.size == SIZE
    assert file.stat().st_size > 0
    assert len(list(tmp_path.iterdir())) == 3
