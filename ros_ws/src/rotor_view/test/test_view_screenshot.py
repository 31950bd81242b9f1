# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures made without a screen: every view has drawn something, and the check can fail."""

import io
import os
import re
import signal
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import psutil  # type: ignore[import-untyped]
import pytest
from PIL import Image

import view_flight
from rotor_interfaces import messages, topics
from rotor_interfaces.topics import Topic
from rotor_recording.reading import Recording
from rotor_recording.recording import RecordingWriter
from rotor_view import ViewError, blueprint, view_recording, viewer
from rotor_view.offline import convert
from rotor_view.screenshot import SIZE, VIEWERS, single_views
from view_pictures import EXPECTED, RATIO_VIEW, RULE_VIEW, empty_views

pytestmark = pytest.mark.slow


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


def test_black_pictures_fail_the_check() -> None:
    black = io.BytesIO()
    Image.new('RGB', (400, 300)).save(black, 'png')
    pictures = dict.fromkeys(EXPECTED, black.getvalue())
    coloured = {name: list(colours) for name, colours in EXPECTED.items() if colours}
    assert empty_views(pictures) == coloured


def test_a_page_has_no_view_of_what_the_recording_lacks(tmp_path: Path) -> None:
    without = (topics.MANEUVER_LOAD, topics.TRUTH, topics.SHAFT, topics.ALARM)
    pictures = pictures_of(tmp_path, without)
    assert set(EXPECTED) - set(pictures) == {
        blueprint.ALARM_VIEW,
        blueprint.SENTENCE_VIEW,
        blueprint.SPEED_VIEW,
        blueprint.TRUTH_VIEW,
    }
    lacking = empty_views({name: pictures[name] for name in (RULE_VIEW, RATIO_VIEW)})
    assert lacking == {}


Crash = Callable[[int], list[int]]


@pytest.fixture
def crash(monkeypatch: pytest.MonkeyPatch) -> Crash:
    """Let so many of the next viewers crash as soon as they listen; returns the pids of all."""

    def arrange(count: int) -> list[int]:
        pids: list[int] = []
        start = viewer.headless

        def crashing(arguments: Sequence[str], size: tuple[int, int]) -> viewer.Viewer:
            started = start(arguments, size)
            pids.append(started._process.pid)
            if len(pids) <= count:
                os.kill(pids[-1], signal.SIGSEGV)
            return started

        monkeypatch.setattr(viewer, 'headless', crashing)
        return pids

    return arrange


def test_a_viewer_that_crashes_is_started_again_and_said(tmp_path: Path, crash: Crash) -> None:
    path, picture = record(tmp_path), tmp_path / 'view.png'
    pids = crash(1)
    said = view_recording(path, screenshot=picture)
    assert len(said) == len(pids) - 1
    assert re.fullmatch(
        r'the rerun viewer .*: it ended by SIGSEGV \(Rerun caught a signal: SIGSEGV\); '
        'it was started again',
        said[0],
    )
    with Image.open(picture) as image:
        assert image.size == SIZE


def test_viewers_that_always_crash_are_given_up_with_their_reason(
    tmp_path: Path, crash: Crash, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = record(tmp_path)
    temp = tmp_path / 'temp'
    temp.mkdir()
    monkeypatch.setattr(tempfile, 'tempdir', str(temp))
    pids = crash(VIEWERS)
    with pytest.raises(ViewError, match=r'SIGSEGV.*; so did 2 viewers before it') as caught:
        view_recording(path, screenshot=tmp_path / 'view.png')
    assert caught.value.__cause__ is not None
    assert 'install_signal_handler' in ''.join(caught.value.__cause__.__notes__)
    assert len(pids) == VIEWERS
    assert not any(psutil.pid_exists(pid) for pid in pids)
    assert list(temp.iterdir()) == []
    assert not (tmp_path / 'view.png').exists()


def test_the_command_makes_a_picture_and_a_file(tmp_path: Path) -> None:
    path = record(tmp_path)
    picture, file = tmp_path / 'view.png', tmp_path / 'view.rrd'
    said = view_recording(path, save=file, screenshot=picture)
    assert all('it was started again' in sentence for sentence in said)
    with Image.open(picture) as image:
        assert image.size == SIZE
    assert file.stat().st_size > 0
    assert len(list(tmp_path.iterdir())) == 3
