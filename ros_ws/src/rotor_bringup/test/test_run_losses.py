# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A run that lost something says so by its exit code and with the count."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from typer.testing import CliRunner

from rotor_bringup.cli import app
from rotor_bringup.display import RunState

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
