# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A refused block of a recording: every command counts it, says so, and goes on."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from rotor_bringup.cli import app
from rotor_interfaces import topics
from rotor_interfaces.messages import OFFLINE, from_cdr, to_cdr
from rotor_interfaces.topics import Topic
from rotor_interfaces.waveform import WaveformBlock, decode, encode
from rotor_recording.recording import RecordingWriter
from rotor_rig.pipeline import simulate
from rotor_rig.scenario_model import Scenario

SPEED_RAD_S = 410.0
SCENARIO = Scenario.from_mapping(
    {
        'name': 'healthy',
        'duration_s': 4.0,
        'speed': {'initial_rad_s': SPEED_RAD_S},
        'maneuver': {'profile': 'sinusoid', 'mean': 2.5, 'amplitude': 1.5, 'frequency_hz': 0.5},
        'rotor': {'crack_stiffness_ratio': 0.0},
    }
)
BAD = 3
"""So many blocks are spoilt, in the middle of the flight."""

Rows = np.ndarray[tuple[int], np.dtype[np.void]]


def with_columns(rows: Rows, **columns: object) -> Rows:
    copy = rows.copy()
    for name, values in columns.items():
        copy[name] = values
    return copy


def without(rows: Rows, name: str) -> Rows:
    kept = [n for n in rows.dtype.names or () if n != name]
    return np.asarray(rows[kept].astype(np.dtype([(n, rows.dtype[n]) for n in kept])))


SPOILT: dict[str, Callable[[Rows], Rows]] = {
    'time stands still': lambda rows: with_columns(rows, time=0.0),
    'time is too fast': lambda rows: with_columns(rows, time=np.arange(len(rows)) * 1e-320),
    'time is nan': lambda rows: with_columns(rows, time=np.nan),
    'sample beyond counting': lambda rows: with_columns(rows, sample=1e300),
    'sample is nan': lambda rows: with_columns(rows, sample=np.nan),
    'samples do not follow': lambda rows: with_columns(rows, sample=rows['sample'][::-1]),
    'no time': lambda rows: without(rows, 'time'),
    'no sample': lambda rows: without(rows, 'sample'),
    'no rows': lambda rows: rows[:0],
}


@pytest.fixture(scope='module')
def flown() -> list[tuple[Topic, int, bytes]]:
    """What a healthy flight said of its waveform and itself."""
    wanted = (topics.CONFIG, topics.WAVEFORM)
    return [
        (topic, stamp_ns, to_cdr(message))
        for step in simulate(SCENARIO)
        for topic, stamp_ns, message in step.messages
        if topic in wanted
    ]


def written(
    flown: list[tuple[Topic, int, bytes]], path: Path, spoil: Callable[[int, bytes], bytes | None]
) -> Path:
    """Write the flight, of which some blocks of the waveform are spoilt or left out."""
    blocks = [item for item in flown if item[0] == topics.WAVEFORM]
    middle = blocks[len(blocks) // 2 : len(blocks) // 2 + BAD]
    with RecordingWriter.single_file(path) as writer:
        for topic, stamp_ns, data in flown:
            sent = spoil(stamp_ns, data) if (topic, stamp_ns, data) in middle else data
            if sent is not None:
                writer.write(topic, sent, stamp_ns, stamp_ns)
    return path


def spoilt(what: str) -> Callable[[int, bytes], bytes]:
    def spoil(stamp_ns: int, data: bytes) -> bytes:
        if what == 'no message':
            return data[: len(data) // 2]
        rows = decoded(data).rows.copy()
        return to_cdr(encode(WaveformBlock(stamp_ns, SPOILT[what](rows)), OFFLINE))

    return spoil


def decoded(data: bytes) -> WaveformBlock:
    return decode(from_cdr(data, topics.WAVEFORM.type))


def call(*words: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, [str(word) for word in words])
    return result.exit_code, result.stdout, result.stderr


@pytest.mark.slow
@pytest.mark.parametrize('what', [*SPOILT, 'no message'])
def test_every_command_counts_refused_blocks_and_goes_on(
    what: str, flown: list[tuple[Topic, int, bytes]], tmp_path: Path
) -> None:
    bad = written(flown, tmp_path / 'bad.mcap', spoilt(what))
    lacking = written(flown, tmp_path / 'lacking.mcap', lambda *_: None)
    for verb in ('baseline', 'analyze'):
        code, out, said = call(verb, bad, '--json')
        assert code == 0, said
        assert said.count(f'left out: {BAD} (') == 1, said
        wanted_code, wanted, nothing = call(verb, lacking, '--json')
        assert (wanted_code, nothing) == (0, '')
        found, right = json.loads(out), json.loads(wanted)
        for either in (found, right):
            either.pop('damage', None)
            either.pop('real_time_factor', None)
        # a refused block is as good as one that never came
        assert found == right
    code, _, said = call('view', bad, '--save', tmp_path / 'view.rrd')
    assert code == 0, said
    assert said.count('warning:') == 1, said
    assert f'left out: {BAD} (' in said or f'{BAD} messages of rotor/waveform break' in said, said


def test_a_baseline_of_refused_blocks_alone_says_why_there_is_none(
    flown: list[tuple[Topic, int, bytes]], tmp_path: Path
) -> None:
    with RecordingWriter.single_file(tmp_path / 'bad.mcap') as writer:
        for topic, stamp_ns, data in flown:
            writer.write(topic, data[:-9] if topic == topics.WAVEFORM else data, stamp_ns, stamp_ns)
    code, _, said = call('baseline', tmp_path / 'bad.mcap')
    assert code == 2
    assert 'hold no whole window' in said
    assert f'left out: {sum(topic == topics.WAVEFORM for topic, *_ in flown)} (' in said
