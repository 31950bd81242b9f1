# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A recording too short for a window says why, and what its samples say."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

from rotor_bringup.analysis import AnalyzedRecording, analyze_recording
from rotor_bringup.cli import app
from rotor_recording.importing.convert import ImportPlan, convert, write

RATE_HZ = 25_600
COUNT = 32_768
"""A file of XJTU-SY: 1.28 s."""


def analyzed(
    tmp_path: Path, columns: list[NDArray[np.float64]], speed_hz: float | None
) -> AnalyzedRecording:
    path, out = tmp_path / 'x.txt', tmp_path / 'x.mcap'
    np.savetxt(path, np.column_stack(columns), fmt='%.6f')
    names = ('brg1_ay', 'brg1_az', 'gap_y')[: len(columns)]
    channels = {name: str(number) for number, name in enumerate(names, 1)}
    units = {'': '1'}
    write(convert(ImportPlan(path, channels, units, RATE_HZ, speed_hz=speed_hz)), out)
    return analyze_recording(out)


@pytest.fixture(scope='module')
def short(tmp_path_factory: pytest.TempPathFactory) -> AnalyzedRecording:
    angle = 2 * np.pi * 31.25 * np.arange(COUNT) / RATE_HZ  # 40 revolutions
    noise = np.random.default_rng(4).standard_normal(COUNT)
    noise[7] = math.nan
    columns = [2.0 * np.cos(angle) + 5.0, noise, np.full(COUNT, 0.5)]
    return analyzed(tmp_path_factory.mktemp('short'), columns, 31.25)


def test_the_statistics_of_a_sine_and_of_noise(short: AnalyzedRecording) -> None:
    assert short.samples is not None
    sine, noise, dead = (short.samples.channels[name] for name in ('brg1_ay', 'brg1_az', 'gap_y'))
    # of a sine of amplitude 2 about 5, float32
    assert sine.rms == pytest.approx(2.0 / math.sqrt(2), rel=1e-6)
    assert sine.peak == pytest.approx(2.0, rel=1e-6)
    assert sine.crest_factor == pytest.approx(math.sqrt(2), rel=1e-6)
    assert sine.kurtosis == pytest.approx(1.5, rel=1e-6)
    assert (sine.samples, sine.samples_without_number, sine.unit) == (COUNT, 0, 'm/s^2')
    # 4 standard errors: of the rms 1/sqrt(2 N), of the kurtosis sqrt(24/N)
    assert noise.rms == pytest.approx(1.0, abs=4 / math.sqrt(2 * COUNT))
    assert noise.kurtosis == pytest.approx(3.0, abs=4 * math.sqrt(24 / COUNT))
    assert noise.samples_without_number == 1
    assert noise.samples == COUNT - 1
    assert math.isnan(dead.rms)
    assert math.isnan(dead.kurtosis)
    assert dead.unit == 'm'


def test_the_reason_is_said_and_nothing_is_judged(short: AnalyzedRecording) -> None:
    assert short.samples is not None
    assert short.samples.reason == 'the shaft turns 40.0 times, and a window takes 64 revolutions'
    assert not short.state.windows
    assert short.state.verdict == 'STALE'


def test_without_an_angle_the_samples_still_speak(tmp_path: Path) -> None:
    signal = np.sin(2 * np.pi * 31.25 * np.arange(COUNT) / RATE_HZ)
    found = analyzed(tmp_path, [signal], None).samples
    assert found is not None
    assert found.reason == 'the shaft angle is missing'
    assert found.channels['brg1_ay'].rms == pytest.approx(1 / math.sqrt(2), rel=1e-6)
    path = str(tmp_path / 'x.mcap')
    printed = CliRunner().invoke(app, ['analyze', path])
    assert printed.exit_code == 0
    assert 'no window: the shaft angle is missing' in printed.stdout
    assert '0.7071' in printed.stdout
    summary = json.loads(CliRunner().invoke(app, ['analyze', path, '--json']).stdout)
    assert summary['no_window'] == 'the shaft angle is missing'
    assert summary['sample_statistics']['brg1_ay']['crest_factor'] == pytest.approx(math.sqrt(2))
    assert summary['worst_alarm'] == 'STALE'


def test_a_window_makes_the_statistics_of_all_samples_superfluous(tmp_path: Path) -> None:
    angle = 2 * np.pi * 60.0 * np.arange(COUNT) / RATE_HZ
    found = analyzed(tmp_path, [np.cos(angle)], 60.0)
    assert found.state.windows == 1
    assert found.samples is None
    assert 'no_window' not in found.summary()
