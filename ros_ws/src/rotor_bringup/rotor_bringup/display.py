# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Status display of a live run: a table on a terminal, one line a second elsewhere."""

import math
import time
from dataclasses import dataclass, field
from typing import Any, Self

from rich.console import Console
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Column, Table
from rich.text import Text

from rotor_common.units import number_text, people_unit
from rotor_interfaces.channels import channel_unit, shown_channel
from vibration_monitor.detection import CANNOT_JUDGE, Level
from vibration_monitor.monitor import IndicatorRecord

LEVELS = tuple(level.name for level in Level)
WORDS = {level.name: level.name for level in Level} | {Level.STALE.name: CANNOT_JUDGE}
"""The text shown for a level."""

COLOURS = {'OK': 'green', 'WARN': 'yellow', 'ERROR': 'bold red', 'STALE': 'magenta'}
_REFUSED = {'refused loads [1]': 'loads', 'refused progress [1]': 'reports of progress'}
REFRESH_S = 0.25
LINE_S = 2.0


@dataclass(frozen=True)
class Alarm:
    """One alarm and its time: level, reasons and time belong to the same window."""

    level: str
    reasons: str
    time_s: float


@dataclass
class RunState:
    """The run as seen from outside, filled from the topics.

    `first_alarm` is the first WARN or ERROR, `worst_alarm` the first of the worst level; `doubt` is
    the last reason why the monitor could not judge.
    """

    duration_s: float
    simulated_s: float = 0.0
    load_factor: float = math.nan
    channel: str = ''
    amplitudes: dict[int, float] = field(default_factory=dict)
    level: str = 'STALE'
    reasons: str = ''
    first_alarm: Alarm | None = None
    worst_alarm: Alarm | None = None
    doubt: str = f'{CANNOT_JUDGE}: the run ended before the first window was complete'
    was_ok: bool = False
    windows: int = 0
    judged_windows: int = 0
    invalid_windows: int = 0
    lost_samples: dict[str, int] = field(default_factory=dict)
    refused_blocks: dict[str, int] = field(default_factory=dict)
    messages_left_out: int = 0
    late_blocks: int = 0
    other_sources: set[str] = field(default_factory=set)
    refused_inputs: dict[str, int] = field(default_factory=dict)
    wall_s: float = 0.0
    _wall_start: float | None = None

    def advance(self, simulated_s: float) -> None:
        """Take the simulation clock."""
        now = time.monotonic()
        if self._wall_start is None:
            self._wall_start = now
        self.simulated_s = max(self.simulated_s, simulated_s)
        self.wall_s = now - self._wall_start

    def take_record(self, record: IndicatorRecord, time_s: float) -> None:
        """Take the monitor's result for the window that ends at simulated time `time_s`."""
        self.take_indicators(record.indicators())
        self.judged_windows += record.alarm.level is not Level.STALE
        self.take_alarm(int(record.alarm.level), '; '.join(record.alarm.reasons), time_s)

    def take_alarm(self, level: int, reasons: str, time_s: float) -> None:
        """Take an alarm of simulated time `time_s`; remembers the first and the worst."""
        self.level, self.reasons = LEVELS[level], reasons
        if self.level == 'OK':
            self.was_ok = True
        elif self.level == 'STALE':
            self.doubt = reasons
        else:
            alarm = Alarm(self.level, reasons, time_s)
            self.first_alarm = self.first_alarm or alarm
            if self.worst_alarm is None or level > LEVELS.index(self.worst_alarm.level):
                self.worst_alarm = alarm

    def take_count(self, name: str, key: str, count: int) -> None:
        """Take a counter that node part `name` of the run reports on /diagnostics."""
        if key == 'lost samples [1]':
            self.lost_samples[name] = count
        elif key == 'refused blocks [1]':
            self.refused_blocks[name] = count
        elif key == 'messages left out [1]':
            self.messages_left_out = count
        elif key == 'late blocks [1]':
            self.late_blocks = count
        elif key == 'windows judged [1]':
            self.judged_windows = count
        elif key in _REFUSED:
            self.refused_inputs[_REFUSED[key]] = count

    def take_indicators(self, values: dict[str, float]) -> None:
        """Take one window's indicators."""
        self.windows += 1
        self.channel = shown_channel(values)
        for order in (1, 2, 3):
            self.amplitudes[order] = values.get(f'{self.channel}/amplitude_order_{order}', math.nan)
        if math.isnan(self.amplitudes[1]):
            self.invalid_windows += 1

    @property
    def real_time_factor(self) -> float:
        """Simulated over wall time so far; NaN before the run moves."""
        return self.simulated_s / self.wall_s if self.wall_s > 0.0 else math.nan

    @property
    def lost(self) -> int:
        """Samples lost by the consumer that lost most."""
        return max(self.lost_samples.values(), default=0)

    @property
    def refused(self) -> int:
        """Blocks refused as malformed by the consumer that refused most."""
        return max(self.refused_blocks.values(), default=0)

    def losses(self) -> str:
        """Return in a few words what the run lost, '' for nothing."""
        counts = (
            (self.lost, 'samples'),
            (self.refused, 'blocks refused'),
            (self.messages_left_out, 'messages not recorded'),
        )
        return ', '.join(f'{count} {what}' for count, what in counts if count)

    @property
    def verdict(self) -> str:
        """The worst level that was found; OK only where the monitor could say so."""
        if self.worst_alarm is not None:
            return self.worst_alarm.level
        return 'OK' if self.was_ok else 'STALE'

    def conclusion(self) -> str:
        """Return in one sentence what the monitor concluded."""
        if self.worst_alarm is not None and self.first_alarm is not None:
            worst, first = self.worst_alarm, self.first_alarm
            text = f'{worst.level} at {worst.time_s:.1f} s: {worst.reasons}'
            if first.level == worst.level:
                return text
            return f'{text} (first alarm: {first.level} at {first.time_s:.1f} s)'
        if not self.was_ok:
            return f'{self.doubt} ({self.windows} windows)'
        text = f'no alarm in {self.judged_windows} windows'
        if others := self.windows - self.judged_windows:
            text += f', {others} others could not be judged'
        return f'{text}; at the end: {self.doubt}' if self.level == 'STALE' else text

    def as_dict(self) -> dict[str, Any]:
        """Return the summary for --json; STALE is `cannot judge`, with the reason."""
        worst, first = self.worst_alarm, self.first_alarm
        reasons = worst.reasons if worst else '' if self.was_ok else self.doubt
        return {
            'simulated_s': self.simulated_s,
            'real_time_factor': self.real_time_factor,
            'conclusion': self.conclusion(),
            'worst_alarm': self.verdict,
            'worst_alarm_s': worst.time_s if worst else None,
            'alarm_reasons': reasons,
            'first_alarm': first.level if first else None,
            'first_alarm_s': first.time_s if first else None,
            'first_alarm_reasons': first.reasons if first else '',
            'windows': self.windows,
            'judged_windows': self.judged_windows,
            'invalid_windows': self.invalid_windows,
            'lost_samples': self.lost,
            'refused_blocks': self.refused,
            'messages_left_out': self.messages_left_out,
            'late_blocks': self.late_blocks,
        }


class Display:
    """Shows a RunState: live on a terminal, as lines in a log; not at all if `quiet`."""

    def __init__(self, state: RunState, console: Console, *, quiet: bool = False) -> None:
        self._state = state
        self._console = console
        self._quiet = quiet
        self._live: Live | None = None
        self._next = 0.0

    def __enter__(self) -> Self:
        if self._console.is_terminal and not self._quiet:
            self._live = Live(console=self._console, auto_refresh=False, transient=True)
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live is not None:
            self._live.stop()

    def refresh(self) -> None:
        """Show the state if it is time to."""
        now = time.monotonic()
        if self._quiet or now < self._next:
            return
        self._next = now + (REFRESH_S if self._live else LINE_S)
        if self._live is not None:
            self._live.update(self._table(), refresh=True)
        elif self._state.simulated_s > 0.0:
            self._console.print(self._line(), markup=False, highlight=False, soft_wrap=True)

    def _amplitudes(self) -> str:
        state = self._state
        if not state.windows:
            return 'no window yet'
        unit, factor = people_unit(channel_unit(state.channel))
        return '  '.join(
            f'{order}x {number_text(amplitude * factor, ".2f", unit)}'
            for order, amplitude in state.amplitudes.items()
        )

    def _line(self) -> str:
        state = self._state
        return (
            f'{state.simulated_s:6.1f} s of {state.duration_s:g} s  '
            f'n = {number_text(state.load_factor, ".2f"):>5}  '
            f'{number_text(state.real_time_factor, ".1f"):>4} x real time  '
            f'{state.channel or "amplitudes"}: {self._amplitudes()}  '
            f'{WORDS[state.level]}  lost {state.lost}'
        )

    def _table(self) -> Table:
        state = self._state
        table = Table.grid(*(Column(overflow='fold') for _ in range(3)), padding=(0, 2))
        bar = ProgressBar(state.duration_s, state.simulated_s, width=40)
        table.add_row('time', f'{state.simulated_s:.1f} of {state.duration_s:g} s', bar)
        table.add_row('load factor', number_text(state.load_factor, '+.2f'))
        table.add_row('real-time factor', number_text(state.real_time_factor, '.2f'))
        table.add_row(Text(state.channel or 'amplitudes'), self._amplitudes())
        table.add_row('alarm', Text(WORDS[state.level], COLOURS[state.level]), Text(state.reasons))
        table.add_row('samples lost', str(state.lost))
        return table
