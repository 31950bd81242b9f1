# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A run that cannot go on ends with one sentence, and what was recorded until then is whole."""

from pathlib import Path

import pytest
import yaml

from rig_support import Rig
from rotor_recording.reading import Recording

pytestmark = pytest.mark.slow


@pytest.fixture
def diverging(tmp_path: Path) -> Path:
    """A scenario whose rotor leaves its bearings after a few seconds, see docs/physics.md."""
    path = tmp_path / 'diverging.yaml'
    path.write_text(
        yaml.safe_dump(
            {
                'duration_s': 30.0,
                'variant': 'figure',
                'rotor': {'crack_stiffness_ratio': 0.1},
                'crack_growth': [{'at_s': 3.0, 'to': 0.45}],
                'maneuver': {'profile': 'constant', 'load_factor': 3.0},
            }
        )
    )
    return path


@pytest.mark.parametrize('options', [(), ('--composed',)])
def test_a_diverging_rotor_ends_the_run(
    rig: Rig, diverging: Path, tmp_path: Path, options: tuple[str, ...]
) -> None:
    done = rig('run', diverging, '--rate', 0, '--record', tmp_path / 'recordings', *options)
    assert done.code == 3
    assert 'diverged at sample' in done.err
    assert 'Traceback' not in done.err
    (bag,) = (tmp_path / 'recordings').iterdir()
    assert not list(bag.glob('*.active'))
    recording = Recording(bag)
    assert not recording.damage
    assert recording.message_counts['/rotor/waveform'] > 100


def test_a_diverging_rotor_ends_the_simulation(rig: Rig, diverging: Path, tmp_path: Path) -> None:
    done = rig('simulate', diverging, '--out', tmp_path / 'out.mcap')
    assert done.code in (2, 3)
    assert 'diverged at sample' in done.err
    assert 'Traceback' not in done.err
