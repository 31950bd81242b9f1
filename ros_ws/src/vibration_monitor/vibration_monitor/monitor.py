# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The monitor: waveform blocks in, indicators and alarm out; used live and offline alike.

Window w covers the shaft revolutions [w hop, w hop + R) of the unwrapped angle column, whatever
the blocks are, so its indicators do not depend on the block size or on where the stream was
joined. A speed that reverses is not supported: it makes windows invalid.
"""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotor_interfaces.errors import WireError
from rotor_interfaces.gaps import Continuity, SampleContinuity
from rotor_interfaces.messages import NANOSECONDS, sample_stamp_ns
from rotor_interfaces.waveform import WaveformBlock
from vibration_monitor.config import MonitorConfig
from vibration_monitor.detection import AlarmState, Detector, Level
from vibration_monitor.indicators import (
    OrderSpectrum,
    Window,
    analyse,
    channels_of,
    indicator_names,
)
from vibration_monitor.order_tracking import MIN_SAMPLES_PER_CYCLE

MAX_WINDOW_SAMPLES = 1 << 20
"""A window with more samples (a shaft that hardly turns) is invalid; this bounds the memory."""

MAX_INVALID_RECORDS = 1000
"""A gap that swallows more windows than this yields so many records; the rest is counted."""

ANGLE_MISSING = 'the shaft angle is missing'
ANGLE_UNSTEADY = 'the shaft angle does not rise steadily'

_MAX_STEP_REVOLUTIONS = 1 / MIN_SAMPLES_PER_CYCLE


@dataclass(frozen=True, eq=False)
class IndicatorRecord:
    """What the monitor says about one window.

    `values` (float64, SI) belong to `names`, the same in every window of a run. A valid record
    carries the first and last sample inside the window and the stamp of the last. An invalid one
    is all NaN, says why in `reason`, has no spectrum, and carries the sample at which that became
    known (the first after a gap), twice. `alarm` is the state after this window.
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


class VibrationMonitor:
    """Computes the indicators of every window of revolutions, and the alarm."""

    def __init__(self, config: MonitorConfig | None = None) -> None:
        self.config = config or MonitorConfig()
        self._continuity = SampleContinuity()
        self._counts = dict.fromkeys(
            ('windows', 'invalid', 'skipped', 'blocks_without_angle', 'angle_faults'), 0
        )
        self._start_run()

    def _start_run(self) -> None:
        """Forget everything but the counters."""
        self._detector = Detector(self.config.alarm)
        self._channels: tuple[str, ...] = ()
        self._names: tuple[str, ...] = ()
        self._buffer = _Buffer()
        self._clock = _Clock()
        self._previous = math.nan
        """Angle of the last sample in revolutions, NaN where the chain is broken."""
        self._gap = ''
        self._placed = False
        self._next = 0
        self._reason = ''
        self._judged = (0, 0)
        """Last sample and length in samples of the last valid window."""

    def push(self, block: WaveformBlock) -> list[IndicatorRecord]:
        """Take the next block; return the records of the windows that it completes or breaks.

        Raises:
            WireError: the block has no `sample` or `time` column, no rows, or its samples or
                its time do not rise; the block is then left out and shows up as a gap.

        """
        first = _first_sample(block)
        expected = self._continuity.next_sample or 0
        continuity = self._continuity.check(first, len(block.rows))
        if continuity is Continuity.RESTART:
            self._start_run()
        elif continuity is Continuity.GAP:
            self._gap = f'{first - expected} samples before sample {first} were lost'
            self._previous = math.nan
        if not self._names:
            self._channels = channels_of(block.columns)
            self._names = indicator_names(self._channels, self.config)
        self._clock.take(first, block.stamp_ns, block.rows['time'])
        revolutions = _column(block, 'angle') / (2 * math.pi)
        if not np.isfinite(revolutions).all():
            self._counts['blocks_without_angle'] += 1
        signals = np.stack([_column(block, name) for name in (*self._channels, 'load_y')])
        records = []
        for piece, fault in self._pieces(revolutions):
            if fault:
                records += self._break(float(revolutions[piece.start]), first + piece.start, fault)
            self._buffer.append(first + piece.start, revolutions[piece], signals[:, piece])
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
        if self._detector.state.level is Level.STALE or waited <= length * patience:
            return self._detector.state
        why = self._reason or 'the shaft has become too slow'
        return AlarmState(Level.STALE, (f'no valid window in the last {waited} samples: {why}',))

    def status(self) -> dict[str, int | str]:
        """Return the counters for /diagnostics, with units; they outlive a restart."""
        return {
            'blocks [1]': self._continuity.blocks,
            'gaps [1]': self._continuity.gaps,
            'lost samples [1]': self._continuity.lost_samples,
            'restarts [1]': self._continuity.restarts,
            'windows [1]': self._counts['windows'],
            'invalid windows [1]': self._counts['invalid'],
            'windows skipped in gaps [1]': self._counts['skipped'],
            'blocks without angle [1]': self._counts['blocks_without_angle'],
            'angle faults [1]': self._counts['angle_faults'],
            'last fault': self._reason,
        }

    def _pieces(self, revolutions: NDArray[np.float64]) -> Iterator[tuple[slice, str]]:
        """Split a block where the angle does not go on; yield each part and what precedes it."""
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
        """Go on at an angle that does not follow: windows across the fault are invalid."""
        hop = self.config.hop_revolutions
        lost = range(0)
        if self._placed:
            lost = range(self._next, math.ceil(max(revolution, self._buffer.last_angle) / hop))
            self._reason = fault
        self._placed = True
        self._next = math.ceil(revolution / hop)
        self._buffer = _Buffer()
        self._counts['skipped'] += max(0, len(lost) - MAX_INVALID_RECORDS)
        return [self._invalid(window, sample, fault) for window in lost[:MAX_INVALID_RECORDS]]

    def _complete_windows(self) -> list[IndicatorRecord]:
        """Return the records of the windows that the samples so far complete."""
        records = []
        hop, count = self.config.hop_revolutions, self.config.window_revolutions
        while self._buffer.last_angle >= self._next * hop + count:
            records.append(self._judge(self._next))
            self._next += 1
            self._buffer.drop_before(self._next * hop)
        self._buffer.keep_last(MAX_WINDOW_SAMPLES)
        return records

    def _judge(self, window: int) -> IndicatorRecord:
        """Return the record of a window whose end has been passed."""
        first_sample, revolutions, signals = self._buffer.joined()
        start = window * self.config.hop_revolutions
        end = start + self.config.window_revolutions
        inside = slice(*np.searchsorted(revolutions, [start, end]).tolist())
        before = int(np.searchsorted(revolutions, start, side='right')) - 1
        last_sample = first_sample + inside.stop - 1
        length = inside.stop - before
        if before < 0 or length > MAX_WINDOW_SAMPLES:
            self._reason = f'the window holds more than {MAX_WINDOW_SAMPLES} samples'
            return self._invalid(window, last_sample, self._reason)
        used = slice(before, inside.stop + 1)
        values, spectrum = analyse(
            Window(
                start=start,
                count=self.config.window_revolutions,
                revolutions=revolutions[used],
                signals=signals[:-1, used],
                load_y=signals[-1, used],
                inside=slice(inside.start - before, inside.stop - before),
                rate_hz=self._clock.rate_hz(),
            ),
            self._channels,
            self.config,
        )
        self._judged = (last_sample, length)
        self._reason = ''
        return self._record(
            window,
            first_sample=first_sample + inside.start,
            last_sample=last_sample,
            reason='',
            values=values,
            spectrum=spectrum,
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
    ) -> IndicatorRecord:
        self._counts['windows'] += 1
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
            alarm=self._detector.update(dict(zip(self._names, values.tolist(), strict=True))),
        )


def _first_sample(block: WaveformBlock) -> int:
    """Return the index of the first sample; raises WireError for a block without a place."""
    first = block.first_sample
    if 'time' not in block.columns:
        raise WireError('the block has no `time` column, so its sample rate is unknown')
    time = block.rows['time']
    if len(time) > 1:
        _whole_rate(len(time) - 1, float(time[-1] - time[0]))
    if not np.array_equal(block.rows['sample'], first + np.arange(len(block.rows))):
        raise WireError(f'the samples of the block at sample {first} do not follow one another')
    return first


def _column(block: WaveformBlock, name: str) -> NDArray[np.float64]:
    """Return a column as float64, NaN where the block does not have it."""
    if name not in block.columns:
        return np.full(len(block.rows), math.nan)
    return block.rows[name].astype(np.float64)


class _Buffer:
    """Consecutive samples that open windows still need."""

    def __init__(self) -> None:
        self._first_sample = 0
        self._angles: list[NDArray[np.float64]] = []
        self._signals: list[NDArray[np.float64]] = []
        self._length = 0
        self.last_angle = -math.inf

    def append(
        self, first_sample: int, angle: NDArray[np.float64], signals: NDArray[np.float64]
    ) -> None:
        """Add samples: angle in revolutions (n,), signals (channels, n)."""
        if not self._length:
            self._first_sample = first_sample
        self._angles.append(angle)
        self._signals.append(signals)
        self._length += len(angle)
        self.last_angle = float(angle[-1])

    def joined(self) -> tuple[int, NDArray[np.float64], NDArray[np.float64]]:
        """Return the first sample's index and all samples in one piece."""
        if len(self._angles) > 1:
            self._angles = [np.concatenate(self._angles)]
            self._signals = [np.concatenate(self._signals, axis=1)]
        return self._first_sample, self._angles[0], self._signals[0]

    def drop_before(self, revolution: float) -> None:
        """Drop the samples that a window starting at `revolution` does not need."""
        _, angle, _ = self.joined()
        self._drop(max(0, int(np.searchsorted(angle, revolution, side='right')) - 1))

    def keep_last(self, count: int) -> None:
        """Bound the memory: keep the last `count` samples and an eighth, at least."""
        if self._length > count + count // 4:
            self.joined()
            self._drop(self._length - count - count // 8)

    def _drop(self, count: int) -> None:
        self._angles = [self._angles[0][count:].copy()]
        self._signals = [self._signals[0][:, count:].copy()]
        self._first_sample += count
        self._length -= count


class _Clock:
    """Sample rate and stamps of a run, from the blocks' stamps and time column."""

    def __init__(self) -> None:
        self._rate_hz: int | None = None
        self._origin: tuple[int, int] | None = None
        self._latest = (0, 0)

    def take(self, first_sample: int, stamp_ns: int, time: NDArray[np.float64]) -> None:
        """Note a block: its first sample, that sample's stamp, its time column in s."""
        self._latest = (first_sample, stamp_ns)
        self._origin = self._origin or self._latest
        if self._rate_hz is None and len(time) > 1:
            self._rate_hz = _whole_rate(len(time) - 1, float(time[-1] - time[0]))

    def rate_hz(self) -> int:
        """Return the sample rate, a whole number of Hz."""
        if self._rate_hz is None:
            # blocks of one sample: their stamps must do
            sample, stamp_ns = self._origin or self._latest
            samples = self._latest[0] - sample
            return _whole_rate(samples, (self._latest[1] - stamp_ns) / NANOSECONDS)
        return self._rate_hz

    def stamp_ns(self, sample: int) -> int:
        """Return the stamp of a sample, the same whichever block it came in."""
        first_sample, stamp_ns = self._latest
        rate_hz = self.rate_hz()
        epoch_ns = stamp_ns - sample_stamp_ns(0, first_sample, rate_hz)
        return sample_stamp_ns(epoch_ns, sample, rate_hz)


def _whole_rate(samples: int, duration_s: float) -> int:
    if not duration_s > 0 or not round(samples / duration_s):
        raise WireError(
            f'{samples} samples take {duration_s:g} s by the time column or the stamps; '
            'time must rise'
        )
    return round(samples / duration_s)
