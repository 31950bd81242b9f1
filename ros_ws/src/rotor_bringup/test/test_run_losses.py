# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A run that lost something says so by its exit code and with the count."""

import functools
import io
import json
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rich.console import Console
from typer.testing import CliRunner

from rotor_bringup.cli import app
from rotor_bringup.display import Display, RunState
from rotor_interfaces import messages
from rotor_interfaces.messages import OFFLINE

live = pytest.importorskip('rotor_bringup.live', reason='needs ROS 2')

RECORDER, MONITOR = 'recorder: stream', 'vibration_monitor: stream'
LOSSES: list[tuple[list[tuple[str, str, int]], str, tuple[int, int, int]]] = [
    ([], '', (0, 0, 0)),
    ([(MONITOR, 'lost samples [1]', 512)], '512 samples', (512, 0, 0)),
    ([(RECORDER, 'lost samples [1]', 256)], '256 samples', (256, 0, 0)),
    ([(RECORDER, 'refused blocks [1]', 1)], '1 blocks refused', (0, 1, 0)),
    ([(MONITOR, 'refused blocks [1]', 2)], '2 blocks refused', (0, 2, 0)),
    ([(RECORDER, 'messages left out [1]', 3)], '3 messages not recorded', (0, 0, 3)),
    (
        [(MONITOR, 'lost samples [1]', 512), (RECORDER, 'refused blocks [1]', 2)],
        '512 samples, 2 blocks refused',
        (512, 2, 0),
    ),
]


def state_after(told: list[tuple[str, str, int]]) -> RunState:
    """Return the state of a run whose nodes have told these counts on /diagnostics."""
    state = RunState(1.0)
    watcher = SimpleNamespace(_state=state)
    for name, key, count in told:
        value = SimpleNamespace(key=key, value=str(count))
        status = SimpleNamespace(name=name, values=[value])
        live.RunWatcher._on_diagnostics(watcher, SimpleNamespace(status=[status]))
    return state


@pytest.mark.parametrize(('told', 'words', 'counts'), LOSSES)
@pytest.mark.parametrize('as_json', [False, True])
@pytest.mark.parametrize(
    ('interrupted', 'failures', 'whole', 'lossy'),
    [(False, [], 0, 1), (True, [], 130, 130), (False, ['rotor_sim has died'], 3, 3)],
)
def test_the_exit_code_tells_a_run_that_lost_something(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    told: list[tuple[str, str, int]],
    words: str,
    counts: tuple[int, int, int],
    *,
    as_json: bool,
    interrupted: bool,
    failures: list[str],
    whole: int,
    lossy: int,
) -> None:
    def run_live(*_: object, folder: Path, **__: object) -> Any:
        return live.RunResult(folder, state_after(told), interrupted, failures, [])

    monkeypatch.setattr(live, 'run_live', run_live)
    arguments = ['run', 'level_healthy', '--record', str(tmp_path)]
    result = CliRunner().invoke(app, [*arguments, '--json'] if as_json else arguments)
    assert result.exit_code == (lossy if words else whole), result.output
    if as_json:
        found = json.loads(result.stdout)
        keys = ('lost_samples', 'refused_blocks', 'messages_left_out')
        assert tuple(found[key] for key in keys) == counts
    elif words:
        assert f'lost:      {words}\n' in result.stderr
    else:
        assert 'lost:' not in result.stderr


EPOCH_NS = 1_800_000_000_000_000_000
STAMPS_NS = (0, -(2**31) * 10**9, EPOCH_NS - 1, EPOCH_NS, EPOCH_NS + 10**9, 2**31 * 10**9)


def hostile_watcher() -> Any:
    """Return a watcher of a run of 1 s that has heard the first load."""
    watcher = SimpleNamespace(_state=RunState(1.0), _epoch_ns=EPOCH_NS, _load_factor=np.ones(102))
    watcher._simulated_s = functools.partial(live.RunWatcher._simulated_s, watcher)
    return watcher


@pytest.mark.parametrize('stamp_ns', STAMPS_NS)
@pytest.mark.parametrize('text', ['[/red]', '[bold', '\x1b]0;owned\x07', 'a\nb'])
@pytest.mark.parametrize('is_terminal', [False, True])
def test_no_message_ends_the_watching_of_a_run(
    stamp_ns: int, text: str, *, is_terminal: bool
) -> None:
    watcher = hostile_watcher()
    header = SimpleNamespace(stamp=messages.stamp(OFFLINE, stamp_ns))
    live.RunWatcher._on_clock(watcher, SimpleNamespace(clock=header.stamp))
    for position in ([], [1.0], [math.inf, 2.0]):
        said = SimpleNamespace(name=[f'{text}_y/amplitude_order_1'], position=position)
        live.RunWatcher._on_indicators(watcher, said)
    status = SimpleNamespace(level=b'\x02', message=text, name=text, values=[])
    for statuses in ([], [status]):
        live.RunWatcher._on_alarm(watcher, SimpleNamespace(header=header, status=statuses))
    value = SimpleNamespace(key='topics with another source', value=f'{text}, /clock')
    said = SimpleNamespace(status=[SimpleNamespace(name=text, values=[value])])
    live.RunWatcher._on_diagnostics(watcher, said)
    state = watcher._state
    assert 0.0 <= state.simulated_s <= 2.0
    assert state.windows == 1
    assert state.other_sources == {'/clock'}
    if state.worst_alarm is not None:
        assert EPOCH_NS <= stamp_ns <= EPOCH_NS + 2 * 10**9
        assert state.reasons.isprintable()
    console = Console(file=io.StringIO(), force_terminal=is_terminal, width=200)
    with Display(state, console) as display:
        display.refresh()
