# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Convert the rig's messages to a rerun recording, live or from files."""

import heapq
import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from rotor_common.constants import GRAVITY_M_S2, NANOSECONDS
from rotor_common.errors import ConfigError, WireError
from rotor_common.plain_data import parse_json
from rotor_interfaces import topics
from rotor_interfaces.gaps import Continuity, SampleContinuity
from rotor_interfaces.topics import Topic
from rotor_interfaces.waveform import WaveformBlock, decode
from rotor_view import scene, style
from rotor_view.blueprint import Page, blueprint
from rotor_view.curves import Curves
from rotor_view.indicators import Indicators
from rotor_view.placing import origin_ns, placed
from rotor_view.spectra import Spectra
from rotor_view.status import Status
from rotor_view.units import Units
from rotor_view.viewer import ViewError
from rotor_view.waveform import Waveform
from vibration_monitor.monitor_config import AlarmRule, MonitorConfig

LIVE_BATCH_S = 0.25
"""A viewer takes few messages a frame: many small ones leave a slow machine ever further behind."""

LIVE_CURVES_S, FILE_CURVES_S = 0.5, 60.0
"""Slow signals are collected for this flight time: each chunk costs rerun memory."""

MAX_WAITING = 8192
"""Messages ahead of the waveform that are kept back; beyond that the oldest is shown."""

BESIDE_FLIGHT_S = 60.0
"""A message stamped longer before sample 0, or after the waveform, is not of this flight."""

FLUSH_S = 30.0
"""A viewer that takes nothing for this long has stopped."""

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
"""Topics that `RigView.push` shows; the others of the table are ignored."""


class RigView:
    """Shows one rig: `push` every message in order of arrival, `flush` at the end.

    Flight time 0 is sample 0 of the waveform. Messages ahead of the waveform (the load is
    published with a lead) wait for it, so that a viewer that follows the newest time always
    has a waveform to show. Waveforms are sent in batches of `batch_s` (s of flight): short ones
    keep a live view fresh, long ones make files that open fast. When the sample index jumps
    back, a new run has begun: another recording, for which `connect` is called again. The page
    has a view for everything shown so far; it is sent once at the end or, live, whenever there is
    more to show. A thin view is for a picture of the end of the flight: of older data it has only
    the curves and the envelope of the waveform.
    """

    def __init__(
        self,
        connect: Callable[[rr.RecordingStream], None],
        *,
        batch_s: float = LIVE_BATCH_S,
        is_live: bool = True,
        is_thin: bool = False,
    ) -> None:
        self._connect = connect
        self._batch_s = batch_s
        self._is_live = is_live
        self._is_thin = is_thin
        self._curves_s = LIVE_CURVES_S if is_live else FILE_CURVES_S
        self._geometry: scene.Geometry | None = None
        self._rules: Sequence[AlarmRule] = ()
        self._units = Units()
        self._order = itertools.count()
        self._refused: dict[str, tuple[int, str]] = {}
        self._waiting: list[tuple[int, int, Topic, Any]] = []
        self._begin()

    @property
    def lost_samples(self) -> int:
        """Samples of this run that never reached the view."""
        return self._continuity.lost_samples

    def _begin(self) -> None:
        """Start a recording; waiting messages now wait for the waveform of the new run."""
        self._stream = rr.RecordingStream(
            style.APPLICATION_ID,
            batcher_config=rr.ChunkBatcherConfig(
                flush_tick=LIVE_BATCH_S if self._is_live else FLUSH_S
            ),
        )
        self._connect(self._stream)
        self._stream.set_log_time_enabled(False)
        self._stream.set_log_tick_enabled(False)
        self._curves = Curves(self._stream)
        self._status = Status(self._stream)
        self._indicators = Indicators(self._curves)
        self._rig = scene.Rig(self._stream)
        self._waveform = Waveform(
            self._stream, self._curves, self._rig, self._hand_over, is_thin=self._is_thin
        )
        self._spectra = Spectra(self._stream, is_thin=self._is_thin)
        self._use_config()
        self._curves_due_ns = 0
        self._continuity = SampleContinuity()
        self._origin_ns: int | None = None
        self._last_ns = 0
        self._blocks: list[WaveformBlock] = []
        self._page: Page | None = None
        self._at(0)

    def _use_config(self) -> None:
        """Use rotor, rules and units of the configuration from here on."""
        self._indicators.judge_by(self._rules, self._units)
        self._rig.geometry = self._geometry
        self._waveform.units = self._waveform.orbit.units = self._spectra.units = self._units

    def judge_by(self, rules: Sequence[AlarmRule]) -> None:
        """Draw these rules of the alarm with their limits; before the first message."""
        self._rules = rules
        self._use_config()

    @property
    def blocks(self) -> int:
        """Waveform blocks of this run so far."""
        return self._continuity.blocks

    def push(self, topic: Topic, stamp_ns: int, message: Any) -> None:
        """Take one message, of rclpy or of rosbags.

        Args:
            topic: an entry of `rotor_interfaces.topics`; others than SHOWN_TOPICS are ignored.
            stamp_ns: the message's stamp, ns since the Unix epoch; ignored for `rotor/config`.
            message: a rclpy message or a rosbags dataclass; one that breaks the wire contract
                is left out, logged in the view and counted in `refusals`.

        """
        if topic == topics.WAVEFORM:
            try:
                self._on_waveform(placed(decode(message)))
            except WireError as error:
                self._refuse(topic, error)
        elif topic == topics.CONFIG:
            self._on_config(message.data)
        elif topic in SHOWN_TOPICS:
            heapq.heappush(self._waiting, (stamp_ns, next(self._order), topic, message))
            if len(self._waiting) > MAX_WAITING:
                self._show(*heapq.heappop(self._waiting))

    def flush(self) -> None:
        """Send everything that is still held, also messages ahead of the waveform.

        Raises:
            ViewError: the viewer or the file did not take all of it.

        """
        self._send_blocks()
        while self._waiting:
            self._show(*heapq.heappop(self._waiting))
        self._end()

    def _end(self) -> None:
        self._send_blocks()
        self._waveform.finish()
        self._curves.send()
        self._spectra.finish()
        self._send_page()
        self._flush_stream()

    def _flush_stream(self) -> None:
        """Send everything to the viewer or the file; raises ViewError if that fails."""
        try:
            self._stream.flush(timeout_sec=FLUSH_S)
        except RuntimeError as error:
            raise ViewError(
                f'the view is not complete: the viewer has stopped or the disk is full ({error})'
            ) from None

    def _send_page(self) -> None:
        """Send the layout of the page if its contents have changed."""
        parts = (self._curves, self._rig, self._waveform.orbit, self._spectra, self._status)
        page = Page(
            drawn=frozenset().union(*(part.drawn for part in parts)),
            channel=self._indicators.channel or self._spectra.channel,
            plane=self._waveform.orbit.plane,
            waveforms=tuple(self._waveform.channels.items()),
            rules=tuple(rule.indicator for rule in self._rules),
            units=self._units,
        )
        if page != self._page:
            self._page = page
            self._stream.send_blueprint(blueprint(page))

    def note(self, text: str) -> None:
        """Write a line into the log of the view, at the flight time of what was shown last."""
        self._status.note(text)

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
        how = self._continuity.check(block.first_sample, count, block.time)
        if how is Continuity.RESTART:
            self._end()
            self._begin()
            self._continuity.check(block.first_sample, count, block.time)
        elif how is Continuity.GAP:
            self._send_blocks()
            self._break(block.stamp_ns)
        if self._blocks and self._blocks[0].rows.dtype != block.rows.dtype:
            self._send_blocks()
        if not self._last_ns:
            self._origin_ns = origin_ns(block)
        self._blocks.append(block)
        self._last_ns = end_ns = block.stamp_ns + round(float(block.rows['time'][-1]) * NANOSECONDS)
        if end_ns - self._blocks[0].stamp_ns >= self._batch_s * NANOSECONDS:
            self._send_blocks()

    def _send_blocks(self) -> None:
        """Send the blocks held as one batch, then whatever waited for this time."""
        if not self._blocks:
            return
        offsets = np.concatenate([self._offsets(block) for block in self._blocks])
        rows = np.concatenate([block.rows for block in self._blocks])
        self._blocks = []
        self._release(int(offsets[0]))  # messages of this time are drawn with it
        self._waveform.add(offsets, rows)
        self._release(int(offsets[-1]))
        if offsets[-1] >= self._curves_due_ns:
            self._curves_due_ns = int(offsets[-1] + self._curves_s * NANOSECONDS)
            self._curves.send()
        if self._is_live:
            self._send_page()
        self._hand_over()

    def _hand_over(self) -> None:
        """Flush to a file now, so that data for a slow disk do not pile up in memory."""
        if not self._is_live:
            self._flush_stream()

    def _break(self, next_stamp_ns: int) -> None:
        """Interrupt the curves where samples are missing, and say so."""
        gap_ns = next_stamp_ns - self._origin() - 1
        self._waveform.interrupt(gap_ns)
        self._at(gap_ns)
        self.note(f'samples are missing here (so far {self.lost_samples})')

    def _offsets(self, block: WaveformBlock) -> NDArray[np.int64]:
        """Return flight time of each row in ns."""
        within = np.rint(block.rows['time'].astype(np.float64) * NANOSECONDS).astype(np.int64)
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
        beside_ns = max(-offset_ns, stamp_ns - self._last_ns)
        if self.blocks and beside_ns > BESIDE_FLIGHT_S * NANOSECONDS:
            self._refuse(
                topic, WireError(f'stamped {beside_ns / NANOSECONDS:.0f} s off the flight')
            )
            return
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
            self._indicators.add(offset_ns, _named(message))
        elif topic == topics.SPECTRUM:
            self._spectra.draw(offset_ns / NANOSECONDS, decode(message))
        elif topic == topics.ALARM:
            self._status.add_alarm(message)
        else:
            self._status.add_health(message)

    def _on_load(self, offset_ns: int, message: Any) -> None:
        load = message.accel.linear
        values = [load.y / GRAVITY_M_S2, load.z / GRAVITY_M_S2]
        self._curves.add(style.LOAD, offset_ns, ['n', 'lateral'], values)

    def _on_truth(self, offset_ns: int, message: Any) -> None:
        truth = _named(message)
        ratio = truth.pop(style.CRACK_NAME, None)
        if truth:
            self._curves.add(style.TRUTH, offset_ns, [*truth], [*truth.values()])
        if ratio is None:
            return
        self._curves.add(style.CRACK_TRUTH, offset_ns, [style.CRACK_NAME], [ratio])
        self._rig.set_crack(float(ratio))

    def _on_config(self, text: str) -> None:
        """Take the rotor, the rules of the alarm and the units from the run's configuration.

        Rotor and rules are known only if it holds a scenario: an imported recording is of another
        machine, and its rules come from the analysis.
        """
        try:
            config = parse_json(text)
            if not isinstance(config, Mapping):
                raise ValueError('it is not a mapping')
            geometry = scene.Geometry.from_config(config)
            scenario = config.get('scenario')
            if isinstance(scenario, Mapping):
                self._geometry = geometry
                if 'monitor' in scenario:
                    self._rules = MonitorConfig.of_run(config).alarm.rules
        except (ValueError, ConfigError) as error:
            self.note(f'rotor/config cannot be used ({error})')
            return
        self._units = Units.from_config(config)
        self._use_config()


def _named(message: Any) -> dict[str, float]:
    """Return the numbers of a JointState by name."""
    if len(message.name) != len(message.position):
        raise WireError(f'{len(message.name)} names for {len(message.position)} numbers')
    return dict(zip(message.name, message.position, strict=True))
