# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""One bad block ends nothing: it is refused and counted, and the next one is taken."""

import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from monitor_signals import RATE_HZ, blocks, run, same, steady_angle, table
from rotor_common.errors import WireError
from rotor_interfaces import topics
from rotor_interfaces.messages import OFFLINE, to_cdr
from rotor_interfaces.waveform import (
    LARGEST_SAMPLE,
    LONGEST_ROW,
    MOST_COLUMNS,
    MOST_ROWS,
    WAVEFORM_DTYPE,
    WaveformBlock,
    decode,
    encode,
)
from rotor_recording.recording_stream import RecordingStream
from rotor_recording.recovery import Samples
from rotor_view.rig_view import RigView
from vibration_monitor import VibrationMonitor
from vibration_monitor.messages import MonitorMessages
from vibration_monitor.monitor import MAX_INVALID_RECORDS
from vibration_monitor.monitor_config import MonitorConfig

ALL = MonitorConfig(
    extras=(
        'spectrum', 'statistics', 'whirl', 'average', 'orbit', 'envelope', 'passage', 'trend',
        'crack',
    ),
    critical_speed_rad_s=700.0,
)  # fmt: skip
ANGLE = steady_angle(2.0, 700.0)
ROWS = table(
    ANGLE,
    {name: 1e-5 * np.cos(ANGLE + number) for number, name in enumerate(('disk_y', 'disk_z'))},
)
STREAM = blocks(ROWS, 256)
NUMBERS = (
    0.0, 1.0, -1.0, 1e-320, 1e-45, 1e6, 1e15, 2.0**53, 1e17, 3.4e38, 1e300, -1e300, math.inf,
    -math.inf, math.nan,
)  # fmt: skip
PATTERNS = ('constant', 'rising', 'flickering', 'somewhere', 'noise')


class NullWriter:
    """A writer that keeps nothing."""

    messages = message_bytes = 0
    flush_max_s = 0.0

    def write(self, *_: object) -> None:
        """Take a message."""


def cloud(block: WaveformBlock = STREAM[2], **changes: Any) -> Any:
    """Return the PointCloud2 of a block with fields of its own, changed."""
    message = encode(block, OFFLINE)
    message.fields = [point_field(f.name, f.offset, f.datatype) for f in message.fields]
    for name, value in changes.items():
        setattr(message, name, value)
    return message


def point_field(name: str, offset: int, datatype: int = 8) -> Any:
    return OFFLINE.new(
        'sensor_msgs/msg/PointField', name=name, offset=offset, datatype=datatype, count=1
    )


EMPTY = np.empty(0, np.uint8)
REFUSED: dict[str, tuple[Callable[[], Any], str]] = {
    'rows of 2 GiB of which there are none': (
        lambda: cloud(width=0, point_step=2**31, data=EMPTY),
        f'2147483648 bytes a row; allowed: up to {LONGEST_ROW}',
    ),
    'more columns than any machine has': (
        lambda: cloud(fields=[point_field(f'c{number}', 0) for number in range(200_000)]),
        f'200000 columns; allowed: up to {MOST_COLUMNS}',
    ),
    'more rows than any block': (
        lambda: cloud(width=MOST_ROWS + 1, point_step=1, data=np.zeros(MOST_ROWS + 1, np.uint8)),
        f'{MOST_ROWS + 1} rows; allowed: up to {MOST_ROWS}',
    ),
    'a name as long as a book': (
        lambda: cloud(fields=[point_field('x' * 1_000_000, 0)]),
        'a name of 1000000 characters',
    ),
    'a column without a name': (
        lambda: cloud(fields=[point_field('', 0)]),
        'a name of 0 characters',
    ),
    'a column twice': (
        lambda: cloud(fields=[point_field('time', 0), point_field('time', 8)]),
        "column 'time' occurs twice",
    ),
    'a column beyond the row': (
        lambda: cloud(fields=[point_field('time', 2**32 - 1)]),
        'ends at byte 4294967303 of a row of 72 bytes',
    ),
}
"""Message and sentence; made when needed, since 200 000 columns are much for all other tests."""


@pytest.mark.parametrize('what', REFUSED)
def test_a_block_beyond_the_bounds_is_refused_in_one_sentence_at_once(what: str) -> None:
    make, sentence = REFUSED[what]
    message = make()
    begun_s = time.process_time()
    with pytest.raises(WireError) as refused:
        decode(message)
    assert time.process_time() - begun_s < 0.5
    assert sentence in str(refused.value)
    assert len(str(refused.value)) < 300
    stream = RecordingStream(NullWriter())  # type: ignore[arg-type]
    begun_s = time.process_time()
    stream.take(topics.WAVEFORM, to_cdr(message), 0)
    assert time.process_time() - begun_s < 2.0
    assert stream.refused_blocks == 1


def changed(block: WaveformBlock, **columns: NDArray[np.floating] | float) -> WaveformBlock:
    rows = block.rows.copy()
    for name, values in columns.items():
        rows[name] = values
    return WaveformBlock(block.stamp_ns, rows)


@pytest.mark.parametrize(
    'bad',
    [
        changed(STREAM[3], sample=1e300),
        WaveformBlock(STREAM[3].stamp_ns, changed(STREAM[3], sample=1e17).rows[:1]),
        WaveformBlock(STREAM[3].stamp_ns, changed(STREAM[3], time=math.nan).rows[:1]),
        WaveformBlock(STREAM[3].stamp_ns, changed(STREAM[3], time=1e300).rows[:1]),
        changed(STREAM[3], time=np.arange(256) * 1e-320),
        changed(STREAM[3], time=np.arange(256) * 1e-12),
        changed(STREAM[3], time=1e15 + np.arange(256)),
        changed(STREAM[3], time=np.arange(256) * 1e300),
        changed(STREAM[3], sample=1e12 + np.arange(256)),
        changed(STREAM[3], sample=np.arange(256.0)),
    ],
    ids=[
        '1e300',
        'coarse',
        'time nan',
        'time 1e300',
        'denormal',
        'fast',
        'late',
        'slow',
        'ahead',
        'back',
    ],
)
def test_a_refused_block_is_as_good_as_one_that_never_came(bad: WaveformBlock) -> None:
    monitor, other = VibrationMonitor(), VibrationMonitor()
    records = run(monitor, STREAM[:3])
    with pytest.raises(WireError):
        monitor.push(bad)
    records += run(monitor, STREAM[4:])
    assert same(records, run(other, [*STREAM[:3], *STREAM[4:]]))
    assert monitor.status() == other.status()
    assert monitor.status()['lost samples [1]'] == 256


@pytest.mark.parametrize('false', [10**12, 0])
def test_a_false_index_is_a_refused_block_to_recorder_view_and_check(false: int) -> None:
    stream, samples = RecordingStream(NullWriter()), Samples()  # type: ignore[arg-type]
    recordings: list[object] = []
    view = RigView(lambda new: recordings.append(new.memory_recording()))
    for number, block in enumerate(STREAM[:8]):
        sent = changed(block, sample=false + np.arange(256.0)) if number == 4 else block
        message = encode(sent, OFFLINE)
        stream.take(topics.WAVEFORM, to_cdr(message), 0)
        samples.take(to_cdr(message))
        view.push(topics.WAVEFORM, block.stamp_ns, message)
    assert (stream.refused_blocks, stream.continuity.lost_samples) == (1, 256)
    assert (samples.blocks_without_index, samples.continuity.lost_samples) == (1, 256)
    assert (stream.continuity.restarts, samples.continuity.restarts, view.blocks) == (0, 0, 7)
    assert view.lost_samples == 256
    assert '1 messages of rotor/waveform' in view.refusals[0]


@pytest.mark.parametrize('step', [1e300, 1e18, -1e300, 2.0**60])
def test_an_angle_beyond_all_running_is_none(step: float) -> None:
    monitor = VibrationMonitor()
    run(monitor, STREAM[:30])
    assert monitor.push(changed(STREAM[30], angle=np.arange(1, 257) * step)) == []
    records = run(monitor, STREAM[31:])
    assert {record.reason for record in records if not record.valid} == {
        'the shaft angle is missing'
    }
    assert sum(int(n) for n in monitor.status().values() if isinstance(n, int)) < 10_000


@pytest.mark.parametrize('size', [64, 256, 1000])
def test_a_flickering_encoder_makes_no_flood_of_records_whatever_the_blocks(size: int) -> None:
    rows = ROWS[:2048].copy()
    rows['angle'][::2] = 0.0
    rows['angle'][1::2] = 1e6
    monitor = VibrationMonitor()
    records = [monitor.push(block) for block in blocks(rows, size)]
    counts = [len(told) for told in records]
    assert max(counts) <= MAX_INVALID_RECORDS + size
    assert sum(counts) <= MAX_INVALID_RECORDS + len(rows) // 6
    whole = run(VibrationMonitor(), blocks(rows, len(rows)))
    assert same([record for told in records for record in told], whole)
    skipped = monitor.status()['windows skipped in gaps [1]']
    # half of the samples jump over 159 154 revolutions, in windows 16 revolutions apart
    assert int(skipped) + sum(counts) == pytest.approx(1023 * 1e6 / (2 * math.pi) / 16, rel=0.01)


def test_more_channels_than_the_monitor_takes_are_refused_with_the_remedy() -> None:
    names = [f'c{number}_y' for number in range(65)]
    rows = np.zeros(256, [('time', '<f8'), ('sample', '<f8'), *((name, '<f4') for name in names)])
    rows['time'], rows['sample'] = np.arange(256) / RATE_HZ, np.arange(256)
    with pytest.raises(WireError, match=r'65 channels; allowed: up to 64; .*monitor\.channels'):
        VibrationMonitor().push(WaveformBlock(0, rows))
    chosen = MonitorConfig(channels=('c1_y', 'c2_y'), extras=())
    assert VibrationMonitor(chosen).push(WaveformBlock(0, rows)) == []


@pytest.mark.parametrize('second', [-(2**31), -(2**31) + 5, 2**31 - 2, 2**31 - 1])
def test_no_window_gets_a_stamp_that_cannot_be_written(second: int) -> None:
    monitor, outgoing = VibrationMonitor(ALL), MonitorMessages(OFFLINE)
    stamp_ns = second * 10**9 + 65_535
    for block in blocks(ROWS, 4):  # short, so that windows end with the block before
        try:
            records = monitor.push(WaveformBlock(stamp_ns, block.rows))
        except WireError:
            records = []
        for _, _, said in outgoing.after_block(monitor, records, stamp_ns):
            to_cdr(said)


def test_one_wrong_stamp_does_not_have_all_blocks_of_one_sample_refused() -> None:
    monitor = VibrationMonitor()
    single = blocks(ROWS[:20], 1)
    late = WaveformBlock(2_000_000_000 * 10**9, single[0].rows)
    run(monitor, [late])
    with pytest.raises(WireError, match='time must rise'):
        monitor.push(single[1])
    run(monitor, single[2:])
    assert monitor.status()['blocks [1]'] == 19


@st.composite
def columns(draw: st.DrawFn, count: int) -> NDArray[np.float64]:
    a, b = draw(st.sampled_from(NUMBERS)), draw(st.sampled_from(NUMBERS))
    index = np.arange(count)
    with np.errstate(all='ignore'):
        return {
            'constant': np.full(count, a),
            'rising': b + index * a,
            'flickering': np.where(index % draw(st.integers(2, 5)), a, b),
            'somewhere': np.where(index == draw(st.integers(0, max(count - 1, 0))), a, index),
            'noise': np.random.default_rng(1).standard_normal(count) * a,
        }[draw(st.sampled_from(PATTERNS))]


@st.composite
def hostile_blocks(draw: st.DrawFn) -> WaveformBlock:
    count = draw(st.sampled_from([0, 1, 2, 17, 256, 4096]))
    names = draw(st.lists(st.sampled_from(WAVEFORM_DTYPE.names or ()), unique=True, max_size=16))
    names = list(dict.fromkeys([*draw(st.sampled_from([(), ('time', 'sample')])), *names]))
    kinds = st.sampled_from(['<f8', '<f8', '<f4', '<i4', 'u1', 'i1', '<u2'])
    rows = np.zeros(count, [(name, draw(kinds)) for name in names])
    first = draw(st.sampled_from([0, 512, 10**6, 2**53 - 5000, -300]))
    with np.errstate(all='ignore'):
        if 'sample' in names:
            rows['sample'] = first + np.arange(count)
        if 'time' in names:
            rows['time'] = np.arange(count) / RATE_HZ
        for name in draw(st.lists(st.sampled_from(names), max_size=4)) if names else ():
            rows[name] = draw(columns(count))
    return WaveformBlock(draw(st.sampled_from([0, STREAM[2].stamp_ns, 2**31 * 10**9 - 1])), rows)


@pytest.mark.slow
@settings(
    max_examples=150,
    deadline=2000,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
@given(st.lists(hostile_blocks(), min_size=1, max_size=3), st.booleans())
@pytest.mark.filterwarnings('ignore::RuntimeWarning')
def test_no_block_ends_the_monitor(hostile: list[WaveformBlock], everything: bool) -> None:
    monitor = VibrationMonitor(ALL if everything else MonitorConfig())
    for block in [*STREAM[:3], *hostile]:
        try:
            assert len(monitor.push(block)) <= MAX_INVALID_RECORDS + len(block.rows)
        except WireError:
            continue
    taken = int(monitor.status()['blocks [1]'])
    run(monitor, STREAM[3:40])
    status = monitor.status()
    assert status['blocks [1]'] == taken + 37
    assert int(status['lost samples [1]']) <= 4 * LARGEST_SAMPLE
    if taken == 3:
        assert any(record.valid for record in run(monitor, STREAM[40:]))


@pytest.mark.slow
@settings(max_examples=300, deadline=1000, derandomize=True)
@given(st.data())
def test_no_message_ends_the_decoder_but_in_a_wire_error(data: st.DataObject) -> None:
    integers = st.sampled_from([0, 1, 8, 72, 255, 256, 2**31, 2**32 - 1]) | st.integers(
        0, 2**32 - 1
    )
    names = st.sampled_from(['', 'time', 'sample', 'a\0b', 'x' * 300, '\n']) | st.text(max_size=8)
    message = cloud()
    for name in data.draw(st.lists(st.sampled_from(['width', 'height', 'point_step', 'row_step']))):
        setattr(message, name, data.draw(integers))
    if data.draw(st.booleans()):
        message.data = message.data[: data.draw(st.integers(0, len(message.data)))]
    for field in data.draw(st.lists(st.sampled_from(message.fields), max_size=4)):
        field.name = data.draw(names)
        field.offset = data.draw(integers)
        field.datatype = data.draw(st.integers(0, 255))
        field.count = data.draw(integers)
    try:
        block = decode(message)
        assert len(block.rows) <= MOST_ROWS
        assert block.first_sample <= LARGEST_SAMPLE
        assert block.step_s == block.step_s or math.isnan(block.step_s)
    except WireError:
        return
