# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""`rotor-rig evaluate`: simulated, stored and over DDS, and what goes wrong in one sentence."""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from rig_support import Rig
from rotor_bringup.evaluation.runner import Simulated
from rotor_bringup.evaluation.suites import load

NODE = Path(__file__).parent / 'score_node.py'


@pytest.fixture(scope='session')
def small_suite(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write a suite of two machines with one flight of each kind, 10 s long."""
    group = {'name': 'test', 'split': 'test', 'machines': 2, 'healthy': 1, 'cracked': 1,
             'growing': 0, 'held_out': True, 'noise': ['realistic']}  # fmt: skip
    references = [{'family': 'pulls_3g', 'speed_program': 'steady'}]
    suite = {'base': 'smoke', 'name': 'small', 'flight_s': 10.0, 'groups': [group],
             'references': references}  # fmt: skip
    path = tmp_path_factory.mktemp('suite') / 'small.yaml'
    path.write_text(yaml.safe_dump(suite))
    return path


def evaluation(folder: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((folder / 'evaluation.json').read_text('utf-8'))
    return content


@pytest.mark.slow
def test_a_stored_suite_gives_the_numbers_of_the_simulated_one(
    rig: Rig, small_suite: Path, tmp_path: Path
) -> None:
    stored = tmp_path / 'stored'
    assert rig('dataset', small_suite, '--out', stored, '--jobs', 1).code == 0
    for suite, out, jobs in ((small_suite, 'a', 1), (stored, 'b', 2)):
        done = rig('evaluate', 'ratios', 'zones', '--suite', suite, '--out', tmp_path / out,
                   '--jobs', jobs)  # fmt: skip
        assert done.code == 0, done.err
        assert 'AUC' in done.out
    simulated, read = evaluation(tmp_path / 'a'), evaluation(tmp_path / 'b')
    assert simulated['flights'] == read['flights']
    assert simulated['detectors'] == read['detectors']
    assert (simulated['stored'], read['stored']) == (False, True)
    assert len(simulated['flights']) == 4
    assert all(numbers['failed'] == 0 for numbers in simulated['detectors'].values())
    assert all((tmp_path / 'a' / name).is_file() for name in ('roc.png', 'growth.png'))


@pytest.mark.slow
def test_a_node_is_tested_by_its_topic(rig: Rig, small_suite: Path, tmp_path: Path) -> None:
    done = rig(
        'evaluate', 'topic:my/score', 'zones', '--node-command', f'{sys.executable} {NODE}',
        '--suite', small_suite, '--limit', 1, '--out', tmp_path, '--json',
    )  # fmt: skip
    assert done.code == 0, done.err
    content = evaluation(tmp_path)
    assert done.json['detectors'] == content['detectors']
    assert set(content['detectors']) == {'zones', 'topic:my/score'}
    assert 'topic: the node hears anonymous blocks alone' in content['isolation']
    chosen = load(str(small_suite), seed=0, split='test', limit=1)
    tests = [flight for flight in chosen.machines[0].flights if flight.role == 'test']
    assert len(content['flights']) == len(tests) == 2
    for flight, result in zip(tests, content['flights'], strict=True):
        outcome = result['outcomes']['topic:my/score']
        blocks = [block.rows['disk_y'] for (block,) in Simulated().fly([flight])]
        # six digits are kept; the last 0.2 s may be spoken about or not when the flight ends
        assert outcome['score'] == pytest.approx(np.abs(blocks).max() / 1e-5, rel=1e-5)
        assert outcome['failure'] == ''
        assert outcome['judged_s'] > 9.0
        assert result['outcomes']['zones']['failure'] == ''


@pytest.mark.slow
def test_a_node_that_says_nothing_has_failed_in_a_sentence(
    rig: Rig, small_suite: Path, tmp_path: Path
) -> None:
    done = rig('evaluate', 'topic:not/there', '--suite', small_suite, '--limit', 1,
               '--out', tmp_path)  # fmt: skip
    assert done.code == 3
    assert done.err.strip().splitlines()[-1] == (
        'error: the replay failed: no node published /not/there and listened to rotor/waveform '
        'within 15 s'
    )


@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        (
            ('ratio', '--suite', 'smoke'),
            "'ratio' is not known; give one of baseline, ratios",
        ),
        (('no_such:Thing', '--suite', 'smoke'), "module 'no_such' of a detector is neither"),
        (('ratios', '--suite', 'smooke'), "'smooke'"),
        (('ratios', 'ratios', '--suite', 'smoke'), "'ratios' is given twice"),
        (('ratios', '--suite', 'smoke', '--jobs', 0), '--jobs 0 is out of range'),
        (('ratios', '--suite', 'smoke', '--limit', 0), '--limit 0 is out of range'),
        (('ratios', '--suite', 'smoke', '--seed', -1), 'seed = -1 is out of range'),
        (('topic:a', '--suite', 'smoke', '--rate', 0), '--rate 0 is out of range'),
        (
            ('topic:a', '--suite', 'smoke', '--node-command', 'no-such-program'),
            'there is no program',
        ),
    ],
)
def test_what_cannot_be_is_one_sentence(
    rig: Rig, tmp_path: Path, arguments: tuple[object, ...], words: str
) -> None:
    done = rig('evaluate', *arguments, '--out', tmp_path / 'out')
    assert done.code == 2
    assert words in done.err
    assert len(done.err.strip().splitlines()) == 1


def test_a_folder_that_is_no_data_set_is_said(rig: Rig, tmp_path: Path) -> None:
    done = rig('evaluate', 'ratios', '--suite', tmp_path, '--out', tmp_path / 'out')
    assert done.code == 2
    assert 'holds no data set' in done.err
