# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The alarm means something: judged on the recorded files of flights."""

import json
import re
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from rig_support import LiveRuns, OfflineFlights, Rig, recorded
from rotor_bringup.cli import app
from rotor_interfaces import topics
from rotor_interfaces.messages import level_of
from rotor_recording.reading import Recording

ROOT = Path(__file__).parents[1]
LEVELS = ['OK', 'WARN', 'ERROR', 'STALE']


def seconds(recording: Recording, log_time_ns: int) -> float:
    assert recording.start_ns is not None
    return (log_time_ns - recording.start_ns) * 1e-9


def alarm_levels(folder: Path) -> list[tuple[float, str]]:
    """Return (simulated time in s, level) of every recorded alarm message."""
    recording = Recording(folder)
    return [
        (seconds(recording, log_time_ns), LEVELS[level_of(message.status[0])])
        for log_time_ns, message in recorded(recording, topics.ALARM)
    ]


def simulated(rig: Rig, folder: Path, *arguments: object) -> Path:
    """Return the recording of a flight made offline: test_bit_identity.py says it is the same."""
    done = rig('simulate', *arguments, '--out', folder / 'flight.mcap')
    assert done.code == 0, done.err
    return folder / 'flight.mcap'


def worst(folder: Path) -> str:
    levels = [level for _, level in alarm_levels(folder) if level != 'STALE']
    assert levels, 'the monitor never came to a conclusion'
    return max(levels, key=LEVELS.index)


@pytest.mark.slow
def test_the_default_flight_alarms_with_a_crack_and_only_then(
    live: LiveRuns, offline: OfflineFlights
) -> None:
    cracked = live('climb_dive', '--rate', 0).folder
    assert worst(cracked) in ('WARN', 'ERROR')
    found_s = next(time_s for time_s, level in alarm_levels(cracked) if level == 'ERROR')
    said = re.search(r'after (\d+) s the monitor', (ROOT / 'README.md').read_text())
    assert said is not None
    assert int(said[1]) == round(found_s)
    sound = offline('climb_dive_healthy')
    assert worst(sound) == 'OK'
    summary = json.loads(CliRunner().invoke(app, ['analyze', str(sound), '--json']).stdout)
    # 46 windows: the estimate settles for 10 s and 160 revolutions, and 3 windows make a level
    assert summary['judged_windows'] == summary['windows'] - 46


@pytest.mark.slow
def test_level_flight_has_no_test_signal_and_is_not_called_ok(live: LiveRuns) -> None:
    run = live('level_healthy', '--rate', 0, '--duration', 15)
    assert {level for _, level in alarm_levels(run.folder)} == {'STALE'}
    assert run.summary['worst_alarm'] == 'STALE'
    assert run.summary['judged_windows'] == 0
    assert 'the load has not changed by 0.079 g' in run.summary['conclusion']


@pytest.mark.slow
def test_a_small_crack_is_found_among_misalignment_noise_and_turns(
    rig: Rig, tmp_path: Path
) -> None:
    # K = 0.03, the shaft angle from the key-phasor alone
    levels = alarm_levels(simulated(rig, tmp_path, 'hidden_crack', '--duration', 20))
    assert {level for _, level in levels} & {'WARN', 'ERROR'}


@pytest.mark.slow
def test_a_growing_crack_changes_the_level(
    offline: OfflineFlights, capsys: pytest.CaptureFixture[str]
) -> None:
    path = offline('growing_crack')
    recording = Recording(path)
    truth = [
        (
            seconds(recording, log_time_ns),
            float(message.position[message.name.index('crack_stiffness_ratio')]),
        )
        for log_time_ns, message in recorded(recording, topics.TRUTH)
    ]
    changes = []
    level = 'OK'
    for time_s, now in alarm_levels(path):
        if now not in (level, 'STALE'):
            ratio = max(k for t, k in truth if t <= time_s)
            changes.append((now, ratio))
            level = now
    with capsys.disabled():
        levels = ', '.join(f'{name} at K = {k:.4f}' for name, k in changes)
        sys.stdout.write(f'\ngrowing crack: {levels}\n')
    assert changes, 'the level never changed'
    assert changes[0][0] == 'WARN'
    assert 0.0 < changes[0][1] < 0.15
