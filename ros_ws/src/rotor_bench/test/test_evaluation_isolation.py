# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Detectors in processes of their own: what they get, and every way in which they fail."""

import math
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from rotor_bench.evaluation import isolation, landlock
from rotor_bench.evaluation.isolation import DetectorProcess, Sandbox
from rotor_common.errors import ConfigError
from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock
from vibration_monitor.errors import MonitorError

BLOCKS = 4
SILENCE_S = 20.0
"""Long for this machine, short for a person."""
STARTED: list[DetectorProcess] = []


def block(number: int, height: float) -> WaveformBlock:
    rows = np.zeros(2048, WAVEFORM_DTYPE)
    rows['sample'] = 2048 * number + np.arange(2048)
    rows['disk_y'] = height
    return WaveformBlock(number * 200_000_000, rows)


@pytest.fixture(scope='module')
def sandbox(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Sandbox]:
    before = Path.cwd()
    os.chdir(Path(__file__).parent)
    with Sandbox(tmp_path_factory.mktemp('sandbox'), SILENCE_S) as server:
        yield server
    os.chdir(before)


@pytest.fixture(autouse=True)
def ended() -> Iterator[None]:
    """End the processes that a test has started."""
    yield
    while STARTED:
        STARTED.pop().close()


def fitted(sandbox: Sandbox, name: str) -> tuple[DetectorProcess, str]:
    process = sandbox.start(sandbox.code(f'faulty_detectors:{name}'))
    STARTED.append(process)
    stream = process.fit()
    for height in (1.0, 2.0):
        for number in range(BLOCKS):
            stream.send(block(number, height))
        stream.end_flight()
    stream.finish()
    return process, stream.failure


def flown(process: DetectorProcess, height: float) -> tuple[list[tuple[int, float, str]], str]:
    stream = process.flight()
    for number in range(BLOCKS):
        stream.send(block(number, height + number))
    stream.finish()
    return list(stream.verdicts), stream.failure


@pytest.mark.slow
def test_every_flight_starts_from_the_fitted_detector(sandbox: Sandbox) -> None:
    process, failure = fitted(sandbox, 'Sound')
    assert (process.failure, failure, process.alarm_score) == ('', '', 2.0)
    for height in (4.0, 6.0):
        verdicts, failure = flown(process, height)
        assert failure == ''
        assert verdicts == [
            (n, (height + n) / 2.0, f'block {n + 1}, fitted on 8, reference 2')
            for n in range(BLOCKS)
        ]


def test_evidence_comes_with_the_largest_score_so_far(sandbox: Sandbox) -> None:
    process, _ = fitted(sandbox, 'Sound')
    stream = process.flight()
    for height in (3.0, 5.0, 4.0, 5.0):
        stream.send(block(0, height))
    stream.finish()
    assert [bool(text) for _, _, text in stream.verdicts] == [True, True, False, False]


def test_nothing_to_say_is_no_failure(sandbox: Sandbox) -> None:
    process, _ = fitted(sandbox, 'Silent')
    verdicts, failure = flown(process, 1.0)
    assert failure == ''
    assert all(math.isnan(score) for _, score, _ in verdicts)
    assert len(verdicts) == BLOCKS


def test_a_fit_may_leave_flights_unread(sandbox: Sandbox) -> None:
    process, failure = fitted(sandbox, 'LooksAtFirstBlocksOnly')
    assert failure == ''
    verdicts, _ = flown(process, 4.0)
    assert verdicts[0][2] == 'block 1, fitted on 2, reference 1'


@pytest.mark.parametrize(
    ('name', 'words'),
    [
        ('RaisesAtOnce', 'ValueError: never made (faulty_detectors.py:'),
        ('HasNoAlarm', 'alarm_score'),
        ('NotThere', 'cannot be loaded'),
    ],
)
def test_a_detector_that_cannot_be_made_has_failed(sandbox: Sandbox, name: str, words: str) -> None:
    process, _ = fitted(sandbox, name)
    assert words in process.failure
    verdicts, failure = flown(process, 1.0)
    assert verdicts == []
    assert failure == process.failure


@pytest.mark.parametrize(
    ('name', 'words'),
    [
        ('RaisesInFit', 'ZeroDivisionError: cannot fit this (faulty_detectors.py:'),
        ('DiesInFit', 'its process died'),
        ('CannotBeCopied', 'keep what pickle can store in the detector'),
    ],
)
def test_a_fit_that_fails_says_why(sandbox: Sandbox, name: str, words: str) -> None:
    _, failure = fitted(sandbox, name)
    assert words in failure


@pytest.mark.parametrize(
    ('name', 'words', 'judged'),
    [
        ('RaisesLater', "KeyError: 'third block' (faulty_detectors.py:", 2),
        ('Exits', 'SystemExit: 0', 0),
        ('Dies', 'its process died', 0),
        ('SaysNoVerdict', 'push returned float, not a Verdict', 0),
        ('SaysInfinity', 'infinite score', 0),
    ],
)
def test_a_flight_that_fails_says_why_and_the_next_one_starts_afresh(
    sandbox: Sandbox, name: str, words: str, judged: int
) -> None:
    process, _ = fitted(sandbox, name)
    for _ in range(2):
        verdicts, failure = flown(process, 1.0)
        assert words in failure
        assert len(verdicts) == judged


@pytest.mark.slow
def test_a_detector_that_hangs_has_failed_and_is_ended(
    sandbox: Sandbox, monkeypatch: pytest.MonkeyPatch
) -> None:
    process, _ = fitted(sandbox, 'Hangs')
    monkeypatch.setattr(sandbox, '_silence_s', 2.0)
    _, failure = flown(process, 1.0)
    assert failure == 'it did not answer within 2 s'


def test_writing_ends_at_the_own_folder(sandbox: Sandbox) -> None:
    if not landlock.version():
        pytest.skip('this kernel has no Landlock')
    process, _ = fitted(sandbox, 'WritesEverywhere')
    assert flown(process, 1.0)[1] == ''


def test_a_detector_cannot_fly_its_flight_again(
    sandbox: Sandbox, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not landlock.version():
        pytest.skip('this kernel has no Landlock')
    # as where the rig is installed: all its packages lie where a detector may read
    source = Path(__file__).parents[2]
    names = ('maneuver_gen', 'rotor_bench', 'rotor_rig', 'rotor_sim')
    here = [source / name / name for name in names]
    installed = [*isolation.readable(), *here]
    monkeypatch.setattr(isolation, 'readable', lambda: installed)
    process, failure = fitted(sandbox, 'FliesItself')
    assert (process.failure, failure) == ('', '')
    assert flown(process, 1.0)[1] == ''


def test_what_detectors_may_read_must_not_hold_the_suite(sandbox: Sandbox) -> None:
    code = sandbox.code('vibration_monitor.detectors.ratios:RatioDetector')
    with pytest.raises(ConfigError, match='can read'):
        sandbox.check_secret(code.origin / 'suite', [code])
    sandbox.check_secret(Path('/nowhere/suite'), [code])


def test_code_that_is_not_there_is_said_at_once(sandbox: Sandbox) -> None:
    with pytest.raises(ConfigError, match='neither installed nor in this folder'):
        sandbox.code('no_such_module:Detector')
    with pytest.raises(MonitorError, match=r'is not known; give one of .*ratios, zones'):
        sandbox.code('ratio')
