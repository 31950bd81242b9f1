# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The monitor: waveform blocks in, indicators and alarm out, live and offline.

Window w covers the shaft revolutions [w hop, w hop + R) of the unwrapped angle column, whatever
the blocks are, so its indicators do not depend on the block size or on where the stream was
joined. A speed that reverses is not supported: it makes windows invalid.
"""

import cmath
import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotor_common.constants import MIN_SAMPLES_PER_CYCLE
from rotor_interfaces.channels import CHANNEL_COLUMNS
from rotor_interfaces.gaps import Continuity, SampleContinuity
from rotor_interfaces.waveform import LARGEST_SAMPLE, WAVEFORM_DTYPE, WaveformBlock
from vibration_monitor.analyzer import Analyzer
from vibration_monitor.block_columns import (
    Column,
    channels_to_use,
    column_of,
    first_sample_of,
    revolutions_of,
    stretches,
)
from vibration_monitor.buffer import SampleBuffer
from vibration_monitor.clock import BlockClock, own_rate
from vibration_monitor.detection import AlarmState, Level, RuleJudge
from vibration_monitor.indicators import OrderSpectrum, Window
from vibration_monitor.keyphasor import KeyphasorAngle, PulseCounts
from vibration_monitor.monitor_config import MonitorConfig

MAX_WINDOW_SAMPLES = 1 << 20
"""A window with more samples (a shaft that hardly turns) is invalid; this bounds the memory."""

MAX_WINDOW_VALUES = 1 << 24
"""The same for samples times columns: with very many channels fewer samples are allowed."""

MAX_INVALID_RECORDS = 1000
"""A gap across more windows than this yields this many records; the rest is only counted.

After that, `MIN_SAMPLES_PER_CYCLE` samples, the shortest revolution, allow one more each, so that
an angle that keeps jumping does not cause a flood.
"""

_TRIAL_RATE_HZ, _TRIAL_SAMPLES = 10_240, 128
"""Sampling of the synthetic flight of `prepare`, in Hz and in samples per revolution."""

ANGLE_MISSING = 'the shaft angle is missing'
ANGLE_UNSTEADY = 'the shaft angle does not rise steadily'

_NO_VECTOR = complex(math.nan, math.nan)

_MAX_STEP_REVOLUTIONS = 1 / MIN_SAMPLES_PER_CYCLE


@dataclass(frozen=True, eq=False)
class IndicatorRecord:
    """What the monitor says about one window.

    `values` (float64, SI) belong to `names`, the same in every window of a run. A valid record
    carries the first and last sample inside the window and the stamp of the last. An invalid one
    is all NaN, says why in `reason`, has no spectrum, and carries as both samples the one at which
    that became known (the first after a gap). `alarm` is the state after this window.
    """

    window: int
    first_sample: int
    last_sample: int
    stamp_ns: int
    valid: bool
    reason: str
    names: tuple[str, ...]
    values: NDArray[np.float64]
    spectrum: OrderSpectrum | None
    alarm: AlarmState

    def value(self, name: str) -> float:
        """Return an indicator by name; NaN where this stream does not have it."""
        return float(self.values[self.names.index(name)]) if name in self.names else math.nan

    def indicators(self) -> dict[str, float]:
        """Return all indicators by name."""
        return dict(zip(self.names, self.values.tolist(), strict=True))

    def vector(self, channel: str, order: str) -> complex:
        """Return A exp(i phase) of `order_2` or `ball_pass`, angle 0 = phase 0; NaN if unknown."""
        amplitude, phase = (
            self.value(f'{channel}/{what}_{order}') for what in ('amplitude', 'phase')
        )
        return cmath.rect(amplitude, phase) if math.isfinite(amplitude + phase) else _NO_VECTOR


class VibrationMonitor:
    """Computes the indicators of every window of revolutions, and the alarm."""

    def __init__(self, config: MonitorConfig | None = None) -> None:
        self.config = config or MonitorConfig()
        self._continuity = SampleContinuity()
        self._counts = dict.fromkeys(
            ('windows', 'judged', 'invalid', 'skipped', 'blocks_without_angle', 'angle_faults'), 0
        )
        self._pulses = PulseCounts()
        self._start_run()

    def _start_run(self) -> None:
        """Forget everything but the counters."""
        self._judge = RuleJudge(self.config.alarm)
        self._names: tuple[str, ...] = ()
        self._clock = BlockClock()
        self._previous = math.nan
        """Angle of the last sample in revolutions, NaN where the chain is broken."""
        self._gap = ''
        self._placed = False
        self._next = 0
        self._reason = ''
        self._judged = (0, 0)
        """Last sample and length in samples of the last valid window."""
        self._turned = 0
        """The whole revolution that follows the last angle."""
        self._keyphasor: KeyphasorAngle | None = None
        self._source = 'none'
        self._invalid_left = MAX_INVALID_RECORDS
        self._counted_to = -LARGEST_SAMPLE
        """Sample up to which `_invalid_left` has grown again."""

    def prepare(self) -> None:
        """Load and compile what the first window needs, on a synthetic flight; no data are kept.

        Takes 1 s, and 10 s in the first process of an installation. Without it the first window
        takes that long, and a stream in real time does not wait.
        """
        trial = VibrationMonitor(self.config)
        turns = self.config.window_revolutions + self.config.hop_revolutions + 1
        sample = np.arange(_TRIAL_SAMPLES * turns)
        rows = np.zeros(len(sample), WAVEFORM_DTYPE)
        rows['sample'], rows['time'] = sample, sample / _TRIAL_RATE_HZ
        rows['angle'] = 2.0 * math.pi / _TRIAL_SAMPLES * sample
        for column in CHANNEL_COLUMNS:
            rows[column] = np.cos(rows['angle'])
        trial.push(WaveformBlock(0, rows))

    def push(self, block: WaveformBlock) -> list[IndicatorRecord]:
        """Take the next block; return the records of the windows that it completes or breaks.

        Raises:
            WireError: the block has no `sample` or `time` column, no rows, too many channels, or
                its samples or its time do not rise, or its sample index contradicts its stamp;
                the block is then left out and shows up as a gap.

        """
        first = first_sample_of(block)
        expected = self._continuity.next_sample
        channels = channels_to_use(block, self.config.channels)
        own_rate(block.stamp_ns, block.rows['time'])
        continuity = self._continuity.follows(first, len(block.rows), block.time)
        clock = BlockClock() if continuity is Continuity.RESTART else self._clock
        clock.take(first, block.stamp_ns, block.rows['time'])
        self._continuity.check(first, len(block.rows), block.time)
        records = []
        if continuity is Continuity.RESTART:
            self._start_run()
            self._clock = clock
        elif continuity is Continuity.GAP:
            records += self._leave_keyphasor()
            self._gap = f'{first - (expected or 0)} samples before sample {first} were lost'
            self._previous = math.nan
        if not self._names:
            self._analyzer = Analyzer(channels, self.config)
            self._names = self._analyzer.names
            self._buffer = SampleBuffer(len(channels) + 2)
            self._waiting = SampleBuffer(len(channels) + 1)
            self._most_samples = min(MAX_WINDOW_SAMPLES, MAX_WINDOW_VALUES // (len(channels) + 2))
        revolutions = revolutions_of(block)
        columns = [column_of(block, name) for name in (*self._analyzer.channels, 'load_y')]
        for piece, present in stretches(np.isfinite(revolutions)):
            parts = [column[piece] for column in columns]
            if present:
                records += self._leave_keyphasor()
                self._source = 'encoder'
                records += self._take(first + piece.start, revolutions[piece], parts)
            else:
                volts = column_of(block, 'keyphasor')[piece]
                records += self._follow_keyphasor(first + piece.start, volts, parts)
        self._counts['blocks_without_angle'] += not np.isfinite(revolutions).all()
        return records

    def _follow_keyphasor(
        self, first_sample: int, volts: Column, columns: list[Column]
    ) -> list[IndicatorRecord]:
        """Take samples whose angle has to wait for the pulses of the key-phasor."""
        if self._keyphasor is None:
            self._keyphasor = KeyphasorAngle(self._turned, self._pulses)
            self._source = 'none'
        self._waiting.append(first_sample, columns)
        return self._take_waiting(self._keyphasor.push(volts))

    def _leave_keyphasor(self) -> list[IndicatorRecord]:
        """Take the samples that still wait without an angle: no further pulse will come."""
        if self._keyphasor is None:
            return []
        records = self._take_waiting(self._keyphasor.finish())
        self._keyphasor = None
        return records

    def _take_waiting(self, revolutions: NDArray[np.float64]) -> list[IndicatorRecord]:
        count = len(revolutions)
        if not count:
            return []
        self._source = 'none' if math.isnan(revolutions[-1]) else 'key-phasor'
        first_sample = self._waiting.first_sample
        records = self._take(first_sample, revolutions, list(self._waiting.rows[:, :count]))
        self._waiting.drop(count)
        return records

    def _take(
        self, first_sample: int, revolutions: NDArray[np.float64], columns: list[Column]
    ) -> list[IndicatorRecord]:
        """Take samples with their angles, NaN where there is none."""
        records = []
        for piece, fault in self._pieces(revolutions):
            if fault:
                angle = float(revolutions[piece.start])
                records += self._break(angle, first_sample + piece.start, fault)
                if piece.stop == piece.start + 1 < len(revolutions):
                    # the next sample does not follow either, as when the shaft turns backwards
                    continue
            parts = [revolutions[piece], *(column[piece] for column in columns)]
            self._buffer.append(first_sample + piece.start, parts)
            self._turned = math.ceil(revolutions[piece.stop - 1])
            records += self._complete_windows()
        return records

    @property
    def alarm(self) -> AlarmState:
        """State of the alarm now: STALE once no valid window has come for too long.

        Too long is M hops and one window, counted in samples at the speed of the last window.
        """
        last_sample, length = self._judged
        config = self.config
        patience = 1 + config.alarm.out_of * config.hop_revolutions / config.window_revolutions
        waited = (self._continuity.next_sample or 0) - last_sample
        if self._judge.state.level is Level.STALE or waited <= length * patience:
            return self._judge.state
        why = self._reason or 'the shaft has become too slow'
        return AlarmState.cannot_judge(f'no valid window in the last {waited} samples: {why}')

    def status(self) -> dict[str, int | str]:
        """Return the counters for /diagnostics, with units; a restart keeps them."""
        return {
            'blocks [1]': self._continuity.blocks,
            'gaps [1]': self._continuity.gaps,
            'lost samples [1]': self._continuity.lost_samples,
            'restarts [1]': self._continuity.restarts,
            'windows [1]': self._counts['windows'],
            'windows judged [1]': self._counts['judged'],
            'invalid windows [1]': self._counts['invalid'],
            'windows skipped in gaps [1]': self._counts['skipped'],
            'blocks without angle [1]': self._counts['blocks_without_angle'],
            'angle faults [1]': self._counts['angle_faults'],
            'angle from': self._source,
            'key-phasor pulses missed [1]': self._pulses.missed,
            'key-phasor pulses too many [1]': self._pulses.extra,
            'key-phasor lost [1]': self._pulses.lost_trains,
            'last fault': self._reason,
        }

    def _pieces(self, revolutions: NDArray[np.float64]) -> Iterator[tuple[slice, str]]:
        """Split a block where the angle is not continuous; yield each part and the fault before."""
        before = np.concatenate(([self._previous], revolutions[:-1]))
        self._previous = float(revolutions[-1])
        step = revolutions - before
        present = np.isfinite(revolutions)
        if not present.any():
            self._reason = self._gap or ANGLE_MISSING
            return
        cuts = np.flatnonzero(~((step > 0) & (step < _MAX_STEP_REVOLUTIONS))).tolist()
        first_cut = cuts[0] if cuts else len(revolutions)
        if first_cut:
            yield slice(0, first_cut), ''
        for cut, end in itertools.pairwise([*cuts, len(revolutions)]):
            if not present[cut]:
                continue
            fault = self._gap
            if not fault:
                fault = ANGLE_MISSING if math.isnan(before[cut]) else ANGLE_UNSTEADY
                self._counts['angle_faults'] += self._placed
            self._gap = ''
            yield slice(cut, end), fault

    def _break(self, revolution: float, sample: int, fault: str) -> list[IndicatorRecord]:
        """Continue at the angle after a fault; windows across the fault are invalid."""
        hop = self.config.hop_revolutions
        lost = range(0)
        if self._placed:
            lost = range(self._next, math.ceil(max(revolution, self._last_angle()) / hop))
            self._reason = fault
        self._placed = True
        self._next = math.ceil(revolution / hop)
        self._buffer.clear()
        told = self._affordable(len(lost), sample)
        self._counts['skipped'] += len(lost) - told
        return [self._invalid(window, sample, fault) for window in lost[:told]]

    def _affordable(self, wanted: int, sample: int) -> int:
        """Return how many of the `wanted` invalid windows are reported at this sample."""
        # by samples, not by blocks: the records must not depend on the blocks
        gained = (sample - self._counted_to) // MIN_SAMPLES_PER_CYCLE
        self._counted_to += gained * MIN_SAMPLES_PER_CYCLE
        self._invalid_left = min(self._invalid_left + gained, MAX_INVALID_RECORDS)
        told = min(wanted, self._invalid_left)
        self._invalid_left -= told
        return told

    def _last_angle(self) -> float:
        return float(self._buffer.rows[0, -1]) if len(self._buffer) else -math.inf

    def _complete_windows(self) -> list[IndicatorRecord]:
        """Return the records of the windows that the samples so far complete."""
        records = []
        hop, count = self.config.hop_revolutions, self.config.window_revolutions
        while self._last_angle() >= self._next * hop + count:
            records.append(self._analyze(self._next))
            self._next += 1
            angle = self._buffer.rows[0]
            before = int(np.searchsorted(angle, float(self._next * hop), side='right')) - 1
            self._buffer.drop(max(0, before))
        # a shaft that hardly turns; an eighth more, so that the data do not move with every block
        if len(self._buffer) > self._most_samples * 5 // 4:
            self._buffer.drop(len(self._buffer) - self._most_samples * 9 // 8)
        return records

    def _analyze(self, window: int) -> IndicatorRecord:
        """Return the record of a window whose end has been passed."""
        first_sample, rows = self._buffer.first_sample, self._buffer.rows
        start = window * self.config.hop_revolutions
        end = start + self.config.window_revolutions
        inside = slice(*np.searchsorted(rows[0], [float(start), float(end)]).tolist())
        before = int(np.searchsorted(rows[0], float(start), side='right')) - 1
        last_sample = first_sample + inside.stop - 1
        length = inside.stop - before
        if before < 0 or length > self._most_samples:
            self._reason = f'the window holds more than {self._most_samples} samples'
            return self._invalid(window, last_sample, self._reason)
        used = rows[:, before : inside.stop + 1]
        found = self._analyzer.analyze(
            Window(
                start=start,
                count=self.config.window_revolutions,
                revolutions=used[0],
                signals=used[1:-1],
                load_y=used[-1],
                inside=slice(inside.start - before, inside.stop - before),
                rate_hz=self._clock.rate_hz(),
            )
        )
        self._judged = (last_sample, length)
        self._reason = ''
        return self._record(
            window,
            first_sample=first_sample + inside.start,
            last_sample=last_sample,
            reason='',
            values=found.values,
            spectrum=found.spectrum,
            doubts=found.doubts,
        )

    def _invalid(self, window: int, sample: int, reason: str) -> IndicatorRecord:
        self._counts['invalid'] += 1
        values = np.full(len(self._names), math.nan)
        return self._record(
            window,
            first_sample=sample,
            last_sample=sample,
            reason=reason,
            values=values,
            spectrum=None,
            doubts=dict.fromkeys(self._names, reason),
        )

    def _record(
        self,
        window: int,
        *,
        first_sample: int,
        last_sample: int,
        reason: str,
        values: NDArray[np.float64],
        spectrum: OrderSpectrum | None,
        doubts: Mapping[str, str],
    ) -> IndicatorRecord:
        alarm = self._judge.update(dict(zip(self._names, values.tolist(), strict=True)), doubts)
        self._counts['windows'] += 1
        self._counts['judged'] += alarm.level is not Level.STALE
        return IndicatorRecord(
            window=window,
            first_sample=first_sample,
            last_sample=last_sample,
            stamp_ns=self._clock.stamp_ns(last_sample),
            valid=not reason,
            reason=reason,
            names=self._names,
            values=values,
            spectrum=spectrum,
            alarm=alarm,
        )
