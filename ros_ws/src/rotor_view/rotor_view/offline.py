# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The view of a recording: in a window, as a rerun file, as a screenshot."""

import contextlib
import json
import os
import shutil
import signal
import sys
import threading
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import rerun as rr

from rotor_common.errors import WireError
from rotor_common.leftovers import OwnFolder, remove_leftovers
from rotor_interfaces import messages, topics
from rotor_interfaces.messages import OFFLINE
from rotor_interfaces.topics import Topic
from rotor_interfaces.waveform import decode
from rotor_recording.reading import OTHER_NAME, UNDECODABLE, Recording, require_cdr
from rotor_view import viewer
from rotor_view.rig_view import SHOWN_TOPICS, RigView
from rotor_view.rrd_file import ViewFile
from rotor_view.screenshot import whole_page
from rotor_view.viewer import ViewError
from vibration_monitor.monitor_config import MonitorConfig

if TYPE_CHECKING:
    from rotor_view.monitoring import Monitoring

MONITOR_TOPICS = (topics.SPECTRUM, topics.INDICATORS, topics.ALARM)
"""Output of the monitor; computed where it was not recorded."""

BATCH_S = 5.0
"""Flight time per batch of a file: few large chunks open fast, but a batch is held in memory."""

WHOLE_PICTURE_SAMPLES = 120 * 10_240
"""Recordings up to this length are drawn from all of their data, longer ones from a part."""


class _SecondRunError(Exception):
    """The sample index jumped back: another run begins in the same recording."""


def view_recording(
    path: Path,
    *,
    save: Path | None = None,
    screenshot: Path | None = None,
    waveform_topic: str | None = None,
) -> list[str]:
    """Show a recording in the viewer's window until it is closed, or write what it would show.

    Args:
        path: folder of a bag, `.mcap` or `.mcap.active`.
        save: write a rerun file (`.rrd`) instead of opening a window; replaced if it exists.
        screenshot: write a picture (`.png`) of the end of the flight, without a screen;
            replaced if it exists. With both, both are written.
        waveform_topic: full name of the waveform; None: `rotor/waveform` of the one rig there.

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
    recording = Recording(path, waveform_topic)
    beside = None if save is None else save.absolute().parent
    remove_leftovers([beside] if beside else [])
    with _cleaned_up(), OwnFolder('view-', beside) as folder:
        file = folder / 'view.rrd'
        damage = convert(recording, file)
        if screenshot is not None:
            picture = folder / 'view.png'
            drawn = file
            if _is_long(recording):
                drawn = folder / 'picture.rrd'
                convert(Recording(path, waveform_topic), drawn, is_thin=True)
            picture.write_bytes(whole_page(drawn, damage.append))
            _put(picture, screenshot)
        if save is not None:
            _put(file, save)
        if save is None and screenshot is None:
            with viewer.window([str(file)]) as window:
                window.wait()
    return damage


def convert(recording: Recording, file: Path, *, is_thin: bool = False) -> list[str]:
    """Write the view of a recording as a rerun file; return what could not be shown.

    `is_thin`: only what a picture of the end of the flight needs.

    Raises:
        ViewError: the recording holds nothing that the view shows.

    """
    wanted = _shown_topics(recording)
    if topics.WAVEFORM not in wanted.values():
        raise ViewError(
            f'{recording.path} holds no {topics.WAVEFORM.name}, so there is nothing to view; its '
            f'topics are: {", ".join(recording.topics()) or "none"}{OTHER_NAME}'
        )
    files: list[ViewFile] = []

    def connect(stream: rr.RecordingStream) -> None:
        if files:
            raise _SecondRunError
        files.append(ViewFile(stream, file))

    config = recording.config()
    computed = _computed(recording, wanted)
    monitoring = None
    if computed:
        # for a recording that has its indicators these kernels would take most of the memory
        from rotor_view.monitoring import Monitoring  # noqa: PLC0415

        monitoring = Monitoring(MonitorConfig.of_run(config), computed)
    view = RigView(connect, batch_s=BATCH_S, is_live=False, is_thin=is_thin)
    if config is not None:
        view.push(topics.CONFIG, 0, messages.string(OFFLINE, json.dumps(config)))
    _tell_what_is_missing(view, wanted, computed)
    if monitoring is not None:
        view.judge_by(monitoring.rules)
    with contextlib.closing(files[0]):
        try:
            for topic, stamp_ns, message in _all_messages(view, recording, wanted, monitoring):
                view.push(topic, stamp_ns, message)
                files[0].check()
            view.flush()
        except _SecondRunError:
            recording.note('a second run begins in this recording; only the first is shown')
    left_out = [*recording.damage, *view.refusals]
    if not view.blocks:
        raise ViewError(
            f'{recording.path} holds no block of {recording.find(topics.WAVEFORM)} that can be '
            f'shown ({"; ".join(left_out) or "its topic is empty"})'
        )
    return left_out


def _is_long(recording: Recording) -> bool:
    """Say whether the flight, by its sample index, is longer than WHOLE_PICTURE_SAMPLES."""
    name, end_ns = recording.find(topics.WAVEFORM), recording.end_ns
    if name is None or end_ns is None:
        return False
    ends = [next(recording.messages([name]), None), *recording.last_before([name], end_ns + 1)]
    try:
        samples = [
            decode(messages.from_cdr(end.data, topics.WAVEFORM.type)).first_sample
            for end in ends
            if end is not None
        ]
    except (*UNDECODABLE, WireError):
        return True  # unknown: take the cheaper way
    return bool(samples) and max(samples) - min(samples) > WHOLE_PICTURE_SAMPLES


def _all_messages(
    view: RigView,
    recording: Recording,
    wanted: Mapping[str, Topic],
    monitoring: 'Monitoring | None',
) -> Iterator[tuple[Topic, int, Any]]:
    """Yield all messages with their stamps, each block followed by the monitor's messages."""
    refused = 0
    for topic, message in _decoded(recording, wanted):
        accepted = view.refusals
        yield topic, messages.stamp_ns(message), message
        if monitoring is None or topic != topics.WAVEFORM:
            continue
        try:
            yield from monitoring.after_block(message)
        except WireError as error:
            if view.refusals == accepted:  # else the view has reported it
                refused += 1
                name = recording.find(topics.WAVEFORM)
                recording.leave_out(
                    f'blocks of {name} that the monitor refuses',
                    refused,
                    f'the first is stamped {messages.stamp_ns(message)} ns: {error}',
                )


def _decoded(recording: Recording, wanted: Mapping[str, Topic]) -> Iterator[tuple[Topic, Any]]:
    """Yield the messages except `rotor/config`, which is known from the start."""
    names = [name for name, topic in wanted.items() if topic != topics.CONFIG]
    left_out: Counter[str] = Counter()
    for message in recording.messages(names):
        topic = wanted[message.topic]
        try:
            yield topic, messages.from_cdr(message.data, topic.type)
        except UNDECODABLE as error:
            left_out[message.topic] += 1
            recording.leave_out(
                f'messages of {message.topic} that cannot be decoded',
                left_out[message.topic],
                f'the first at log time {message.log_time_ns} ns: '
                f'{str(error) or type(error).__name__}',
            )


def _computed(recording: Recording, wanted: Mapping[str, Topic]) -> list[Topic]:
    """Return the topics that the monitor must compute: none if its indicators were recorded."""
    counts = recording.message_counts
    recorded = {topic for name, topic in wanted.items() if counts.get(name)}
    if topics.INDICATORS in recorded:
        return []
    return [topic for topic in MONITOR_TOPICS if topic not in recorded]


def _tell_what_is_missing(
    view: RigView, wanted: Mapping[str, Topic], computed: Collection[Topic]
) -> None:
    known = (*wanted.values(), *computed, topics.CONFIG, topics.DIAGNOSTICS)
    missing = [topic.name for topic in SHOWN_TOPICS if topic not in known]
    if missing:
        view.note(f'not in this recording: {", ".join(missing)}')
    if computed:
        names = ', '.join(topic.name for topic in computed)
        view.note(f'not in this recording but computed from its waveform: {names}')


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
    """Return the topics of a recording that the view shows, by their recorded names."""
    wanted: dict[str, Topic] = {}
    known = recording.topics()
    for topic in SHOWN_TOPICS:
        name = recording.find(topic)
        if name is None:
            continue
        if topic == topics.WAVEFORM:
            require_cdr(recording, known[name])
        if (known[name].type, known[name].encoding) == (topic.type, 'cdr'):
            wanted[name] = topic
        else:
            kind = f'{known[name].type} as {known[name].encoding}'
            recording.note(f'{name} is {kind}, not {topic.type} as cdr; not shown')
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
