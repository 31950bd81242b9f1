# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""From the messages of the rig to a rerun recording, live and from files alike."""

import heapq
import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from rotor_interfaces import topics
from rotor_interfaces.errors import WireError
from rotor_interfaces.gaps import Continuity, SampleContinuity
from rotor_interfaces.messages import NANOSECONDS, level_of
from rotor_interfaces.plain_data import parse_json
from rotor_interfaces.topics import Topic
from rotor_interfaces.waveform import CHANNEL_COLUMNS, COLUMN_UNITS, WaveformBlock, decode
from vibration_monitor.view import scene, style
from vibration_monitor.view.curves import Curves
from vibration_monitor.view.orbit import Orbit
from vibration_monitor.view.spectra import Spectra
from vibration_monitor.view.viewer import ViewError

FRAME_S = 0.1
"""Orbit and load arrow are drawn this often in flight time."""

LIVE_BATCH_S = 0.25
"""A viewer takes few messages a frame: many small ones leave a slow machine ever further behind."""

CURVES_EVERY_S = 0.5
"""Slow numbers are collected this long, in flight time."""

MAX_WAITING = 8192
"""Messages ahead of the waveform that are kept back; beyond that the oldest is shown."""

LONGEST_BLOCK_S = 1e5

FLUSH_S = 30.0
"""A viewer that takes nothing for this long has stopped."""

STANDARD_GRAVITY_M_S2 = 9.81
_MICRO = 1e6
_INDICATOR_KINDS = ('amplitude', 'phase', 'ratio')

SHOWN_TOPICS = (
    topics.MANEUVER_LOAD,
    topics.WAVEFORM,
    topics.SHAFT,
    topics.TRUTH,
    topics.CONFIG,
    topics.SPECTRUM,
    topics.INDICATORS,
    topics.ALARM,
    topics.DIAGNOSTICS,
)
"""What `RigView.push` understands; the rest of the table is not shown."""


class RigView:
    """Shows one rig: `push` every message in order of arrival, `flush` at the end.

    Flight time 0 is sample 0 of the waveform. Messages ahead of the waveform (the load is
    published with a lead) wait for it, so that a viewer that follows the newest time always
    has a waveform to show. Waveforms are sent in batches of `batch_s` (s of flight): short ones
    keep a live view fresh, long ones make files that open fast. When the sample index jumps
    back, a new run has begun: another recording, for which `connect` is called again.
    """

    def __init__(
        self, connect: Callable[[rr.RecordingStream], None], *, batch_s: float = LIVE_BATCH_S
    ) -> None:
        self._connect = connect
        self._batch_s = batch_s
        self._geometry = scene.Geometry()
        self._order = itertools.count()
        self._refused: dict[str, tuple[int, str]] = {}
        self._waiting: list[tuple[int, int, Topic, Any]] = []
        self._begin()

    @property
    def lost_samples(self) -> int:
        """Samples of this run that never reached the view."""
        return self._continuity.lost_samples

    def _begin(self) -> None:
        """Start a recording; what waits for the waveform now waits for the new run's."""
        self._stream = rr.RecordingStream(
            style.APPLICATION_ID,
            batcher_config=rr.ChunkBatcherConfig(flush_tick=LIVE_BATCH_S),
        )
        self._connect(self._stream)
        self._stream.set_log_time_enabled(False)
        self._stream.set_log_tick_enabled(False)
        self._curves = Curves(self._stream)
        self._orbit = Orbit(self._stream)
        self._spectra = Spectra(self._stream)
        self._curves_due_ns = 0
        self._continuity = SampleContinuity()
        self._origin_ns: int | None = None
        self._blocks: list[WaveformBlock] = []
        self._levels: dict[str, int] = {}
        self._crack_ratio: float | None = None
        self._at(0)
        scene.log_bodies(self._stream, self._geometry)
        self._stream.log(
            style.ALARM_LEVEL,
            rr.StateConfiguration(values=style.LEVELS, colors=style.LEVEL_COLOURS),
            static=True,
        )

    def push(self, topic: Topic, stamp_ns: int, message: Any) -> None:
        """Take one message of either world.

        Args:
            topic: an entry of `rotor_interfaces.topics`; others than SHOWN_TOPICS are ignored.
            stamp_ns: the message's stamp, ns since the Unix epoch; ignored for `rotor/config`.
            message: a rclpy message or a rosbags dataclass; one that breaks the wire contract
                is left out, logged in the view and counted in `refusals`.

        """
        if topic == topics.WAVEFORM:
            try:
                self._on_waveform(_placed(decode(message)))
            except WireError as error:
                self._refuse(topic, error)
        elif topic == topics.CONFIG:
            self._on_config(message.data)
        elif topic in SHOWN_TOPICS:
            heapq.heappush(self._waiting, (stamp_ns, next(self._order), topic, message))
            if len(self._waiting) > MAX_WAITING:
                self._show(*heapq.heappop(self._waiting))

    def flush(self) -> None:
        """Send everything that is still held, also what lies ahead of the waveform.

        Raises:
            ViewError: the viewer or the file did not take all of it.

        """
        self._send_blocks()
        while self._waiting:
            self._show(*heapq.heappop(self._waiting))
        self._end()

    def _end(self) -> None:
        self._send_blocks()
        self._curves.send()
        self._spectra.send_spectrogram()
        try:
            self._stream.flush(timeout_sec=FLUSH_S)
        except RuntimeError as error:
            raise ViewError(
                f'the view is not complete: the viewer has stopped or the disk is full ({error})'
            ) from None

    def note(self, text: str) -> None:
        """Write a line into the log of the view, at the flight time of what was shown last."""
        self._stream.log(f'{style.LOG}/view', rr.TextLog(text, level='INFO', color=style.GREY))

    @property
    def refusals(self) -> list[str]:
        """One sentence for each topic of which messages were left out."""
        return [
            f'{count} messages of {name} break the wire contract and are not shown ({reason})'
            for name, (count, reason) in self._refused.items()
        ]

    def _refuse(self, topic: Topic, error: WireError) -> None:
        count, reason = self._refused.get(topic.name, (0, str(error)))
        self._refused[topic.name] = (count + 1, reason)
        if not count:
            self.note(f'{topic.name}: messages are left out ({reason})')

    # The waveform

    def _on_waveform(self, block: WaveformBlock) -> None:
        count = len(block.rows)
        how = self._continuity.check(block.first_sample, count)
        if how is Continuity.RESTART:
            self._end()
            self._begin()
            self._continuity.check(block.first_sample, count)
        elif how is Continuity.GAP:
            self._send_blocks()
            self._break(block.stamp_ns)
        if self._blocks and self._blocks[0].rows.dtype != block.rows.dtype:
            self._send_blocks()
        if self._origin_ns is None:
            self._origin_ns = _origin_ns(block)
        self._blocks.append(block)
        end_ns = block.stamp_ns + round(float(block.rows['time'][-1]) * NANOSECONDS)
        if end_ns - self._blocks[0].stamp_ns >= self._batch_s * NANOSECONDS:
            self._send_blocks()

    def _send_blocks(self) -> None:
        """Send the blocks held as one batch, then whatever waited for this time."""
        if not self._blocks:
            return
        offsets = np.concatenate([self._offsets(block) for block in self._blocks])
        rows = np.concatenate([block.rows for block in self._blocks])
        self._blocks = []
        self._send_channels(offsets, rows)
        poses = slice(None, None, scene.POSE_EVERY)
        scene.send_poses(self._stream, self._geometry, offsets[poses], rows[poses])
        frames = max(1, round((offsets[-1] - offsets[0]) / (FRAME_S * NANOSECONDS)))
        for frame in np.array_split(np.arange(len(rows)), frames):
            self._draw_frame(offsets[frame], rows[frame])
        self._release(int(offsets[-1]))
        if offsets[-1] >= self._curves_due_ns:
            self._curves_due_ns = int(offsets[-1] + CURVES_EVERY_S * NANOSECONDS)
            self._curves.send()

    def _draw_frame(self, offsets: NDArray[np.int64], rows: NDArray[np.void]) -> None:
        """Draw what shows the rotor at one moment: orbit and load."""
        self._at(int(offsets[-1]))
        self._orbit.add(rows)
        self._orbit.log()
        if 'load_y' in (rows.dtype.names or ()):
            mean_m_s2 = float(np.mean(rows['load_y'], dtype=np.float64))
            # rounded, or the axis of a steady flight would zoom in on what float32 leaves over
            load_factor = round(mean_m_s2 / STANDARD_GRAVITY_M_S2, 4)
            middle_ns = int(offsets[0] + offsets[-1]) // 2
            self._curves.add(style.LOAD_SENSOR, middle_ns, ['n'], [load_factor])
            scene.log_load(self._stream, load_factor, self._crack_ratio)

    def _send_channels(self, offsets: NDArray[np.int64], rows: NDArray[np.void]) -> None:
        for path, channels in _groups(rows.dtype.names or ()).items():
            table = np.stack([rows[name] for name in channels], axis=1)
            factor = _MICRO if COLUMN_UNITS[channels[0]] == 'm' else 1.0
            self._curves.add_table(path, offsets, channels, (table * factor).astype(np.float32))

    def _break(self, next_stamp_ns: int) -> None:
        """Interrupt the curves where samples are missing, and say so."""
        gap_ns = next_stamp_ns - self._origin() - 1
        self._curves.interrupt(style.WAVEFORM, gap_ns)
        self._orbit.clear()
        self._at(gap_ns)
        self.note(f'samples are missing here (so far {self.lost_samples})')

    def _offsets(self, block: WaveformBlock) -> NDArray[np.int64]:
        """Return flight time of each row in ns."""
        within = np.rint(block.rows['time'] * NANOSECONDS).astype(np.int64)
        return within + (block.stamp_ns - self._origin())

    def _origin(self) -> int:
        return self._origin_ns or 0

    def _at(self, offset_ns: int) -> None:
        """Set the flight time of what is logged next."""
        self._stream.set_time(style.TIMELINE, duration=np.timedelta64(offset_ns, 'ns'))

    # Everything else, in the order of its stamps

    def _release(self, until_offset_ns: int) -> None:
        until_ns = until_offset_ns + self._origin()
        while self._waiting and self._waiting[0][0] <= until_ns:
            self._show(*heapq.heappop(self._waiting))

    def _show(self, stamp_ns: int, _order: int, topic: Topic, message: Any) -> None:
        if self._origin_ns is None:
            self._origin_ns = stamp_ns
        offset_ns = stamp_ns - self._origin_ns
        self._at(offset_ns)
        try:
            self._show_at(offset_ns, topic, message)
        except WireError as error:
            self._refuse(topic, error)

    def _show_at(self, offset_ns: int, topic: Topic, message: Any) -> None:
        if topic == topics.MANEUVER_LOAD:
            self._on_load(offset_ns, message)
        elif topic == topics.SHAFT:
            if len(message.velocity):
                self._curves.add(style.SPEED, offset_ns, ['speed'], [message.velocity[0]])
        elif topic == topics.TRUTH:
            self._on_truth(offset_ns, message)
        elif topic == topics.INDICATORS:
            self._on_indicators(offset_ns, message)
        elif topic == topics.SPECTRUM:
            self._spectra.draw(offset_ns / NANOSECONDS, decode(message))
        else:
            self._on_status(topic, message)

    def _on_load(self, offset_ns: int, message: Any) -> None:
        load = message.accel.linear
        values = [load.y / STANDARD_GRAVITY_M_S2, load.z / STANDARD_GRAVITY_M_S2]
        self._curves.add(style.LOAD, offset_ns, ['n', 'lateral'], values)

    def _on_truth(self, offset_ns: int, message: Any) -> None:
        truth = _named(message)
        ratio = truth.pop(style.CRACK_NAME, None)
        if truth:
            self._curves.add(style.TRUTH, offset_ns, [*truth], [*truth.values()])
        if ratio is None:
            return
        self._curves.add(style.CRACK_TRUTH, offset_ns, [style.CRACK_NAME], [ratio])
        if ratio != self._crack_ratio:
            self._crack_ratio = float(ratio)
            scene.log_crack(self._stream, self._geometry, self._crack_ratio)

    def _on_indicators(self, offset_ns: int, message: Any) -> None:
        """Log indicators by channel and kind: `disk_z/ratio_3_1` goes to disk_z/ratio."""
        groups: dict[str, dict[str, float]] = {}
        for name, value in _named(message).items():
            channel, _, indicator = name.rpartition('/')
            kind = indicator.split('_')[0]
            if kind not in _INDICATOR_KINDS or not indicator[-1:].isdigit():
                kind = 'other'
            path = '/'.join(part for part in (style.INDICATORS, channel, kind) if part)
            groups.setdefault(path, {})[indicator] = value
        for path, values in groups.items():
            self._curves.add(path, offset_ns, [*values], [*values.values()])

    def _on_status(self, topic: Topic, message: Any) -> None:
        """Log alarm and health: a line whenever a level changes; health only once it is bad."""
        for status in message.status:
            level = min(level_of(status), len(style.LEVELS) - 1)
            name = style.LEVELS[level]
            is_alarm = topic == topics.ALARM
            known = self._levels.get(status.name, None if is_alarm else 0)
            self._levels[status.name] = level
            if level == known:
                continue
            if is_alarm:
                self._stream.log(style.ALARM_LEVEL, rr.StateChange(state=name))
            text = status.message if is_alarm else f'{status.name}: {status.message}'
            self._stream.log(
                f'{style.LOG}/{"alarm" if is_alarm else "health"}',
                rr.TextLog(text, level=name, color=style.LEVEL_COLOURS[level]),
            )

    def _on_config(self, text: str) -> None:
        """Take the geometry of the rotor from the run's configuration."""
        try:
            geometry = scene.Geometry.from_config(parse_json(text))
        except ValueError as error:
            self.note(f'rotor/config cannot be used, the rig is drawn as before ({error})')
            return
        if geometry != self._geometry:
            self._geometry = geometry
            scene.log_bodies(self._stream, geometry)


def _placed(block: WaveformBlock) -> WaveformBlock:
    """Return the block; raises WireError where its place on the time axis is not known."""
    if 'time' not in block.columns or not len(block.rows):
        raise WireError('the block has no `time` column or no rows')
    time_s = block.rows['time'].astype(np.float64)
    if not (time_s[0] >= 0.0 and time_s[-1] < LONGEST_BLOCK_S and (np.diff(time_s) > 0.0).all()):
        raise WireError('the `time` column does not count seconds upwards from the stamp')
    return block


def _named(message: Any) -> dict[str, float]:
    """Return the numbers of a JointState by name."""
    if len(message.name) != len(message.position):
        raise WireError(f'{len(message.name)} names for {len(message.position)} numbers')
    return dict(zip(message.name, message.position, strict=True))


def _groups(columns: tuple[str, ...]) -> dict[str, list[str]]:
    """Return the channels by entity: `disk`, `brg1`, `brg1_acceleration` and so on."""
    groups: dict[str, list[str]] = {}
    for name in columns:
        if name in CHANNEL_COLUMNS:
            point, _, axis = name.partition('_')
            path = f'{style.WAVEFORM}/{point}' + ('_acceleration' if axis[0] == 'a' else '')
            groups.setdefault(path, []).append(name)
    return groups


def _origin_ns(block: WaveformBlock) -> int:
    """Return the stamp of sample 0, from the stamp and the sample index of a block."""
    time = block.rows['time']
    if len(time) < 2:
        return block.stamp_ns
    rate_hz = round((len(time) - 1) / float(time[-1] - time[0]))
    return block.stamp_ns - round(block.first_sample * NANOSECONDS / rate_hz)
