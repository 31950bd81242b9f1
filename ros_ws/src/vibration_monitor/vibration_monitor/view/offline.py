# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The view of a recording: in a window, as a rerun file, as a picture."""

import contextlib
import os
import shutil
import signal
import sys
import tempfile
import threading
from collections.abc import Iterator, Mapping
from pathlib import Path

import rerun as rr

from rotor_interfaces import messages, topics
from rotor_interfaces.topics import Topic
from vibration_monitor.reading import UNDECODABLE, Recording, require_cdr
from vibration_monitor.view import viewer
from vibration_monitor.view.file import ViewFile
from vibration_monitor.view.rig_view import SHOWN_TOPICS, RigView
from vibration_monitor.view.screenshot import whole_page
from vibration_monitor.view.viewer import ViewError

BATCH_S = 1.0
"""Flight time per batch of a file: few large chunks open fast."""


class _SecondRunError(Exception):
    """The sample index jumped back: another run begins in the same recording."""


def view_recording(
    path: Path, *, save: Path | None = None, screenshot: Path | None = None
) -> list[str]:
    """Show a recording in the viewer's window until it is closed, or write what it would show.

    Args:
        path: folder of a bag, `.mcap` or `.mcap.active`.
        save: write a rerun file (`.rrd`) instead of opening a window; replaced if it exists.
        screenshot: write a picture (`.png`) of the end of the flight, without a screen;
            replaced if it exists. With both, both are written.

    Returns:
        One sentence for each thing that the recording lost or that could not be shown, and for
        each viewer that crashed while it drew and was started again.

    Raises:
        RecordingError: nothing there to read.
        ViewError: no screen, no software renderer, or a name that cannot be written.

    """
    _check_target('--save', save, '.rrd')
    _check_target('--screenshot', screenshot, '.png')
    if save is None and screenshot is None:
        viewer.require_screen()
    recording = Recording(path)
    beside = None if save is None else save.absolute().parent
    with _cleaned_up(), tempfile.TemporaryDirectory(prefix='rotor-rig-view-', dir=beside) as folder:
        file = Path(folder) / 'view.rrd'
        damage = convert(recording, file)
        if screenshot is not None:
            picture = Path(folder) / 'view.png'
            picture.write_bytes(whole_page(file, damage.append))
            _put(picture, screenshot)
        if save is not None:
            _put(file, save)
        if save is None and screenshot is None:
            with viewer.window([str(file)]) as window:
                window.wait()
    return damage


def convert(recording: Recording, file: Path) -> list[str]:
    """Write the view of a recording as a rerun file; return what could not be shown.

    Raises:
        ViewError: the recording holds nothing that the view shows.

    """
    wanted = _shown_topics(recording)
    if topics.WAVEFORM not in wanted.values():
        raise ViewError(
            f'{recording.path} holds no {topics.WAVEFORM.name}, so there is nothing to view; its '
            f'topics are: {", ".join(recording.topics()) or "none"}'
        )
    files: list[ViewFile] = []

    def connect(stream: rr.RecordingStream) -> None:
        if files:
            raise _SecondRunError
        files.append(ViewFile(stream, file))

    view = RigView(connect, batch_s=BATCH_S)
    with contextlib.closing(files[0]):
        _show(recording, wanted, view, files[0])
    return [*recording.damage, *view.refusals]


def _show(recording: Recording, wanted: Mapping[str, Topic], view: RigView, file: ViewFile) -> None:
    """Push the wanted topics of a recording into its view."""
    missing = [
        topic.name
        for topic in SHOWN_TOPICS
        if topic not in (*wanted.values(), topics.CONFIG, topics.DIAGNOSTICS)
    ]
    if missing:
        view.note(f'not in this recording: {", ".join(missing)}')
    try:
        for message in recording.messages(list(wanted)):
            topic = wanted[message.topic]
            try:
                decoded = messages.from_cdr(message.data, topic.type)
            except UNDECODABLE:
                recording.note(f'a message of {message.topic} cannot be decoded and is left out')
                continue
            stamp_ns = 0 if topic == topics.CONFIG else messages.stamp_ns(decoded)
            view.push(topic, stamp_ns, decoded)
            file.check()
        view.flush()
    except _SecondRunError:
        recording.note('a second run begins in this recording; only the first is shown')


@contextlib.contextmanager
def _cleaned_up() -> Iterator[None]:
    """Let SIGTERM and SIGHUP end the viewer and remove its files, as Ctrl-C does."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may handle signals
        return

    def leave(number: int, _: object) -> None:
        sys.exit(128 + number)

    before = {n: signal.signal(n, leave) for n in (signal.SIGTERM, signal.SIGHUP)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _shown_topics(recording: Recording) -> dict[str, Topic]:
    """Return what the view shows of a recording: topics by their recorded names."""
    wanted: dict[str, Topic] = {}
    known = recording.topics()
    for topic in SHOWN_TOPICS:
        name = recording.find(topic)
        if name is None:
            continue
        require_cdr(recording, known[name])
        if known[name].type == topic.type:
            wanted[name] = topic
        else:
            recording.note(f'{name} has type {known[name].type}, not {topic.type}; not shown')
    return wanted


def _check_target(option: str, path: Path | None, suffix: str) -> None:
    """Raise ViewError unless `path` names a file that can be written, before any work."""
    if path is None:
        return
    if path.suffix != suffix:
        raise ViewError(f'{option} {path} must end in {suffix}')
    if not path.absolute().parent.is_dir():
        raise ViewError(f'{option} {path}: the folder {path.absolute().parent} does not exist')
    if not os.access(path.absolute().parent, os.W_OK):
        raise ViewError(f'{option} {path}: the folder {path.absolute().parent} is not writable')
    if path.is_dir():
        raise ViewError(f'{option} {path} is a folder; give the name of a file')


def _put(file: Path, target: Path) -> None:
    try:
        shutil.move(file, target)
    except OSError as error:
        raise ViewError(f'{target} cannot be written ({error.strerror})') from None
