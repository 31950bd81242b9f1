# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Same scenario, same bytes: live in processes, composed, accelerated and offline.

Header stamps differ by the epoch of a live run; columns never do.
"""

import hashlib
from pathlib import Path

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from rig_support import LiveRuns, Rig, recorded
from rotor_bringup.cli import app
from rotor_interfaces import topics
from rotor_recording.reading import Recording, waveform_blocks
from rotor_rig.pipeline import simulate
from rotor_rig.scenario_model import load_scenario
from vibration_monitor.monitor import VibrationMonitor
from vibration_monitor.monitor_config import MonitorConfig

DURATION_S = '6'


@pytest.fixture(scope='module')
def noisy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scenario that uses everything that could break identity: noise, ramps, growth."""
    path = tmp_path_factory.mktemp('scenario') / 'everything.yaml'
    path.write_text(
        yaml.safe_dump(
            {
                'duration_s': 4.0,
                'seed': 7,
                'rotor': {'crack_stiffness_ratio': 0.05, 'clearance_m': 1e-6},
                'speed': {
                    'initial_rad_s': 300.0,
                    'ramps': [{'at_s': 1.003, 'to_rad_s': 400.0, 'acceleration_rad_s2': 30.0}],
                },
                'crack_growth': [{'at_s': 1.0, 'to': 0.12, 'over_s': 2.0}],
                'maneuver': {'profile': 'climb_dive', 'level_s': 0.5},
                'sensors': {
                    'displacement_noise_m': 1e-7,
                    'acceleration_noise_m_s2': 0.2,
                    'load_noise_m_s2': 0.05,
                    'truth_waveform': True,
                },
            }
        )
    )
    return path


def waveform(path: Path) -> bytes:
    """Return the bytes of all rows of rotor/waveform."""
    return b''.join(block.rows.tobytes() for block in waveform_blocks(Recording(path)))


def indicators(path: Path, analysis: Path) -> list[list[str]]:
    """Return what `rotor-rig analyze` saved, less the stamps."""
    done = CliRunner().invoke(app, ['analyze', str(path), '--out', str(analysis)])
    assert done.exit_code == 0, done.stderr
    rows = [line.split(',') for line in analysis.read_text().splitlines()]
    stamp = rows[0].index('stamp_ns')
    return [row[:stamp] + row[stamp + 1 :] for row in rows]


@pytest.mark.slow
def test_every_way_of_running_gives_the_same_bytes(
    noisy: Path, live: LiveRuns, rig: Rig, tmp_path: Path
) -> None:
    offline = tmp_path / 'offline.mcap'
    done = rig('simulate', noisy, '--out', offline)
    assert done.code == 0, done.err
    expected = waveform(offline)
    assert len(expected) == 4 * 10_240 * 72
    runs = {
        'processes, rate 1': live(noisy),
        'composed': live(noisy, '--composed'),
        'rate 0': live(noisy, '--rate', 0),
        'composed, rate 0': live(noisy, '--rate', 0, '--composed'),
    }
    reference = indicators(offline, tmp_path / 'offline.csv')
    assert len(reference) > 5
    for name, run in runs.items():
        assert hashlib.sha256(waveform(run.folder)).digest() == (
            hashlib.sha256(expected).digest()
        ), name
        assert indicators(run.folder, tmp_path / 'live.csv') == reference, name


@pytest.mark.slow
def test_offline_files_are_the_same_bytes_twice(noisy: Path, rig: Rig, tmp_path: Path) -> None:
    for name in ('a.mcap', 'b.mcap'):
        done = rig('simulate', noisy, '--out', tmp_path / name, '--duration', 2)
        assert done.code == 0, done.err
    assert (tmp_path / 'a.mcap').read_bytes() == (tmp_path / 'b.mcap').read_bytes()


def test_block_size_changes_neither_waveform_nor_indicators(noisy: Path) -> None:
    results = []
    for block_samples in (64, 205, 256, 1000):
        scenario = load_scenario(str(noisy), block_samples=block_samples, duration_s=4.0)
        rows, values = [], []
        for step in simulate(scenario):
            rows.append(step.block.rows)
            values += [record.values for record in step.records]
        table = np.concatenate(rows)
        # `time` counts from the block's own stamp, so it is the one column that must differ
        columns = [table[name].tobytes() for name in table.dtype.names or () if name != 'time']
        results.append((columns, np.array(values).tobytes()))
    assert len(results[0][1]) > 0
    assert all(result == results[0] for result in results[1:])


@pytest.mark.slow
def test_recorded_live_indicators_are_those_of_the_analysis(live: LiveRuns) -> None:
    """What the monitor node published is bit for bit what the recording gives offline."""
    run = live('climb_dive', '--duration', DURATION_S, '--rate', 0)
    recording = Recording(run.folder)
    published = [
        message.position.tobytes() for _, message in recorded(recording, topics.INDICATORS)
    ]
    monitor = VibrationMonitor(MonitorConfig())
    computed = [
        record.values.tobytes()
        for block in waveform_blocks(recording)
        for record in monitor.push(block)
    ]
    assert len(computed) > 5
    assert published == computed


@pytest.fixture(scope='module')
def offline_indicators(noisy: Path) -> list[bytes]:
    """What the monitor says of the scenario offline, in blocks of the usual size."""
    return [
        record.values.tobytes()
        for step in simulate(load_scenario(str(noisy)))
        for record in step.records
    ]


@pytest.mark.slow
@pytest.mark.parametrize('block_samples', [64, 205, 1000])
def test_live_indicators_do_not_depend_on_the_block_size(
    noisy: Path,
    live: LiveRuns,
    offline_indicators: list[bytes],
    tmp_path: Path,
    block_samples: int,
) -> None:
    scenario = yaml.safe_load(noisy.read_text()) | {'block_samples': block_samples}
    path = tmp_path / 'blocks.yaml'
    path.write_text(yaml.safe_dump(scenario))
    run = live(path, '--rate', 0)
    published = [
        message.position.tobytes()
        for _, message in recorded(Recording(run.folder), topics.INDICATORS)
    ]
    assert len(published) > 5
    assert published == offline_indicators
