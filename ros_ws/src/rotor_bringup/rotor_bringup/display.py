# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""What a person sees of a live run: a table on a terminal, one line a second elsewhere."""

import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Self

from rich.console import Console
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Column, Table
from rich.text import Text

LEVELS = ('OK', 'WARN', 'ERROR', 'STALE')
SEVERITY = ('STALE', 'OK', 'WARN', 'ERROR')
"""From knowing nothing to the worst."""

COLOURS = {'OK': 'green', 'WARN': 'yellow', 'ERROR': 'bold red', 'STALE': 'magenta'}
SHOWN_CHANNEL = 'disk_z'
REFRESH_S = 0.25
LINE_S = 2.0


def shown_channel(indicators: Iterable[str]) -> str:
    """Return the channel that people are shown: SHOWN_CHANNEL, or the first where it is absent."""
    end = '/amplitude_order_1'
    channels = [name.removesuffix(end) for name in indicators if name.endswith(end)]
    return SHOWN_CHANNEL if SHOWN_CHANNEL in channels or not channels else channels[0]


@dataclass
class RunState:
    """The run as seen from outside, filled from the topics."""

    duration_s: float
    simulated_s: float = 0.0
    load_factor: float = 0.0
    amplitudes_m: dict[int, float] = field(default_factory=dict)
    level: str = 'STALE'
    reasons: str = ''
    worst_level: str = 'STALE'
    worst_reasons: str = 'the run ended before the first window of 64 revolutions'
    first_alarm_s: float | None = None
    windows: int = 0
    invalid_windows: int = 0
    lost_samples: dict[str, int] = field(default_factory=dict)
    late_blocks: int = 0
    wall_s: float = 0.0
    _wall_start: float | None = None

    def advance(self, simulated_s: float) -> None:
        """Take the simulation clock."""
        now = time.monotonic()
        if self._wall_start is None:
            self._wall_start = now
        self.simulated_s = max(self.simulated_s, simulated_s)
        self.wall_s = now - self._wall_start

    def take_alarm(self, level: int, reasons: str, time_s: float) -> None:
        """Take an alarm that was raised at simulated time `time_s`; remembers the worst."""
        self.level, self.reasons = LEVELS[level], reasons
        if self.level in ('WARN', 'ERROR') and self.first_alarm_s is None:
            self.first_alarm_s = time_s
        if SEVERITY.index(self.level) >= SEVERITY.index(self.worst_level):
            self.worst_level, self.worst_reasons = self.level, reasons

    def take_indicators(self, values: dict[str, float]) -> None:
        """Take one window's indicators."""
        self.windows += 1
        channel = shown_channel(values)
        for order in (1, 2, 3):
            value = values.get(f'{channel}/amplitude_order_{order}', float('nan'))
            self.amplitudes_m[order] = value
        if self.amplitudes_m[1] != self.amplitudes_m[1]:
            self.invalid_windows += 1

    @property
    def real_time_factor(self) -> float:
        """Simulated over wall time so far; NaN before the run moves."""
        return self.simulated_s / self.wall_s if self.wall_s > 0.0 else float('nan')

    @property
    def lost(self) -> int:
        """Samples lost, the worst consumer counting."""
        return max(self.lost_samples.values(), default=0)

    def conclusion(self) -> str:
        """Return in one sentence what the monitor concluded."""
        judged = self.windows - self.invalid_windows
        if self.worst_level == 'STALE':
            return f'no conclusion from {judged} valid windows: {self.worst_reasons}'
        if self.worst_level == 'OK':
            return f'no alarm in {judged} windows'
        return (
            f'{self.worst_level}, first alarm at {self.first_alarm_s:.1f} s: {self.worst_reasons}'
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the summary for --json."""
        return {
            'simulated_s': self.simulated_s,
            'real_time_factor': self.real_time_factor,
            'worst_alarm': self.worst_level,
            'alarm_reasons': self.worst_reasons,
            'first_alarm_s': self.first_alarm_s,
            'windows': self.windows,
            'invalid_windows': self.invalid_windows,
            'lost_samples': self.lost,
            'late_blocks': self.late_blocks,
        }


class Display:
    """Shows a RunState: live on a terminal, as lines in a log; silent when asked to be."""

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
            self._console.print(self._line(), highlight=False, soft_wrap=True)

    def _amplitudes(self) -> str:
        state = self._state
        return '  '.join(
            f'{order}x {state.amplitudes_m.get(order, float("nan")) * 1e6:.2f} um'
            for order in (1, 2, 3)
        )

    def _line(self) -> str:
        state = self._state
        return (
            f'{state.simulated_s:6.1f} s of {state.duration_s:g} s  n = {state.load_factor:5.2f}  '
            f'{state.real_time_factor:4.1f} x real time  {SHOWN_CHANNEL}: {self._amplitudes()}  '
            f'{state.level}  lost {state.lost}'
        )

    def _table(self) -> Table:
        state = self._state
        table = Table.grid(*(Column(overflow='fold') for _ in range(3)), padding=(0, 2))
        bar = ProgressBar(state.duration_s, state.simulated_s, width=40)
        table.add_row('time', f'{state.simulated_s:.1f} of {state.duration_s:g} s', bar)
        table.add_row('load factor', f'{state.load_factor:+.2f}')
        table.add_row('real-time factor', f'{state.real_time_factor:.2f}')
        table.add_row(SHOWN_CHANNEL, self._amplitudes())
        table.add_row('alarm', Text(state.level, COLOURS[state.level]), state.reasons)
        table.add_row('samples lost', str(state.lost))
        return table
